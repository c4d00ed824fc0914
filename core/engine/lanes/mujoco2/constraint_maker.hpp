// Makes the constraints of several rows in lanes: equalities, friction, limits and contacts.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/lanes/frame/row_maker.hpp"
#include "engine/lanes/mujoco2/lanes.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/lanes/mujoco2/solver.hpp"

namespace mjenv::core::lanes {

class ConstraintMaker final : public RowMaker {
 public:
  // Returns null if lanes cannot make the constraints of this model. The tables must outlive the maker.
  static std::unique_ptr<ConstraintMaker> make(const Code& code, const mjModel& m, const ModelTables& tables);

  bool follow(const RowModels& models, const RowData& data, int count);

  // Finds the reached limits and the contacts of `rows` (bits). Call Code::reject first. Returns false if MuJoCo's
  // functions must find them instead.
  bool find(const Lanes& lanes, std::uint32_t rows, const Solver& solver, const RowModels& models, const RowData& data);

 private:
  // Whether Model has no list of pairs, so that MuJoCo searches for them in every row. Then `find` finds what this
  // search would, and set_contact computes the pairs' parameters, which no mjModel has.
  const bool are_always_searched_;
  const ModelTables& tables_;
  // The arguments of the current call of `find`:
  const Lanes* lanes_ = nullptr;
  const RowModels* models_ = nullptr;
  const RowData* data_ = nullptr;

  ConstraintMaker(const Code& code, const mjModel& m, const ModelTables& tables);
  int collide(int pair, unsigned rows);
  int collide(int pair, int lane);
};

}  // namespace mjenv::core::lanes
