// The contacts of pairs of geoms, and the constraints of limits and contacts, for several rows at once. What
// functions.hpp says of bits holds here, too. A column of a contact's Jacobian that is 0 in MuJoCo is +0.
#pragma once

#include "engine/lanes/constraints.hpp"
#include "engine/lanes/primitives.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_core_constraint.c: which limits are reached ----

// The first half of mj_instantiateLimit, for slides and hinges.
bool instantiateLimit(const Lanes& d, Contacts& c) {
  const mjModel& m = *d.model;
  c.limit_count = 0;
  for (int lane = 0; lane < kWidth; ++lane) c.constraints[lane] = c.frictional[lane];
  for (int i = 0; i < c.joint_count; ++i) {
    const int joint = c.joints[i];
    const V value = vectors(d.qpos)[m.jnt_qposadr[joint]], margin = vectors(d.jnt_margin)[joint];
    for (int side = -1; side <= 1; side += 2) {
      const V dist = side * 1.0 * (vectors(d.jnt_range)[2 * joint + (side + 1) / 2] - value);
      const unsigned rows = bits(dist < margin) & c.rows;
      if (rows == 0) continue;
      if (c.limit_count == Contacts::kMost) return false;
      c.limits[c.limit_count] = {joint, side, rows, {}};
      vectors(c.limit_dist)[c.limit_count++] = dist;
      for (int lane = 0; lane < kWidth; ++lane) c.constraints[lane] += rows >> lane & 1;
    }
  }
  return true;
}

// mju_makeFrame. Returns in which lanes it fails.
inline Mask makeFrame(V* frame) {
  V* const y = frame + 3;
  const Mask fails = normalize3(frame) < splat(0.5);
  const Mask is_undefined = sqrt(dot3(y, y)) < splat(0.5);
  const Mask is_free = (frame[1] < splat(0.5)) & (frame[1] > splat(-0.5));
  y[0] = is_undefined ? V{} : y[0];
  y[1] = is_undefined ? (is_free ? splat(1) : V{}) : y[1];
  y[2] = is_undefined ? (is_free ? V{} : splat(1)) : y[2];
  const V scale = dot3(frame, y);
  for (int k = 0; k < 3; ++k) y[k] -= frame[k] * scale;
  normalize3(y);
  cross(frame + 6, frame, y);
  return fails;
}

// ---- engine_collision_driver.c ----

// The lanes, as bits, in which MuJoCo's search may miss a contact of the pair.
unsigned uncertain(const ContactPair& pair, const V* pos1, const V* pos2) {
  V dif[3], size = splat(pair.reach);
  for (int k = 0; k < 3; ++k) {
    dif[k] = pos1[k] - pos2[k];
    size += abs(pos1[k]) + abs(pos2[k]);
  }
  return bits(~(sqrt(dot3(dif, dif)) < pair.reach - 1e-6 * size));
}

// Contact i that MuJoCo's function found
void take(Contact& con, const Contacts& c, int i) {
  con.dist = vectors(c.single_dist)[i];
  copy(con.pos, vectors(c.single_pos) + 3 * i, 3);
  copy(con.frame, vectors(c.single_frame) + 9 * i, 9);
  con.is_there = mask_of(c.single_rows[i]);
}

