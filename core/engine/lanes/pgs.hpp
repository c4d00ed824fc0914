// MuJoCo 2.2.2's PGS solver for several rows at once.
#pragma once

#include "engine/lanes/constraints.hpp"

namespace mjenv::core::lanes {
namespace {

// Repeats mj_projectConstraint, mj_referenceConstraint and mj_fwdConstraint with mj_solPGS.
class Pgs : Constrained {
 public:
  Pgs(Lanes& d, Constraints& c) : Constrained(d, c), blocks_(c.size - Constraints::kRest) {}

  void run() {
    find_columns();
    solveM2();
    leave_huge(c_.JM2, size_ * nv_);
    leave_huge(c_.D, size_);
    projectConstraint();
    ARdiaginv();
    referenceConstraint();
    warmstart();
    if (c_.bounded > 0)
      solve<true>();
    else
      solve<false>();
    finish();
  }

 private:
  const int blocks_;  // how many places are in whole blocks of four

  // mju_dot of two vectors with a number for each place. A sum that is zero is +0 here, while MuJoCo's may be -0. For
  // inequalities this makes no difference: their forces are never -0, and subtracting +0 or -0 from another number
  // gives the same. Forces of equalities and friction can be -0, so leave_negative_zeros leaves the lanes in which the
  // sign of such a sum matters to MuJoCo.
  V dot_places(const V* a, const V* b) const {
    V res0{}, res1{}, res2{}, res3{};
    int j = 0;
    for (; j < blocks_; j += 4) {
      res0 += a[j] * b[j];
      res1 += a[j + 1] * b[j + 1];
      res2 += a[j + 2] * b[j + 2];
      res3 += a[j + 3] * b[j + 3];
    }
    const V sum = (res0 + res2) + (res1 + res3);
    return sum + (a[j] * b[j] + a[j + 1] * b[j + 1] + a[j + 2] * b[j + 2]);
  }

  void leave_negative_zeros(const V* b) {
    for (int i = 0; i < c_.bounded; ++i)
      if (const Mask is_zero = b[i] == V{}; __builtin_expect(any(is_zero), 0))
        leave(bits(is_zero & (1.0 / b[i] < V{})) & c_.rows);
  }

  // Where an element of x is 0, MuJoCo skips the subtraction, which could turn -0 into +0. This code subtracts +0
  // there.
  void solveM2() {
    const V *const qLD = vectors(d_.qLD), *const scale = vectors(d_.qLDiagSqrtInv);
    const int *const dof_Madr = m_.dof_Madr, *const dof_parentid = m_.dof_parentid;
    for (int row = 0; row < size_; ++row) {
      V* const x = vectors(c_.JM2) + row * nv_;
      copy(x, vectors(c_.J) + row * nv_, nv_);
      for (int i = nv_ - 1; i >= 0; --i) {
        const V tmp = x[i];
        const Mask is_zero = tmp == V{};
        if (m_.dof_simplenum[i] || !any(~is_zero)) continue;
        const V* factor = qLD + dof_Madr[i];
        for (int j = dof_parentid[i]; j >= 0; j = dof_parentid[j]) {
          const V product = *++factor * tmp;
          x[j] -= is_zero ? V{} : product;
        }
      }
      for (int i = 0; i < nv_; ++i) x[i] *= scale[i];
    }
  }

  // mju_sqrMatTD without a diagonal. Computes four numbers of AR at a time, because each is a sum whose terms must be
  // added one after the other.
  void projectConstraint() {
    const V* const JM2 = vectors(c_.JM2);
    V* const AR = vectors(c_.AR);
    for (int i = 0; i < size_; ++i) {
      const V* const row = JM2 + i * nv_;
      for (int k = 0; k <= i; k += 4) {
        // The last block of four may go beyond i. At the end of the matrix it computes the last row again, so that it
        // reads nothing beyond the matrix.
        const V* others[4];
        V sums[4]{};
        for (int n = 0; n < 4; ++n) others[n] = JM2 + (k + n < size_ ? k + n : size_ - 1) * nv_;
        for (int j = 0; j < nv_; ++j)
          for (int n = 0; n < 4; ++n) sums[n] += others[n][j] * row[j];
        for (int n = 0; n < 4 && k + n <= i; ++n) AR[i * size_ + k + n] = AR[(k + n) * size_ + i] = sums[n];
      }
    }
    for (int i = 0; i < size_; ++i) AR[i * (size_ + 1)] += vectors(c_.R)[i];
  }

