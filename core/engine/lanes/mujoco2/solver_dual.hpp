// What MuJoCo 2.2.2's solvers PGS and noslip share. Both look for the forces of constraints that minimise the cost of
// the dual problem, a few forces at a time.
#pragma once

#include "engine/lanes/frame/constrained.hpp"
#include "engine/lanes/mujoco2/unlisted.hpp"
#include "engine/lanes/mujoco2/util_sparse.hpp"

namespace mjenv::core::lanes {
namespace {

class Dual : protected Constrained {
 public:
  Dual(Lanes& d, Constraints& c) : Constrained(d, c), blocks_(size_ - (c.is_numbered ? 0 : Constraints::kRest)) {
    for (int j = 0; j < size_ && c.is_numbered; j += 4) {
      unsigned rows = 0;
      for (int lane = 0; lane < kWidth; ++lane)
        if (j < c.at_first[lane] && c.at_first[lane] < j + 4) rows |= 1u << lane;
      has_rest_[j / 4] = rows != 0;
      is_rest_[j / 4] = mask_of(rows);
    }
  }

 protected:
  // mju_dot of two vectors with a number for each place. A sum that is zero is +0 here, while MuJoCo's may be -0. This
  // can change a residual (b plus the sum) only where b is -0, and then only from -0 to +0. For inequalities this makes
  // no difference: a multiple of the residual is subtracted from the force, which is never -0, so the sign of a zero
  // does not matter. Forces of equalities, friction and elliptic cones can be -0, so leave_negative_zeros leaves to
  // MuJoCo the lanes in which b is -0 for such a constraint.
  V dot_places(const V* a, const V* b) const {
    if (c_.is_numbered) return dot_numbered(a, b);
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

  // Leaves the lanes in which b is -0 at one of the first `count` places.
  void leave_negative_zeros(const V* b, int count) {
    for (int i = 0; i < count; ++i)
      if (const Mask is_zero = b[i] == V{}; __builtin_expect(any(is_zero), 0))
        leave(bits(is_zero & (1.0 / b[i] < V{})) & c_.rows);
  }

  // mj_projectConstraint
  void projectConstraint() {
    solveM2();
    leave_huge(c_.JM2, size_ * nv_);
    sqrMatTD();
    for (int i = 0; i < size_; ++i) AR(i, i) += vectors(c_.R)[i];
  }

  V& AR(int i, int j) const { return vectors(c_.AR)[i * size_ + j]; }

  // `residual` of engine_solver.c for one constraint
  V residual_at(int i) const { return vectors(c_.b)[i] + dot_places(&AR(i, 0), vectors(c_.force)); }

  // dualFinish
  void finish() {
    V *const qfrc = vectors(d_.qfrc_constraint), *const qacc = vectors(d_.qacc);
    mulJacTVec(qfrc, vectors(c_.force));
    copy(qacc, qfrc, nv_);
    solveLD(m_, qacc, vectors(d_.qLD), vectors(d_.qLDiagInv));
    add_to(qacc, vectors(d_.qacc_smooth), nv_);
  }

  // The part of AR that belongs to kSize constraints from `first` on.
  template <int kSize>
  void extractBlock(V* block, int first) const {
    for (int j = 0; j < kSize; ++j)
      for (int k = 0; k < kSize; ++k) block[j * kSize + k] = AR(first + j, first + k);
  }

  // costChange of engine_solver.c, for more than one constraint. Returns the change by which MuJoCo decides
  // whether to restore the forces.
  template <int kSize>
  static V costChange(const V* block, const V* force, const V* old, const V* res) {
    V delta[kSize], product[kSize];
    for (int j = 0; j < kSize; ++j) delta[j] = force[j] - old[j];
    for (int j = 0; j < kSize; ++j) product[j] = dot(block + j * kSize, delta, kSize);
    return 0.5 * dot(delta, product, kSize) + dot(delta, res, kSize);
  }
  static Mask is_worse(V change) { return change > splat(1e-10); }

  // Takes the new forces of kSize constraints in these lanes, unless the cost rises.
  template <int kSize>
  static void take(V* force, const V* next, V change, Mask rows, V& improvement) {
    const Mask is_taken = rows & ~is_worse(change);
    for (int j = 0; j < kSize; ++j) force[j] = is_taken ? next[j] : force[j];
    improvement = is_taken ? improvement - change : improvement;
  }

  // The friction of a contact with an elliptic cone, given its normal force. MuJoCo's function finds it in each of
  // these lanes (bits).
  template <int kSize>
  static void find_friction(V* friction, const V* block, const V* b, const V* mu, V normal, unsigned rows) {
    for (int lane = 0; lane < kWidth; ++lane) {
      if (!(rows >> lane & 1)) continue;
      double found[kSize]{}, A[kSize * kSize], offset[kSize], scale[kSize];
      for (int j = 0; j < kSize * kSize; ++j) A[j] = block[j][lane];
      for (int j = 0; j < kSize; ++j) {
        offset[j] = b[j][lane];
        scale[j] = mu[j][lane];
      }
      if (!(normal[lane] < mjMINVAL) && QCQP<kSize>(found, A, offset, scale, normal[lane])) {
        double sum = 0;
        for (int j = 0; j < kSize; ++j) sum += found[j] * found[j] / (scale[j] * scale[j]);
        sum = std::sqrt(normal[lane] * normal[lane] / (mjMINVAL >= sum ? mjMINVAL : sum));
        for (double& x : found) x *= sum;
      }
      for (int j = 0; j < kSize; ++j) friction[j][lane] = found[j];
    }
  }

 private:
  static constexpr int kMostBlocks = Constraints::kMostNumbered / 4;
  const int blocks_;  // how many places are in blocks of four
  // If places are numbered, for each block of four: whether there are lanes whose constraints end within it, after one,
  // two or three, and which lanes these are.
  bool has_rest_[kMostBlocks]{};
  Mask is_rest_[kMostBlocks]{};

  // dot_places if places are numbered. As in mju_dot, a lane's last one, two or three products are summed separately,
  // and added after the others.
  V dot_numbered(const V* a, const V* b) const {
    V res0{}, res1{}, res2{}, res3{}, rest{};
    for (int j = 0; j < blocks_; j += 4) {
      const V part0 = a[j] * b[j], part1 = a[j + 1] * b[j + 1], part2 = a[j + 2] * b[j + 2],
              part3 = a[j + 3] * b[j + 3];
      if (!has_rest_[j / 4]) {
        res0 += part0;
        res1 += part1;
        res2 += part2;
        res3 += part3;
        continue;
      }
      const Mask is_rest = is_rest_[j / 4];
      rest = is_rest ? part0 + part1 + part2 : rest;
      res0 = is_rest ? res0 : res0 + part0;
      res1 = is_rest ? res1 : res1 + part1;
      res2 = is_rest ? res2 : res2 + part2;
      res3 = is_rest ? res3 : res3 + part3;
    }
    return (res0 + res2) + (res1 + res3) + rest;
  }

  template <int kSize>
  static int QCQP(double* res, const double* A, const double* b, const double* mu, double r) {
    if constexpr (kSize == 2) return mju_QCQP2(res, A, b, mu, r);
    if constexpr (kSize == 3) return mju_QCQP3(res, A, b, mu, r);
    if constexpr (kSize > 3) return mju_QCQP(res, A, b, mu, r, kSize);
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
  void sqrMatTD() {
    const V* const JM2 = vectors(c_.JM2);
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
        for (int n = 0; n < 4 && k + n <= i; ++n) AR(i, k + n) = AR(k + n, i) = sums[n];
      }
    }
  }
};

}  // namespace
}  // namespace mjenv::core::lanes
