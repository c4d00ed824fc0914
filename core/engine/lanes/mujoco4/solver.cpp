#include "engine/lanes/mujoco4/solver.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

#include "engine/lanes/frame/contact_pairs.hpp"
#include "engine/lanes/mujoco4/collider.hpp"

namespace mjenv::core::lanes {
namespace {

// Whether MuJoCo finds one island with all dofs, if there is a constraint.
bool has_one_island(const mjModel& m) { return m.ntree == 1; }

bool is_elliptic(const mjModel& m) { return m.opt.cone == mjCONE_ELLIPTIC; }

bool is_dual(const mjModel& m) { return m.opt.solver == mjSOL_PGS; }

// Whether there are constraints to whose references MuJoCo adds centripetal and Coriolis accelerations.
bool has_connect_or_weld(const mjModel& m) {
  return std::any_of(m.eq_type, m.eq_type + m.neq, [](int type) { return type == mjEQ_CONNECT || type == mjEQ_WELD; });
}

Counts<Constraints> special_counts(const mjModel& m, int most_places) {
  using C = Constraints;
  const auto nv = static_cast<std::size_t>(m.nv), places = static_cast<std::size_t>(most_places);
  if (is_dual(m)) return {{&C::JM2, places * nv}, {&C::R, places}};
  Counts<C> counts{{&C::ls_tolerance, 1}, {&C::qfrc, nv}};
  if (has_connect_or_weld(m)) counts.insert(counts.end(), {{&C::drift, places}, {&C::J_dot, 6 * nv}});
  if (is_elliptic(m)) counts.insert(counts.end(), {{&C::scale, places}, {&C::Hcone, nv * nv}, {&C::LTJ, 6 * nv}});
  return counts;
}

// How many numbers of MuJoCo's memory it takes to solve a row's constraints, at most.
std::int64_t numbers_to_solve(const mjModel& m, std::int64_t rows) {
  const std::int64_t nv = m.nv, primal = 40 * rows + 50 * nv + 3 * nv * nv + 2 * nv * rows + 6 * m.nC;
  return is_dual(m) ? primal + rows * (rows + 2 * nv) : primal;
}

// The same for making them, and the contacts, beside what it takes to solve them.
std::int64_t numbers_to_make(const mjModel& m, const Contacts& contacts, int lane) {
  constexpr auto kBytes = static_cast<std::int64_t>(sizeof(double));
  return Collider::bytes_of(m, contacts, contacts.found[lane]) / kBytes + contacts.constraints[lane] * (m.nv + 64) +
         m.ntendon;
}

// DualRow::order for each number of constraints. MuJoCo shuffles the constraints before each iteration, by numbers from
// PCG32 that are the same in each step.
using Orders = std::array<std::vector<unsigned char>, DualRow::kMost + 1>;

Orders make_orders() {
  Orders orders;
  for (std::uint32_t size = 1; size < orders.size(); ++size) {
    std::vector<unsigned char> order(size);
    std::iota(order.begin(), order.end(), static_cast<unsigned char>(0));
    std::uint64_t state = 1;  // after the first number, which MuJoCo drops
    const auto draw = [&] {
      const std::uint64_t old = state;
      state = old * 6364136223846793005U + 1;
      const auto mixed = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27),
                 turn = static_cast<std::uint32_t>(old >> 59);
      return (mixed >> turn) | (mixed << (-turn & 31));
    };
    orders[size].reserve(std::size_t{DualRow::kMostIterations} * size);
    for (int iteration = 0; iteration < DualRow::kMostIterations; ++iteration) {
      for (std::uint32_t i = size - 1; i > 0; --i) std::swap(order[i], order[draw() % (i + 1)]);
      orders[size].insert(orders[size].end(), order.begin(), order.end());
    }
  }
  return orders;
}

// All solvers share these 2 MB, which the first of them computes.
const Orders& orders() {
  static const Orders computed = make_orders();
  return computed;
}

}  // namespace

std::string Solver::unsupported_feature(const mjModel& m) {
  if (m.opt.solver != mjSOL_NEWTON && m.opt.solver != mjSOL_PGS) return "a solver other than Newton and PGS";
  if (is_sparse(m)) return "sparse Jacobians";
  if (is_elliptic(m) && m.opt.solver == mjSOL_PGS) return "elliptic cones with PGS";
  if (m.opt.noslip_iterations > 0) return "noslip";
  if (m.opt.disableflags & mjDSBL_ISLAND) return "no islands (opt.disableflags)";
  if (m.opt.enableflags & mjENBL_DIAGEXACT) return "exact diagonals (opt.enableflags)";
  if (m.flg_surfacevel) return "velocities of surfaces";
  return m.flg_adhesion ? "adhesion" : "";
}

