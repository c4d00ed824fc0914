// What the constraints of MuJoCo 2.2.2 have of their own.
#pragma once

#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

inline void ball_axis(V* axis, const V* quat) { quat2Vel(axis, quat); }
inline V tendon_J(const Lanes& d, int tendon, int dof) { return vectors(d.ten_J)[tendon * d.model->nv + dof]; }
inline const V* quat_of_site(const Lanes& d, int /*site*/) { return vectors(d.xquat); }  // no equality is between sites

}  // namespace
}  // namespace mjenv::core::lanes

#include "engine/lanes/frame/equality.hpp"

namespace mjenv::core::lanes {
namespace {

void makeConstraint(Lanes& d, const Contacts& contacts, Constraints& c) {
  make_constraints<MakeEquality>(d, contacts, c);
}

}  // namespace
}  // namespace mjenv::core::lanes
