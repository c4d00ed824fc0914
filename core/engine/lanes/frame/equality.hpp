// The constraints of equalities, which lanes make before those of constraint.hpp.
#pragma once

#include "engine/lanes/frame/constraint.hpp"

namespace mjenv::core::lanes {
namespace {

// The translational part of mj_jacDifPair. Calls use(dof, column) for each column that may differ from 0.
template <typename Use>
inline void jacDifPair(const Lanes& d, const BodyPair& pair, const V* point1, const V* point2, const Use& use) {
  const int *const columns = d.columns + pair.first_column, second = pair.count1, both = second + pair.count2;
  V offset1[3], offset2[3];
  offset_of(d, offset1, pair.body1, point1);
  offset_of(d, offset2, pair.body2, point2);
  for (int n = 0; n < both + pair.count_both; ++n) {
    V jac1[3]{}, jac2[3]{};
    if (n < second || n >= both) jac(d, jac1, columns[n], offset1);
    if (n >= second) jac(d, jac2, columns[n], offset2);
    for (int k = 0; k < 3; ++k) jac2[k] = pair.negates && n < second ? -jac1[k] : jac2[k] - jac1[k];
    use(columns[n], jac2);
  }
}

class MakeEquality : public MakeConstraint {
 public:
  using MakeConstraint::MakeConstraint;

  // mj_instantiateEquality
  void instantiateEquality(int i) {
    const Equality& equality = *contacts_.equals[i].equality;
    add(contacts_.equals[i].rows, contacts_.equals[i].numbers, equality.size, equality.chain);
    V pos[6];
    const V* const data = vectors(d_.eq_data) + mjNEQDATA * equality.id;
    switch (equality.type) {
      case mjEQ_CONNECT: connect(equality, pos); break;
      case mjEQ_WELD: weld(equality, data, pos); break;
      default: couple(equality, data, pos);
    }
    leave_empty(equality.size);

    V error[6];
    copy(error, pos, equality.size);
    for (int k = 3; k < equality.size; ++k) error[k] *= data[10];
    if (kWeighsTurns) copy(pos, error, equality.size);
    const V norm = equality.size > 1 ? sqrt(dot(error, error, equality.size)) : pos[0], imp = getimpedance(norm);
    set_R(0, equality.size, regularization(imp));
    if (equality.size == 6) set_R(3, 6, regularization(imp, &ConstraintNumbers::diagApproxTurn));
    for (int k = 0; k < equality.size; ++k) {
      set_one(c_.spring, k, number(&ConstraintNumbers::stiffness) * imp * pos[k]);
      set_one(c_.high, k, splat(kNoBound));
      if (c_.least) set_one(c_.least, k, splat(-kInfinite));
    }
  }

 protected:
  // A point that a connect or weld holds: a site, or a point of a body.
  void point_of(V* point, const Equality& equality, int object, const V* anchor) const {
    if (equality.has_sites) return copy(point, vectors(d_.site_xpos) + 3 * object, 3);
    rotVecMat(point, anchor, vectors(d_.xmat) + 9 * object);
    add_to(point, vectors(d_.xpos) + 3 * object, 3);
  }
  // mj_equalityAnchors
  void points_of(V points[2][3], const Equality& equality) const {
    const V* const data = vectors(d_.eq_data) + mjNEQDATA * equality.id;
    const bool is_weld = equality.type == mjEQ_WELD;
    point_of(points[0], equality, equality.object1, is_weld ? data + 3 : data);
    point_of(points[1], equality, equality.object2, is_weld ? data : data + 3);
  }
  // The orientations between which a weld of bodies takes the difference: of the first one, with the relative pose, and
  // of the second.
  void quats_of(V* first, V* second, const Equality& equality) const {
    mulQuat(first, vectors(d_.xquat) + 4 * equality.object1, vectors(d_.eq_data) + mjNEQDATA * equality.id + 6);
    copy(second, vectors(d_.xquat) + 4 * equality.object2, 4);
  }

 private:
  // The part of mj_instantiateEquality for points on two bodies: the difference of the points, and of their Jacobians.
  void connect(const Equality& equality, V* pos) {
    V points[2][3];
    points_of(points, equality);
    for (int k = 0; k < 3; ++k) pos[k] = points[0][k] - points[1][k];
    jacDifPair(d_, equality.bodies, points[1], points[0], [&](int dof, const V* dif) {
      for (int k = 0; k < 3; ++k) set_J(k, dof, dif[k]);
    });
  }

