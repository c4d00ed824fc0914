// Steps rows in lanes and one by one, and compares both with what MuJoCo computes.
#pragma once

#include "engine/mujoco.hpp"  // before cmocka's macro fail
#include "error.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <vector>

#include "engine/lanes/frame/stepper.hpp"
#include "engine/lanes/mujoco4/lanes.hpp"
#include "engine/own_arrays.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "registry.hpp"
#include "run.hpp"
#include "twins/models.hpp"

namespace mjenv::core::twins {

constexpr int kRounds = 12;  // with each number of lanes

// A state in which joints move, sometimes so fast that they turn more than once in a timestep, and some are exactly where the
// model has them. Contacts occur in some states.
void set_random(const mjModel& m, Work& work, Noise& noise);

// What mj_step computes with the model itself, instead of a view of it.
class Original {
 public:
  explicit Original(const Model& model) : m_(*model.get()), d_(mj_makeData(&m_)) {}
  void load(const mjData& from) {
    mj_resetData(&m_, d_.get());
    std::copy_n(from.qpos, m_.nq, d_->qpos);
    std::copy_n(from.qvel, m_.nv, d_->qvel);
    std::copy_n(from.act, m_.na, d_->act);
    std::copy_n(from.ctrl, m_.nu, d_->ctrl);
    std::copy_n(from.qacc_warmstart, m_.nv, d_->qacc_warmstart);
  }
  void step(std::int64_t frames = 1) {
    for (std::int64_t i = 0; i < frames; ++i) mj_step(&m_, d_.get());
  }
  bool has_state_of(const mjData& other) const {
    return std::memcmp(other.qpos, d_->qpos, sizeof(mjtNum) * m_.nq) == 0 &&
           std::memcmp(other.qvel, d_->qvel, sizeof(mjtNum) * m_.nv) == 0;
  }
  int contacts() const { return d_->ncon; }

 private:
  const mjModel& m_;
  const std::unique_ptr<mjData, DeleteData> d_;
};

// How rows are read after a step.
struct Reading {
  const char* array;                                    // one that is announced
  bool is_current;                                      // Work::keep_current
  std::int64_t frames;                                  // 0: mj_forward
  const char* own = nullptr;                            // an array of which rows have their own values
  const char* bad = nullptr;                            // a part of the state that has bad numbers in some rows
  void (*place)(std::size_t row, mjData& d) = nullptr;  // changes the random state of a row
  bool has_callback = false;                            // controls change before each mj_step, and some are bad
  bool returns = false;                                 // rows stay in lanes where their own values are the model's
};

// Steps leave the bits of mj_step, and lanes leave few rows.
void compare_steps(const Named& named, const lanes::Code& code, const Reading& reading, int& rows, int& left);

// Rows in the initial state, for the widest lanes.
struct Rows {
  std::vector<std::unique_ptr<Work>> works;
  std::vector<Work*> all;
  std::vector<std::vector<double>> states, befores;
  std::vector<double*> before;

  explicit Rows(const std::shared_ptr<const Model>& model)
      : states(static_cast<std::size_t>(lanes::widths().back()), std::vector<double>(StateLayout(*model).size)),
        befores(states) {
    for (std::size_t row = 0; row < states.size(); ++row) {
      works.push_back(std::make_unique<Work>(model));
      works.back()->clear();
      all.push_back(works.back().get());
      before.push_back(befores[row].data());
    }
  }
  std::uint32_t step(lanes::Stepper& stepper) {
    for (std::size_t row = 0; row < states.size(); ++row) works[row]->load(states[row].data());
    return stepper.step(all.data(), static_cast<int>(all.size()), 1, before.data());
  }
};

// Steps rows whose states `set` has changed. Compares those that lanes do not leave to MuJoCo, and returns them, as bits.
std::uint32_t step_rows(const std::shared_ptr<const Model>& model,
                        const std::function<void(std::size_t, mjData&)>& set);

}  // namespace mjenv::core::twins
