// MuJoCo's constraint solvers in lanes. Copies the constraints of several rows to lanes, solves them, and copies the
// results back.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/frame/row_solver.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

class Solver : public RowSolver {
 public:
  // The feature of the model for which lanes have no solver; "" if there is none.
  static std::string unsupported_feature(const mjModel& m);
  // Returns null if unsupported_feature names a feature.
  static std::unique_ptr<Solver> make(const Code& code, const mjModel& m);
  // How much memory a solver's arrays take.
  static std::size_t bytes(int width, const mjModel& m);

  // Whether lanes can solve the constraints that MuJoCo has made for this row.
  bool solves(const mjModel& m, const mjData& d) const {
    return d.nefc > 0 && !constraints_.is_aligned && !is_elliptic_ && !removes_slip_ && m.opt.noslip_iterations == 0 &&
           can_solve(d, d.nefc);
  }
  // Whether this solver and MuJoCo agree for this row on whether noslip runs after the main solver.
  bool has_noslip_of(const mjModel& m) const { return removes_slip_ == (m.opt.noslip_iterations > 0); }
  // Whether lanes can solve this number of constraints for this row.
  bool can_solve(const mjData& d, int constraints) const;
  // How many numbers of MuJoCo's stack solving takes at most. An int may not hold them.
  static constexpr std::int64_t stack_numbers(std::int64_t rows, std::int64_t nv, bool is_sparse) {
    return 10 * rows + 24 * nv + (is_sparse ? 6 : 3) * nv * nv + 2 * nv * rows;
  }

  // Whether there are enough places for the constraints of all rows.
  bool has_room(const Contacts& contacts) const;

  // Does what mj_forward does with constraints after mj_makeConstraint, which must have run for these rows (bits).
  // is_read: also writes efc_vel, efc_aref, efc_b, efc_force and efc_state, which only sensors and readers of mjData
  // after the step need.
  void solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_read);
  // Makes the constraints that `contacts` lists, then solves them in the same way. Writes only the number of
  // constraints to the rows' mjData.
  void solve(Lanes& lanes, const Contacts& contacts, const RowModels& models, const RowData& data);
  // The part of mj_fwdConstraint after the main solver. lanes.qacc_warmstart must have been set.
  void remove_slip(Lanes& lanes, const Contacts& contacts);

 private:
  // If a place belongs to the same contact in all rows (Constraints::is_aligned), more places are needed, because each
  // row has few contacts, but rows have different ones.
  static constexpr int kSharedPlaces = 2 * kMaxConstraints;
  const bool is_elliptic_, removes_slip_;
  Constraints numbered_{};  // a copy for noslip if constraints_ are aligned
  Memory<Constraints> numbered_memory_;
  // The place of each constraint of a lane.
  std::array<std::array<int, Constraints::kMostNumbered>, kMaxWidth> origins_{};
  std::vector<Constraints::Starts> starts_;
  std::vector<unsigned char> elements_;  // of Constraints::pattern
  std::vector<int> element_columns_;

  Solver(const Code& code, const mjModel& m);
  static int places_of(const mjModel& m);
  int shared_places(const Contacts& contacts) const;
  void make_pattern(const mjModel& m);
  void run(Lanes& lanes);
  void number(const Contacts& contacts);
  void copy_to_numbered(const Contacts& contacts);
  void copy_forces_back();
  using RowSolver::load;
  void load(int lane, const mjModel& m);
  void finish(const Lanes& lanes, int lane, mjData& d, bool is_read) const;
  void write_states(int lane, mjData& d) const;
};

}  // namespace mjenv::core::lanes
