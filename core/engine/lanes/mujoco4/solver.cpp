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

Counts<Constraints> special_counts(const mjModel& m) {
  return {{&Constraints::ls_tolerance, 1}, {&Constraints::qfrc, static_cast<std::size_t>(m.nv)}};
}

}  // namespace

std::string Solver::unsupported_feature(const mjModel& m) {
  if (m.opt.solver != mjSOL_NEWTON && m.opt.solver != mjSOL_PGS) return "a solver other than Newton and PGS";
  if (is_sparse(m)) return "sparse Jacobians";
  if (m.opt.cone != mjCONE_PYRAMIDAL) return "elliptic cones";
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
  return unsupported_feature(m).empty() ? RowSolver::bytes(width, m, kMaxConstraints, special_counts(m)) : 0;
}

Solver::Solver(const Code& code, const mjModel& m)
    : RowSolver(code, m, kMaxConstraints, special_counts(m)),
      m_(m),
      dual_rows_(is_dual_ ? static_cast<std::size_t>(code.width) : 0),
      orders_(is_dual_ ? DualRow::kMost + 1 : 0) {}

// MuJoCo fails if its memory is too small to solve the constraints. `needed` is more than it takes. A row with a single
// tree has one island, without mj_island. The dofs of each island must follow each other.
bool Solver::prepare(const mjModel& m, mjData& d) {
  const std::int64_t rows = d.nefc, nv = m.nv;
  const std::int64_t needed = 40 * rows + 50 * nv + 3 * nv * nv + 2 * nv * rows + 6 * m.nC;
  const bool is_dual = m.opt.solver == mjSOL_PGS;
  if (rows == 0 || rows > (is_dual ? DualRow::kMost : kMaxConstraints) || d.ne > 0 || d.nf > 0 ||
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
  } else if (rows != 0) {
    RowSolver::load(rows, data);
    set_options(rows, models);
    code_.warmstart(lanes, constraints_);
    constraints_.rows = rows & ~lanes.left_to_mujoco;
    if (has_one_island(m_)) {
      code_.solNewton(lanes, constraints_);
      for (int lane = 0; lane < code_.width && is_read; ++lane) {
        if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
        write(lane, *data[lane]);
        mj_island(models[lane], data[lane]);
        data[lane]->solver_niter[0] = constraints_.iterations[lane];
      }
    } else {
      solve_islands(lanes, constraints_.rows, data);
    }
  }
  set_rest(lanes, rows);
}

// MuJoCo shuffles the constraints before each iteration, by numbers from PCG32 that are the same in each step.
const unsigned char* Solver::order_of(int constraints) {
  std::vector<unsigned char>& orders = orders_[static_cast<std::size_t>(constraints)];
  if (!orders.empty()) return orders.data();
  std::vector<unsigned char> order(static_cast<std::size_t>(constraints));
  std::iota(order.begin(), order.end(), static_cast<unsigned char>(0));
  std::uint64_t state = 1;  // after the first number, which MuJoCo drops
  const auto draw = [&] {
    const std::uint64_t old = state;
    state = old * 6364136223846793005U + 1;
    const auto mixed = static_cast<std::uint32_t>(((old >> 18) ^ old) >> 27),
               turn = static_cast<std::uint32_t>(old >> 59);
    return (mixed >> turn) | (mixed << (-turn & 31));
  };
  for (int iteration = 0; iteration < DualRow::kMostIterations; ++iteration) {
    for (std::uint32_t i = static_cast<std::uint32_t>(constraints) - 1; i > 0; --i)
      std::swap(order[i], order[draw() % (i + 1)]);
    orders.insert(orders.end(), order.begin(), order.end());
  }
  return orders.data();
}

