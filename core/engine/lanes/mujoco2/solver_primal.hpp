// MuJoCo 2.2.2's solvers Newton and CG. After the last iteration, MuJoCo also computes a Hessian and a search direction.
// Nothing reads them, so lanes do not compute them.
#pragma once

#include "engine/lanes/frame/solver_primal.hpp"
#include "engine/lanes/mujoco2/util_sparse.hpp"

namespace mjenv::core::lanes {
namespace {

// mj_referenceConstraint and mj_fwdConstraint with mj_solNewton or mj_solCG, also for sparse Jacobians.
template <bool kPlain>
class CGNewton final : Primal<kPlain, false> {
  using Base = Primal<kPlain, false>;
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
  using Base::HessianIncremental;
  using Base::is_quadratic;
  using Base::is_small;
  using Base::leave;
  using Base::leave_huge;
  using Base::m_;
  using Base::move;
  using Base::number_of_dofs;
  using Base::nv_;
  using Base::of;
  using Base::referenceConstraint;
  using Base::size_;
  using Base::take;
  using Base::updateConstraint;
  using Base::updateGradient;
  using Base::warmstart;

 public:
  CGNewton(Lanes& d, Constraints& c) : Base(d, c), H_(c, nv_, c.H), Hcone_(c, nv_, c.Hcone) {}

  void run() {
    if (is_sparse()) {
      leave_huge_sparse();
    } else {
      leave_huge(c_.J, size_ * nv_);
      find_columns();
    }
    leave_huge(c_.D, size_);
    referenceConstraint();
    warmstart();
    solve();
  }

 private:
  SparseFactor H_, Hcone_;  // c_.H and c_.Hcone if Jacobians are sparse
  V product_{};             // of CG: the dot product of the gradient and the gradient preconditioned by M

  bool is_newton() const { return kPlain || m_.opt.solver == mjSOL_NEWTON; }
  bool is_sparse() const { return !kPlain && c_.is_sparse; }

  // leave_huge for a sparse Jacobian
  void leave_huge_sparse() {
    Mask good = V{} == V{};
    for (int i = 0; i < size_; ++i)
      for (int k = 0; k < c_.column_counts[i]; ++k) good &= is_small(vectors(c_.J)[i * nv_ + c_.columns[i * nv_ + k]]);
    leave(bits(~good) & c_.rows);
  }

  void mulJacVec(V* res, const V* vec) const override {
    if (!is_sparse()) return Base::mulJacVec(res, vec);
    for (int i = 0; i < size_; ++i)
      res[i] = dotSparse(vectors(c_.J) + i * nv_, vec, c_.columns + i * nv_, c_.column_counts[i]);
  }

  // mj_mulJacTVec with a sparse Jacobian. In its transpose, the row of a dof has an element for each constraint with
  // that dof.
  void mulJacTVec(V* res, const V* vec) const override {
    if (!is_sparse()) return Base::mulJacTVec(res, vec);
    V* const products = vectors(c_.products);
    for (int dof = 0; dof < nv_; ++dof) {
      const int *const places = c_.dof_places + dof * c_.most_places, count = c_.dof_place_counts[dof];
      for (int i = 0; i < count; ++i) {
        products[i] = vectors(c_.J)[places[i] * nv_ + dof] * vec[places[i]];
        c_.product_lanes[i] = c_.holders[places[i]];
      }
      if (count < 4) {  // one sum, which begins at +0 and so never becomes -0
        V sum{};
        for (int i = 0; i < count; ++i) sum += products[i];
        res[dof] = sum;
        continue;
      }
      res[dof] = sum_of_each(products, c_.product_lanes, count);
    }
  }

  void begin_vector(V* vec) override { is_sparse() ? H_.begin_vector(vec) : Base::begin_vector(vec); }
  void add_element(int k, unsigned lanes) override {
    if (is_sparse()) H_.add_element(k, lanes);
  }
  unsigned update(V* vec, Mask plus) override { return is_sparse() ? H_.update(vec, plus) : Base::update(vec, plus); }

  // The constraints of a contact have the same columns.
  void HessianDirect() {
    if (!is_sparse()) {
      Base::HessianDirect();
      return;
    }
    H_.find_pattern();
    H_.clear();
    // mju_sqrMatTDSparse, of the lower triangle
    for (int first = 0; first < size_; first += c_.dims[first]) {
      int places[4], count = 0;
      for (int i = first; i < first + c_.dims[first]; ++i) {
        if (!(c_.quadratic[i] & active_)) continue;
        places[count++] = i;
        if (count < 4) continue;
        addJTDJ<4>(places);
        count = 0;
      }
      if (count == 1) addJTDJ<1>(places);
      if (count == 2) addJTDJ<2>(places);
      if (count == 3) addJTDJ<3>(places);
    }
    H_.addM(m_, vectors(d_.qM));
    leave(H_.factor() & active_);
  }

