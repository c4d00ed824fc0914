// MuJoCo 4.0's Newton and PGS for several rows at once, for dense Jacobians. PGS is only for pyramidal cones, limits and
// contacts.
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
  const mjModel& m_;
  mjModel part_;  // the dofs of an island: the shared model's addresses of M, but columns that count from its first dof
  std::vector<int> columns_;  // M_colind of part_
  std::vector<DualRow> dual_rows_;

  Solver(const Code& code, const mjModel& m);
  void solve_dual(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data);
  static int first_dof(const mjData& d, int island) { return d.map_idof2dof[d.island_idofadr[island]]; }
  // A lane has few contacts, but not the same ones as others.
  static constexpr int kMostPlaces = 2 * kMaxConstraints;
  // The constraints of a lane: all, or those in the list.
  struct List {
    const int* list;
    int count;
    int constraint(int i) const { return list ? list[i] : i; }
  };
  using Lists = std::array<List, kMaxWidth>;
  bool load(std::uint32_t rows, const RowData& data);
  bool lay_out(std::uint32_t rows, const RowData& data, const Lists& lists);
  void load_cones(int lane, const mjData& d);
  void set_options(std::uint32_t rows, const RowModels& models);
  void solve_islands(Lanes& lanes, std::uint32_t rows, const RowData& data);
  void solve_island(Lanes& lanes, int first, int count, std::uint32_t rows, const std::array<int, kMaxWidth>& islands,
                    const RowData& data);
  void begin_part(int first, int count);
};

}  // namespace mjenv::core::lanes
