// The layout of a row's state: the numbers from which MuJoCo continues a simulation exactly.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "engine/model.hpp"

namespace mjenv::core {

// A state consists of time, qpos, qvel, act, qacc_warmstart and ctrl, in this order, followed by the numbers that only
// some versions of MuJoCo need (Model::more_state).
class StateLayout {
 public:
  explicit StateLayout(const Model& model)
      : nq(model.nq()),
        nv(model.nv()),
        na(model.na()),
        nu(model.nu()),
        more(model.more_state()),
        size(1 + nq + nv + na + nv + nu + more) {}

  std::size_t nq, nv, na, nu, more, size;

  // The part of a state that is this array of mjData; no value if a state does not contain the array.
  struct Part {
    std::size_t offset, count;
  };
  std::optional<Part> part(const std::string& array) const;

  double* qpos(double* state) const { return state + 1; }
  double* qvel(double* state) const { return state + 1 + nq; }
  double* act(double* state) const { return state + 1 + nq + nv; }
  double* warmstart(double* state) const { return state + 1 + nq + nv + na; }
  double* rest(double* state) const { return state + size - more; }
};

}  // namespace mjenv::core
