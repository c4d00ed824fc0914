// MuJoCo 4.0's Newton and PGS for several rows at once: for dense Jacobians, pyramidal cones, limits and contacts.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

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

  // Whether lanes can solve the constraints that MuJoCo has made for this row. If so, calls those of MuJoCo's functions
  // whose results the solver reads.
  static bool prepare(const mjModel& m, mjData& d);
  // Whether `prepare` and `solve` read what kConstraints reads in mjData.
  bool reads_rows() const { return is_dual_; }
  // Does what mj_forward does with constraints after mj_makeConstraint for these rows (bits). is_read: also writes what only
  // sensors and readers of mjData after the step need.
  void solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_read);

 private:
  // Dofs that follow each other, as a model of their own.
  struct Part {
    int first, count;
    mjModel model;             // with the shared model's addresses of M, but columns that count from `first`
    std::vector<int> columns;  // M_colind
  };
  const mjModel& m_;
  std::vector<std::unique_ptr<Part>> parts_;  // the islands that have occurred

  std::vector<DualRow> dual_rows_;
  std::vector<std::vector<unsigned char>> orders_;  // DualRow::order for each number of constraints

  Solver(const Code& code, const mjModel& m);
  const unsigned char* order_of(int constraints);
  void solve_dual(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data);
  static int first_dof(const mjData& d, int island) { return d.map_idof2dof[d.island_idofadr[island]]; }
  void set_options(std::uint32_t rows, const RowModels& models);
  void solve_islands(Lanes& lanes, std::uint32_t rows, const RowData& data);
  void solve_island(Lanes& lanes, const Part& part, std::uint32_t rows, const std::array<int, kMaxWidth>& islands,
                    const RowData& data);
  const Part& part(int first, int count);
};

}  // namespace mjenv::core::lanes
