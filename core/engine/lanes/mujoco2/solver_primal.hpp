// MuJoCo 2.2.2's solvers Newton and CG (engine_solver.c) for several rows at once. A lane that has converged keeps its
// acceleration while the others iterate. After the last iteration, MuJoCo also computes a Hessian and a search
// direction. Nothing reads them, so lanes do not compute them.
#pragma once

#include "engine/lanes/mujoco2/places.hpp"

namespace mjenv::core::lanes {
namespace {

// mj_mulM
void mulM(const Lanes& d, V* res, const V* vec) {
  const mjModel& m = *d.model;
  const V* const qM = vectors(d.qM);
  const int *const dof_Madr = m.dof_Madr, *const dof_parentid = m.dof_parentid, *const dof_simplenum = m.dof_simplenum;
  const int nv = m.nv;
  zero(res, nv);
  for (int i = 0; i < nv; ++i) {
    int adr = dof_Madr[i];
    const V own = vec[i];
    if (dof_simplenum[i]) {
      res[i] = qM[adr] * own;
      continue;
    }
    V sum = res[i] + qM[adr] * own;
    for (int j = dof_parentid[i]; j >= 0; j = dof_parentid[j]) {
      ++adr;
      sum += qM[adr] * vec[j];
      res[j] += qM[adr] * own;
    }
    res[i] = sum;
  }
}

// mju_cholFactor, of the lower triangle
void cholFactor(V* mat, int n) {
  for (int j = 0; j < n; ++j) {
    V* const row = mat + j * n;
    V diagonal = row[j] - dot(row, row, j);
    diagonal = diagonal < splat(mjMINVAL) ? splat(mjMINVAL) : diagonal;
    diagonal = sqrt(diagonal);
    row[j] = diagonal;
    const V inverse = 1.0 / diagonal;
    for (int i = j + 1; i < n; ++i) mat[i * n + j] = (mat[i * n + j] - dot(mat + i * n, row, j)) * inverse;
  }
}

// mju_cholSolve
void cholSolve(V* res, const V* mat, const V* vec, int n) {
  copy(res, vec, n);
  for (int i = 0; i < n; ++i) res[i] = (res[i] - dot(mat + i * n, res, i)) / mat[i * (n + 1)];
  for (int i = n - 1; i >= 0; --i) {
    V sum = res[i];
    for (int j = i + 1; j < n; ++j) sum -= mat[j * n + i] * res[j];
    res[i] = sum / mat[i * (n + 1)];
  }
}

// mju_cholUpdate in the lanes in which x is not 0. Returns the lanes, as bits, in which the matrix loses rank.
// x - y * z has the same bits as x + (-y) * z.
unsigned cholUpdate(V* mat, V* x, int n, Mask plus) {
  unsigned lost = 0;
  for (int k = 0; k < n; ++k) {
    const V vec = x[k];
    const Mask is_used = vec != V{};
    if (!any(is_used)) continue;
    const V diagonal = mat[k * (n + 1)];
    V square = diagonal * diagonal + (plus ? vec * vec : -vec * vec);
    const Mask is_small = square < splat(mjMINVAL);
    lost |= bits(is_small & is_used);
    square = is_small ? splat(mjMINVAL) : square;
    const V r = sqrt(square), c = r / diagonal, inverse = 1.0 / c, s = vec / diagonal, signed_s = plus ? s : -s;
    mat[k * (n + 1)] = is_used ? r : diagonal;
    for (int i = k + 1; i < n; ++i) {
      const V old = mat[i * n + k], next = (old + signed_s * x[i]) * inverse;
      mat[i * n + k] = is_used ? next : old;
      x[i] = is_used ? c * x[i] - s * next : x[i];
    }
  }
  return lost;
}

// MuJoCo's line search (CGsearch) for one lane. It stops where CGsearch calls CGeval, so that the caller can evaluate
// all lanes together, and goes on in `take`. Each Stage is one of these calls, and the points have CGsearch's names.
class LineSearch {
 public:
  void begin(double gtol) {
    gtol_ = gtol;
    evaluations_ = 0;
    has_p2_ = false;
    evaluate_at(0, Stage::start);
  }
  void end(double alpha) {
    alpha_ = alpha;
    stage_ = Stage::ended;
  }
  bool has_ended() const { return stage_ == Stage::ended; }
  // Where the caller must evaluate next, or, after the search has ended, the step that it has found.
  double alpha() const { return alpha_; }

