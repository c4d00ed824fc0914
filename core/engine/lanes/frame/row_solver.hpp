// The constraints of several rows side by side, and copying them from and to the rows' mjData.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/lanes/frame/memory.hpp"
#include "engine/lanes/frame/version.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

using RowModels = std::array<const mjModel*, kMaxWidth>;
using RowData = std::array<mjData*, kMaxWidth>;

class RowSolver {
 public:
  // The constraints that were solved last.
  const Constraints& constraints() const { return constraints_; }

 protected:
  static constexpr int kMaxConstraints = 64;  // of one row
  static constexpr int kPlaces = kMaxConstraints + Constraints::kRest;
  const Code& code_;
  const int nv_;
  const bool is_dual_;  // the solver is PGS
  const int places_;
  Constraints constraints_{};

  // special: the arrays that only some solvers of a version have.
  RowSolver(const Code& code, const mjModel& m, int places, const Counts<Constraints>& special);
  // How much memory the arrays take.
  static std::size_t bytes(int width, const mjModel& m, int places, const Counts<Constraints>& special);

  // If places are aligned: how many places belong to equalities, friction and limits.
  static int places_without_contacts(const Contacts& contacts);
  // The next multiple of four
  static int in_fours(int count) { return (count + 3) / 4 * 4; }
  int in_blocks(int count) const { return is_dual_ && !constraints_.is_numbered ? count / 4 * 4 : count; }
  // rows: the rows that have constraints, as bits. most: the largest number of constraints in a row; if places are
  // aligned, the number of places. bounded: the same for equality and friction constraints alone. cones:
  // Constraints::cones; -1: no aligned cones.
  void set_size(std::uint32_t rows, int most, int bounded, int cones = -1);
  // The constraint at a lane's place; -1 if there is none.
  int& constraint_at(int lane, int place) {
    return constraints_at_[static_cast<std::size_t>(std::ptrdiff_t{lane} * places_ + place)];
  }
  int constraint_at(int lane, int place) const {
    return constraints_at_[static_cast<std::size_t>(std::ptrdiff_t{lane} * places_ + place)];
  }
  // The row whose constraints a lane computes: lanes that take no part compute those of the first row that does.
  static int row_of(int lane, std::uint32_t rows) {
    return rows >> lane & 1 ? lane : static_cast<int>(__builtin_ctz(rows));
  }
  // Copies the constraints that MuJoCo has made for these rows (bits) to lanes.
  void load(std::uint32_t rows, const RowData& data);
  // The second part of it: after set_size, and when constraint_at of all lanes is set.
  void load_places(std::uint32_t rows, const RowData& data);
  // The same of one row, without J.
  void load_row(int lane, const mjData& d);
  // Does what mj_fwdConstraint does for a row without constraints, in all but these rows (bits).
  void set_rest(Lanes& lanes, std::uint32_t rows) const;
  // Copy what a solver has found to the row's mjData: efc_vel, efc_aref and efc_b; efc_force.
  void write_references(int lane, mjData& d) const;
  void write_forces(int lane, mjData& d) const;

 private:
  Memory<Constraints> memory_;
  std::vector<unsigned char> bits_;
  std::vector<int> columns_;
  std::vector<double> zeros_;  // the row of J at a place without a constraint
  std::vector<int> constraints_at_;

  // The constraint at a place in a row that has `count` constraints, without special alignment.
  int usual_constraint_at(int place, int count) const;
  void gather_J(const RowData& from);
  void load_bounds(int lane, const mjData& d);
};

}  // namespace mjenv::core::lanes
