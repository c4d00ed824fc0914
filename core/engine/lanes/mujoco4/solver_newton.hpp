// MuJoCo 4.0's Newton (engine_solver.c) for dense Jacobians.
#pragma once

#include "engine/lanes/frame/solver_primal.hpp"
#include "engine/lanes/mujoco4/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

template <bool kPlain>
class Newton final : Primal<kPlain, true> {
  using Base = Primal<kPlain, true>;
  using Base::active_;
  using Base::alphas;
  using Base::bounded;
  using Base::c_;
  using Base::cones;
  using Base::cost_;
  using Base::d_;
  using Base::find_columns;
  using Base::gauss_;
  using Base::has_middle;
  using Base::HessianCone;
  using Base::HessianDirect;
  using Base::HessianIncremental;
  using Base::leave;
  using Base::leave_huge;
  using Base::m_;
  using Base::move;
  using Base::nv_;
  using Base::of;
  using Base::referenceConstraint;
  using Base::residual;
  using Base::searches_;
  using Base::size_;
  using Base::take;
  using Base::updateConstraint;
  using Base::updateGradient;
  using Base::warmstart;

 public:
  Newton(Lanes& d, Constraints& c) : Base(d, c), tolerance_(*of(c.tolerance)), scale_(scale()) {}

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
    updateMgrad();
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
      updateMgrad();
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

  // PrimalUpdateMgrad, after HessianCone
  void updateMgrad() {
    if (has_middle()) HessianCone();
    cholSolve(of(c_.Mgrad), of(has_middle() ? c_.Hcone : c_.H), of(c_.grad), nv_);
  }

  // frictionCostDif: by how much the cost of friction at x exceeds that at start.
  static V friction_change(V start, V x, V loss, V bound, V D) {
    const auto is_inside = [&](V at) { return (-bound < at) & (at < bound); };
    const auto is_above = [&](V at) { return ~(is_inside(at) | (at <= -bound)); };
    const auto cost_at = [&](V at) {
      const V sum = at <= -bound ? -0.5 * bound - at : -0.5 * bound + at;
      return is_inside(at) ? 0.5 * D * at * at : loss * sum;
    };
    const Mask both_inside = is_inside(start) & is_inside(x), both_below = (start <= -bound) & (x <= -bound);
    const V change = is_above(start) & is_above(x) ? loss * (x - start) : cost_at(x) - cost_at(start);
    return both_inside ? 0.5 * D * (x - start) * (x + start) : both_below ? loss * (start - x) : change;
  }

  // A contact at a point of the line search: normal and tangential part, and what follows for the middle zone.
  struct ConePoint {
    V N, T;
    V growth;            // of the square of T since the search's start
    V slope, curvature;  // what the middle zone adds to the derivatives
    Mask is_top, is_bottom;

    void find_zone(V mu) {
      const Mask is_frictionless = T <= V{};
      is_top = is_frictionless ? ~(N < V{}) : N >= mu * T;
      is_bottom = ~is_top & (is_frictionless | (mu * N + T <= V{}));
    }
    Mask is_middle() const { return ~(is_top | is_bottom); }
  };

  ConePoint cone_at_start(int i) const {
    ConePoint p;
    p.N = of(c_.quad)[3 * i + 3];
    p.T = sqrt(of(c_.quad)[3 * i + 5]);
    p.find_zone(of(c_.scale)[i]);
    return p;
  }

  ConePoint cone_at_alpha(int i, V alpha) const {
    const V mu = of(c_.scale)[i], V0 = of(c_.quad)[3 * i + 4];
    const int count = c_.dims[i] - 1;
    V position[5], direction[5], square{}, product{}, turn{};
    ConePoint p;
    p.growth = V{};
    for (int k = 0; k < count; ++k) {
      const int place = i + 1 + k;
      const V friction = of(c_.scale)[place], start = friction * of(c_.jar)[place];
      direction[k] = friction * of(c_.Jv)[place];
      const V step = alpha * direction[k], x = position[k] = step + start;
      square += x * x;
      product += x * direction[k];
      p.growth += step * (start + x);
    }
    p.N = of(c_.quad)[3 * i + 3] + alpha * V0;
    p.T = sqrt(square);
    p.find_zone(mu);
    if (!any(p.is_middle())) return p;
    for (int k = 0; k < count; ++k) position[k] = position[k] / p.T;
    for (int k = 0; k < count; ++k)
      for (int j = k + 1; j < count; ++j) {
        const V area = position[k] * direction[j] - direction[k] * position[j];
        turn += area * area;
      }
    const V Dm = of(c_.quad)[3 * i + 8], along = V0 - mu * (product / p.T);
    p.slope = Dm * (p.N - mu * p.T) * along;
    p.curvature = Dm * (along * along - (p.N / p.T - mu) * (turn * mu));
    return p;
  }