  // Receives the result of the evaluation at alpha(): the cost and its first two derivatives. Then searches on, up to
  // the next evaluation.
  void take(double cost, double slope, double curvature) {
    ++evaluations_;
    const Point point{alpha_, cost, slope, curvature};
    switch (stage_) {
      case Stage::start: p0_ = point; return evaluate_at(newton(p0_), Stage::first);
      case Stage::first:
        p1_ = p0_.cost < point.cost ? p0_ : point;
        if (is_flat(p1_)) return end(p1_.alpha);
        direction_ = p1_.slope < 0 ? 1 : -1;
        return go_on();
      case Stage::one_sided: p1_ = point; return is_flat(p1_) ? end(p1_.alpha) : go_on();
      case Stage::bracketed: p1_next_ = point; return bisect();
      case Stage::middle: middle_ = point; return narrow();
      case Stage::next1: p1_next_ = point; return narrow_p2();
      case Stage::next2: p2_next_ = point; return bisect();
      default: return;
    }
  }

 private:
  static constexpr int kMaxEvaluations = 50;  // LSmaxiter
  enum class Stage {
    start,      // CGeval(&p0)
    first,      // CGeval(&p1): the one Newton step that CGsearch always attempts
    one_sided,  // CGeval(&p1) in the one-sided search
    bracketed,  // CGeval(&p1next) before the bracketed search
    middle,     // CGeval(&pmid)
    next1,      // CGeval(&p1next) in updateBracket of p1
    next2,      // CGeval(&p2next) in updateBracket of p2
    ended
  };
  struct Point {
    double alpha, cost, slope, curvature;
  };
  Stage stage_ = Stage::ended;
  double gtol_ = 0, alpha_ = 0;
  int evaluations_ = 0, direction_ = 0;
  bool has_p2_ = false, has_moved_ = false;
  Point p0_{}, p1_{}, p2_{}, p1_next_{}, p2_next_{}, middle_{}, candidates_[3]{};

  static double newton(const Point& p) { return p.alpha - p.slope / p.curvature; }
  bool is_flat(const Point& p) const { return (p.slope < 0 ? -p.slope : p.slope) < gtol_; }
  void evaluate_at(double alpha, Stage stage) {
    alpha_ = alpha;
    stage_ = stage;
  }

  // The one-sided search, which ends when the least cost is between p1 and p2.
  void go_on() {
    if (p1_.slope * direction_ <= -gtol_ && evaluations_ < kMaxEvaluations) {
      p2_ = p1_;
      has_p2_ = true;
      return evaluate_at(newton(p1_), Stage::one_sided);
    }
    if (evaluations_ >= kMaxEvaluations || !has_p2_) return end(p1_.alpha);
    p2_next_ = p1_;
    evaluate_at(newton(p1_), Stage::bracketed);
  }

  void bisect() {
    if (evaluations_ < kMaxEvaluations) return evaluate_at(0.5 * (p1_.alpha + p2_.alpha), Stage::middle);
    if (p1_.cost <= p2_.cost && p1_.cost < p0_.cost) return end(p1_.alpha);
    // MuJoCo also tests p2_.cost <= p1_.cost here. After the test above, this follows from p2_.cost < p0_.cost.
    end(p2_.cost < p0_.cost ? p2_.alpha : 0);
  }

  void narrow() {
    candidates_[0] = p1_next_;
    candidates_[1] = p2_next_;
    candidates_[2] = middle_;
    const Point* best = nullptr;
    for (const Point& candidate : candidates_)
      if (is_flat(candidate) && (!best || candidate.cost < best->cost)) best = &candidate;
    if (best) return end(best->alpha);
    has_moved_ = updateBracket(p1_);
    if (has_moved_) return evaluate_at(newton(p1_), Stage::next1);
    narrow_p2();
  }

