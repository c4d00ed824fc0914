// Newton's method and CG (engine_solver.c) for several rows at once: what their drivers in all versions of MuJoCo share. A
// lane that has converged keeps its acceleration while the others iterate. A version includes this after it has defined
// the matrix functions that add in an order of its own: mulM, addM and cholSolve.
#pragma once

#include "engine/lanes/frame/constrained.hpp"

namespace mjenv::core::lanes {
namespace {

// mju_cholFactor, of the lower triangle. Returns the lanes, as bits, in which the matrix does not have full rank.
unsigned cholFactor(V* mat, int n) {
  unsigned lost = 0;
  for (int j = 0; j < n; ++j) {
    V* const row = mat + j * n;
    V diagonal = row[j] - dot(row, row, j);
    const Mask is_small = diagonal < splat(mjMINVAL);
    lost |= bits(is_small);
    diagonal = sqrt(is_small ? splat(mjMINVAL) : diagonal);
    row[j] = diagonal;
    const V inverse = 1.0 / diagonal;
    for (int i = j + 1; i < n; ++i) {
      const V number = (mat[i * n + j] - dot(mat + i * n, row, j)) * inverse;
      mat[i * n + j] = kClearsLostColumns ? (is_small ? V{} : number) : number;
    }
  }
  return lost;
}

// The step of mju_cholUpdate for column k, in the lanes in which x is not 0. Returns the lanes, as bits, in which the matrix
// loses rank. x - y * z has the same bits as x + (-y) * z.
inline unsigned cholUpdate(V* mat, V* x, int n, Mask plus, int k) {
  const V vec = x[k];
  const Mask is_used = vec != V{};
  if (!any(is_used)) return 0;
  const V diagonal = mat[k * (n + 1)];
  V square = diagonal * diagonal + (plus ? vec * vec : -vec * vec);
  const Mask is_small = square < splat(mjMINVAL);
  square = is_small ? splat(mjMINVAL) : square;
  const V r = sqrt(square), c = r / diagonal, inverse = 1.0 / c, s = vec / diagonal, signed_s = plus ? s : -s;
  mat[k * (n + 1)] = is_used ? r : diagonal;
  for (int i = k + 1; i < n; ++i) {
    const V old = mat[i * n + k], next = (old + signed_s * x[i]) * inverse;
    mat[i * n + k] = is_used ? next : old;
    x[i] = is_used ? c * x[i] - s * next : x[i];
  }
  return bits(is_small & is_used);
}

unsigned cholUpdate(V* mat, V* x, int n, Mask plus) {
  unsigned lost = 0;
  for (int k = 0; k < n; ++k) lost |= cholUpdate(mat, x, n, plus, k);
  return lost;
}

// The same for several vectors. The CPU overlaps the updates of different columns, which do not wait for each other.
void cholUpdates(V* mat, V* x, int n, int count) {
  for (int k = 0; k < n; ++k)
    for (int vec = 0; vec < count; ++vec) cholUpdate(mat, x + vec * n, n, V{} == V{}, k);
}

// MuJoCo's line search (CGsearch, later PrimalSearch) for one lane. It stops where CGsearch calls CGeval, so that the
// caller can evaluate all lanes together, and goes on in `take`. Each Stage is one of these calls, and the points have
// CGsearch's names. kDescends: as since MuJoCo 3, costs are differences from the cost at 0, a search whose slope is flat
// ends only where the cost has fallen, and a bracket can begin at 0.
template <bool kDescends>
class LineSearch {
 public:
  void begin(double gtol, int most) {
    gtol_ = gtol;
    most_ = most;
    evaluations_ = 0;
    has_p2_ = kDescends;
    evaluate_at(0, Stage::start);
  }
  // The search has not found a step.
  void end() { end(Point{}); }
  bool has_ended() const { return stage_ == Stage::ended; }
  // Where the caller must evaluate next, or, after the search has ended, the step that it has found.
  double alpha() const { return alpha_; }
  // After the search has ended, the cost that it has found.
  double cost() const { return cost_; }

  // Receives the result of the evaluation at alpha(): the cost and its first two derivatives. Then searches on, up to
  // the next evaluation.
  void take(double cost, double slope, double curvature) {
    ++evaluations_;
    const Point point{alpha_, cost, slope, curvature};
    switch (stage_) {
      case Stage::start: p0_ = p2_ = point; return evaluate_at(newton(p0_), Stage::first);
      case Stage::first:
        p1_ = !kDescends && p0_.cost < point.cost ? p0_ : point;
        if (is_found(p1_) || (kDescends && is_flat(p1_) && p1_.alpha == 0)) return end(p1_);
        direction_ = p1_.slope < 0 ? 1 : -1;
        return go_on();
      case Stage::one_sided: p1_ = point; return is_found(p1_) ? end(p1_) : go_on();
      case Stage::bracketed: p1_next_ = point; return bisect();
      case Stage::middle: middle_ = point; return narrow();
      case Stage::next1: p1_next_ = point; return narrow_p2();
      case Stage::next2: p2_next_ = point; return bisect();
      default: return;
    }
  }

