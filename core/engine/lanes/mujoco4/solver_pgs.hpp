// MuJoCo 4.0's PGS (engine_solver.c) for dense Jacobians and pyramidal cones, and constraints of limits and contacts. Each
// row visits its constraints in a random order of its own, so the numbers of rows do not lie side by side, but in their
// mjData. Rows take turns after each constraint, so that the CPU computes with several at once.
#pragma once

#include <mujoco/mjdata.h>

#include "engine/lanes/mujoco4/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

typedef double Four __attribute__((vector_size(32)));

// mju_dot of two vectors of one row, as `dot` computes it in lanes.
inline double dot_row(const double* a, const double* b, int n) {
  double res = 0;
  int i = 0;
  if (n >= 4) {
    Four sums = {-0.0, -0.0, -0.0, -0.0}, x, y;
    for (; i <= n - 4; i += 4) {
      __builtin_memcpy(&x, a + i, sizeof x);
      __builtin_memcpy(&y, b + i, sizeof y);
      sums += x * y;
    }
    res = (sums[0] + sums[2]) + (sums[1] + sums[3]);
  }
  if (n - i == 3)
    res += a[i] * b[i] + a[i + 1] * b[i + 1] + a[i + 2] * b[i + 2];
  else if (n - i == 2)
    res += a[i] * b[i] + a[i + 1] * b[i + 1];
  else if (n - i == 1)
    res += a[i] * b[i];
  return res;
}

class PGS {
 public:
  explicit PGS(DualRow& row) : r_(row), m_(*row.model), d_(*row.data), force_(d_.efc_force), size_(d_.nefc) {}

  // The first part of mj_fwdConstraint: the forces of the last step if they are better than none.
  void begin() {
    const int nv = static_cast<int>(m_.nv);
    for (int i = 0; i < size_; ++i) {
      const double* const J = d_.efc_J + i * nv;
      d_.efc_b[i] = dot_row(J, d_.qacc_smooth, nv) - d_.efc_aref[i];
      const double jar = dot_row(J, d_.qacc_warmstart, nv) - d_.efc_aref[i];
      force_[i] = jar >= 0 ? 0 : -d_.efc_D[i] * jar;
      r_.inverse[i] = 1 / AR(i)[i];
      r_.A[i] = 1 / r_.inverse[i];
    }
    for (int i = 0; i < size_; ++i) r_.momentum[i] = dot_row(AR(i), force_, size_);
    const double cost = dot_row(force_, d_.efc_b, size_) + 0.5 * dot_row(force_, r_.momentum, size_);
    const bool is_cold = (m_.opt.disableflags & mjDSBL_WARMSTART) != 0;
    for (int i = 0; i < size_ && (is_cold || cost > 0); ++i) force_[i] = 0;
    r_.iterations = r_.since_restart = 0;
  }

  // Moves on in the direction of the last iteration (Nesterov's momentum).
  void extrapolate() {
    r_.improvement = 0;
    const double beta =
        r_.iterations > 0 ? static_cast<double>(r_.since_restart - 1) / static_cast<double>(r_.since_restart + 2) : 0;
    for (int i = 0; i < size_; ++i) {
      const double force = force_[i], moved = force + beta * (force - r_.previous[i]);
      if (beta > 0) force_[i] = moved < 0 ? 0 : moved;
      r_.previous[i] = force;
      r_.momentum[i] = force_[i];
    }
  }

  // Changes the force of one constraint.
  void update(int turn) {
    const int i = r_.order[r_.iterations * size_ + turn];
    const double residual = d_.efc_b[i] + dot_row(AR(i), force_, size_), old = force_[i];
    const double next = old - residual * r_.inverse[i], force = next < 0 ? 0 : next, delta = force - old;
    const double change = 0.5 * delta * delta * r_.A[i] + delta * residual;
    if (change > 1e-10) return;
    force_[i] = force;
    r_.improvement -= change;
  }

  void end_iteration() {
    double product = 0;
    for (int i = 0; i < size_ && r_.iterations > 0; ++i)
      product += (force_[i] - r_.momentum[i]) * (r_.momentum[i] - r_.previous[i]);
    r_.since_restart = product < 0 ? 0 : r_.since_restart + 1;
    ++r_.iterations;
    r_.has_ended = r_.improvement * r_.scale < m_.opt.tolerance || r_.iterations >= m_.opt.iterations;
  }

  // The first part of mj_dualFinish
  void finish() {
    const int nv = static_cast<int>(m_.nv);
    for (int k = 0; k < nv; ++k) d_.qfrc_constraint[k] = 0;
    for (int i = 0; i < size_; ++i) {
      if (force_[i] == 0) continue;
      for (int k = 0; k < nv; ++k) d_.qfrc_constraint[k] += d_.efc_J[i * nv + k] * force_[i];
    }
  }

  int size() const { return size_; }

 private:
  DualRow& r_;
  const mjModel& m_;
  mjData& d_;
  double* const force_;
  const int size_;

  const double* AR(int i) const { return d_.efc_AR + i * size_; }
};

// mj_fwdConstraint without the second part of mj_dualFinish
void solPGS(DualRow* rows, int count) {
  int most = 0;
  for (int r = 0; r < count; ++r) {
    PGS row(rows[r]);
    row.begin();
    most = most < row.size() ? row.size() : most;
    rows[r].has_ended = rows[r].model->opt.iterations <= 0;
  }
  const auto for_each = [&](const auto& body) {
    bool is_any = false;
    for (int r = 0; r < count; ++r) {
      if (rows[r].has_ended) continue;
      PGS row(rows[r]);
      body(row);
      is_any = true;
    }
    return is_any;
  };
  while (for_each([](PGS& row) { row.extrapolate(); })) {
    for (int turn = 0; turn < most; ++turn)
      for_each([&](PGS& row) {
        if (turn < row.size()) row.update(turn);
      });
    for_each([](PGS& row) { row.end_iteration(); });
  }
  for (int r = 0; r < count; ++r) PGS(rows[r]).finish();
}

// The second part of mj_dualFinish
void dualFinish(Lanes& d) {
  const int nv = static_cast<int>(d.model->nv);
  V* const qacc = vectors(d.qacc);
  copy(qacc, vectors(d.qfrc_constraint), nv);
  solveLD(*d.model, qacc, vectors(d.qLD), vectors(d.qLDiagInv));
  add_to(qacc, vectors(d.qacc_smooth), nv);
}

}  // namespace
}  // namespace mjenv::core::lanes