  void narrow_p2() {
    if (updateBracket(p2_)) return evaluate_at(newton(p2_), Stage::next2);
    if (!has_moved_) return end(middle_.alpha);
    bisect();
  }

  bool updateBracket(Point& p) const {
    bool has_moved = false;
    for (const Point& candidate : candidates_)
      if ((p.slope < 0 && candidate.slope < 0 && p.slope < candidate.slope) ||
          (p.slope > 0 && candidate.slope > 0 && p.slope > candidate.slope)) {
        p = candidate;
        has_moved = true;
      }
    return has_moved;
  }
};

// mj_referenceConstraint and mj_fwdConstraint with mj_solNewton or mj_solCG. kPlain: Newton's method for dense
// Jacobians and inequalities alone, for which the compiler leaves out the code for equalities, friction and elliptic
// cones.
template <bool kPlain>
class Primal : Constrained {
 public:
  Primal(Lanes& d, Constraints& c) : Constrained(d, c), H_(c, nv_, c.H), Hcone_(c, nv_, c.Hcone) {}

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
  V cost_{}, gauss_[3]{};
  V product_{};              // of CG: the dot product of the gradient and the gradient preconditioned by M
  bool has_middle_ = false;  // whether a contact is in the middle zone of its cone
  LineSearch searches_[kWidth];

  bool is_newton() const { return kPlain || m_.opt.solver == mjSOL_NEWTON; }
  bool is_sparse() const { return !kPlain && c_.is_sparse; }
  bool has_middle() const { return !kPlain && has_middle_; }
  int bounded() const { return kPlain ? 0 : c_.bounded; }
  int cones() const { return kPlain ? size_ : c_.cones; }
  V* of(double* numbers) const { return vectors(numbers); }

  // The cost that mj_constraintUpdate computes.
  V cost_of(const V* jar) const {
    V sum{};
    for (int i = 0; i < bounded(); ++i) {
      const V frictionloss = of(c_.frictionloss)[i], linear = frictionloss * jar[i];
      const V beyond = jar[i] >= of(c_.high)[i] ? of(c_.bend)[i] + linear : of(c_.bend)[i] - linear;
      sum += is_quadratic(i, jar[i]) ? 0.5 * of(c_.D)[i] * jar[i] * jar[i] : beyond;
    }
    for (int i = bounded(); i < cones(); ++i) {
      const Mask is_satisfied = jar[i] >= V{};
      sum += is_satisfied ? V{} : 0.5 * vectors(c_.D)[i] * jar[i] * jar[i];
    }
    for (int i = cones(); i < size_; i += c_.dims[i]) {
      Mask is_quadratic = ~(jar[i] >= V{});
      if (c_.dims[i] > 1) {
        const Cone cone = cone_at(i, jar);
        const V NmT = cone.U[0] - cone.mu * cone.T;
        sum += cone.is_middle() ? 0.5 * cone_D(i, cone.mu) * NmT * NmT : V{};
        is_quadratic = cone.is_bottom;
      }
      for (int j = i; j < i + c_.dims[i]; ++j) sum += is_quadratic ? 0.5 * of(c_.D)[j] * jar[j] * jar[j] : V{};
    }
    return sum;
  }

  V gauss_of(const V* Ma, const V* qacc, V sum) const {
    for (int i = 0; i < nv_; ++i)
      sum += 0.5 * (Ma[i] - vectors(d_.qfrc_smooth)[i]) * (qacc[i] - vectors(d_.qacc_smooth)[i]);
    return sum;
  }