// mj_collision, of the pairs that `reject` has not excluded
bool collision(const Lanes& d, Contacts& c) {
  const mjModel& m = *d.model;
  c.contact_count = 0;
  for (int lane = 0; lane < kWidth; ++lane) c.found[lane] = 0;
  for (int i = 0; i < d.pair_count; ++i) {
    const unsigned near = d.hits[i] & c.rows;
    if (near == 0) continue;
    const ContactPair& pair = c.pairs[i];
    const auto geom = [&](int id) {
      return Geom{vectors(d.geom_xpos) + 3 * id, vectors(d.geom_xmat) + 9 * id, m.geom_size + 3 * id};
    };
    const Geom g1 = geom(pair.geom1), g2 = geom(pair.geom2);
    Contact found[kMostFound];
    int count = 1;
    Mask is_left{};
    switch (pair.shapes) {
      case Shapes::plane_sphere: PlaneSphere(found[0], pair.margin, g1, g2.pos, g2.size[0]); break;
      case Shapes::plane_capsule:
        PlaneCapsule(found, pair.margin, g1, g2);
        count = 2;
        break;
      case Shapes::plane_ellipsoid: PlaneEllipsoid(found[0], pair.margin, g1, g2); break;
      case Shapes::plane_cylinder:
        PlaneCylinder(found, pair.margin, g1, g2);
        count = 4;
        break;
      case Shapes::plane_box:
        PlaneBox(found, pair.margin, g1, g2);
        count = 4;
        break;
      case Shapes::sphere_sphere: SphereSphere(found[0], pair.margin, g1, g1.pos, g2, g2.pos); break;
      case Shapes::sphere_capsule: SphereCapsule(found[0], pair.margin, g1, g2); break;
      case Shapes::sphere_box: SphereBox(found[0], pair.margin, g1, g2); break;
      case Shapes::capsule_capsule: is_left = CapsuleCapsule(found[0], pair.margin, g1, g2); break;
      default: is_left = V{} == V{};
    }
    const bool is_single = (bits(is_left) & near) != 0;
    if (is_single) count = c.collide(c.maker, i, near);
    if (count < 0) return false;
    for (int k = 0; k < count; ++k) {
      if (is_single) take(found[0], c, k);
      Contact& con = found[is_single ? 0 : k];
      const unsigned rows = bits(con.is_there) & near;
      if (rows == 0) continue;
      if (pair.is_searched && (uncertain(pair, g1.pos, g2.pos) & rows) != 0) return false;
      if ((bits(makeFrame(con.frame)) & rows) != 0) return false;
      for (int lane = 0; lane < kWidth; ++lane) c.found[lane] += rows >> lane & 1;
      const unsigned included = rows & bits(con.dist < splat(pair.includemargin));
      if (included == 0) continue;
      if (c.contact_count == Contacts::kMost) return false;
      const int n = c.contact_count++;
      c.contacts[n] = {i, included, {}};
      vectors(c.dist)[n] = con.dist;
      copy(vectors(c.pos) + 3 * n, con.pos, 3);
      copy(vectors(c.frame) + 9 * n, con.frame, 9);
      const int size = constraints_of(pair, m.opt.cone);
      for (int lane = 0; lane < kWidth; ++lane)
        if (included >> lane & 1) c.constraints[lane] += size;
    }
  }
  return true;
}

// ---- engine_core_constraint.c ----

// Makes constraints one after the other, each in the lanes that have it.
class Making {
 public:
  Making(const Lanes& d, const Contacts& contacts, Constraints& c)
      : d_(d), contacts_(contacts), c_(c), m_(*d.model), nv_(m_.nv) {}

  // mj_makeConstraint
  void run() {
    zero(vectors(c_.J), c_.size * nv_);
    double* const numbers[] = {c_.D, c_.damping, c_.spring, c_.R, c_.scale};
    for (double* array : numbers)
      if (array) zero(vectors(array), c_.size);
    clear_bounds();
    for (int i = 0; i < contacts_.friction_count; ++i) instantiateFriction(i);
    for (int i = 0; i < contacts_.limit_count; ++i) instantiateLimit(i);
    for (int i = 0; i < contacts_.contact_count; ++i) instantiateContact(i);
  }

 private:
  static constexpr int kMostRows = 10;
  const Lanes& d_;
  const Contacts& contacts_;
  Constraints& c_;
  const mjModel& m_;
  const int nv_;
  int next_[kWidth] = {};            // the number of each lane's next constraint
  unsigned rows_ = 0;                // the lanes, as bits, in which a constraint is made
  int places_[kMostRows][kWidth]{};  // where the rows of its Jacobian go
  const ConstraintNumbers* const* numbers_ = nullptr;

  V number(double ConstraintNumbers::*member) const {
    V result{};
    for (int lane = 0; lane < kWidth; ++lane) result[lane] = numbers_[lane]->*member;
    return result;
  }

  V friction(int i) const {
    V result{};
    for (int lane = 0; lane < kWidth; ++lane) result[lane] = numbers_[lane]->friction[i];
    return result;
  }

  // mj_addConstraint
  void begin(unsigned rows, const ConstraintNumbers* const* numbers, int size) {
    rows_ = rows;
    numbers_ = numbers;
    for (int lane = 0; lane < kWidth; ++lane) {
      if (c_.is_aligned)
        for (int i = 0; i < size; ++i) places_[i][lane] = next_[lane]++;
      if (!(rows >> lane & 1) || c_.is_aligned) continue;
      for (int i = 0; i < size; ++i) {
        const int beyond = next_[lane]++ - c_.at_first[lane];
        places_[i][lane] = beyond < 0 ? beyond + c_.at_first[lane] : c_.size - Constraints::kRest + beyond;
      }
    }
  }