std::unique_ptr<Solver> Solver::make(const Code& code, const mjModel& m) {
  return unsupported_feature(m).empty() ? std::unique_ptr<Solver>(new Solver(code, m)) : nullptr;
}

Counts<Solver::Whole> Solver::whole_counts(const mjModel& m) {
  if (has_one_island(m)) return {};
  constexpr auto places = static_cast<std::size_t>(kMaxConstraints);
  return {{&Whole::J, places * static_cast<std::size_t>(m.nv)}, {&Whole::D, places}, {&Whole::aref, places}};
}

Counts<Solver::DualArrays> Solver::dual_counts(const mjModel& m) {
  if (!is_dual(m)) return {};
  constexpr std::size_t most = DualRow::kMost;
  return {{&DualArrays::AR, most * most + DualRow::kBehind}, {&DualArrays::b, most}, {&DualArrays::force, most}};
}

std::size_t Solver::bytes(int width, const mjModel& m) {
  if (!unsupported_feature(m).empty()) return 0;
  return RowSolver::bytes(width, m, places_of(m), special_counts(m, places_of(m))) +
         Memory<Whole>::bytes(width, whole_counts(m)) + Memory<DualArrays>::bytes(width, dual_counts(m));
}

Solver::Solver(const Code& code, const mjModel& m)
    : RowSolver(code, m, places_of(m), special_counts(m, places_of(m))),
      m_(m),
      part_(m),
      columns_(static_cast<std::size_t>(m.nC)),
      whole_memory_(whole_, code.width, whole_counts(m)),
      dual_memory_(dual_, code.width, dual_counts(m)),
      roots_(static_cast<std::size_t>(m.ntree)),
      dual_rows_(is_dual_ ? static_cast<std::size_t>(code.width) : 0) {
  part_.M_colind = columns_.data();
  constraints_.is_numbered = is_dual_;  // constraint i of a row is at place i
  for (Islands& islands : islands_) {
    islands.list.reserve(static_cast<std::size_t>(m.ntree));
    islands.members.reserve(kMaxConstraints);
  }
  for (std::size_t lane = 0; lane < dual_rows_.size(); ++lane) {
    dual_rows_[lane].AR = dual_.AR + lane * (DualRow::kMost * DualRow::kMost + DualRow::kBehind);
    dual_rows_[lane].b = dual_.b + lane * DualRow::kMost;
    dual_rows_[lane].force = dual_.force + lane * DualRow::kMost;
  }
  if (is_dual_) orders();  // so that no step allocates them
}

// MuJoCo fails if its memory is too small to solve the constraints. A row with a single tree has one island, without
// mj_island. The dofs of each island must follow each other; MuJoCo calls mj_island again for other rows, for which
// numbers_to_solve leaves room.
bool Solver::prepare(const mjModel& m, mjData& d) {
  const std::int64_t rows = d.nefc, room = static_cast<std::int64_t>(d.narena - d.parena);
  if (rows == 0 || rows > most_constraints(m) || (is_dual(m) && d.ne + d.nf > 0) ||
      room < 8 * numbers_to_solve(m, rows))
    return false;
  if (has_connect_or_weld(m)) mj_referenceConstraint(&m, &d);
  if (is_dual(m)) return has_one_island(m) && m.opt.iterations <= DualRow::kMostIterations;
  if (has_one_island(m)) return true;
  mj_island(&m, &d);
  bool solves = d.nisland > 0;
  for (int i = 0; i < d.nisland && solves; ++i) {
    const int* const dofs = d.map_idof2dof + d.island_idofadr[i];
    solves = dofs[d.island_nv[i] - 1] == dofs[0] + d.island_nv[i] - 1;
  }
  return solves;
}

bool Solver::follows(const mjModel& m) const {
  return !is_dual_ || (has_one_island(m) && m.opt.iterations <= DualRow::kMostIterations);
}

