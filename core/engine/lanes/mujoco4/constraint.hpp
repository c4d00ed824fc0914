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

}  // namespace
}  // namespace mjenv::core::lanes

#include "engine/lanes/frame/constraint.hpp"

namespace mjenv::core::lanes {
namespace {

// mj_makeConstraint
void makeConstraint(Lanes& d, const Contacts& contacts, Constraints& c) {
  MakeConstraint maker(d, contacts, c);
  maker.begin();
  maker.make();
}

}  // namespace
}  // namespace mjenv::core::lanes