  void set_J(int i, int column, V value) {
    for (int lane = 0; lane < kWidth; ++lane)
      if (rows_ >> lane & 1) c_.J[(places_[i][lane] * nv_ + column) * kWidth + lane] = value[lane];
  }

  void set_one(double* array, int i, V value) {
    for (int lane = 0; lane < kWidth; ++lane)
      if (rows_ >> lane & 1) array[places_[i][lane] * kWidth + lane] = value[lane];
  }

  void set(double* array, int size, V value) {
    for (int i = 0; i < size; ++i) set_one(array, i, value);
  }

  // Until friction is made there, each place is that of an inequality.
  void clear_bounds() {
    for (int i = 0; i < c_.bounded; ++i) {
      vectors(c_.low)[i] = splat(kNoBound);
      vectors(c_.high)[i] = vectors(c_.frictionloss)[i] = vectors(c_.bend)[i] = V{};
      if (!c_.least) continue;
      vectors(c_.least)[i] = V{};
      vectors(c_.greatest)[i] = splat(kInfinite);
    }
  }

  // The impedance that getimpedance computes. The powers are the C library's, as in MuJoCo.
  V getimpedance(V dif) const {
    using N = ConstraintNumbers;
    const V dmin = number(&N::dmin), dmax = number(&N::dmax), width = number(&N::width);
    const Mask is_flat = (dmin == dmax) | (width <= splat(mjMINVAL));
    V x = dif / width;
    x = x < V{} ? -x : x;
    const Mask is_saturated = (x >= splat(1)) | (x <= V{});
    V y = x;
    const unsigned curved = bits(~(is_flat | is_saturated)) & rows_;
    for (int lane = 0; lane < kWidth; ++lane) {
      if (!(curved >> lane & 1)) continue;
      const N& n = *numbers_[lane];
      const double at = x[lane];
      if (n.power == 1) continue;
      y[lane] = at <= n.midpoint ? n.below * std::pow(at, n.power) : 1 - n.above * std::pow(1 - at, n.power);
    }
    const V imp = is_saturated ? (x >= splat(1) ? dmax : dmin) : dmin + y * (dmax - dmin);
    return is_flat ? 0.5 * (dmin + dmax) : imp;
  }

  // mj_diagApprox and mj_makeImpedance. pos and margin are those of all `size` constraints. Returns efc_R.
  V makeImpedance(int size, V pos, V margin) {
    using N = ConstraintNumbers;
    const V dif = pos - margin, imp = getimpedance(dif);
    V R = (1.0 - imp) * number(&N::diagApprox) / imp;
    R = splat(mjMINVAL) >= R ? splat(mjMINVAL) : R;
    if (size > 1) {
      const V mu = friction(0) * sqrt(R / number(&N::impratio) / R);
      R = 2.0 * mu * mu * R;
    }
    if (c_.R) set(c_.R, size, R);
    set(c_.D, size, 1.0 / R);
    set(c_.damping, size, number(&N::damping));
    set(c_.spring, size, number(&N::stiffness) * imp * dif);
    return R;
  }

  // The same for a contact with an elliptic cone
  void makeConeImpedance(int dim, V pos, V margin) {
    using N = ConstraintNumbers;
    const V dif = pos - margin, imp = getimpedance(dif);
    V normal = (1.0 - imp) * number(&N::diagApprox) / imp;
    normal = splat(mjMINVAL) >= normal ? splat(mjMINVAL) : normal;
    const V tangent = normal / number(&N::impratio), first = friction(0);
    set(c_.damping, dim, number(&N::damping));
    for (int j = 0; j < dim; ++j) {
      const V other = friction(j > 0 ? j - 1 : 0);
      const V R = j == 0 ? normal : (j == 1 ? tangent : tangent * first * first / (other * other));
      set_one(c_.D, j, 1.0 / R);
      set_one(c_.spring, j, j == 0 ? number(&N::stiffness) * imp * dif : V{});
      set_one(c_.scale, j, j == 0 ? first * sqrt(tangent / normal) : other);
    }
  }

  // mj_instantiateFriction
  void instantiateFriction(int i) {
    const Contacts::Friction& friction = contacts_.frictions[i];
    begin(friction.rows, friction.numbers, 1);
    set_J(0, friction.dof, splat(1));
    const V R = makeImpedance(1, V{}, V{}), frictionloss = number(&ConstraintNumbers::frictionloss);
    const V bound = R * frictionloss;
    set(c_.low, 1, -bound);
    set(c_.high, 1, bound);
    set(c_.frictionloss, 1, frictionloss);
    set(c_.bend, 1, -0.5 * R * frictionloss * frictionloss);
    if (!c_.least) return;
    set(c_.least, 1, -frictionloss);
    set(c_.greatest, 1, frictionloss);
  }

