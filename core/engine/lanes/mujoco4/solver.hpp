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
  // Does what mj_forward does with constraints after mj_makeConstraint for these rows (bits). is_read: also writes what only
  // sensors and readers of mjData after the step need.
  void solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_read);

  // Whether lanes can solve the constraints of rows with this model, if lanes make them.
  bool follows(const mjModel& m) const;
  // The same for these constraints.
  bool can_solve(const Contacts& contacts, const RowData& data);
  // Makes and solves them. Writes only their number to the rows' mjData.
  void solve(Lanes& lanes, const Contacts& contacts, const RowModels& models, const RowData& data);

 private:
  // Some dofs of a row, and its constraints that act on them alone.
  struct Island {
    int first, count;  // the dofs
    int begin, end;    // of the row's list `members`
  };
  struct Islands {
    std::vector<Island> list;
    std::vector<int> members;  // constraints
  };
  // Constraints that lanes have made, whose numbers those of an island overwrite in constraints_.
  struct Whole {
    double *J, *D, *aref;
  };
  // Room for the arrays of DualRow.
  struct DualArrays {
    double *AR, *b, *force;
  };

  const mjModel& m_;
  mjModel part_;  // the dofs of an island: the shared model's addresses of M, but columns that count from its first dof
  std::vector<int> columns_;  // M_colind of part_
  Whole whole_{};
  DualArrays dual_{};
  Memory<Whole> whole_memory_;
  Memory<DualArrays> dual_memory_;
  std::array<Islands, kMaxWidth> islands_;
  std::vector<int> roots_;  // for each tree of a row, another one of its island, or itself; -1 if it has no constraint
  std::vector<DualRow> dual_rows_;

  Solver(const Code& code, const mjModel& m);
  // A lane has few contacts, but not the same ones as others.
  static constexpr int kMostPlaces = 2 * kMaxConstraints;
  static int most_constraints(const mjModel& m) {
    return m.opt.solver == mjSOL_PGS ? DualRow::kMost : static_cast<int>(kMaxConstraints);
  }
  static int places_of(const mjModel& m) {
    return m.opt.solver == mjSOL_PGS ? DualRow::kMost : static_cast<int>(kMostPlaces);
  }
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
  static Counts<Whole> whole_counts(const mjModel& m);
  static Counts<DualArrays> dual_counts(const mjModel& m);
  void set_options(std::uint32_t rows, const RowModels& models);
  void run(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool are_made);
  void run_dual(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data);
  static void list_islands(Islands& islands, const mjData& d);
  bool list_islands(int row, const Contacts& contacts);
  int root_of(int tree) const;
  void solve_islands(Lanes& lanes, std::uint32_t rows, const RowData& data, bool are_made);
  void solve_island(Lanes& lanes, std::uint32_t rows, const std::array<const Island*, kMaxWidth>& islands,
                    const RowData& data, bool are_made);
  void begin_part(int first, int count);
};

}  // namespace mjenv::core::lanes