  // Adds the products of these constraints, which have the same columns, to H.
  template <int kCount>
  void addJTDJ(const int* places) {
    const V* rows[kCount];
    V D[kCount], scale[kCount];
    for (int n = 0; n < kCount; ++n) {
      rows[n] = of(c_.J) + places[n] * nv_;
      D[n] = mask_of(c_.quadratic[places[n]]) ? of(c_.D)[places[n]] : V{};
    }
    const int *const columns = c_.columns + places[0] * nv_, count = c_.column_counts[places[0]];
    for (int a = 0; a < count; ++a) {
      V* const res = of(c_.H) + columns[a] * nv_;
      for (int n = 0; n < kCount; ++n) scale[n] = rows[n][columns[a]] * D[n];
      for (int b = 0; b <= a; ++b) {
        V sum = res[columns[b]];
        for (int n = 0; n < kCount; ++n) sum += rows[n][columns[b]] * scale[n];
        res[columns[b]] = sum;
      }
    }
  }

  void update_cone(int i, V* from, int count) override {
    if (!is_sparse()) return Base::update_cone(i, from, count);
    for (int r = 0; r < count; ++r) update_cone(i, from + r * nv_);
  }
  void update_cone(int i, const V* from) {
    V* const vec = of(c_.vec);
    Hcone_.begin_vector(vec);
    for (int n = 0; n < c_.column_counts[i]; ++n) {
      const int column = c_.columns[i * nv_ + n];
      vec[column] = from[column];
      Hcone_.add_element(column, c_.middle[i] & active_);
    }
    Hcone_.update(vec, V{} == V{});
  }

  // Adds what CGeval adds to the cost and its derivatives for a contact in the middle zone. Returns the lanes in which
  // the contact is in the bottom zone.
  Mask evaluate_cone(int i, V alpha, V* sums) const {
    const V *const quad = of(c_.quad) + 3 * i, mu = of(c_.scale)[i], U0 = quad[3], V0 = quad[4], UU = quad[5],
                   UV = quad[6], VV = quad[7], Dm = quad[8];
    const V N = U0 + alpha * V0, Tsqr = UU + alpha * (2.0 * UV + alpha * VV);
    const Mask is_frictionless = Tsqr <= V{};
    const V T = sqrt(Tsqr);
    const Mask is_top = N >= mu * T, is_bottom = ~is_top & (mu * N + T <= V{});
    const Mask is_middle = ~(is_frictionless | is_top | is_bottom);
    if (any(is_middle)) {
      const V T1 = (UV + alpha * VV) / T, T2 = VV / T - (UV + alpha * VV) * T1 / (T * T);
      const V NmT = N - mu * T, NmT1 = V0 - mu * T1;
      sums[0] = is_middle ? sums[0] + 0.5 * Dm * NmT * NmT : sums[0];
      sums[1] = is_middle ? sums[1] + Dm * NmT * NmT1 : sums[1];
      sums[2] = is_middle ? sums[2] + Dm * (NmT1 * NmT1 + NmT * (-mu * T2)) : sums[2];
    }
    return is_frictionless ? N < V{} : is_bottom;
  }

  // CGeval at each lane's alpha
  void evaluate() {
    const V alpha = alphas();
    const V *const jar = of(c_.jar), *const Jv = of(c_.Jv), *const quad = of(c_.quad);
    V sum0 = gauss_[0], sum1 = gauss_[1], sum2 = gauss_[2];
    for (int i = 0; i < bounded(); ++i) {
      const V frictionloss = of(c_.frictionloss)[i], bound = of(c_.high)[i], x = jar[i] + alpha * Jv[i];
      const Mask is_inside = is_quadratic(i, x), is_above = x >= bound, has_friction = frictionloss > V{};
      const V bent = -0.5 * bound, slope = frictionloss * Jv[i];
      const V line0 = frictionloss * (is_above ? bent + jar[i] : bent - jar[i]), line1 = is_above ? slope : -slope;
      sum0 = is_inside ? sum0 + quad[3 * i] : (has_friction ? sum0 + line0 : sum0);
      sum1 = is_inside ? sum1 + quad[3 * i + 1] : (has_friction ? sum1 + line1 : sum1);
      sum2 = is_inside ? sum2 + quad[3 * i + 2] : (has_friction ? sum2 + V{} : sum2);
    }
    const auto add = [&](int i, Mask is_active) {
      sum0 = is_active ? sum0 + quad[3 * i] : sum0;
      sum1 = is_active ? sum1 + quad[3 * i + 1] : sum1;
      sum2 = is_active ? sum2 + quad[3 * i + 2] : sum2;
    };
    for (int i = bounded(); i < cones(); ++i) add(i, jar[i] + alpha * Jv[i] < V{});
    V of_cones[3]{};
    for (int i = cones(); i < size_; i += c_.dims[i])
      add(i, c_.dims[i] > 1 ? evaluate_cone(i, alpha, of_cones) : jar[i] + alpha * Jv[i] < V{});
    const V cost = of_cones[0] + (alpha * alpha * sum2 + alpha * sum1 + sum0);
    const V slope = of_cones[1] + (2.0 * alpha * sum2 + sum1);
    take(cost, slope, of_cones[2] + 2.0 * sum2);
  }

