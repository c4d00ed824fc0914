#include "engine/lanes/mujoco4/solver.hpp"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

namespace mjenv::core::lanes {
namespace {

bool is_sparse(const mjModel& m) {
  return m.opt.jacobian == mjJAC_SPARSE || (m.opt.jacobian == mjJAC_AUTO && m.nv >= 60);
}

// Whether MuJoCo finds one island with all dofs, if there is a constraint.
bool has_one_island(const mjModel& m) { return m.ntree == 1; }

bool is_elliptic(const mjModel& m) { return m.opt.cone == mjCONE_ELLIPTIC; }

Counts<Constraints> special_counts(const mjModel& m, int places) {
  const auto nv = static_cast<std::size_t>(m.nv);
  Counts<Constraints> counts{{&Constraints::ls_tolerance, 1}, {&Constraints::qfrc, nv}};
  if (is_elliptic(m))
    counts.insert(counts.end(), {{&Constraints::scale, static_cast<std::size_t>(places)},
                                 {&Constraints::Hcone, nv * nv},
                                 {&Constraints::LTJ, 6 * nv}});
  return counts;
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

std::size_t Solver::bytes(int width, const mjModel& m) {
  return unsupported_feature(m).empty() ? RowSolver::bytes(width, m, kMostPlaces, special_counts(m, kMostPlaces)) : 0;
}

Solver::Solver(const Code& code, const mjModel& m)
    : RowSolver(code, m, kMostPlaces, special_counts(m, kMostPlaces)),
      m_(m),
      part_(m),
      columns_(static_cast<std::size_t>(m.nC)),
      dual_rows_(is_dual_ ? static_cast<std::size_t>(code.width) : 0) {
  part_.M_colind = columns_.data();
  if (is_dual_) orders();  // so that no step allocates them
}

// MuJoCo fails if its memory is too small to solve the constraints. `needed` is more than it takes. A row with a single
// tree has one island, without mj_island. The dofs of each island must follow each other.
bool Solver::prepare(const mjModel& m, mjData& d) {
  const std::int64_t rows = d.nefc, nv = m.nv;
  const std::int64_t needed = 40 * rows + 50 * nv + 3 * nv * nv + 2 * nv * rows + 6 * m.nC;
  const bool is_dual = m.opt.solver == mjSOL_PGS;
  if (rows == 0 || rows > (is_dual ? DualRow::kMost : kMaxConstraints) || (is_dual && d.ne + d.nf > 0) ||
      !unsupported_feature(m).empty() || static_cast<std::int64_t>(d.narena - d.parena - d.pstack) < 8 * needed)
    return false;
  if (is_dual) {
    if (!has_one_island(m) || m.opt.iterations > DualRow::kMostIterations) return false;
    mj_projectConstraint(&m, &d);
    mj_referenceConstraint(&m, &d);
    return true;
  }
  if (has_one_island(m)) return true;
  const auto used = d.parena;
  mj_island(&m, &d);
  bool solves = d.nisland > 0;
  for (int i = 0; i < d.nisland && solves; ++i)
    solves = d.map_idof2dof[d.island_idofadr[i] + d.island_nv[i] - 1] == first_dof(d, i) + d.island_nv[i] - 1;
  if (!solves) d.parena = used;  // mj_island is called again for this row
  return solves;
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
  if (rows != 0 && is_dual_) {
    solve_dual(lanes, rows, models, data);
    for (int lane = 0; lane < code_.width && is_read; ++lane)
      if (rows >> lane & 1) mj_island(models[lane], data[lane]);
  } else if (rows != 0 && !load(rows, data)) {
    lanes.left_to_mujoco |= rows;
  } else if (rows != 0) {
    set_options(rows, models);
    code_.warmstart(lanes, constraints_);
    constraints_.rows = rows & ~lanes.left_to_mujoco;
    if (has_one_island(m_)) {
      code_.solNewton(lanes, constraints_);
      for (int lane = 0; lane < code_.width && is_read; ++lane) {
        if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
        write_references(lane, *data[lane]);
        write_forces(lane, *data[lane]);
        mj_island(models[lane], data[lane]);
        data[lane]->solver_niter[0] = constraints_.iterations[lane];
      }
    } else {
      solve_islands(lanes, constraints_.rows, data);
    }
  }
  set_rest(lanes, rows);
}

void Solver::solve_dual(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data) {
  int count = 0;
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    DualRow& row = dual_rows_[static_cast<std::size_t>(count++)];
    row.model = models[lane];
    row.data = data[lane];
    row.order = orders()[static_cast<std::size_t>(data[lane]->nefc)].data();
    double inertia = 0;
    for (int i = 0; i < nv_; ++i) inertia += data[lane]->M[m_.M_rowadr[i] + m_.M_rownnz[i] - 1];
    row.scale = 1 / std::max(mjMINVAL, inertia);
  }
  code_.solPGS(dual_rows_.data(), count);
  const DualRow* row = dual_rows_.data();
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    data[lane]->solver_niter[0] = (row++)->iterations;
    for (int i = 0; i < nv_; ++i) lanes.qfrc_constraint[i * code_.width + lane] = data[lane]->qfrc_constraint[i];
  }
  code_.dualFinish(lanes);
}

void Solver::solve_islands(Lanes& lanes, std::uint32_t rows, const RowData& data) {
  const int width = code_.width;
  for (int lane = 0; lane < width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    write_references(lane, *data[lane]);
    for (int i = 0; i < nv_; ++i) {
      const int number = i * width + lane;
      if (data[lane]->dof_island[i] < 0) lanes.qacc[number] = lanes.qacc_smooth[number];
      lanes.qfrc_constraint[number] = 0;
    }
  }
  // The islands of all rows, of which those with the same dofs are solved together.
  std::array<int, kMaxWidth> next{}, islands{};
  for (;;) {
    int first = 0, count = 0;
    std::uint32_t together = 0;
    for (int lane = 0; lane < width; ++lane) {
      if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
      const mjData& d = *data[lane];
      if (next[lane] == d.nisland) continue;
      const int first_here = first_dof(d, next[lane]), count_here = d.island_nv[next[lane]];
      if (together == 0) {
        first = first_here;
        count = count_here;
      } else if (first_here != first || count_here != count) {
        continue;
      }
      together |= 1U << lane;
      islands[lane] = next[lane]++;
    }
    if (together == 0) return;
    solve_island(lanes, first, count, together, islands, data);
  }
}

// Solves an island of these rows (bits), which has the same dofs in all of them.
void Solver::solve_island(Lanes& lanes, int first, int count, std::uint32_t rows,
                          const std::array<int, kMaxWidth>& islands, const RowData& data) {
  const int width = code_.width;
  Constraints& c = constraints_;
  Lists lists{};
  for (int lane = 0; lane < width; ++lane) {
    const int island = islands[row_of(lane, rows)];
    const mjData& d = *data[row_of(lane, rows)];
    lists[lane] = {d.map_iefc2efc + d.island_iefcadr[island], d.island_nefc[island]};
  }
  if (!lay_out(rows, data, lists)) {
    lanes.left_to_mujoco |= rows;
    return;
  }
  for (int lane = 0; lane < width; ++lane) {
    const mjData& d = *data[row_of(lane, rows)];
    load_row(lane, d);
    for (int at = 0; at < c.size; ++at) {
      const int from = constraint_at(lane, at);
      const double* const J = d.efc_J + static_cast<std::ptrdiff_t>(std::max(from, 0)) * nv_ + first;
      c.aref[at * width + lane] = from < 0 ? 0 : d.efc_aref[from];
      for (int k = 0; k < count; ++k) c.J[(at * count + k) * width + lane] = from < 0 ? 0 : J[k];
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
    mjData& d = *data[lane];
    const int island = islands[lane];
    write_forces(lane, d);
    for (int k = 0; k < count; ++k) lanes.qfrc_constraint[(first + k) * width + lane] = c.qfrc[k * width + lane];
    if (island < mjNISLAND) d.solver_niter[island] = c.iterations[lane];
  }
}

// Loads all constraints of these rows (bits). Returns false if there are not enough places.
bool Solver::load(std::uint32_t rows, const RowData& data) {
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