// Equalities and friction must be at the same places in all lanes.
bool Solver::can_solve(const Contacts& contacts, const RowData& data) {
  int bounded = -1, cones = places_without_contacts(contacts);
  for (int i = 0; i < contacts.contact_count; ++i)
    cones += constraints_of(contacts.pairs[contacts.contacts[i].pair], mjCONE_ELLIPTIC);
  if (is_elliptic(m_) && cones > kMostPlaces) return false;
  for (int lane = 0; lane < code_.width; ++lane) {
    const int rows = contacts.constraints[lane];
    if (!(contacts.rows >> lane & 1)) continue;
    if (bounded < 0) bounded = contacts.bounded[lane];
    const std::int64_t room = data[lane]->narena,
                       needed = numbers_to_make(m_, contacts, lane) + numbers_to_solve(m_, rows);
    if (contacts.bounded[lane] != bounded || rows > most_constraints(m_) || room < 8 * needed) return false;
    if (m_.nconmax >= 0 && contacts.found[lane] > m_.nconmax) return false;
    if (has_one_island(m_)) continue;
    if (bounded > 0 || is_elliptic(m_) || !list_islands(lane, contacts)) return false;
  }
  return !(is_dual_ && bounded > 0);
}

void Solver::set_options(std::uint32_t rows, const RowModels& models) {
  Constraints& c = constraints_;
  for (int lane = 0; lane < code_.width; ++lane) {
    const mjModel& m = *models[row_of(lane, rows)];
    c.tolerance[lane] = m.opt.tolerance;
    c.ls_tolerance[lane] = m.opt.ls_tolerance;
    c.most[lane] = std::max(0, m.opt.iterations);
    c.most_evaluations[lane] = m.opt.ls_iterations;
  }
}

void Solver::solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_read) {
  constraints_.has_references = has_connect_or_weld(m_);
  if (rows != 0 && !load(rows, data)) {
    lanes.left_to_mujoco |= rows;
  } else if (rows != 0) {
    for (int lane = 0; lane < code_.width; ++lane) {
      constraints_.at_first[lane] = rows >> lane & 1 ? data[lane]->nefc : 0;
      if (rows >> lane & 1 && !has_one_island(m_)) list_islands(islands_[lane], *data[lane]);
    }
    run(lanes, rows, models, data, false);
    for (int lane = 0; lane < code_.width && is_read && has_one_island(m_); ++lane) {
      if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
      write_references(lane, *data[lane]);
      write_forces(lane, *data[lane]);
    }
  }
  set_rest(lanes, rows);
}

void Solver::solve(Lanes& lanes, const Contacts& contacts, const RowModels& models, const RowData& data) {
  std::uint32_t rows = 0;
  int most = 0, bounded = 0;
  constraints_.has_references = false;
  for (int lane = 0; lane < code_.width; ++lane) {
    const bool is_there = (contacts.rows >> lane & 1) != 0;
    constraints_.at_first[lane] = is_there ? contacts.constraints[lane] : 0;
    if (is_there) data[lane]->nefc = contacts.constraints[lane];
    if (constraints_.at_first[lane] == 0) continue;
    most = std::max(most, constraints_.at_first[lane]);
    bounded = contacts.bounded[lane];
    rows |= 1U << lane;
  }
  if (rows != 0) {
    constraints_.is_aligned = is_elliptic(m_);
    if (constraints_.is_aligned) {
      const int cones = places_without_contacts(contacts);
      int places = cones;
      for (int i = 0; i < contacts.contact_count; ++i)
        if (contacts.contacts[i].rows != 0)
          places += constraints_of(contacts.pairs[contacts.contacts[i].pair], mjCONE_ELLIPTIC);
      set_size(rows, places, cones - contacts.limit_count, cones);
    } else {
      set_size(rows, most, bounded);
    }
    code_.makeConstraint(lanes, contacts, constraints_);
    constraints_.rows = rows &= ~lanes.left_to_mujoco;
    if (rows != 0) run(lanes, rows, models, data, true);
  }
  set_rest(lanes, rows);
}

// Solves the constraints in constraints_, of which each row has at_first. are_made: lanes have made them.
void Solver::run(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool are_made) {
  if (is_dual_) return run_dual(lanes, rows, models, data);
  set_options(rows, models);
  code_.warmstart(lanes, constraints_);
  constraints_.rows = rows & ~lanes.left_to_mujoco;
  if (!has_one_island(m_)) return solve_islands(lanes, constraints_.rows, data, are_made);
  code_.solNewton(lanes, constraints_);
  for (int lane = 0; lane < code_.width; ++lane)
    if (rows >> lane & 1) data[lane]->solver_niter[0] = constraints_.iterations[lane];
}