  // By how much the cost of a contact at p exceeds that at the search's start
  V cone_change(int i, V alpha, const ConePoint& p) const {
    const V *const quad = of(c_.quad) + 3 * i, mu = of(c_.scale)[i], half = 0.5 * quad[8];
    const ConePoint start = cone_at_start(i);
    const Mask was_middle = start.is_middle(), is_middle = p.is_middle();
    const V quadratic = alpha * alpha * quad[2] + alpha * quad[1], nested = alpha * (alpha * quad[2] + quad[1]);
    const V from_top = p.is_bottom ? quadratic + quad[0] : is_middle ? half * (p.N - mu * p.T) * (p.N - mu * p.T) : V{};
    const V gap = mu * p.N + p.T, from_bottom = p.is_bottom ? quadratic
                                                : is_middle ? nested - half * gap * gap
                                                            : -quad[0];
    const V change = start.is_top ? from_top : from_bottom;
    if (!any(was_middle)) return change;
    const V old = start.N - mu * start.T, old_gap = mu * start.N + start.T;
    const V more = alpha * quad[4] - mu * (p.growth / (p.T + start.T));
    const V from_middle = is_middle     ? half * more * (2.0 * old + more)
                          : p.is_bottom ? nested + half * old_gap * old_gap
                                        : -half * old * old;
    return was_middle ? from_middle : change;
  }

  // PrimalEval at each lane's alpha. Costs are differences from the cost at 0.
  void evaluate() {
    const V alpha = alphas(), *const jar = of(c_.jar), *const Jv = of(c_.Jv), *const quad = of(c_.quad);
    V cost{}, slope{}, curvature{}, sum0{}, sum1 = gauss_[1], sum2 = gauss_[2];
    for (int i = 0; i < bounded(); ++i) {
      const V loss = of(c_.frictionloss)[i], bound = of(c_.high)[i], D = of(c_.D)[i], x = jar[i] + alpha * Jv[i];
      const Mask is_friction = loss > V{}, is_inside = is_friction & (-bound < x) & (x < bound);
      sum1 = is_friction ? sum1 : sum1 + quad[3 * i + 1];
      sum2 = is_friction ? sum2 : sum2 + quad[3 * i + 2];
      cost = is_friction ? cost + friction_change(jar[i], x, loss, bound, D) : cost;
      const V outside = (x <= -bound ? -loss : loss) * Jv[i];
      slope = is_friction ? slope + (is_inside ? D * x * Jv[i] : outside) : slope;
      curvature = is_inside ? curvature + D * Jv[i] * Jv[i] : curvature;
    }
    const auto add = [&](int i) {
      const V at_0 = jar[i] < V{} ? quad[3 * i] : V{};
      const Mask is_active = jar[i] + alpha * Jv[i] < V{};
      cost = is_active ? cost : cost - at_0;
      sum0 = is_active ? sum0 + (quad[3 * i] - at_0) : sum0;
      sum1 = is_active ? sum1 + quad[3 * i + 1] : sum1;
      sum2 = is_active ? sum2 + quad[3 * i + 2] : sum2;
    };
    for (int i = bounded(); i < cones(); ++i) add(i);
    for (int i = cones(); i < size_; i += c_.dims[i]) {
      if (c_.dims[i] == 1) {
        add(i);
        continue;
      }
      const ConePoint p = cone_at_alpha(i, alpha);
      cost += cone_change(i, alpha, p);
      slope = p.is_bottom ? slope + (2.0 * alpha * quad[3 * i + 2] + quad[3 * i + 1])
              : p.is_top  ? slope
                          : slope + p.slope;
      curvature = p.is_bottom ? curvature + 2.0 * quad[3 * i + 2] : p.is_top ? curvature : curvature + p.curvature;
    }
    take(cost + (alpha * alpha * sum2 + alpha * sum1 + sum0), slope + (2.0 * alpha * sum2 + sum1),
         curvature + 2.0 * sum2);
  }

  // PrimalSearch
  V search() {
    for (int i = 0; i < nv_; ++i) of(c_.search)[i] = of(c_.Mgrad)[i] * -1.0;
    const V norm = sqrt(dot(of(c_.search), vectors(c_.search), nv_));
    return Base::search(norm, tolerance_ * *of(c_.ls_tolerance) * norm / scale_, [&] { evaluate(); });
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

// Calls use(solver) with the solver for these constraints.
template <typename Use>
void with_newton(Lanes& d, Constraints& c, const Use& use) {
  if (c.bounded == 0 && c.cones == c.size) {
    Newton<true> solver(d, c);
    use(solver);
  } else {
    Newton<false> solver(d, c);
    use(solver);
  }
}

void warmstart(Lanes& d, Constraints& c) {
  with_newton(d, c, [](auto& newton) { newton.begin(); });
}
void begin_island(Lanes& d, Constraints& c) {
  with_newton(d, c, [](auto& newton) { newton.begin_island(); });
}
void solNewton(Lanes& d, Constraints& c) {
  with_newton(d, c, [](auto& newton) { newton.solve(); });
}

}  // namespace
}  // namespace mjenv::core::lanes