  // warmstart of engine_forward.c. Chooses the acceleration with which the solver begins, and keeps the products of M
  // and J with it.
  void warmstart() {
    V *const qacc = vectors(d_.qacc), *const Ma = of(c_.Ma), *const jar = of(c_.jar), *const b = of(c_.b);
    const V* const smooth = vectors(d_.qacc_smooth);
    residual(b, smooth);
    Mask is_smooth = V{} == V{};
    if (!(m_.opt.disableflags & mjDSBL_WARMSTART)) {
      copy(qacc, vectors(d_.qacc_warmstart), nv_);
      residual(jar, qacc);
      mulM(d_, Ma, qacc);
      is_smooth = gauss_of(Ma, qacc, cost_of(jar)) > cost_of(b);
    }
    if (!any(is_smooth)) return;
    V* const M_smooth = of(c_.Mv);
    mulM(d_, M_smooth, smooth);
    for (int i = 0; i < nv_; ++i) {
      qacc[i] = is_smooth ? smooth[i] : qacc[i];
      Ma[i] = is_smooth ? M_smooth[i] : Ma[i];
    }
    for (int i = 0; i < size_; ++i) jar[i] = is_smooth ? b[i] : jar[i];
  }

  // CGupdateConstraint and mj_constraintUpdate
  void updateConstraint() {
    const V* const jar = of(c_.jar);
    for (int i = 0; i < bounded(); ++i) c_.quadratic[i] = static_cast<unsigned char>(bits(is_quadratic(i, jar[i])));
    for (int i = bounded(); i < cones(); ++i) c_.quadratic[i] = static_cast<unsigned char>(bits(~(jar[i] >= V{})));
    has_middle_ = false;
    for (int i = cones(); i < size_; i += c_.dims[i]) {
      Mask is_quadratic = ~(jar[i] >= V{});
      c_.middle[i] = 0;
      if (c_.dims[i] > 1) {
        const Cone cone = cone_at(i, jar);
        is_quadratic = cone.is_bottom;
        c_.middle[i] = static_cast<unsigned char>(bits(cone.is_middle()));
        has_middle_ |= (c_.middle[i] & active_) != 0;
      }
      for (int j = i; j < i + c_.dims[i]; ++j) c_.quadratic[j] = static_cast<unsigned char>(bits(is_quadratic));
    }
    force_of(jar);
    mulJacTVec(vectors(d_.qfrc_constraint), of(c_.force));
    gauss_[0] = gauss_of(of(c_.Ma), vectors(d_.qacc), V{});
    cost_ = cost_of(jar) + gauss_[0];
  }

  void HessianDirect() {
    V* const H = of(c_.H);
    if (is_sparse()) return HessianDirectSparse();
    zero(H, nv_ * nv_);
    // mju_sqrMatTD, of the lower triangle
    for (int j = 0; j < size_; ++j) {
      if (!(c_.quadratic[j] & active_)) continue;
      const V jar = of(c_.jar)[j];
      const Mask is_used = j < bounded() ? is_quadratic(j, jar)
                           : j < cones() ? ~(jar >= V{})
                                         : mask_of(c_.quadratic[j]);
      const V D = is_used ? of(c_.D)[j] : V{};
      const V* const row = of(c_.J) + j * nv_;
      const int *const columns = c_.columns + j * nv_, count = c_.column_counts[j];
      for (int a = 0; a < count; ++a) {
        V* const res = H + columns[a] * nv_;
        const V scale = row[columns[a]] * D;
        for (int b = 0; b <= a; ++b) res[columns[b]] += row[columns[b]] * scale;
      }
    }
    // mj_addM
    for (int i = 0; i < nv_; ++i) {
      int adr = m_.dof_Madr[i];
      for (int j = i; j >= 0; j = m_.dof_simplenum[i] ? -1 : m_.dof_parentid[j])
        H[i * nv_ + j] += vectors(d_.qM)[adr++];
    }
    cholFactor(H, nv_);
  }