void Solver::run_dual(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data) {
  const int width = code_.width;
  for (int lane = 0; lane < width; ++lane) {
    DualRow& row = dual_rows_[static_cast<std::size_t>(lane)];
    row.model = models[row_of(lane, rows)];
    row.size = rows >> lane & 1 ? constraints_.at_first[lane] : 0;
    row.order = orders()[static_cast<std::size_t>(row.size)].data();
    double inertia = 0;
    for (int i = 0; i < nv_; ++i) inertia += lanes.M[(m_.M_rowadr[i] + m_.M_rownnz[i] - 1) * width + lane];
    row.scale = 1 / std::max(mjMINVAL, inertia);
  }
  code_.projectConstraint(lanes, constraints_, dual_rows_.data());
  code_.solPGS(dual_rows_.data(), width);
  for (int lane = 0; lane < width; ++lane) {
    const DualRow& row = dual_rows_[static_cast<std::size_t>(lane)];
    for (int i = 0; i < row.size; ++i) constraints_.force[i * width + lane] = row.force[i];
    if (row.size > 0) data[lane]->solver_niter[0] = row.iterations;
  }
  code_.dualFinish(lanes, constraints_);
}

// Those that mj_island has found.
void Solver::list_islands(Islands& islands, const mjData& d) {
  islands.list.clear();
  for (int i = 0; i < d.nisland; ++i) {
    const int begin = d.island_iefcadr[i];
    islands.list.push_back({d.map_idof2dof[d.island_idofadr[i]], d.island_nv[i], begin, begin + d.island_nefc[i]});
  }
  islands.members.assign(d.map_iefc2efc, d.map_iefc2efc + d.nefc);
}

int Solver::root_of(int tree) const {
  while (roots_[static_cast<std::size_t>(tree)] != tree) tree = roots_[static_cast<std::size_t>(tree)];
  return tree;
}

// Finds the islands of a row whose constraints have not been made yet. Returns false if their dofs do not follow each
// other, or if a tendon has a constraint.
bool Solver::list_islands(int row, const Contacts& contacts) {
  std::array<int, kMaxConstraints> trees{};  // a tree of each constraint
  int count = 0;
  std::fill(roots_.begin(), roots_.end(), -1);
  // Trees with the number -1 do not move.
  const auto join = [&](int tree1, int tree2, int constraints) {
    for (const int tree : {tree1, tree2})
      if (tree >= 0 && roots_[static_cast<std::size_t>(tree)] < 0) roots_[static_cast<std::size_t>(tree)] = tree;
    if (tree1 >= 0 && tree2 >= 0) roots_[static_cast<std::size_t>(root_of(tree1))] = root_of(tree2);
    for (int i = 0; i < constraints; ++i) trees[static_cast<std::size_t>(count++)] = tree1 >= 0 ? tree1 : tree2;
  };
  for (int i = 0; i < contacts.limit_count; ++i) {
    const Contacts::Limit& limit = contacts.limits[i];
    if (!(limit.rows >> row & 1)) continue;
    if (limit.object == Object::tendon) return false;
    join(m_.dof_treeid[m_.jnt_dofadr[limit.id]], -1, 1);
  }
  for (int i = 0; i < contacts.contact_count; ++i) {
    const Contacts::Contact& contact = contacts.contacts[i];
    const ContactPair& pair = contacts.pairs[contact.pair];
    const auto tree_of = [&](int geom) { return m_.body_treeid[m_.geom_bodyid[geom]]; };
    if (contact.rows >> row & 1) join(tree_of(pair.geom1), tree_of(pair.geom2), constraints_of(pair, m_.opt.cone));
  }
  Islands& islands = islands_[static_cast<std::size_t>(row)];
  islands.list.clear();
  islands.members.clear();
  for (int root = 0; root < m_.ntree; ++root) {
    if (roots_[static_cast<std::size_t>(root)] != root) continue;
    Island island{0, 0, static_cast<int>(islands.members.size()), 0};
    for (int tree = 0; tree < m_.ntree; ++tree) {
      if (roots_[static_cast<std::size_t>(tree)] < 0 || root_of(tree) != root) continue;
      if (island.count == 0) island.first = m_.tree_dofadr[tree];
      if (m_.tree_dofadr[tree] != island.first + island.count) return false;
      island.count += m_.tree_dofnum[tree];
    }
    for (int i = 0; i < count; ++i)
      if (root_of(trees[static_cast<std::size_t>(i)]) == root) islands.members.push_back(i);
    island.end = static_cast<int>(islands.members.size());
    islands.list.push_back(island);
  }
  return true;
}

