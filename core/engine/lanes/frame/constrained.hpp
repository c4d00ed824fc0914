// The base class of all solvers. The results have MuJoCo's bits for the reasons that smooth.hpp gives: a term that MuJoCo
// skips adds a zero here, and so does a place without a constraint.
#pragma once

#include "engine/lanes/frame/spatial.hpp"
#include "engine/lanes/frame/version.hpp"

namespace mjenv::core::lanes {
namespace {

// Its functions have the names of the MuJoCo functions whose computations they repeat. Virtual functions are those that
// sparse Jacobians need otherwise.
class Constrained {
 protected:
  Constrained(Lanes& d, Constraints& c) : d_(d), c_(c), m_(*d.model), nv_(m_.nv), size_(c.size), active_(c.rows) {}
  ~Constrained() = default;

  Lanes& d_;
  Constraints& c_;
  const mjModel& m_;
  const int nv_, size_;
  unsigned active_;  // lanes, as bits, that still iterate

  double number_of_dofs() const { return nv_ > 1 ? nv_ : 1; }

  // Leaves lanes (bits) to MuJoCo.
  void leave(unsigned rows) {
    d_.left_to_mujoco |= rows;
    active_ &= ~rows;
  }
  // Leaves the lanes with a huge number to MuJoCo. The solvers leave out products with 0, which are 0 only if the other
  // factor is finite. The bound keeps products of four numbers finite.
  void leave_huge(const double* numbers, int count) {
    Mask good = V{} == V{};
    for (int i = 0; i < count; ++i) good &= is_small(vectors(numbers)[i]);
    leave(bits(~good) & c_.rows);
  }
  static Mask is_small(V x) {
    constexpr double kLargest = 1e75;
    return (x <= splat(kLargest)) & (x >= splat(-kLargest));
  }

  void find_columns() {
    for (int i = 0; i < size_; ++i) {
      int *const columns = c_.columns + i * nv_, count = 0;
      for (int k = 0; k < nv_; ++k)
        if (any(vectors(c_.J)[i * nv_ + k] != V{})) columns[count++] = k;
      c_.column_counts[i] = count;
    }
  }

  virtual void mulJacVec(V* res, const V* vec) const {
    for (int i = 0; i < size_; ++i) res[i] = dot(vectors(c_.J) + i * nv_, vec, nv_);
  }

  virtual void mulJacTVec(V* res, const V* vec) const {
    zero(res, nv_);
    for (int i = 0; i < size_; ++i) {
      const V factor = vec[i];
      if (!any(factor != V{})) continue;
      const V* const row = vectors(c_.J) + i * nv_;
      const int *const columns = c_.columns + i * nv_, count = c_.column_counts[i];
      for (int k = 0; k < count; ++k) res[columns[k]] += row[columns[k]] * factor;
    }
  }

  void referenceConstraint() {
    if (c_.has_references) return;
    V *const vel = vectors(c_.vel), *const aref = vectors(c_.aref);
    mulJacVec(vel, vectors(d_.qvel));
    for (int i = 0; i < size_; ++i) aref[i] = -vectors(c_.damping)[i] * vel[i] - vectors(c_.spring)[i];
    for (int i = 0; i < c_.bounded && c_.drift; ++i) aref[i] -= vectors(c_.drift)[i];
  }

  // J * vec - aref
  void residual(V* res, const V* vec) const {
    mulJacVec(res, vec);
    for (int i = 0; i < size_; ++i) res[i] -= vectors(c_.aref)[i];
  }

  // The lanes in which the cost of the constraint at place i is quadratic. i is less than c_.bounded.
  Mask is_quadratic(int i, V jar) const { return ~((jar <= vectors(c_.low)[i]) | (jar >= vectors(c_.high)[i])); }

  // Computes the forces as mj_constraintUpdate does. Subtracts frictionloss from 0 instead of negating it, because the
  // frictionloss of an inequality is 0, and MuJoCo's force is then +0, not -0.
  void force_of(const V* jar) {
    V* const force = vectors(c_.force);
    for (int i = 0; i < c_.bounded; ++i) {
      const V frictionloss = vectors(c_.frictionloss)[i];
      const V beyond = jar[i] >= vectors(c_.high)[i] ? V{} - frictionloss : frictionloss;
      force[i] = is_quadratic(i, jar[i]) ? -vectors(c_.D)[i] * jar[i] : beyond;
    }
    for (int i = c_.bounded; i < c_.cones; ++i) force[i] = jar[i] >= V{} ? V{} : -vectors(c_.D)[i] * jar[i];
    for (int i = c_.cones; i < size_; i += c_.dims[i])
      if (c_.dims[i] == 1)
        force[i] = jar[i] >= V{} ? V{} : -vectors(c_.D)[i] * jar[i];
      else
        cone_force(i, c_.dims[i], jar, force + i);
  }

  // A contact with an elliptic cone, and the zone of the cone in which mj_constraintUpdate finds it. In a lane without
  // this contact all numbers are 0. They lie in the top zone, so the force is 0.
  struct Cone {
    V U[6], T, mu;  // U[0] is N
    Mask is_top, is_bottom;
    Mask is_middle() const { return ~(is_top | is_bottom); }
    // x times component j of the unit vector along the tangent
    V tangent(V x, int j) const { return kDividesFirst ? x * (U[j] / T) : x / T * U[j]; }
  };

  Cone cone_at(int i, const V* jar) const { return cone_at(i, c_.dims[i], jar); }
  Cone cone_at(int i, int dim, const V* jar) const {
    Cone cone;
    for (int j = 0; j < dim; ++j) cone.U[j] = jar[i + j] * vectors(c_.scale)[i + j];
    const V mu = vectors(c_.scale)[i], N = cone.U[0], T = sqrt(dot(cone.U + 1, cone.U + 1, dim - 1));
    const Mask is_frictionless = T <= V{};
    cone.mu = mu;
    cone.T = T;
    cone.is_top = (N >= mu * T) | (is_frictionless & (N >= V{}));
    cone.is_bottom = ~cone.is_top & ((mu * N + T <= V{}) | (is_frictionless & (N < V{})));
    return cone;
  }

  V cone_D(int i, V mu) const { return vectors(c_.D)[i] / (mu * mu * (1.0 + mu * mu)); }

  void cone_force(int i, int dim, const V* jar, V* force) const {
    const Cone cone = cone_at(i, dim, jar);
    const Mask is_middle = cone.is_middle();
    const V normal = -cone_D(i, cone.mu) * (cone.U[0] - cone.mu * cone.T) * cone.mu;
    for (int j = 0; j < dim; ++j) {
      const V quadratic = -vectors(c_.D)[i + j] * jar[i + j];
      const V middle = j == 0 ? normal : cone.tangent(-normal, j) * vectors(c_.scale)[i + j];
      force[j] = is_middle ? middle : (cone.is_bottom ? quadratic : V{});
    }
  }
};

}  // namespace
}  // namespace mjenv::core::lanes