  // The part of mj_instantiateEquality for the orientation of a weld. MuJoCo corrects all columns of the Jacobian, also
  // those of dofs that move neither body, which become +0 or -0. This code does the same.
  void weld(const Equality& equality, const V* data, V* pos) {
    connect(equality, pos);
    V quat[4], other[4], negative[4], error[4];
    if (equality.has_sites) {
      copy(quat, quat_of_site(d_, equality.object1), 4);
      copy(other, quat_of_site(d_, equality.object2), 4);
    } else {
      quats_of(quat, other, equality);
    }
    negQuat(negative, other);
    mulQuat(error, negative, quat);
    copy(pos + 3, error + 1, 3);
    const BodyPair& pair = equality.bodies;
    const int *const columns = d_.columns + pair.first_column, second = pair.count1, both = second + pair.count2,
                     end = both + pair.count_both;
    const int* const chain = d_.columns + equality.chain.first_column;
    const int count = c_.is_sparse ? equality.chain.count : nv_;
    for (int i = 0; i < count; ++i) {
      const int dof = c_.is_sparse ? chain[i] : i;
      int n = 0;
      while (n < end && columns[n] != dof) ++n;
      V axis[3]{}, half[4], turned[4];
      const V* const cdof = vectors(d_.cdof) + 6 * dof;
      for (int k = 0; k < 3 && n < end; ++k)
        axis[k] = pair.negates && n < second
                      ? -cdof[k]
                      : (n >= second ? cdof[k] : V{}) - (n < second || n >= both ? cdof[k] : V{});
      mulQuatAxis(half, negative, axis);
      mulQuat(turned, half, quat);
      for (int k = 0; k < 3; ++k) set_J(3 + k, dof, 0.5 * turned[k + 1] * data[10]);
    }
  }

  // The part of mj_instantiateEquality for a joint whose position depends on that of another joint, or a tendon whose
  // length depends on that of another tendon.
  void couple(const Equality& equality, const V* data, V* pos) {
    const bool is_joint = equality.type == mjEQ_JOINT;
    const auto offset = [&](int id) {
      if (!is_joint) return vectors(d_.ten_length)[id] - vectors(d_.tendon_length0)[id];
      const int adr = m_.jnt_qposadr[id];
      return vectors(d_.qpos)[adr] - (d_.has_own_frames ? vectors(d_.qpos0)[adr] : splat(m_.qpos0[adr]));
    };
    pos[0] = offset(equality.object1) - data[0];
    V derivative{};
    const bool is_alone = equality.object2 < 0;
    if (!is_alone) {
      const V dif = offset(equality.object2);
      pos[0] -= data[1] * dif + data[2] * dif * dif + data[3] * dif * dif * dif + data[4] * dif * dif * dif * dif;
      derivative = data[1] + 2.0 * data[2] * dif + 3.0 * data[3] * dif * dif + 4.0 * data[4] * dif * dif * dif;
    }
    if (c_.is_sparse) return couple_sparse(equality, -derivative);
    for (int k = 0; k < nv_; ++k) {
      const auto column = [&](int id) { return is_joint ? splat(k == m_.jnt_dofadr[id]) : tendon_J(d_, id, k); };
      const V own = column(equality.object1);
      set_J(0, k, is_alone ? own : own + column(equality.object2) * -derivative);
    }
  }

  // The Jacobian of a joint whose position depends on that of another joint, as mju_combineSparse makes it
  void couple_sparse(const Equality& equality, V factor) {
    const int dof1 = m_.jnt_dofadr[equality.object1];
    const int dof2 = equality.object2 < 0 ? -1 : m_.jnt_dofadr[equality.object2];
    set_J(0, dof1, splat(1));
    if (dof2 >= 0) set_J(0, dof2, factor);
  }
};

// mj_makeConstraint
template <typename Maker>
void make_constraints(Lanes& d, const Contacts& contacts, Constraints& c) {
  Maker maker(d, contacts, c);
  maker.begin();
  for (int i = 0; i < contacts.equality_count; ++i) maker.instantiateEquality(i);
  maker.make();
}

}  // namespace
}  // namespace mjenv::core::lanes