void Solver::solve_islands(Lanes& lanes, std::uint32_t rows, const RowData& data, bool are_made) {
  const int width = code_.width, size = constraints_.size;
  if (are_made) {
    std::copy_n(constraints_.J, size * nv_ * width, whole_.J);
    std::copy_n(constraints_.D, size * width, whole_.D);
    std::copy_n(constraints_.aref, size * width, whole_.aref);
  }
  for (int lane = 0; lane < width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    if (!are_made) write_references(lane, *data[lane]);
    const std::vector<Island>& list = islands_[static_cast<std::size_t>(lane)].list;
    for (int i = 0; i < nv_; ++i) {
      const int number = i * width + lane;
      const bool is_in_one = std::any_of(list.begin(), list.end(), [&](const Island& island) {
        return i >= island.first && i < island.first + island.count;
      });
      if (!is_in_one) lanes.qacc[number] = lanes.qacc_smooth[number];
      lanes.qfrc_constraint[number] = 0;
    }
  }
  // The islands of all rows, of which those with the same dofs are solved together.
  std::array<std::size_t, kMaxWidth> next{};
  for (;;) {
    std::array<const Island*, kMaxWidth> islands{};
    const Island* first = nullptr;
    std::uint32_t together = 0;
    for (int lane = 0; lane < width; ++lane) {
      const std::vector<Island>& list = islands_[static_cast<std::size_t>(lane)].list;
      if (!((rows & ~lanes.left_to_mujoco) >> lane & 1) || next[lane] == list.size()) continue;
      const Island* const island = &list[next[lane]];
      if (!first) first = island;
      if (island->first != first->first || island->count != first->count) continue;
      together |= 1U << lane;
      islands[lane] = island;
    }
    if (together == 0) return;
    solve_island(lanes, together, islands, data, are_made);
    for (int lane = 0; lane < width; ++lane) {
      if (!(together >> lane & 1)) continue;
      if (next[lane] < mjNISLAND) data[lane]->solver_niter[next[lane]] = constraints_.iterations[lane];
      ++next[lane];
    }
  }
}

// Solves an island of these rows (bits), which has the same dofs in all of them.
void Solver::solve_island(Lanes& lanes, std::uint32_t rows, const std::array<const Island*, kMaxWidth>& islands,
                          const RowData& data, bool are_made) {
  const int width = code_.width, first = islands[row_of(0, rows)]->first, count = islands[row_of(0, rows)]->count;
  Constraints& c = constraints_;
  Lists lists{};
  int most = 0;
  for (int lane = 0; lane < width; ++lane) {
    const Island& island = *islands[row_of(lane, rows)];
    lists[lane] = {islands_[static_cast<std::size_t>(row_of(lane, rows))].members.data() + island.begin,
                   island.end - island.begin};
    most = std::max(most, lists[lane].count);
  }
  if (are_made) {
    set_size(rows, most, 0);
  } else if (!lay_out(rows, data, lists)) {
    lanes.left_to_mujoco |= rows;
    return;
  }
  for (int lane = 0; lane < width; ++lane) {
    const int row = row_of(lane, rows);
    const mjData& d = *data[row];
    if (!are_made) load_row(lane, d);
    for (int at = 0; at < c.size; ++at) {
      const int from = !are_made ? constraint_at(lane, at) : at < lists[lane].count ? lists[lane].constraint(at) : -1;
      const std::ptrdiff_t whole = std::max(from, 0);
      const double* const J = are_made ? whole_.J + (whole * nv_ + first) * width + row : d.efc_J + whole * nv_ + first;
      const int step = are_made ? width : 1;
      if (are_made) c.D[at * width + lane] = from < 0 ? 0 : whole_.D[whole * width + row];
      c.aref[at * width + lane] = from < 0 ? 0 : are_made ? whole_.aref[whole * width + row] : d.efc_aref[from];
      for (int k = 0; k < count; ++k) c.J[(at * count + k) * width + lane] = from < 0 ? 0 : J[k * step];
    }
  }
  begin_part(first, count);
  Lanes own = lanes;
  own.model = &part_;
  for (double* Lanes::*array : {&Lanes::qacc, &Lanes::qacc_smooth, &Lanes::qfrc_smooth, &Lanes::qLDiagInv})
    own.*array += static_cast<std::ptrdiff_t>(first) * width;
  own.qfrc_constraint = c.qfrc;
  code_.begin_island(own, c);
  code_.solNewton(own, c);
  lanes.left_to_mujoco |= own.left_to_mujoco;
  for (int lane = 0; lane < width; ++lane) {
    if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
    if (!are_made) write_forces(lane, *data[lane]);
    for (int k = 0; k < count; ++k) lanes.qfrc_constraint[(first + k) * width + lane] = c.qfrc[k * width + lane];
  }
}

