// MuJoCo 4.0's Newton (engine_solver.c) for dense Jacobians and pyramidal cones, and constraints of limits and contacts.
#pragma once

#include "engine/lanes/frame/solver_primal.hpp"
#include "engine/lanes/mujoco4/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

class Newton final : Primal<true, true> {
 public:
  Newton(Lanes& d, Constraints& c) : Primal(d, c), tolerance_(*of(c.tolerance)), scale_(scale()) {}

  void begin() {
    leave_huge(c_.J, size_ * nv_);
    leave_huge(c_.D, size_);
    find_columns();
    referenceConstraint();
    warmstart();
  }

  void begin_island() {
    find_columns();
    residual(of(c_.jar), vectors(d_.qacc));
    mulM(d_, of(c_.Ma), vectors(d_.qacc));
  }

  // mj_solPrimal
  void solve() {
    unsigned ended = 0;
    for (int lane = 0; lane < kWidth; ++lane) {
      c_.iterations[lane] = 0;
      if (c_.most[lane] == 0) ended |= 1u << lane;
    }
    updateConstraint();
    leave(bits(~(abs(cost_) <= splat(kHuge))) & active_);
    updateGradient();
    V* const Mgrad = of(c_.Mgrad);
    copy(Mgrad, of(c_.grad), nv_);
    solveLD(m_, Mgrad, vectors(d_.qLD), vectors(d_.qLDiagInv));
    const Mask was_flat = is_flat();
    if (!end(ended | bits(was_flat & has_little_to_gain()))) return;
    leave(HessianDirect());
    cholSolve(Mgrad, of(c_.H), of(c_.grad), nv_);
    end(bits(was_flat & has_little_to_gain()));
    while (active_ != 0) {
      const V alpha = search();
      if (!end(bits(alpha == V{}))) return;
      move(alpha);
      for (int i = 0; i < size_; ++i) c_.old[i] = c_.quadratic[i];
      updateConstraint();
      updateGradient();
      ended = bits(improves_little() | is_flat());
      for (int lane = 0; lane < kWidth; ++lane)
        if (active_ >> lane & 1 && ++c_.iterations[lane] == c_.most[lane]) ended |= 1u << lane;
      if (!end(ended)) return;
      HessianIncremental(c_.old);
      cholSolve(Mgrad, of(c_.H), of(c_.grad), nv_);
      end(bits(has_little_to_gain()));
    }
  }

 private:
  const V tolerance_, scale_;

  // By what MuJoCo multiplies costs and gradients before it compares them with the tolerance.
  V scale() const {
    V inertia{};
    for (int i = 0; i < nv_; ++i) inertia += vectors(d_.M)[m_.M_rowadr[i] + m_.M_rownnz[i] - 1];
    return 1.0 / inertia;
  }

  // Whether half the product of the gradient with Mgrad, which bounds what is left to gain, is below the tolerance.
  Mask has_little_to_gain() const {
    const V gain = 0.5 * scale_ * dot(of(c_.grad), vectors(c_.Mgrad), nv_);
    return (gain < V{} ? V{} : gain) < tolerance_;
  }
  Mask is_flat() const { return scale_ * sqrt(dot(of(c_.grad), vectors(c_.grad), nv_)) < tolerance_; }

  // PrimalEval at each lane's alpha. Costs are differences from the cost at 0.
  void evaluate() {
    const V alpha = alphas(), *const jar = of(c_.jar), *const Jv = of(c_.Jv), *const quad = of(c_.quad);
    V satisfied{}, sum0{}, sum1 = gauss_[1], sum2 = gauss_[2];
    for (int i = 0; i < size_; ++i) {
      const V at_0 = jar[i] < V{} ? quad[3 * i] : V{};
      const Mask is_active = jar[i] + alpha * Jv[i] < V{};
      satisfied = is_active ? satisfied : satisfied - at_0;
      sum0 = is_active ? sum0 + (quad[3 * i] - at_0) : sum0;
      sum1 = is_active ? sum1 + quad[3 * i + 1] : sum1;
      sum2 = is_active ? sum2 + quad[3 * i + 2] : sum2;
    }
    take(satisfied + (alpha * alpha * sum2 + alpha * sum1 + sum0), V{} + (2.0 * alpha * sum2 + sum1), 2.0 * sum2);
  }

  // PrimalSearch
  V search() {
    for (int i = 0; i < nv_; ++i) of(c_.search)[i] = of(c_.Mgrad)[i] * -1.0;
    const V norm = sqrt(dot(of(c_.search), vectors(c_.search), nv_));
    return Primal::search(norm, tolerance_ * *of(c_.ls_tolerance) * norm / scale_, [&] { evaluate(); });
  }

  // The improvements that the searches have found, which end the solver if they are small.
  Mask improves_little() const {
    V improvement{};
    for (int lane = 0; lane < kWidth; ++lane) improvement[lane] = -searches_[lane].cost();
    improvement *= scale_;
    return (improvement > V{}) & (improvement < tolerance_);
  }

  // Takes these lanes out of the iterations. Returns whether others are left.
  bool end(unsigned rows) {
    active_ &= ~rows;
    return active_ != 0;
  }
};

void warmstart(Lanes& d, Constraints& c) { Newton(d, c).begin(); }
void begin_island(Lanes& d, Constraints& c) { Newton(d, c).begin_island(); }
void solNewton(Lanes& d, Constraints& c) { Newton(d, c).solve(); }

}  // namespace
}  // namespace mjenv::core::lanes