  // The second half of mj_instantiateLimit
  void instantiateLimit(int i) {
    const Contacts::Limit& limit = contacts_.limits[i];
    begin(limit.rows, limit.numbers, 1);
    set_J(0, m_.jnt_dofadr[limit.joint], splat(-limit.side));
    makeImpedance(1, vectors(contacts_.limit_dist)[i], vectors(d_.jnt_margin)[limit.joint]);
  }

  // A column of mj_jac: what a point moves with a dof
  void jac(V* res, int dof, const V* offset) const {
    V shift[3];
    const V* const cdof = vectors(d_.cdof) + 6 * dof;
    cross(shift, cdof, offset);
    for (int k = 0; k < 3; ++k) res[k] = cdof[3 + k] + shift[k];
  }

  // A column of mju_mulMatMat: the first rows of a contact's frame times a vector
  static inline __attribute__((always_inline)) void rotate(V* res, const V* frame, const V* vec, int rows) {
    for (int k = 0; k < rows; ++k)
      res[k] = V{} + frame[3 * k] * vec[0] + frame[3 * k + 1] * vec[1] + frame[3 * k + 2] * vec[2];
  }

  // mj_instantiateContact
  void instantiateContact(int i) {
    const Contacts::Contact& contact = contacts_.contacts[i];
    const ContactPair& pair = contacts_.pairs[contact.pair];
    const bool is_elliptic = pair.dim > 1 && m_.opt.cone == mjCONE_ELLIPTIC;
    const int size = constraints_of(pair, m_.opt.cone);
    if (c_.is_aligned) c_.dims[next_[0]] = static_cast<unsigned char>(size);
    begin(contact.rows, contact.numbers, size);
    V offset1[3], offset2[3];
    for (int k = 0; k < 3; ++k) {
      const V point = vectors(contacts_.pos)[3 * i + k];
      offset1[k] = point - vectors(d_.subtree_com)[3 * pair.root1 + k];
      offset2[k] = point - vectors(d_.subtree_com)[3 * pair.root2 + k];
    }
    const V* const frame = vectors(contacts_.frame) + 9 * i;
    const V friction1 = friction(0), friction2 = friction(1);
    const int* const columns = contacts_.columns + pair.first_column;
    for (int n = 0; n < pair.count1 + pair.count2; ++n) {
      // mj_jacDifPair
      V dif[3], edge[6];
      jac(dif, columns[n], n < pair.count1 ? offset1 : offset2);
      if (n < pair.count1)
        for (V& x : dif) x = V{} - x;
      rotate(edge, frame, dif, 3);
      if (size == 1) {
        set_J(0, columns[n], edge[0]);
        continue;
      }
      if (is_elliptic && size == 3) {
        for (int k = 0; k < 3; ++k) set_J(k, columns[n], edge[k]);
        continue;
      }
      if (size == 4 && !is_elliptic) {
        set_J(0, columns[n], edge[0] + edge[1] * friction1);
        set_J(1, columns[n], edge[0] + edge[1] * -friction1);
        set_J(2, columns[n], edge[0] + edge[2] * friction2);
        set_J(3, columns[n], edge[0] + edge[2] * -friction2);
        continue;
      }
      copy(dif, vectors(d_.cdof) + 6 * columns[n], 3);
      if (n < pair.count1)
        for (V& x : dif) x = V{} - x;
      rotate(edge + 3, frame, dif, pair.dim - 3);
      for (int k = 0; k < pair.dim && is_elliptic; ++k) set_J(k, columns[n], edge[k]);
      for (int k = 1; k < pair.dim && !is_elliptic; ++k) {
        set_J(2 * k - 2, columns[n], edge[0] + edge[k] * friction(k - 1));
        set_J(2 * k - 1, columns[n], edge[0] + edge[k] * -friction(k - 1));
      }
    }
    if (is_elliptic)
      makeConeImpedance(size, vectors(contacts_.dist)[i], splat(pair.includemargin));
    else
      makeImpedance(size, vectors(contacts_.dist)[i], splat(pair.includemargin));
  }
};

void makeConstraint(const Lanes& d, const Contacts& contacts, Constraints& c) { Making(d, contacts, c).run(); }

}  // namespace
}  // namespace mjenv::core::lanes