// Loads all constraints of these rows (bits). Returns false if there are not enough places.
bool Solver::load(std::uint32_t rows, const RowData& data) {
  if (is_dual_) {
    RowSolver::load(rows, data);
    return true;
  }
  Lists lists{};
  for (int lane = 0; lane < code_.width; ++lane) lists[lane] = {nullptr, data[row_of(lane, rows)]->nefc};
  if (!lay_out(rows, data, lists)) return false;
  load_places(rows, data);
  return true;
}

// Chooses the places of these constraints: each belongs to equalities, to friction, or to limits and contacts that make
// equally many constraints in all lanes. Returns false if there are not enough.
bool Solver::lay_out(std::uint32_t rows, const RowData& data, const Lists& lists) {
  enum Kind { equality, friction, other };
  struct Next {
    Kind kind;
    int size;  // how many constraints belong together
  };
  std::array<int, kMaxWidth> done{};
  const auto next = [&](int lane) {
    const mjData& d = *data[row_of(lane, rows)];
    const int i = lists[lane].constraint(done[lane]);
    const bool is_cone = d.efc_type[i] == mjCNSTR_CONTACT_ELLIPTIC;
    return Next{i < d.ne ? equality : (i < d.ne + d.nf ? friction : other), is_cone ? d.contact[d.efc_id[i]].dim : 1};
  };
  int place = 0, bounded = 0;
  for (const Kind kind : {equality, friction, other}) {
    for (;;) {
      int size = 0, most = 0;
      for (int lane = 0; lane < code_.width; ++lane) {
        const int left = lists[lane].count - done[lane];
        if (left <= most || next(lane).kind != kind) continue;
        most = left;
        size = next(lane).size;
      }
      if (size == 0) break;
      if (place + size > kMostPlaces) return false;
      constraints_.dims[place] = static_cast<unsigned char>(size);
      for (int lane = 0; lane < code_.width; ++lane) {
        const bool is_there = done[lane] < lists[lane].count && next(lane).kind == kind && next(lane).size == size;
        for (int k = 0; k < size; ++k)
          constraint_at(lane, place + k) = is_there ? lists[lane].constraint(done[lane]++) : -1;
      }
      place += size;
    }
    if (kind == friction) bounded = place;
  }
  set_size(rows, place, bounded, is_elliptic(m_) ? bounded : -1);
  for (int lane = 0; lane < code_.width && is_elliptic(m_); ++lane) load_cones(lane, *data[row_of(lane, rows)]);
  return true;
}

void Solver::load_cones(int lane, const mjData& d) {
  const Constraints& c = constraints_;
  for (int at = c.cones; at < c.size; at += c.dims[at]) {
    const int i = constraint_at(lane, at);
    for (int k = 0; k < c.dims[at] && c.dims[at] > 1; ++k) {
      const mjContact* const con = i < 0 ? nullptr : d.contact + d.efc_id[i];
      c.scale[(at + k) * code_.width + lane] = !con ? 0 : (k == 0 ? con->mu : con->friction[k - 1]);
    }
  }
}

// Makes part_ the model of these dofs.
void Solver::begin_part(int first, int count) {
  part_.nv = count;
  part_.M_rownnz = m_.M_rownnz + first;
  part_.M_rowadr = m_.M_rowadr + first;
  const int last = first + count - 1, end = m_.M_rowadr[last] + m_.M_rownnz[last];
  for (int i = m_.M_rowadr[first]; i < end; ++i) columns_[static_cast<std::size_t>(i)] = m_.M_colind[i] - first;
}

}  // namespace mjenv::core::lanes
