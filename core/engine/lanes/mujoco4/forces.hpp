// Tendons, actuators and passive forces of MuJoCo 4.0 for several rows at once: tendons along joints and sites, actuators
// without states on slides, hinges and tendons, their springs, dampers, fluids that act on bodies as on boxes, and
// compensation of gravity.
#pragma once

#include "engine/lanes/frame/actuation.hpp"
#include "engine/lanes/frame/fluid.hpp"
#include "engine/lanes/mujoco4/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// mj_tendon for tendons along joints or sites, and the velocities that mj_fwdVelocity computes. MuJoCo adds to zeros.
void tendon(Lanes& d) {
  const mjModel& m = *d.model;
  for (int i = 0; i < m.ntendon; ++i) {
    const int first = m.tendon_adr[i], last = first + m.tendon_num[i] - 1;
    const int count = m.ten_J_rownnz[i], *const columns = m.ten_J_colind + m.ten_J_rowadr[i];
    V *const J = vectors(d.ten_J) + m.ten_J_rowadr[i], length{};
    const auto add = [&](int dof, V part) {
      for (int k = 0; k < count; ++k)
        if (columns[k] == dof) J[k] += part;
    };
    zero(J, count);
    if (m.wrap_type[first] == mjWRAP_JOINT) {
      length = length_along_joints(d, i);
      for (int j = first; j <= last; ++j) add(m.jnt_dofadr[m.wrap_objid[j]], vectors(d.wrap_prm)[j]);
    }
    for (int j = first; j < last && m.wrap_type[j] == mjWRAP_SITE; ++j) {
      const int site1 = m.wrap_objid[j], site2 = m.wrap_objid[j + 1];
      const int body1 = m.site_bodyid[site1], body2 = m.site_bodyid[site2];
      const V *const from = vectors(d.site_xpos) + 3 * site1, *const to = vectors(d.site_xpos) + 3 * site2;
      length += distance(from, to);
      if (body1 != body2) stretch(d, body1, body2, from, to, add);
    }
    vectors(d.ten_length)[i] = length;
    vectors(d.ten_velocity)[i] = dotSparse(J, vectors(d.qvel), count, columns);
  }
}

// A row of actuator_moment, and the length without the gear. The moment of a slide or hinge is the gear.
struct Transmission {
  Transmission(const Lanes& d, int id) : gear(vectors(d.actuator_gear)[6 * id]) {
    const mjModel& m = *d.model;
    const int object = m.actuator_trnid[2 * id];
    if (m.actuator_trntype[id] == mjTRN_TENDON) {
      length = vectors(d.ten_length)[object];
      count = m.ten_J_rownnz[object];
      columns = m.ten_J_colind + m.ten_J_rowadr[object];
      J = vectors(d.ten_J) + m.ten_J_rowadr[object];
    } else {
      length = vectors(d.qpos)[m.jnt_qposadr[object]];
      columns = m.jnt_dofadr + object;
    }
  }
  V operator[](int k) const { return J ? J[k] * gear : gear; }
  const V gear;
  V length;
  int count = 1;
  const int* columns;
  const V* J = nullptr;
};

// mj_transmission, and the velocities that mj_fwdVelocity computes
void transmission(Lanes& d) {
  for (int i = 0; i < d.model->nu; ++i) {
    const Transmission moment(d, i);
    vectors(d.actuator_length)[i] = moment.length * moment.gear;
    vectors(d.actuator_velocity)[i] = dotSparse(moment, vectors(d.qvel), moment.count, moment.columns);
  }
}

// mj_fwdActuation
void fwdActuation(Lanes& d) {
  const mjModel& m = *d.model;
  V* const qfrc = vectors(d.qfrc_actuator);
  zero(qfrc, m.nv);
  for (int i = 0; i < m.nu; ++i) {
    const V force = vectors(d.actuator_force)[i] = SimpleActuation(d, i).force();
    const Transmission moment(d, i);
    for (int k = 0; k < moment.count; ++k) qfrc[moment.columns[k]] += moment[k] * force;
  }
  for (int i = 0; i < m.njnt; ++i) {
    V& force = qfrc[m.jnt_dofadr[i]];
    if (m.jnt_actfrclimited[i]) force = clip(force, vectors(d.jnt_actfrcrange) + 2 * i);
  }
}

