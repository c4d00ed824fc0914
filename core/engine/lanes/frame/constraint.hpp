// The constraints of friction, limits and contacts, for several rows at once, as engine_core_constraint.c makes them. The
// results have MuJoCo's bits for the reasons that smooth.hpp gives, also the signs of zeros in the Jacobians. A version
// includes this after it has defined includemargin, ball_axis and tendon_J.
#pragma once

#include <cmath>

#include "engine/lanes/frame/places.hpp"

namespace mjenv::core::lanes {
namespace {

// The first half of mj_instantiateLimit, which finds the reached limits.
class Limits {
 public:
  Limits(const Lanes& d, Contacts& c) : d_(d), c_(c), m_(*d.model) {}

  bool find() {
    c_.limit_count = 0;
    for (int lane = 0; lane < kWidth; ++lane) c_.constraints[lane] = c_.bounded[lane];
    for (int i = 0; i < c_.joint_count; ++i) {
      const Contacts::Limited& joint = c_.joints[i];
      const V* const q = vectors(d_.qpos) + m_.jnt_qposadr[joint.id];
      if (m_.jnt_type[joint.id] == mjJNT_BALL ? !find_ball(joint, q)
                                              : !find_sides(Object::joint, joint, *q, d_.jnt_range, d_.jnt_margin))
        return false;
    }
    for (int i = 0; i < c_.tendon_count; ++i) {
      const Contacts::Limited& tendon = c_.tendons[i];
      if (!find_sides(Object::tendon, tendon, vectors(d_.ten_length)[tendon.id], d_.tendon_range, d_.tendon_margin))
        return false;
    }
    return true;
  }

 private:
  const Lanes& d_;
  Contacts& c_;
  const mjModel& m_;

  // Adds a limit that some lane has reached. Returns false if there is no room for it.
  bool add(Object object, const Contacts::Limited& limited, int side, V dist, V margin, const V* axis = nullptr) {
    const unsigned rows = bits(dist < margin) & limited.rows & c_.rows;
    if (rows == 0) return true;
    if (c_.limit_count == Contacts::kCapacity) return false;
    const int i = c_.limit_count++;
    c_.limits[i] = {object, limited.id, side, rows, {}};
    vectors(c_.limit_dist)[i] = dist;
    if (axis) copy(vectors(c_.limit_axis) + 3 * i, axis, 3);
    for (int lane = 0; lane < kWidth; ++lane) c_.constraints[lane] += rows >> lane & 1;
    return true;
  }

  bool find_sides(Object object, const Contacts::Limited& limited, V value, const double* range, const double* margin) {
    for (int side = -1; side <= 1; side += 2) {
      const V dist = side * 1.0 * (vectors(range)[2 * limited.id + (side + 1) / 2] - value);
      if (!add(object, limited, side, dist, vectors(margin)[limited.id])) return false;
    }
    return true;
  }

  bool find_ball(const Contacts::Limited& joint, const V* quat) {
    V axis[3];
    ball_axis(axis, quat);
    const V value = normalize3(axis), *const range = vectors(d_.jnt_range) + 2 * joint.id;
    return add(Object::ball, joint, 1, (range[0] > range[1] ? range[0] : range[1]) - value,
               vectors(d_.jnt_margin)[joint.id], axis);
  }
};

bool instantiateLimit(const Lanes& d, Contacts& c) { return Limits(d, c).find(); }

// Makes constraints one after the other, each in the lanes that have it.
class MakeConstraint {
 public:
  MakeConstraint(Lanes& d, const Contacts& contacts, Constraints& c)
      : d_(d), contacts_(contacts), c_(c), m_(*d.model), nv_(m_.nv), places_(contacts, c) {}

  // mj_makeConstraint. A version with equalities makes them between these two.
  void begin() {
    if (!c_.is_sparse) zero(vectors(c_.J), c_.size * nv_);
    for (int k = 0; k < nv_ && c_.is_sparse; ++k) c_.dof_place_counts[k] = 0;
    double* const numbers[] = {c_.D, c_.damping, c_.spring, c_.R, c_.scale};
    for (double* array : numbers)
      if (array) zero(vectors(array), c_.size);
    clear_bounds();
  }
  void make() {
    for (int i = 0; i < contacts_.friction_count; ++i) instantiateFriction(i);
    for (int i = 0; i < contacts_.limit_count; ++i) instantiateLimit(i);
    for (int i = 0; i < contacts_.contact_count; ++i)
      if (contacts_.contacts[i].rows != 0) instantiateContact(i);
  }