  // CGsearch's tolerance for the slope, and the search
  V search() {
    const V norm = sqrt(dot(of(c_.search), vectors(c_.search), nv_));
    const V gtol = *of(c_.tolerance) * 0.01 * norm * *of(c_.meaninertia) * number_of_dofs();
    return Base::search(norm, gtol, [&] { evaluate(); });
  }

  // The end of CGupdateGradient, and the new search direction, which follows from the gradient. is_first: before the
  // first iteration.
  void updateSearch(bool is_first) {
    if (!is_newton()) return updateConjugate(is_first);
    V* const vec = of(c_.search);
    if (has_middle()) HessianCone();
    if (is_sparse())
      (has_middle() ? Hcone_ : H_).solve(vec, of(c_.grad));
    else
      cholSolve(vec, of(has_middle() ? c_.Hcone : c_.H), of(c_.grad), nv_);
    for (int i = 0; i < nv_; ++i) vec[i] *= -1.0;
  }

  // The same for CG: the direction of Polak and Ribiere.
  void updateConjugate(bool is_first) {
    V *const vec = of(c_.search), *const grad = of(c_.grad), *const Mgrad = of(c_.Mgrad), *const dif = of(c_.Mgraddif);
    copy(dif, Mgrad, nv_);
    copy(Mgrad, grad, nv_);
    solveLD(m_, Mgrad, vectors(d_.qLD), vectors(d_.qLDiagInv));
    for (int i = 0; i < nv_; ++i) dif[i] = Mgrad[i] - dif[i];
    V beta = dot(grad, dif, nv_) / (splat(mjMINVAL) >= product_ ? splat(mjMINVAL) : product_);
    beta = beta < V{} ? V{} : beta;
    product_ = dot(grad, Mgrad, nv_);
    for (int i = 0; i < nv_; ++i) vec[i] = is_first ? Mgrad[i] * -1.0 : -Mgrad[i] + beta * vec[i];
  }

  // mj_solCGNewton
  void solve() {
    const V scale = *of(c_.meaninertia) * number_of_dofs();
    unsigned ended = 0;
    for (int lane = 0; lane < kWidth; ++lane) {
      c_.iterations[lane] = 0;
      if (c_.most[lane] == 0) ended |= 1u << lane;
    }
    updateConstraint();
    leave(bits(~(abs(cost_) <= splat(kHuge))) & active_);
    active_ &= ~ended;
    if (active_ == 0) return;
    if (is_newton()) HessianDirect();
    updateGradient();
    updateSearch(true);
    while (active_ != 0) {
      const V alpha = search();
      active_ &= bits(alpha != V{});
      if (active_ == 0) return;
      move(alpha);
      for (int i = 0; i < size_; ++i) c_.old[i] = c_.quadratic[i];
      const V old_cost = cost_;
      updateConstraint();
      updateGradient();
      const V tolerance = *of(c_.tolerance), gradient = sqrt(dot(of(c_.grad), vectors(c_.grad), nv_)) / scale;
      unsigned has_converged = bits((old_cost - cost_) / scale < tolerance) | bits(gradient < tolerance);
      for (int lane = 0; lane < kWidth; ++lane)
        if (active_ >> lane & 1 && ++c_.iterations[lane] == c_.most[lane]) has_converged |= 1u << lane;
      active_ &= ~has_converged;
      if (active_ == 0) return;
      if (is_newton()) HessianIncremental(c_.old);
      updateSearch(false);
    }
  }
};

void solNewton(Lanes& d, Constraints& c) {
  if (c.bounded == 0 && c.cones == c.size && !c.is_sparse)
    CGNewton<true>(d, c).run();
  else
    CGNewton<false>(d, c).run();
}
void solCG(Lanes& d, Constraints& c) { CGNewton<false>(d, c).run(); }

}  // namespace
}  // namespace mjenv::core::lanes
