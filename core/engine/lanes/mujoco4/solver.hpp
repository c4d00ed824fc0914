// MuJoCo 4.0's Newton in lanes: for dense Jacobians, pyramidal cones, limits and contacts, and one island.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "engine/lanes/frame/row_solver.hpp"

namespace mjenv::core::lanes {

class Solver : public RowSolver {
 public:
  // The feature of the model for which lanes have no solver; "" if there is none.
  static std::string unsupported_feature(const mjModel& m);
  // Returns null if unsupported_feature names a feature.
  static std::unique_ptr<Solver> make(const Code& code, const mjModel& m);
  // How much memory a solver's arrays take.
  static std::size_t bytes(int width, const mjModel& m);

  // Whether lanes can solve the constraints that MuJoCo has made for this row. May call mj_island.
  static bool solves(const mjModel& m, mjData& d);
  // Does what mj_forward does with constraints after mj_makeConstraint for these rows (bits). is_read: also writes what only
  // sensors and readers of mjData after the step need.
  void solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_read);

 private:
  Solver(const Code& code, const mjModel& m);
};

}  // namespace mjenv::core::lanes