 protected:
  Lanes& d_;
  const Contacts& contacts_;
  Constraints& c_;
  const mjModel& m_;
  const int nv_;
  Places places_;
  unsigned rows_ = 0;  // the lanes, as bits, in which a constraint is made
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

  // mj_addConstraint. columns, count: the dofs at which the constraint's sparse Jacobian has numbers, ascending.
  void add(unsigned rows, const ConstraintNumbers* const* numbers, int size, const int* columns, int count,
           bool couples = false) {
    rows_ = rows & contacts_.rows;
    numbers_ = numbers;
    places_.next(rows_, size);
    if (c_.is_aligned) c_.dims[places_.at(0, 0)] = static_cast<unsigned char>(size);
    if (!c_.is_sparse) return;
    for (int i = 0; i < size; ++i) {
      const int place = places_.at(i, 0);
      c_.column_counts[place] = count;
      c_.couples[place] = i == 0 && couples;
      c_.holders[place] = static_cast<unsigned char>(rows | ~c_.rows);
      for (int k = 0; k < count; ++k) {
        const int dof = columns[k];
        c_.columns[place * nv_ + k] = dof;
        c_.dof_places[dof * c_.most_places + c_.dof_place_counts[dof]++] = place;
        vectors(c_.J)[place * nv_ + dof] = V{};
      }
    }
  }
  void add(unsigned rows, const ConstraintNumbers* const* numbers, int size, const Chain& chain) {
    add(rows, numbers, size, d_.columns + chain.first_column, chain.count, chain.couples);
  }

  void set_J(int i, int column, V value) {
    if (c_.is_aligned) {
      V& number = vectors(c_.J)[places_.at(i, 0) * nv_ + column];
      number = mask_of(rows_) ? value : number;
      return;
    }
    for (int lane = 0; lane < kWidth; ++lane)
      if (rows_ >> lane & 1) c_.J[(places_.at(i, lane) * nv_ + column) * kWidth + lane] = value[lane];
  }

  void set_one(double* array, int i, V value) {
    for (int lane = 0; lane < kWidth; ++lane)
      if (rows_ >> lane & 1) array[places_.at(i, lane) * kWidth + lane] = value[lane];
  }

  void set(double* array, int size, V value) {
    for (int i = 0; i < size; ++i) set_one(array, i, value);
  }

  // Sets the bounds of each place to those of an inequality. Equalities and friction overwrite those that differ.
  void clear_bounds() {
    for (int i = 0; i < c_.bounded; ++i) {
      if (c_.drift) vectors(c_.drift)[i] = V{};
      vectors(c_.low)[i] = splat(kNoBound);
      vectors(c_.high)[i] = vectors(c_.frictionloss)[i] = vectors(c_.bend)[i] = V{};
      if (!c_.least) continue;
      vectors(c_.least)[i] = V{};
      vectors(c_.greatest)[i] = splat(kInfinite);
    }
  }

  // The impedance that getimpedance computes. As in MuJoCo, the C library computes the powers.
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
      y[lane] = at <= n.midpoint ? n.below * power(at, n.power) : 1 - n.above * power(1 - at, n.power);
    }
    const V imp = is_saturated ? (x >= splat(1) ? dmax : dmin) : dmin + y * (dmax - dmin);
    return is_flat ? 0.5 * (dmin + dmax) : imp;
  }

  // The efc_R with which mj_makeImpedance begins, before it considers the friction of contacts
  V regularization(V imp, double ConstraintNumbers::*diagApprox = &ConstraintNumbers::diagApprox) const {
    const V R = (1.0 - imp) * number(diagApprox) / imp;
    return splat(mjMINVAL) >= R ? splat(mjMINVAL) : R;
  }

  void set_R(int begin, int end, V R) {
    for (int i = begin; i < end; ++i) {
      if (c_.R) set_one(c_.R, i, R);
      set_one(c_.D, i, 1.0 / R);
      set_one(c_.damping, i, number(&ConstraintNumbers::damping));
    }
  }

  // mj_diagApprox and mj_makeImpedance for `size` constraints, which have the same pos and margin. Returns efc_R.
  V makeImpedance(int size, V pos, V margin) {
    const V dif = pos - margin, imp = getimpedance(dif);
    V R = regularization(imp);
    if (size > 1) {
      const V mu = friction(0) * sqrt(R / number(&ConstraintNumbers::impratio) / R);
      R = 2.0 * mu * mu * R;
    }
    set_R(0, size, R);
    set(c_.spring, size, number(&ConstraintNumbers::stiffness) * imp * dif);
    return R;
  }