// mj_gravcomp, for joints whose compensation is no part of an actuator's force
void gravcomp(Lanes& d) {
  const mjModel& m = *d.model;
  V *const qfrc = vectors(d.qfrc_passive), *const sum = vectors(d.qfrc_gravcomp);
  const V *const gravity = vectors(d.gravity), torque[3]{};
  zero(sum, m.nv);
  for (int i = 1; i < m.nbody; ++i) {
    if (m.body_gravcomp[i] == 0) continue;
    const V scale = -(vectors(d.body_mass)[i] * m.body_gravcomp[i]);
    const V force[3] = {gravity[0] * scale, gravity[1] * scale, gravity[2] * scale};
    applyFT(d, force, torque, vectors(d.xipos) + 3 * i, i, sum);
  }
  const Mask is_there = dot3(gravity, gravity) > V{};
  for (int i = 0; i < m.nv; ++i) qfrc[i] = is_there ? qfrc[i] + sum[i] : qfrc[i];
}

// The force of a spring or damper, which MuJoCo does not compute where the factor is 0
inline V resistance(V factor, V x) { return factor == V{} ? V{} : -x * factor; }

// mj_springdamper for tendons, between whose two lengths springs are slack
void springdamper(const Lanes& d, V* spring, V* damper) {
  const mjModel& m = *d.model;
  for (int i = 0; i < m.ntendon; ++i) {
    const V length = vectors(d.ten_length)[i], *const slack = vectors(d.tendon_lengthspring) + 2 * i;
    const V x = length > slack[1] ? length - slack[1] : (length < slack[0] ? length - slack[0] : V{});
    const V stiffness = m.opt.disableflags & mjDSBL_SPRING ? V{} : vectors(d.tendon_stiffness)[i];
    const V damping = m.opt.disableflags & mjDSBL_DAMPER ? V{} : vectors(d.tendon_damping)[i];
    const V pull = resistance(stiffness, x), drag = resistance(damping, vectors(d.ten_velocity)[i]);
    const Mask acts = (pull != V{}) | (drag != V{});
    for (int k = m.ten_J_rowadr[i]; k < m.ten_J_rowadr[i] + m.ten_J_rownnz[i]; ++k) {
      const V J = vectors(d.ten_J)[k];
      V &to_spring = spring[m.ten_J_colind[k]], &to_damper = damper[m.ten_J_colind[k]];
      to_spring = acts ? to_spring + J * pull : to_spring;
      to_damper = acts ? to_damper + J * drag : to_damper;
    }
  }
}

// mj_passive
void passive(Lanes& d) {
  const mjModel& m = *d.model;
  V *const qfrc = vectors(d.qfrc_passive), *const spring = vectors(d.qfrc_spring),
           *const damper = vectors(d.qfrc_damper), *const fluid = vectors(d.qfrc_fluid);
  zero(spring, m.nv);
  for (int i = 0; i < m.njnt && !(m.opt.disableflags & mjDSBL_SPRING); ++i) {
    if (m.jnt_type[i] != mjJNT_SLIDE && m.jnt_type[i] != mjJNT_HINGE) continue;
    const int adr = m.jnt_qposadr[i];
    spring[m.jnt_dofadr[i]] =
        resistance(vectors(d.jnt_stiffness)[i], vectors(d.qpos)[adr] - vectors(d.qpos_spring)[adr]);
  }
  for (int i = 0; i < m.nv; ++i) {
    const V damping = m.opt.disableflags & mjDSBL_DAMPER ? V{} : vectors(d.dof_damping)[i];
    damper[i] = resistance(damping, vectors(d.qvel)[i]);
  }
  springdamper(d, spring, damper);
  for (int i = 0; i < m.nv; ++i) qfrc[i] = spring[i] + damper[i];
  constexpr int kBoth = mjDSBL_SPRING | mjDSBL_DAMPER;
  if ((m.opt.disableflags & kBoth) == kBoth) return;
  if (d.has_fluid) {
    const Mask adds_fluid = (*vectors(d.density) != V{}) | (*vectors(d.viscosity) != V{});
    zero(fluid, m.nv);
    for (int i = 1; i < m.nbody; ++i)
      if (any(is_heavy(d, i))) inertiaBoxFluidModel(d, i, fluid);
    for (int i = 0; i < m.nv; ++i) qfrc[i] = adds_fluid ? qfrc[i] + fluid[i] : qfrc[i];
  }
  if (m.flg_gravcomp && !(m.opt.disableflags & mjDSBL_GRAVITY)) gravcomp(d);
}

}  // namespace
}  // namespace mjenv::core::lanes