 private:
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
  double gtol_ = 0, alpha_ = 0, cost_ = 0;
  int most_ = 0, evaluations_ = 0, direction_ = 0;  // most_: LSmaxiter, later ls_iterations
  bool has_p2_ = false, has_moved_ = false;
  Point p0_{}, p1_{}, p2_{}, p1_next_{}, p2_next_{}, middle_{}, candidates_[3]{};

  static double newton(const Point& p) { return p.alpha - p.slope / p.curvature; }
  bool is_flat(const Point& p) const { return (p.slope < 0 ? -p.slope : p.slope) < gtol_; }
  bool is_found(const Point& p) const { return is_flat(p) && (!kDescends || p.cost < 0); }
  void end(const Point& p) {
    alpha_ = p.alpha;
    cost_ = p.cost;
    stage_ = Stage::ended;
  }
  void evaluate_at(double alpha, Stage stage) {
    alpha_ = alpha;
    stage_ = stage;
  }

  // The one-sided search, which ends when the least cost is between p1 and p2.
  void go_on() {
    if (p1_.slope * direction_ <= -gtol_ && evaluations_ < most_) {
      p2_ = p1_;
      has_p2_ = true;
      return evaluate_at(newton(p1_), Stage::one_sided);
    }
    if (evaluations_ >= most_ || !has_p2_) return end(p1_);
    p2_next_ = p1_;
    evaluate_at(newton(p1_), Stage::bracketed);
  }

  void bisect() {
    if (evaluations_ < most_) return evaluate_at(0.5 * (p1_.alpha + p2_.alpha), Stage::middle);
    if (p1_.cost <= p2_.cost && p1_.cost < p0_.cost) return end(p1_);
    // MuJoCo also tests p2_.cost <= p1_.cost here. After the test above, this follows from p2_.cost < p0_.cost.
    end(p2_.cost < p0_.cost ? p2_ : Point{});
  }

  void narrow() {
    candidates_[0] = p1_next_;
    candidates_[1] = p2_next_;
    candidates_[2] = middle_;
    const Point* best = nullptr;
    for (const Point& candidate : candidates_)
      if (is_flat(candidate) && (!best || candidate.cost < best->cost)) best = &candidate;
    if (best) return end(*best);
    has_moved_ = updateBracket(p1_);
    if (has_moved_) return evaluate_at(newton(p1_), Stage::next1);
    narrow_p2();
  }

