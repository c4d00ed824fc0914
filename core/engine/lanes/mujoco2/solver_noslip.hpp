// MuJoCo 2.2.2's noslip solver for several rows at once. After the main solver it finds other forces of friction, as if
// constraints were hard (without R).
#pragma once

#include "engine/lanes/mujoco2/solver_dual.hpp"

namespace mjenv::core::lanes {
namespace {

// mj_solNoSlip. Places are numbered. The main solver has computed the forces and b, and PGS also AR.
class NoSlip : Dual {
 public:
  using Dual::Dual;

  void run(bool has_AR) {
    find_columns();
    if (!has_AR) projectConstraint();
    leave_negative_zeros(vectors(c_.b), size_);
    solve();
    finish();
  }

 private:
  V residual_without_R(int i) const { return residual_at(i) - vectors(c_.R)[i] * vectors(c_.force)[i]; }

  // extractBlock with flg_subR
  template <int kSize>
  void extractBlock_without_R(V* block, int first) const {
    extractBlock<kSize>(block, first);
    for (int j = 0; j < kSize; ++j) {
      V& diagonal = block[j * (kSize + 1)];
      diagonal -= vectors(c_.R)[first + j];
      diagonal = splat(1e-10) > diagonal ? splat(1e-10) : diagonal;
    }
  }

  void solve() {
    const V scale = *vectors(c_.meaninertia) * number_of_dofs(), tolerance = *vectors(c_.noslip_tolerance);
    int iteration = 0;
    while (active_ != 0) {
      V improvement{};
      for (int i = 0; i < size_ && iteration == 0; ++i)
        improvement += 0.5 * vectors(c_.force)[i] * vectors(c_.force)[i] * vectors(c_.R)[i];
      for (int i = 0; i < c_.bounded; ++i)
        if (any(vectors(c_.frictionloss)[i] > V{})) update_dry_friction(i, improvement);
      for (int i = 0; i < size_; ++i) {
        const Constraints::Starts& starts = c_.starts[i];
        if (const unsigned rows = starts.blocks[2] & active_; rows != 0) update_edges(i, mask_of(rows), improvement);
        if (const unsigned rows = starts.blocks[3] & active_; rows != 0) update_cone<3>(i, rows, improvement);
        if (const unsigned rows = starts.blocks[4] & active_; rows != 0) update_cone<4>(i, rows, improvement);
        if (const unsigned rows = starts.blocks[6] & active_; rows != 0) update_cone<6>(i, rows, improvement);
      }
      active_ &= ~bits(improvement / scale < tolerance);
      ++iteration;
      for (int lane = 0; lane < kWidth; ++lane)
        if (iteration == c_.noslip_most[lane]) active_ &= ~(1u << lane);
    }
  }

  // The dry friction of a joint or tendon
  void update_dry_friction(int i, V& improvement) {
    V& force = vectors(c_.force)[i];
    const V loss = vectors(c_.frictionloss)[i], res = residual_without_R(i), diagonal = AR(i, i) - vectors(c_.R)[i];
    const V ARinv = 1.0 / (splat(mjMINVAL) >= diagonal ? splat(mjMINVAL) : diagonal);
    V next = force - res * ARinv;
    next = next < -loss ? -loss : (next > loss ? loss : next);
    const V delta = next - force;
    const Mask is_updated = (loss > V{}) & mask_of(active_);
    improvement = is_updated ? improvement - (0.5 * delta * delta / ARinv + delta * res) : improvement;
    force = is_updated ? next : force;
  }

  // Two opposite edges of a pyramidal cone. The sum of their forces stays.
  void update_edges(int i, Mask rows, V& improvement) {
    V* const force = vectors(c_.force) + i;
    V res[2], block[4], b[2], next[2];
    for (int j = 0; j < 2; ++j) res[j] = residual_without_R(i + j);
    extractBlock_without_R<2>(block, i);
    for (int j = 0; j < 2; ++j) b[j] = res[j] - dot(block + 2 * j, force, 2);
    const V mid = 0.5 * (force[0] + force[1]);
    const V K1 = block[0] + block[3] - block[1] - block[2], K0 = mid * (block[0] - block[3]) + b[0] - b[1];
    const V y = -K0 / K1;
    const Mask is_flat = K1 < splat(mjMINVAL), is_low = y<-mid, is_high = y> mid;
    next[0] = is_low ? V{} : (is_high ? 2.0 * mid : mid + y);
    next[1] = is_low ? 2.0 * mid : (is_high ? V{} : mid - y);
    for (V& x : next) x = is_flat ? mid : x;
    take<2>(force, next, costChange<2>(block, next, force, res), rows, improvement);
  }

  // The friction of a contact with an elliptic cone. Its normal force stays.
  template <int kDim>
  void update_cone(int i, unsigned rows, V& improvement) {
    constexpr int kSize = kDim - 1;
    V* const force = vectors(c_.force) + i + 1;
    V res[kSize], block[kSize * kSize], b[kSize], next[kSize]{};
    for (int j = 0; j < kSize; ++j) res[j] = residual_without_R(i + 1 + j);
    extractBlock_without_R<kSize>(block, i + 1);
    for (int j = 0; j < kSize; ++j) b[j] = res[j] - dot(block + j * kSize, force, kSize);
    find_friction<kSize>(next, block, b, vectors(c_.scale) + i + 1, force[-1], rows);
    take<kSize>(force, next, costChange<kSize>(block, next, force, res), mask_of(rows), improvement);
  }
};

void solNoSlip(Lanes& d, Constraints& c, bool has_AR) { NoSlip(d, c).run(has_AR); }

}  // namespace
}  // namespace mjenv::core::lanes
