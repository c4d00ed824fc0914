#include "engine/lanes/mujoco4/solver.hpp"

#include <algorithm>
#include <cstddef>

namespace mjenv::core::lanes {
namespace {

bool is_sparse(const mjModel& m) {
  return m.opt.jacobian == mjJAC_SPARSE || (m.opt.jacobian == mjJAC_AUTO && m.nv >= 60);
}

Counts<Constraints> special_counts() { return {{&Constraints::ls_tolerance, 1}}; }

}  // namespace

std::string Solver::unsupported_feature(const mjModel& m) {
  if (m.opt.solver != mjSOL_NEWTON) return "a solver other than Newton";
  if (is_sparse(m)) return "sparse Jacobians";
  if (m.opt.cone != mjCONE_PYRAMIDAL) return "elliptic cones";
  if (m.opt.noslip_iterations > 0) return "noslip";
  if (m.opt.enableflags & mjENBL_DIAGEXACT) return "exact diagonals (opt.enableflags)";
  if (m.flg_surfacevel) return "velocities of surfaces";
  return m.flg_adhesion ? "adhesion" : "";
}

std::unique_ptr<Solver> Solver::make(const Code& code, const mjModel& m) {
  return unsupported_feature(m).empty() ? std::unique_ptr<Solver>(new Solver(code, m)) : nullptr;
}

std::size_t Solver::bytes(int width, const mjModel& m) {
  return unsupported_feature(m).empty() ? RowSolver::bytes(width, m, kMaxConstraints, special_counts()) : 0;
}

Solver::Solver(const Code& code, const mjModel& m) : RowSolver(code, m, kMaxConstraints, special_counts()) {}

// MuJoCo solves all dofs at once without islands, and if all are part of one island. With a single tree, that is known
// without mj_island. MuJoCo fails if its memory is too small to solve the constraints. `needed` is more than it takes.
bool Solver::solves(const mjModel& m, mjData& d) {
  const std::int64_t rows = d.nefc, nv = m.nv;
  const std::int64_t needed = 40 * rows + 50 * nv + 3 * nv * nv + 2 * nv * rows + 6 * m.nC;
  if (rows == 0 || rows > kMaxConstraints || d.ne > 0 || d.nf > 0 || !unsupported_feature(m).empty() ||
      static_cast<std::int64_t>(d.narena - d.parena - d.pstack) < 8 * needed)
    return false;
  if (m.ntree == 1) return true;
  const auto used = d.parena;
  mj_island(&m, &d);
  if (d.nisland == 0 || (d.nisland == 1 && d.nidof == m.nv)) return true;
  d.parena = used;  // mj_island is called again for this row
  return false;
}

void Solver::solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_read) {
  if (rows == 0) return set_rest(lanes, rows);
  RowSolver::load(rows, data);
  Constraints& c = constraints_;
  c.islands = 0;
  for (int lane = 0; lane < code_.width; ++lane) {
    const int row = row_of(lane, rows);
    const mjModel& m = *models[row];
    c.tolerance[lane] = m.opt.tolerance;
    c.ls_tolerance[lane] = m.opt.ls_tolerance;
    c.meaninertia[lane] = m.stat.meaninertia;
    c.most[lane] = std::max(0, m.opt.iterations);
    c.most_evaluations[lane] = m.opt.ls_iterations;
    const bool has_islands = (m.opt.disableflags & mjDSBL_ISLAND) == 0 && (m.ntree == 1 || data[row]->nisland > 0);
    if (has_islands) c.islands |= 1U << lane;
  }
  code_.solNewton(lanes, c);
  set_rest(lanes, rows);
  for (int lane = 0; lane < code_.width && is_read; ++lane) {
    if (!((rows & ~lanes.left_to_mujoco) >> lane & 1)) continue;
    write(lane, *data[lane]);
    data[lane]->solver_niter[0] = c.iterations[lane];
  }
}

}  // namespace mjenv::core::lanes