  void narrow_p2() {
    if (updateBracket(p2_)) return evaluate_at(newton(p2_), Stage::next2);
    if (!has_moved_) return end(middle_);
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

// kPlain: Newton's method for dense Jacobians and inequalities alone, for which the compiler leaves out the code for
// equalities, friction and elliptic cones. kDescends: LineSearch's.
template <bool kPlain, bool kDescends>
class Primal : protected Constrained {
 protected:
  using Search = LineSearch<kDescends>;
  V cost_{}, gauss_[3]{};
  bool has_middle_ = false;  // whether a contact is in the middle zone of its cone
  Search searches_[kWidth];

  Primal(Lanes& d, Constraints& c) : Constrained(d, c) {}
  ~Primal() = default;

  bool has_middle() const { return !kPlain && has_middle_; }
  int bounded() const { return kPlain ? 0 : c_.bounded; }
  int cones() const { return kPlain ? size_ : c_.cones; }
  V* of(double* numbers) const { return vectors(numbers); }

  // A rank-one update of the Hessian's factor: its vector, of which the given elements are set, and the update. Returns
  // the lanes, as bits, in which the matrix loses rank.
  virtual void begin_vector(V* vec) { zero(vec, nv_); }
  virtual void add_element(int /*k*/, unsigned /*lanes*/) {}
  virtual unsigned update(V* vec, Mask plus) { return cholUpdate(of(c_.H), vec, nv_, plus); }
  // Updates Hcone by vectors that have the columns of the constraint at place i, and overwrites the vectors.
  virtual void update_cone(int /*i*/, V* from, int count) { cholUpdates(of(c_.Hcone), from, nv_, count); }

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

  // What warmstart compares: gauss_of, which since MuJoCo 3 comes from the difference of the accelerations.
  V warmstart_cost(const V* Ma, const V* qacc, V sum) const {
    if constexpr (!kDescends) return gauss_of(Ma, qacc, sum);
    V *const change = of(c_.search), *const force = of(c_.Mv);
    for (int i = 0; i < nv_; ++i) change[i] = qacc[i] - vectors(d_.qacc_smooth)[i];
    mulM(d_, force, change);
    return sum + 0.5 * dot(change, force, nv_);
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
      is_smooth = warmstart_cost(Ma, qacc, cost_of(jar)) > cost_of(b);
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

  // Returns the lanes, as bits, in which the Hessian does not have full rank.
  unsigned HessianDirect() {
    V* const H = of(c_.H);
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
    addM(d_, H);
    return cholFactor(H, nv_) & active_;
  }

  // The H of mjContact that mj_constraintUpdate computes. Computes only the lower triangle, because mju_cholFactor does
  // not read the rest.
  void cone_Hessian(V* H, int i) const {
    const int dim = c_.dims[i];
    const Cone cone = cone_at(i, of(c_.jar));
    const V *const U = cone.U, *const scale = of(c_.scale) + i, mu = cone.mu, N = U[0], T = cone.T;
    const V Dm = cone_D(i, mu), block = mu * N / (T * T * T), ratio = kDividesFirst ? mu * (N / T) : mu * N / T;
    for (int k = 0; k < dim; ++k)
      for (int j = k; j < dim; ++j) {
        V number = j > 0 ? cone.tangent(-mu, j) : splat(1);
        if (k > 0) number = kDividesFirst ? cone.tangent(cone.tangent(ratio, j), k) : block * U[j] * U[k];
        if (k > 0 && j == k) number += mu * mu - ratio;
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
      update_cone(i, LTJ, dim);
    }
  }

  // Updates H for the constraints whose state has changed. In each round, every lane that still has such a constraint
  // updates H for one of them. old: c_.quadratic before the move.
  void HessianIncremental(const unsigned char* old) {
    int next[kWidth] = {};
    V* const vec = of(c_.vec);
    for (;;) {
      unsigned plus = 0;
      bool has_change = false;
      begin_vector(vec);
      for (int lane = 0; lane < kWidth; ++lane) {
        if (!(active_ >> lane & 1)) continue;
        int& i = next[lane];
        while (i < size_ && !((old[i] ^ c_.quadratic[i]) >> lane & 1)) ++i;
        if (i == size_) continue;
        has_change = true;
        plus |= (c_.quadratic[i] >> lane & 1u) << lane;
        const double scale = std::sqrt(c_.D[i * kWidth + lane]);
        for (int n = 0; n < c_.column_counts[i]; ++n) {
          const int k = c_.columns[i * nv_ + n];
          vec[k][lane] = c_.J[(i * nv_ + k) * kWidth + lane] * scale;
          add_element(k, 1U << lane);
        }
        ++i;
      }
      if (!has_change) return;
      leave(update(vec, mask_of(plus)));
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

  // CGsearch. evaluate() evaluates all searches that have not ended. Returns each lane's step, 0 for a lane that has
  // ended.
  template <typename Evaluate>
  V search(V norm, V gtol, const Evaluate& evaluate) {
    const unsigned is_short = bits(norm < splat(mjMINVAL));
    for (int lane = 0; lane < kWidth; ++lane) {
      if ((active_ & ~is_short) >> lane & 1)
        searches_[lane].begin(gtol[lane], c_.most_evaluations[lane]);
      else
        searches_[lane].end();
    }
    mulM(d_, of(c_.Mv), of(c_.search));
    mulJacVec(of(c_.Jv), of(c_.search));
    prepare();
    const auto is_searching = [&] {
      for (const Search& lane : searches_)
        if (!lane.has_ended()) return true;
      return false;
    };
    while (is_searching()) evaluate();
    return alphas();
  }

  V alphas() const {
    V alpha{};
    for (int lane = 0; lane < kWidth; ++lane) alpha[lane] = searches_[lane].alpha();
    return alpha;
  }

  // The end of CGeval. Lanes in which the second derivative is not positive are left to MuJoCo, which warns of it.
  void take(V cost, V slope, V curvature) {
    const unsigned bad = bits(~(curvature > V{})) | bits(~(abs(cost) <= splat(kHuge)));
    for (int lane = 0; lane < kWidth; ++lane) {
      if (searches_[lane].has_ended()) continue;
      if (bad >> lane & 1) {
        leave(1u << lane);
        searches_[lane].end();
      } else {
        searches_[lane].take(cost[lane], slope[lane], curvature[lane]);
      }
    }
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
};

}  // namespace
}  // namespace mjenv::core::lanes
