// What the constraints of MuJoCo 4.0 have of their own.
#pragma once

#include "engine/lanes/mujoco4/collision.hpp"
#include "engine/lanes/mujoco4/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

inline void ball_axis(V* axis, const V* qpos) {
  V quat[4];
  copy(quat, qpos, 4);
  normalize4(quat);
  quat2Vel(axis, quat);
}

// An element of ten_J, which is sparse.
inline V tendon_J(const Lanes& d, int tendon, int dof) {
  const mjModel& m = *d.model;
  for (int at = m.ten_J_rowadr[tendon]; at < m.ten_J_rowadr[tendon] + m.ten_J_rownnz[tendon]; ++at)
    if (m.ten_J_colind[at] == dof) return vectors(d.ten_J)[at];
  return V{};
}

inline const V* quat_of_site(const Lanes& d, int site) { return vectors(d.site_xquat) + 4 * site; }

}  // namespace
}  // namespace mjenv::core::lanes

#include "engine/lanes/frame/equality.hpp"

namespace mjenv::core::lanes {
namespace {

// Also computes the changes of Jacobians for which the references of equalities make up.
class MakeDrift : public MakeEquality {
 public:
  using MakeEquality::MakeEquality;

  // PGS has no room for the change of Jacobians: then only rows that are left to MuJoCo have equalities.
  void instantiateEquality(int i) {
    MakeEquality::instantiateEquality(i);
    const Equality& equality = *contacts_.equals[i].equality;
    if (rows_ != 0 && (equality.type == mjEQ_CONNECT || equality.type == mjEQ_WELD)) Jdotv(equality);
  }

 private:
  // What mj_Jdotv subtracts for a connect or weld.
  void Jdotv(const Equality& equality) {
    V points[2][3], vel[2][6];
    points_of(points, equality);
    const int bodies[2] = {equality.bodies.body2, equality.bodies.body1};
    for (int n = 0; n < 2; ++n) {
      jacDot(points[n], bodies[n]);
      for (int k = 0; k < 6; ++k) vel[n][k] = dot(vectors(c_.J_dot) + k * nv_, vectors(d_.qvel), nv_);
    }
    for (int k = 0; k < 3; ++k) set_one(c_.drift, k, vel[0][3 + k] - vel[1][3 + k]);
    if (equality.type == mjEQ_WELD) turn(equality, vel[0], vel[1], bodies);
  }

  // mj_jacDot: the rows for rotations, then those for translations.
  void jacDot(const V* point, int body) {
    V offset[3], shift[3], vel[3], *const res = vectors(c_.J_dot);
    const V* const cvel = vectors(d_.cvel) + 6 * body;
    offset_of(d_, offset, body, point);
    cross(shift, offset, cvel);
    for (int k = 0; k < 3; ++k) vel[k] = cvel[3 + k] - shift[k];
    zero(res, 6 * nv_);
    for (int i = last_dof(m_, body); i >= 0; i = m_.dof_parentid[i]) {
      const int joint = m_.dof_jntid[i], type = m_.jnt_type[joint];
      const bool is_turn = type == mjJNT_BALL || (type == mjJNT_FREE && i >= m_.jnt_dofadr[joint] + 3);
      const V* const cdof = vectors(d_.cdof) + 6 * i;
      V change[6], of_axis[3], of_point[3];
      if (is_turn)
        crossMotion(change, vectors(d_.cvel) + 6 * m_.dof_bodyid[i], cdof);
      else
        copy(change, vectors(d_.cdof_dot) + 6 * i, 6);
      cross(of_axis, change, offset);
      cross(of_point, cdof, vel);
      for (int k = 0; k < 3; ++k) {
        res[k * nv_ + i] += change[k];
        res[(3 + k) * nv_ + i] += change[3 + k] + of_axis[k] + of_point[k];
      }
    }
  }

  // The same for the rotations of a weld, which derives the product of three quaternions. Here, MuJoCo does not read
  // site_xquat, which differs where a row has its own site_quat for a site with the frame of its body.
  void turn(const Equality& equality, const V* vel1, const V* vel2, const int* bodies) {
    V first[4], second[4], negative[4], speed1[4], speed2[4], dif[3], change[3], half[4], terms[3][4];
    const V *const omega1 = vectors(d_.cvel) + 6 * bodies[0], *const omega2 = vectors(d_.cvel) + 6 * bodies[1];
    const auto of_site = [&](V* quat, int body, int site) {
      const V* const parent = vectors(d_.xquat) + 4 * body;
      d_.has_own_frames ? mulQuat(quat, parent, vectors(d_.site_quat) + 4 * site)
                        : mulQuat(quat, parent, m_.site_quat + 4 * site);
    };
    if (equality.has_sites) {
      of_site(first, bodies[0], equality.object1);
      of_site(second, bodies[1], equality.object2);
    } else {
      quats_of(first, second, equality);
    }
    negQuat(negative, second);
    for (int k = 0; k < 3; ++k) dif[k] = omega1[k] - omega2[k], change[k] = vel1[k] - vel2[k];
    if (equality.has_sites) {
      derivQuat(speed1, first, omega1);
    } else {
      V speed[4];
      derivQuat(speed, vectors(d_.xquat) + 4 * equality.object1, omega1);
      mulQuat(speed1, speed, vectors(d_.eq_data) + mjNEQDATA * equality.id + 6);
    }
    derivQuat(half, second, omega2);
    negQuat(speed2, half);
    const auto product = [&](V* res, const V* left, const V* axis, const V* right) {
      mulQuatAxis(half, left, axis);
      mulQuat(res, half, right);
    };
    product(terms[0], speed2, dif, first);
    product(terms[1], negative, change, first);
    product(terms[2], negative, dif, speed1);
    const V scale = vectors(d_.eq_data)[mjNEQDATA * equality.id + 10];
    for (int k = 0; k < 3; ++k)
      set_one(c_.drift, 3 + k, 0.5 * (terms[0][k + 1] + terms[1][k + 1] + terms[2][k + 1]) * scale);
  }
};

void makeConstraint(Lanes& d, const Contacts& contacts, Constraints& c) { make_constraints<MakeDrift>(d, contacts, c); }

}  // namespace
}  // namespace mjenv::core::lanes