  // makeImpedance for a contact with an elliptic cone
  void makeConeImpedance(int dim, V pos, V margin) {
    using N = ConstraintNumbers;
    const V dif = pos - margin, imp = getimpedance(dif), normal = regularization(imp);
    const V tangent = normal / number(&N::impratio), first = friction(0);
    set(c_.damping, dim, number(&N::damping));
    for (int j = 0; j < dim; ++j) {
      const V other = friction(j > 0 ? j - 1 : 0);
      const V R = j == 0 ? normal : (j == 1 ? tangent : tangent * first * first / (other * other));
      if (c_.R) set_one(c_.R, j, R);
      set_one(c_.D, j, 1.0 / R);
      set_one(c_.spring, j, j == 0 ? number(&N::stiffness) * imp * dif : V{});
      set_one(c_.scale, j, j == 0 ? first * sqrt(tangent / normal) : other);
    }
  }

  // Sets the Jacobian to a tendon's row of ten_J times a factor.
  void set_tendon(int tendon, double factor) {
    for (int k = 0; k < nv_; ++k) set_J(0, k, tendon_J(d_, tendon, k) * factor);
    leave_empty(1);
  }

  // Except for contacts, MuJoCo makes no constraint whose Jacobian is 0. Lanes with such a constraint are left to
  // MuJoCo.
  void leave_empty(int size) {
    if (c_.is_sparse) return;  // with a sparse Jacobian, MuJoCo only checks whether the constraint has columns
    for (int lane = 0; lane < kWidth; ++lane) {
      if (!(rows_ >> lane & 1)) continue;
      bool is_empty = true;
      for (int i = 0; i < size && is_empty; ++i)
        for (int k = 0; k < nv_ && is_empty; ++k) is_empty = c_.J[(places_.at(i, lane) * nv_ + k) * kWidth + lane] == 0;
      if (is_empty) d_.left_to_mujoco |= 1U << lane;
    }
  }

  // mj_instantiateFriction
  void instantiateFriction(int i) {
    const Contacts::Friction& friction = contacts_.frictions[i];
    add(friction.rows, friction.numbers, 1, &friction.id, 1);
    if (friction.object == Object::tendon)
      set_tendon(friction.id, 1);
    else
      set_J(0, friction.id, splat(1));
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
    const bool is_ball = limit.object == Object::ball;
    const int dof = limit.object == Object::tendon ? 0 : m_.jnt_dofadr[limit.id], dofs[3] = {dof, dof + 1, dof + 2};
    add(limit.rows, limit.numbers, 1, dofs, is_ball ? 3 : 1);
    const V dist = vectors(contacts_.limit_dist)[i];
    if (limit.object == Object::tendon) {
      set_tendon(limit.id, -limit.side);
      makeImpedance(1, dist, vectors(d_.tendon_margin)[limit.id]);
      return;
    }
    if (limit.object == Object::joint) set_J(0, dof, splat(-limit.side));
    for (int k = 0; k < 3 && is_ball; ++k) set_J(0, dof + k, vectors(contacts_.limit_axis)[3 * i + k] * -1.0);
    makeImpedance(1, dist, vectors(d_.jnt_margin)[limit.id]);
  }

  // One column of mju_mulMatMat: the first `rows` rows of a contact's frame times a vector
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
    add(contact.rows, contact.numbers, size, pair.chain);
    V offset1[3], offset2[3];
    for (int k = 0; k < 3; ++k) {
      const V point = vectors(contacts_.pos)[3 * i + k];
      offset1[k] = point - vectors(d_.subtree_com)[3 * pair.root1 + k];
      offset2[k] = point - vectors(d_.subtree_com)[3 * pair.root2 + k];
    }
    const V* const frame = vectors(contacts_.frame) + 9 * i;
    const V friction1 = friction(0), friction2 = friction(1);
    const int* const columns = d_.columns + pair.first_column;
    for (int n = 0; n < pair.count1 + pair.count2; ++n) {
      // mj_jacDifPair
      V dif[3], edge[6];
      jac(d_, dif, columns[n], n < pair.count1 ? offset1 : offset2);
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
    const V margin = includemargin(d_, contact.pair);
    if (is_elliptic)
      makeConeImpedance(size, vectors(contacts_.dist)[i], margin);
    else
      makeImpedance(size, vectors(contacts_.dist)[i], margin);
  }
};

}  // namespace
}  // namespace mjenv::core::lanes