  // The same for a sparse Jacobian, where the constraints of a contact have the same columns
  void HessianDirectSparse() {
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

  // The H of mjContact that mj_constraintUpdate computes. Computes only the lower triangle, because mju_cholFactor does
  // not read the rest.
  void cone_Hessian(V* H, int i) const {
    const int dim = c_.dims[i];
    const Cone cone = cone_at(i, of(c_.jar));
    const V *const U = cone.U, *const scale = of(c_.scale) + i, mu = cone.mu, N = U[0], T = cone.T;
    const V Dm = cone_D(i, mu), first = -mu / T, block = mu * N / (T * T * T), diagonal = mu * mu - mu * N / T;
    for (int k = 0; k < dim; ++k)
      for (int j = k; j < dim; ++j) {
        V number = k > 0 ? block * U[j] * U[k] : (j > 0 ? first * U[j] : splat(1));
        if (k > 0 && j == k) number += diagonal;
        H[j * dim + k] = number * (Dm * scale[k] * scale[j]);
      }
  }

  // H plus the part of the contacts that are in the middle zone of their cones.
  void HessianCone() {
    V *const Hcone = of(c_.Hcone), *const LTJ = of(c_.LTJ);
    copy(Hcone, of(c_.H), nv_ * nv_);
    for (int i = cones(); i < size_; i += c_.dims[i]) {
      if (!(c_.middle[i] & active_)) continue;
      const int dim = c_.dims[i];
      const Mask is_middle = mask_of(c_.middle[i]);
      V local[36];
      cone_Hessian(local, i);
      cholFactor(local, dim);
      zero(LTJ, dim * nv_);
      for (int r = 0; r < dim; ++r) {
        const V* const row = of(c_.J) + (i + r) * nv_;
        const int *const columns = c_.columns + (i + r) * nv_, count = c_.column_counts[i + r];
        for (int c = 0; c <= r; ++c) {
          const V scale = is_middle ? local[r * dim + c] : V{};
          for (int n = 0; n < count; ++n) LTJ[c * nv_ + columns[n]] += row[columns[n]] * scale;
        }
      }
      for (int r = 0; r < dim; ++r)
        if (is_sparse())
          update_cone(i, LTJ + r * nv_);
        else
          cholUpdate(Hcone, LTJ + r * nv_, nv_, V{} == V{});
    }
  }

  // Updates Hcone by a vector that has the columns of the constraint at place i.
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

  // Updates H for the constraints whose state has changed. In each round, every lane that still has such a constraint
  // updates H for one of them. old: c_.quadratic before the move.
  void HessianIncremental(const unsigned char* old) {
    int next[kWidth] = {};
    V* const vec = of(c_.vec);
    auto* const numbers = reinterpret_cast<double*>(vec);
    for (;;) {
      unsigned plus = 0;
      bool has_change = false;
      if (is_sparse())
        H_.begin_vector(vec);
      else
        zero(vec, nv_);
      for (int lane = 0; lane < kWidth; ++lane) {
        if (!(active_ >> lane & 1)) continue;
        int& i = next[lane];
        while (i < size_ && !((old[i] ^ c_.quadratic[i]) >> lane & 1)) ++i;
        if (i == size_) continue;
        has_change = true;
        plus |= (c_.quadratic[i] >> lane & 1u) << lane;
        const double scale = std::sqrt(c_.D[i * kWidth + lane]);
        const auto set = [&](int k) { numbers[k * kWidth + lane] = c_.J[(i * nv_ + k) * kWidth + lane] * scale; };
        for (int k = 0; k < nv_ && !is_sparse(); ++k) set(k);
        for (int n = 0; n < c_.column_counts[i] && is_sparse(); ++n) {
          const int k = c_.columns[i * nv_ + n];
          set(k);
          H_.add_element(k, 1U << lane);
        }
        ++i;
      }
      if (!has_change) return;
      leave(is_sparse() ? H_.update(vec, mask_of(plus)) : cholUpdate(of(c_.H), vec, nv_, mask_of(plus)));
    }
  }

  // CGprepare
  void prepare() {
    const V *const search = of(c_.search), *const jar = of(c_.jar), *const Jv = of(c_.Jv);
    V* const quad = of(c_.quad);
    gauss_[1] = dot(search, vectors(c_.Ma), nv_) - dot(search, vectors(d_.qfrc_smooth), nv_);
    gauss_[2] = 0.5 * dot(search, vectors(c_.Mv), nv_);
    for (int i = 0; i < size_; ++i) {
      const V D = of(c_.D)[i], DJ0 = D * jar[i];
      quad[3 * i] = jar[i] * DJ0 * 0.5;
      quad[3 * i + 1] = Jv[i] * DJ0;
      quad[3 * i + 2] = Jv[i] * D * Jv[i] * 0.5;
    }
    for (int i = cones(); i < size_; i += c_.dims[i])
      if (c_.dims[i] > 1) prepare_cone(i);
  }

  void prepare_cone(int i) {
    const V *const D = of(c_.D) + i, *const jar = of(c_.jar) + i, *const Jv = of(c_.Jv) + i,
                   *const scale = of(c_.scale) + i;
    V* const quad = of(c_.quad) + 3 * i;
    V sum[3]{}, UU{}, UV{}, VV{};
    for (int j = 0; j < c_.dims[i]; ++j) {
      const V DJ = D[j] * jar[j], parts[3] = {jar[j] * DJ, Jv[j] * DJ, Jv[j] * D[j] * Jv[j]};
      for (int k = 0; k < 3; ++k) sum[k] = j == 0 ? parts[k] : sum[k] + parts[k];
    }
    for (int j = 1; j < c_.dims[i]; ++j) {
      const V U = jar[j] * scale[j], along = Jv[j] * scale[j];
      UU += U * U;
      UV += U * along;
      VV += along * along;
    }
    const V results[9] = {sum[0] * 0.5, sum[1], sum[2] * 0.5, jar[0] * scale[0],  Jv[0] * scale[0],
                          UU,           UV,     VV,           cone_D(i, scale[0])};
    copy(quad, results, 9);
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

  // CGeval at each lane's alpha. Lanes in which the second derivative is not positive are left to MuJoCo, which warns
  // of it.
  void evaluate() {
    V alpha{};
    for (int lane = 0; lane < kWidth; ++lane) alpha[lane] = searches_[lane].alpha();
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
    const V curvature = of_cones[2] + 2.0 * sum2;
    const unsigned bad = bits(~(curvature > V{})) | bits(~(abs(cost) <= splat(kHuge)));
    for (int lane = 0; lane < kWidth; ++lane) {
      if (searches_[lane].has_ended()) continue;
      if (bad >> lane & 1) {
        leave(1u << lane);
        searches_[lane].end(0);
      } else {
        searches_[lane].take(cost[lane], slope[lane], curvature[lane]);
      }
    }
  }

  // CGsearch. Returns each lane's step, 0 for a lane that has ended.
  V search() {
    V* const vec = of(c_.search);
    const V norm = sqrt(dot(vec, vectors(c_.search), nv_));
    const V gtol = *of(c_.tolerance) * 0.01 * norm * *of(c_.meaninertia) * number_of_dofs();
    const unsigned is_short = bits(norm < splat(mjMINVAL));
    for (int lane = 0; lane < kWidth; ++lane) {
      if ((active_ & ~is_short) >> lane & 1)
        searches_[lane].begin(gtol[lane]);
      else
        searches_[lane].end(0);
    }
    mulM(d_, of(c_.Mv), vec);
    mulJacVec(of(c_.Jv), vec);
    prepare();
    const auto is_searching = [&] {
      for (const LineSearch& lane : searches_)
        if (!lane.has_ended()) return true;
      return false;
    };
    while (is_searching()) evaluate();
    V alpha{};
    for (int lane = 0; lane < kWidth; ++lane) alpha[lane] = searches_[lane].alpha();
    return alpha;
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

  void updateGradient() {
    for (int i = 0; i < nv_; ++i)
      of(c_.grad)[i] = of(c_.Ma)[i] - vectors(d_.qfrc_smooth)[i] - vectors(d_.qfrc_constraint)[i];
  }

  // Moves by alpha in the lanes that have found a step.
  void move(V alpha) {
    const Mask is_moving = mask_of(active_);
    const auto add = [&](V* res, const V* vec, int n) {
      for (int i = 0; i < n; ++i) res[i] = is_moving ? res[i] + vec[i] * alpha : res[i];
    };
    add(vectors(d_.qacc), of(c_.search), nv_);
    add(of(c_.Ma), of(c_.Mv), nv_);
    add(of(c_.jar), of(c_.Jv), size_);
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
    Primal<true>(d, c).run();
  else
    Primal<false>(d, c).run();
}
void solCG(Lanes& d, Constraints& c) { Primal<false>(d, c).run(); }

}  // namespace
}  // namespace mjenv::core::lanes
