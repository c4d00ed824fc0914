// MuJoCo's solvers of constraints in lanes: constraints of several rows are copied to lanes, solved, and copied back.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/lanes/lanes.hpp"
#include "engine/lanes/memory.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

using RowModels = std::array<const mjModel*, kMaxWidth>;
using RowData = std::array<mjData*, kMaxWidth>;

class Solver {
 public:
  // What the model has because of which lanes cannot solve its constraints, "" if nothing.
  static std::string why_none(const mjModel& m);
  // Null if there is something.
  static std::unique_ptr<Solver> make(const Code& code, const mjModel& m);
  // How much memory its arrays take.
  static std::size_t bytes(int width, const mjModel& m);

  // Whether lanes can solve the constraints of this row.
  bool solves(const mjData& d) const { return d.nefc > 0 && !is_elliptic_ && can_solve(d, d.nefc); }
  // Whether they can solve so many constraints of it.
  bool can_solve(const mjData& d, int constraints) const;

  // What was solved last
  const Constraints& constraints() const { return constraints_; }

  // Whether there are places enough for the constraints of all rows.
  bool has_room(const Contacts& contacts) const;

  // The rows, as bits, in which mj_makeConstraint has run. Does the rest of what mj_forward does with constraints.
  // is_last: also writes what only readers of mjData need.
  void solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_last);
  // Makes the constraints of these limits and contacts, and does the same. Writes to the rows' mjData only what the
  // next frame needs, and the number of constraints.
  void solve(Lanes& lanes, const Contacts& contacts, const RowModels& models, const RowData& data);

 private:
  static constexpr int kMost = 64, kPlaces = kMost + Constraints::kRest;  // constraints of a row
  // Rows with elliptic cones share places. Each has few constraints, but they differ.
  static constexpr int kSharedPlaces = 2 * kMost;
  const Code& code_;
  const int nv_;
  const bool is_dual_;  // PGS; else Newton's method
  const bool is_elliptic_;
  const int places_;
  Constraints constraints_{};
  Memory<Constraints> memory_;
  std::vector<unsigned char> bits_;
  std::vector<int> columns_;
  std::vector<double> zeros_;  // a row of J at a place without a constraint

  Solver(const Code& code, const mjModel& m);
  static int places_without_contacts(const Contacts& contacts);
  static int shared_places(const Contacts& contacts);
  int in_blocks(int count) const { return is_dual_ ? count / 4 * 4 : count; }
  void set_size(std::uint32_t rows, int most, int bounded, int cones = -1);
  int place(int constraint, int count) const;
  int constraint_at(int place, int count) const;
  void gather_J(const RowData& from);
  void load(int lane, const mjModel& m);
  void load(int lane, const mjData& d);
  void load_bounds(int lane, const mjData& d);
  void finish(const Lanes& lanes, int lane, mjData& d, bool is_last) const;
};

}  // namespace mjenv::core::lanes
