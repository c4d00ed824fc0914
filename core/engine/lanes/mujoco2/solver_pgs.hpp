// MuJoCo 2.2.2's PGS solver for several rows at once.
#pragma once

#include "engine/lanes/mujoco2/solver_dual.hpp"

namespace mjenv::core::lanes {
namespace {

// Repeats mj_projectConstraint, mj_referenceConstraint and mj_fwdConstraint with mj_solPGS.
class Pgs : Dual {
 public:
  using Dual::Dual;

  void run() {
    find_columns();
    leave_huge(c_.D, size_);
    projectConstraint();
    ARdiaginv();
    referenceConstraint();
    warmstart();
    solve();
    finish();
  }

 private:
  void ARdiaginv() {
    for (int i = 0; i < size_; ++i) {
      const Mask is_empty = vectors(c_.D)[i] == V{};
      const V inverse = 1.0 / AR(i, i);
      vectors(c_.ARinv)[i] = is_empty ? V{} : inverse;
      vectors(c_.A)[i] = is_empty ? V{} : 1.0 / inverse;
    }
  }

  // warmstart of engine_forward.c
  void warmstart() {
    V *const force = vectors(c_.force), *const jar = vectors(c_.jar), *const b = vectors(c_.b);
    residual(b, vectors(d_.qacc_smooth));
    leave_negative_zeros(b, c_.is_numbered ? size_ : c_.bounded);
    if (m_.opt.disableflags & mjDSBL_WARMSTART) return zero(force, size_);
    leave_huge(d_.qacc_warmstart, nv_);  // mulJacTVec skips zeros of the Jacobian, which needs finite forces
    residual(jar, vectors(d_.qacc_warmstart));
    force_of(jar);
    if (c_.is_numbered) force_of_cones(jar);
    V* const ARf = jar;
    for (int i = 0; i < size_; ++i) ARf[i] = dot_places(&AR(i, 0), force);
    const Mask is_worse = dot_places(force, b) + 0.5 * dot_places(force, ARf) > V{};
    for (int i = 0; i < size_; ++i) force[i] = is_worse ? V{} : force[i];
  }

  // force_of has treated the constraints of contacts with elliptic cones as inequalities. Replaces their forces by
  // those of the cones.
  void force_of_cones(const V* jar) {
    for (int i = 0; i < size_; ++i)
      for (const int dim : {3, 4, 6}) {
        const unsigned rows = c_.starts[i].blocks[dim];
        if (rows == 0) continue;
        V force[6];
        cone_force(i, dim, jar, force);
        const Mask is_cone = mask_of(rows);
        for (int j = 0; j < dim; ++j) vectors(c_.force)[i + j] = is_cone ? force[j] : vectors(c_.force)[i + j];
      }
  }

  // mj_solPGS. Lanes that have converged keep their forces.
  void solve() {
    const V scale = *vectors(c_.meaninertia) * number_of_dofs(), tolerance = *vectors(c_.tolerance);
    for (int lane = 0; lane < kWidth; ++lane) {
      c_.iterations[lane] = 0;
      if (c_.most[lane] == 0) active_ &= ~(1u << lane);
    }
    while (active_ != 0) {
      V improvement{};
      if (c_.is_numbered)
        sweep_numbered(improvement);
      else if (c_.bounded > 0)
        sweep<true>(improvement);
      else
        sweep<false>(improvement);
      unsigned has_ended = bits(improvement / scale < tolerance);
      for (int lane = 0; lane < kWidth; ++lane)
        if (active_ >> lane & 1 && ++c_.iterations[lane] == c_.most[lane]) has_ended |= 1u << lane;
      active_ &= ~has_ended;
    }
  }

  template <bool kIsBounded>
  void sweep(V& improvement) {
    const Mask is_active = mask_of(active_);
    for (int i = 0; i < size_; ++i) update<kIsBounded>(i, is_active, improvement);
  }

  // A place may belong to a contact in one lane, and to another constraint in another.
  void sweep_numbered(V& improvement) {
    for (int i = 0; i < size_; ++i) {
      const Constraints::Starts& starts = c_.starts[i];
      if (const unsigned rows = starts.blocks[1] & active_; rows != 0) {
        if (i < c_.bounded)
          update<true>(i, mask_of(rows), improvement);
        else
          update<false>(i, mask_of(rows), improvement);
      }
      if (const unsigned rows = starts.blocks[3] & active_; rows != 0) update_cone<3>(i, rows, improvement);
      if (const unsigned rows = starts.blocks[4] & active_; rows != 0) update_cone<4>(i, rows, improvement);
      if (const unsigned rows = starts.blocks[6] & active_; rows != 0) update_cone<6>(i, rows, improvement);
    }
  }

  // Updates one force in these lanes.
  template <bool kIsBounded>
  void update(int i, Mask rows, V& improvement) {
    V& force = vectors(c_.force)[i];
    const V res = residual_at(i), old = force;
    V next = old - res * vectors(c_.ARinv)[i];
    if (kIsBounded) {
      const V least = vectors(c_.least)[i], greatest = vectors(c_.greatest)[i];
      next = next < least ? least : (next > greatest ? greatest : next);
    } else {
      next = next < V{} ? V{} : next;
    }

    // costChange for one constraint
    const V delta = next - old;
    take<1>(&force, &next, 0.5 * delta * delta * vectors(c_.A)[i] + delta * res, rows, improvement);
  }

  // Updates the forces of a contact with an elliptic cone in these lanes (bits).
  template <int kDim>
  void update_cone(int i, unsigned rows, V& improvement) {
    V* const force = vectors(c_.force) + i;
    V res[kDim], block[kDim * kDim], ray[kDim], next[kDim]{};
    for (int j = 0; j < kDim; ++j) res[j] = residual_at(i + j);
    extractBlock<kDim>(block, i);

    // The normal update, or the ray update, of which only the normal force matters to the friction update
    V normal = force[0] - res[0] * vectors(c_.ARinv)[i];
    normal = normal < V{} ? V{} : normal;
    for (int j = 0; j < kDim; ++j) ray[j] = dot(block + j * kDim, force, kDim);
    const V denom = dot(force, ray, kDim);
    V x = -dot(force, res, kDim) / denom;
    x = force[0] + x * force[0] < V{} ? -force[0] / force[0] : x;
    const V scaled = denom >= splat(mjMINVAL) ? force[0] + x * force[0] : force[0];
    next[0] = force[0] < splat(mjMINVAL) ? normal : scaled;

    // The friction update, with this normal force
    constexpr int kSize = kDim - 1;
    V of_friction[kSize * kSize], b[kSize];
    for (int j = 0; j < kSize; ++j) {
      copy(of_friction + j * kSize, block + (j + 1) * kDim + 1, kSize);
      b[j] = res[j + 1] - dot(of_friction + j * kSize, force + 1, kSize);
      b[j] += block[(j + 1) * kDim] * (next[0] - force[0]);
    }
    find_friction<kSize>(next + 1, of_friction, b, vectors(c_.scale) + i + 1, next[0], rows);
    take<kDim>(force, next, costChange<kDim>(block, next, force, res), mask_of(rows), improvement);
  }
};

void solPGS(Lanes& d, Constraints& c) { Pgs(d, c).run(); }

}  // namespace
}  // namespace mjenv::core::lanes