void Solver::solve_dual(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data) {
  int count = 0;
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    DualRow& row = dual_rows_[static_cast<std::size_t>(count++)];
    row.model = models[lane];
    row.data = data[lane];
    row.order = order_of(data[lane]->nefc);
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
    write(lane, *data[lane]);
    for (int i = 0; i < nv_; ++i) {
      const int number = i * width + lane;
      if (data[lane]->dof_island[i] < 0) lanes.qacc[number] = lanes.qacc_smooth[number];
      lanes.qfrc_constraint[number] = 0;
    }
  }
  // The islands of all rows, of which those with the same dofs are solved together.
  std::array<int, kMaxWidth> next{}, islands{};
  for (;;) {
    const Part* solved = nullptr;
    std::uint32_t together = 0;
    for (int lane = 0; lane < width; ++lane) {
      if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
      const mjData& d = *data[lane];
      if (next[lane] == d.nisland) continue;
      const int first = first_dof(d, next[lane]), count = d.island_nv[next[lane]];
      if (!solved) solved = &part(first, count);
      if (solved->first != first || solved->count != count) continue;
      together |= 1U << lane;
      islands[lane] = next[lane]++;
    }
    if (!solved) return;
    solve_island(lanes, *solved, together, islands, data);
  }
}

// Solves an island of these rows (bits), which has the same dofs in all of them.
void Solver::solve_island(Lanes& lanes, const Part& part, std::uint32_t rows, const std::array<int, kMaxWidth>& islands,
                          const RowData& data) {
  const int width = code_.width, count = part.count;
  Constraints& c = constraints_;
  int most = 0;
  for (int lane = 0; lane < width; ++lane)
    if (rows >> lane & 1) most = std::max(most, data[lane]->island_nefc[islands[lane]]);
  set_size(rows, most, 0);
  for (int lane = 0; lane < width; ++lane) {
    const int row = row_of(lane, rows), island = islands[row];
    const mjData& d = *data[row];
    const int* const constraints = d.map_iefc2efc + d.island_iefcadr[island];
    for (int i = 0; i < most; ++i) {
      const bool is_there = i < d.island_nefc[island];
      const int from = is_there ? constraints[i] : 0;
      const double* const J = d.efc_J + static_cast<std::ptrdiff_t>(from) * nv_ + part.first;
      c.D[i * width + lane] = is_there ? d.efc_D[from] : 0;
      c.aref[i * width + lane] = is_there ? d.efc_aref[from] : 0;
      for (int k = 0; k < count; ++k) c.J[(i * count + k) * width + lane] = is_there ? J[k] : 0;
    }
  }
  Lanes own = lanes;
  own.model = &part.model;
  for (double* Lanes::*array : {&Lanes::qacc, &Lanes::qacc_smooth, &Lanes::qfrc_smooth, &Lanes::qLDiagInv})
    own.*array += static_cast<std::ptrdiff_t>(part.first) * width;
  own.qfrc_constraint = c.qfrc;
  code_.begin_island(own, c);
  code_.solNewton(own, c);
  lanes.left_to_mujoco |= own.left_to_mujoco;
  for (int lane = 0; lane < width; ++lane) {
    if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
    mjData& d = *data[lane];
    const int island = islands[lane], *const constraints = d.map_iefc2efc + d.island_iefcadr[island];
    for (int i = 0; i < d.island_nefc[island]; ++i) d.efc_force[constraints[i]] = c.force[i * width + lane];
    for (int k = 0; k < count; ++k) lanes.qfrc_constraint[(part.first + k) * width + lane] = c.qfrc[k * width + lane];
    if (island < mjNISLAND) d.solver_niter[island] = c.iterations[lane];
  }
}

const Solver::Part& Solver::part(int first, int count) {
  for (const auto& known : parts_)
    if (known->first == first && known->count == count) return *known;
  parts_.push_back(std::make_unique<Part>(Part{first, count, m_, {m_.M_colind, m_.M_colind + m_.nC}}));
  Part& made = *parts_.back();
  for (int& column : made.columns) column -= first;
  made.model.nv = count;
  made.model.M_rownnz += first;
  made.model.M_rowadr += first;
  made.model.M_colind = made.columns.data();
  return made;
}

}  // namespace mjenv::core::lanes