  void ARdiaginv() {
    for (int i = 0; i < size_; ++i) {
      const Mask is_empty = vectors(c_.D)[i] == V{};
      const V inverse = 1.0 / vectors(c_.AR)[i * (size_ + 1)];
      vectors(c_.ARinv)[i] = is_empty ? V{} : inverse;
      vectors(c_.A)[i] = is_empty ? V{} : 1.0 / inverse;
    }
  }

  // warmstart of engine_forward.c
  void warmstart() {
    V *const force = vectors(c_.force), *const jar = vectors(c_.jar), *const b = vectors(c_.b);
    residual(b, vectors(d_.qacc_smooth));
    leave_negative_zeros(b);
    if (m_.opt.disableflags & mjDSBL_WARMSTART) return zero(force, size_);
    residual(jar, vectors(c_.warmstart));
    force_of(jar);
    V* const ARf = jar;
    for (int i = 0; i < size_; ++i) ARf[i] = dot_places(vectors(c_.AR) + i * size_, force);
    const Mask is_worse = dot_places(force, b) + 0.5 * dot_places(force, ARf) > V{};
    for (int i = 0; i < size_; ++i) force[i] = is_worse ? V{} : force[i];
  }

  // mj_solPGS. Lanes that have converged keep their forces.
  template <bool kIsBounded>
  void solve() {
    V* const force = vectors(c_.force);
    const V scale = *vectors(c_.meaninertia) * number_of_dofs(), tolerance = *vectors(c_.tolerance);
    for (int lane = 0; lane < kWidth; ++lane) {
      c_.iterations[lane] = 0;
      if (c_.most[lane] == 0) active_ &= ~(1u << lane);
    }
    while (active_ != 0) {
      const Mask is_active = mask_of(active_);
      V improvement{};
      for (int i = 0; i < size_; ++i) {
        const V res = vectors(c_.b)[i] + dot_places(vectors(c_.AR) + i * size_, force);
        const V old = force[i];
        V next = old - res * vectors(c_.ARinv)[i];
        if (kIsBounded) {
          const V least = vectors(c_.least)[i], greatest = vectors(c_.greatest)[i];
          next = next < least ? least : (next > greatest ? greatest : next);
        } else {
          next = next < V{} ? V{} : next;
        }

        // costChange
        const V delta = next - old;
        const V change = 0.5 * delta * delta * vectors(c_.A)[i] + delta * res;
        const Mask is_worse = change > splat(1e-10);
        force[i] = (is_worse | ~is_active) ? old : next;
        improvement -= is_worse ? V{} : change;
      }
      unsigned has_ended = bits(improvement / scale < tolerance);
      for (int lane = 0; lane < kWidth; ++lane)
        if (active_ >> lane & 1 && ++c_.iterations[lane] == c_.most[lane]) has_ended |= 1u << lane;
      active_ &= ~has_ended;
    }
  }

  // dualFinish
  void finish() {
    V *const qfrc = vectors(d_.qfrc_constraint), *const qacc = vectors(d_.qacc);
    mulJacTVec(qfrc, vectors(c_.force));
    copy(qacc, qfrc, nv_);
    solveLD(m_, qacc, vectors(d_.qLD), vectors(d_.qLDiagInv));
    add_to(qacc, vectors(d_.qacc_smooth), nv_);
  }
};

void solPGS(Lanes& d, Constraints& c) { Pgs(d, c).run(); }

}  // namespace
}  // namespace mjenv::core::lanes
