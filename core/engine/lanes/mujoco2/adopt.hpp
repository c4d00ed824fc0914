// What follows from the numbers of mjModel alone. It is not computed in each mj_step: if rows have numbers of their
// own, it is computed once in each step of the environment; if all rows share the model's, it stays valid from step to
// step.
#pragma once

#include "engine/lanes/mujoco2/passive.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// Computes what mj_tendon and mj_transmission compute from nothing but gears and the coefficients of tendons along
// joints. A lane is left to MuJoCo if a coefficient in it is not 0 although the tendon's Jacobian is always 0 in the
// shared model (is_still_tendon).
void adopt_transmissions(Lanes& d) {
  const mjModel& m = *d.model;
  const V* const wrap_prm = vectors(d.wrap_prm);
  for (int i = 0; i < m.ntendon; ++i)
    for (int j = m.tendon_adr[i]; j < m.tendon_adr[i] + m.tendon_num[i]; ++j) {
      if (m.wrap_type[j] != mjWRAP_JOINT) continue;
      vectors(d.ten_J)[i * m.nv + m.jnt_dofadr[m.wrap_objid[j]]] = wrap_prm[j];
      if (d.is_still_tendon[i]) d.unlike |= bits(wrap_prm[j] != V{});
    }
  for (int i = 0; i < m.nu && d.has_moments; ++i) {
    const Actuator& actuator = d.actuators[i];
    const V gear = vectors(d.actuator_gear)[6 * i];
    V* const moment = vectors(d.actuator_moment) + i * m.nv;
    if (actuator.transmission == Actuator::Transmission::dof) moment[actuator.dof] = gear;
    if (actuator.transmission != Actuator::Transmission::tendon) continue;
    for (int k = 0; k < m.nv; ++k) moment[k] = vectors(d.ten_J)[actuator.object * m.nv + k] * gear;
  }
}

// Computes what mj_comPos computes from the masses alone. Lanes are left to MuJoCo if the quaternion of a geom does not
// have length 1, because such a geom may touch others beyond its bounding sphere.
void adopt(Lanes& d) {
  const mjModel& m = *d.model;
  V* const scale = vectors(d.com_scale);
  zero(scale, m.nbody);
  for (int i = m.nbody - 1; i >= 0; --i) {
    const V mass = scale[i] + vectors(d.body_mass)[i];
    if (i > 0) scale[m.body_parentid[i]] += mass;
    scale[i] = mass < splat(mjMINVAL) ? V{} : 1.0 / mass;
  }

  d.unlike = d.damped = 0;
  for (int i = 0; i < m.nv; ++i) d.damped |= bits(vectors(d.dof_damping)[i] > V{});
  if (!d.has_single_actuation) adopt_transmissions(d);
  for (int i = 0; i < m.ngeom && d.has_own_frames; ++i) {
    const V* const quat = vectors(d.geom_quat) + 4 * i;
    const V square = quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2] + quat[3] * quat[3];
    d.unlike |= bits(~(abs(square - 1.0) < splat(1e-6)));
  }
  if (d.needs_fluids) adopt_fluid(d);
}

}  // namespace
}  // namespace mjenv::core::lanes
