// MuJoCo 4.0's PGS (engine_solver.c) for dense Jacobians and pyramidal cones, and constraints of limits and contacts. Each
// row visits its constraints in a random order of its own, so the numbers of rows do not lie side by side there, but one
// row after the other. Rows take turns after each constraint, so that the CPU computes with several at once.
#pragma once

#include "engine/lanes/frame/constrained.hpp"
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
  explicit PGS(DualRow& row) : r_(row), m_(*row.model), force_(row.force), size_(row.size) {}

  // The rest of the first part of mj_fwdConstraint: the forces of the last step if they are better than none.
  void begin() {
    for (int i = 0; i < size_; ++i) {
      r_.inverse[i] = 1 / AR(i)[i];
      r_.A[i] = 1 / r_.inverse[i];
    }
    for (int i = 0; i < size_; ++i) r_.momentum[i] = dot_row(AR(i), force_, size_);
    const double cost = dot_row(force_, r_.b, size_) + 0.5 * dot_row(force_, r_.momentum, size_);
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
    const double residual = r_.b[i] + dot_row(AR(i), force_, size_), old = force_[i];
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

  int size() const { return size_; }

 private:
  DualRow& r_;
  const mjModel& m_;
  double* const force_;
  const int size_;

  const double* AR(int i) const { return r_.AR + i * size_; }
};

// The iterations of mj_fwdConstraint, for the rows that have constraints
void solPGS(DualRow* rows, int count) {
  int most = 0;
  for (int r = 0; r < count; ++r) {
    PGS row(rows[r]);
    row.begin();
    most = most < row.size() ? row.size() : most;
    rows[r].has_ended = row.size() == 0 || rows[r].model->opt.iterations <= 0;
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
}

// What lanes compute before and after the iterations.
class Dual : Constrained {
 public:
  Dual(Lanes& d, Constraints& c) : Constrained(d, c), Y_(vectors(c.JM2)) {}

  void begin(DualRow* rows) {
    leave_huge(c_.J, size_ * nv_);
    leave_huge(c_.R, size_);
    referenceConstraint();
    V *const b = vectors(c_.b), *const jar = vectors(c_.jar), *const force = vectors(c_.force);
    residual(b, vectors(d_.qacc_smooth));
    residual(jar, vectors(d_.qacc_warmstart));
    for (int i = 0; i < size_; ++i) force[i] = jar[i] >= V{} ? V{} : -vectors(c_.D)[i] * jar[i];
    solveM2();
    leave_huge(c_.JM2, size_ * nv_);
    for (int i = 0; i < size_; ++i) project(i, rows);
    for (int lane = 0; lane < kWidth; ++lane)
      for (int i = 0; i < rows[lane].size; ++i) {
        rows[lane].b[i] = b[i][lane];
        rows[lane].force[i] = force[i][lane];
      }
  }

  // mj_dualFinish
  void finish() {
    V* const qacc = vectors(d_.qacc);
    find_columns();  // `project` has overwritten them
    mulJacTVec(vectors(d_.qfrc_constraint), vectors(c_.force));
    copy(qacc, vectors(d_.qfrc_constraint), nv_);
    solveLD(m_, qacc, vectors(d_.qLD), vectors(d_.qLDiagInv));
    add_to(qacc, vectors(d_.qacc_smooth), nv_);
  }

 private:
  V* const Y_;

  // mj_solveM2. Where an element of x is 0, MuJoCo skips the subtraction, which could turn -0 into +0. This code
  // subtracts +0 there.
  void solveM2() {
    const V* const qLD = vectors(d_.qLD);
    for (int row = 0; row < size_; ++row) {
      V* const x = Y_ + row * nv_;
      copy(x, vectors(c_.J) + row * nv_, nv_);
      for (int i = nv_ - 1; i > 0; --i) {
        const V tmp = x[i];
        const Mask is_zero = tmp == V{};
        const int start = m_.M_rowadr[i], end = start + m_.M_rownnz[i] - 1;
        if (start == end || !any(~is_zero)) continue;
        for (int adr = start; adr < end; ++adr) {
          const V product = qLD[adr] * tmp;
          x[m_.M_colind[adr]] -= is_zero ? V{} : product;
        }
      }
    }
    for (int i = 0; i < nv_; ++i) {
      const V scale = 1.0 / sqrt(qLD[m_.M_rowadr[i] + m_.M_rownnz[i] - 1]);
      for (int row = 0; row < size_; ++row) Y_[row * nv_ + i] *= scale;
    }
  }

  // Row i of AR up to its diagonal, and column i. Computes four numbers at a time, because each is a sum whose terms
  // must be added one after the other. The last four may go beyond the diagonal and the row: those numbers are
  // overwritten later, or lie behind the matrix (DualRow::kBehind).
  void project(int i, DualRow* rows) const {
    const V *const row = Y_ + i * nv_, R = vectors(c_.R)[i];
    int *const columns = c_.columns, count = 0;
    for (int j = 0; j < nv_; ++j)
      if (any(row[j] != V{})) columns[count++] = j;
    double spare[DualRow::kMost + DualRow::kBehind], *to[kWidth];
    for (int lane = 0; lane < kWidth; ++lane)
      to[lane] = i < rows[lane].size ? rows[lane].AR + i * rows[lane].size : spare;
    for (int k = 0; k <= i; k += 4) {
      const V* others[4];
      V sums[4]{};
      for (int n = 0; n < 4; ++n) others[n] = Y_ + (k + n < size_ ? k + n : size_ - 1) * nv_;
      for (int c = 0; c < count; ++c)
        for (int n = 0; n < 4; ++n) sums[n] += others[n][columns[c]] * row[columns[c]];
      if (i - k < 4) sums[i - k] += R;
      double* at[kWidth];
      for (int lane = 0; lane < kWidth; ++lane) at[lane] = to[lane] + k;
      scatter(at, reinterpret_cast<const double*>(sums), 4);
    }
    for (int lane = 0; lane < kWidth; ++lane)
      for (int k = 0; k < i && i < rows[lane].size; ++k) rows[lane].AR[k * rows[lane].size + i] = to[lane][k];
  }
};

void projectConstraint(Lanes& d, Constraints& c, DualRow* rows) { Dual(d, c).begin(rows); }
void dualFinish(Lanes& d, Constraints& c) { Dual(d, c).finish(); }

}  // namespace
}  // namespace mjenv::core::lanes
