// Tendons and actuators of several rows at once. The results have MuJoCo's bits for the reasons that smooth.hpp
// gives.
#pragma once

#include <mujoco/mujoco.h>

#include "engine/lanes/frame/actuation.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"
#include "engine/lanes/mujoco2/unlisted.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_core_smooth.c ----

// Calls mju_wrap for each lane, because its angles come from the C library. Writes the two points at which the tendon
// touches the geom. Returns the length on the geom, which is negative in lanes in which the tendon does not touch it.
V wrap(const Lanes& d, const Segment& segment, V* points) {
  const mjModel& m = *d.model;
  const auto of_lane = [](double* res, const double* numbers, int first, int count, int lane) {
    for (int k = 0; k < count; ++k) res[k] = numbers[(first + k) * kWidth + lane];
  };
  const int geom = segment.geom, type = m.geom_type[geom] == mjGEOM_SPHERE ? mjWRAP_SPHERE : mjWRAP_CYLINDER;
  V length{};
  for (int lane = 0; lane < kWidth; ++lane) {
    double x0[3], x1[3], side[3], xpos[3], xmat[9], size[3], wpnt[6] = {};
    of_lane(x0, d.site_xpos, 3 * segment.site1, 3, lane);
    of_lane(x1, d.site_xpos, 3 * segment.site2, 3, lane);
    of_lane(xpos, d.geom_xpos, 3 * geom, 3, lane);
    of_lane(xmat, d.geom_xmat, 9 * geom, 9, lane);
    of_lane(size, d.geom_size, 3 * geom, 3, lane);
    if (segment.side >= 0) of_lane(side, d.site_xpos, 3 * segment.side, 3, lane);
    length[lane] = mju_wrap(wpnt, x0, x1, xpos, xmat, size, type, segment.side >= 0 ? side : nullptr);
    for (int k = 0; k < 6; ++k) points[k][lane] = wpnt[k];
  }
  return length;
}

// mj_tendon for a tendon along sites, over pulleys and around geoms. Sums begin at +0, as in MuJoCo.
void spatial_tendon(Lanes& d, int tendon) {
  const mjModel& m = *d.model;
  V* const J = vectors(d.ten_J) + tendon * m.nv;
  for (int k = d.tendon_dof_adr[tendon]; k < d.tendon_dof_adr[tendon + 1]; ++k) J[d.tendon_dofs[k]] = V{};
  V length{};
  // Adds the Jacobian of a straight part in these lanes.
  const auto add = [&](int body1, int body2, const V* from, const V* to, double divisor, Mask lanes) {
    if (body1 == body2 || !any(lanes)) return;
    const double factor = 1 / divisor;
    stretch(d, body1, body2, from, to, [&](int dof, V part) { J[dof] = lanes ? J[dof] + part * factor : J[dof]; });
  };
  for (int i = d.segment_adr[tendon]; i < d.segment_adr[tendon + 1]; ++i) {
    const Segment& segment = d.segments[i];
    const V *const from = vectors(d.site_xpos) + 3 * segment.site1, *const to =
                                                                        vectors(d.site_xpos) + 3 * segment.site2;
    const int body1 = m.site_bodyid[segment.site1], body2 = m.site_bodyid[segment.site2];
    const V straight = distance(from, to);
    Mask is_wrapped{};
    if (segment.geom >= 0) {
      V points[6];
      const V on_geom = wrap(d, segment, points);
      is_wrapped = ~(on_geom < V{});
      length += (is_wrapped ? distance(from, points) + on_geom + distance(points + 3, to) : straight) / segment.divisor;
      add(body1, m.geom_bodyid[segment.geom], from, points, segment.divisor, is_wrapped);
      add(m.geom_bodyid[segment.geom], body2, points + 3, to, segment.divisor, is_wrapped);
    } else {
      length += straight / segment.divisor;
    }
    add(body1, body2, from, to, segment.divisor, ~is_wrapped);
  }
  vectors(d.ten_length)[tendon] = length;
}

// mj_tendon. `adopt` computes the Jacobians of tendons along joints.
void tendon(Lanes& d) {
  const mjModel& m = *d.model;
  for (int i = 0; i < m.ntendon; ++i)
    if (m.wrap_type[m.tendon_adr[i]] == mjWRAP_JOINT)
      vectors(d.ten_length)[i] = length_along_joints(d, i);
    else
      spatial_tendon(d, i);
}

// mj_transmission for an actuator on a ball or free joint. Its gear is a vector in the frame of the joint, or of the
// joint's parent.
void transmit_rotation(Lanes& d, int i) {
  const mjModel& m = *d.model;
  const Actuator& actuator = d.actuators[i];
  const bool is_free = actuator.transmission == Actuator::Transmission::free;
  const V *const gears = vectors(d.actuator_gear) + 6 * i, *const gear = gears + (is_free ? 3 : 0);
  const V* const quat = vectors(d.qpos) + m.jnt_qposadr[actuator.object] + (is_free ? 3 : 0);
  V* moment = vectors(d.actuator_moment) + i * m.nv + actuator.dof;
  for (int k = 0; k < 3 && is_free; ++k) *moment++ = gears[k];
  if (m.actuator_trntype[i] == mjTRN_JOINT) {
    copy(moment, gear, 3);
  } else {
    V inverse[4];
    negQuat(inverse, quat);
    rotVecQuat(moment, gear, inverse, true);
  }
  V axis[3];
  quat2Vel(axis, quat);
  vectors(d.actuator_length)[i] = is_free ? V{} : dot3(axis, moment);
}

// mj_transmission for an actuator on a site. Its gear is a force and a torque in the site's frame.
void transmit_site(Lanes& d, int i) {
  const mjModel& m = *d.model;
  const Actuator& actuator = d.actuators[i];
  const V *const pos = vectors(d.site_xpos) + 3 * actuator.object, *const mat =
                                                                       vectors(d.site_xmat) + 9 * actuator.object;
  const V* const gear = vectors(d.actuator_gear) + 6 * i;
  V force[3], torque[3], offset[3];
  rotVecMat(force, gear, mat);
  rotVecMat(torque, gear + 3, mat);
  offset_of(d, offset, m.site_bodyid[actuator.object], pos);
  for (int n = actuator.first_column; n < actuator.first_column + actuator.count; ++n) {
    const int dof = d.columns[n];
    const V* const turn = vectors(d.cdof) + 6 * dof;
    V shift[3];
    jac(d, shift, dof, offset);
    vectors(d.actuator_moment)[i * m.nv + dof] =
        (V{} + shift[0] * force[0] + shift[1] * force[1] + shift[2] * force[2]) +
        (V{} + turn[0] * torque[0] + turn[1] * torque[1] + turn[2] * torque[2]);
  }
}

// mj_transmission. `adopt` computes the moments of actuators on slides and hinges and on tendons along joints.
void transmission(Lanes& d) {
  const mjModel& m = *d.model;
  for (int i = 0; i < m.nu; ++i) {
    const Actuator& actuator = d.actuators[i];
    const V gear = vectors(d.actuator_gear)[6 * i];
    V& length = vectors(d.actuator_length)[i];
    switch (actuator.transmission) {
      case Actuator::Transmission::dof: length = vectors(d.qpos)[m.jnt_qposadr[actuator.object]] * gear; break;
      case Actuator::Transmission::site: transmit_site(d, i); break;
      case Actuator::Transmission::tendon:
        length = vectors(d.ten_length)[actuator.object] * gear;
        if (m.wrap_type[m.tendon_adr[actuator.object]] == mjWRAP_JOINT) break;
        for (int k = 0; k < m.nv; ++k)
          vectors(d.actuator_moment)[i * m.nv + k] = vectors(d.ten_J)[actuator.object * m.nv + k] * gear;
        break;
      default: transmit_rotation(d, i);
    }
  }
}

// ---- engine_forward.c ----

// The velocities of tendons and actuators, as mj_fwdVelocity computes them. The moment of an actuator on a slide or a
// hinge is 0 except at one dof. So the products with the other dofs are zeros, which can only change the sign of a sum
// that is zero.
void fwdVelocity(Lanes& d) {
  const mjModel& m = *d.model;
  const V* const qvel = vectors(d.qvel);
  for (int i = 0; i < m.ntendon; ++i) vectors(d.ten_velocity)[i] = dot(vectors(d.ten_J) + i * m.nv, qvel, m.nv);
  for (int i = 0; i < m.nu; ++i) {
    const Actuator& actuator = d.actuators[i];
    if (actuator.transmission != Actuator::Transmission::dof) {
      vectors(d.actuator_velocity)[i] = dot(vectors(d.actuator_moment) + i * m.nv, qvel, m.nv);
      continue;
    }
    V velocity = vectors(d.actuator_gear)[6 * i] * qvel[actuator.dof];
    if (m.nv < 4)
      velocity += V{};  // the sum of mju_dot begins at +0
    else if (any(velocity == V{}))
      for (int k = 0; k < m.nv; ++k)
        if (k != actuator.dof) velocity += 0.0 * qvel[k];
    vectors(d.actuator_velocity)[i] = velocity;
  }
}

// What mj_fwdActuation computes for one actuator.
class Actuation : public SimpleActuation {
 public:
  Actuation(const Lanes& d, int id)
      : SimpleActuation(d, id), acc0_(vectors(d.actuator_acc0)[id]), state_(id - (m_.nu - m_.na)) {
    if (has_state()) act_ = vectors(d.act)[state_];
  }

  bool has_state() const { return state_ >= 0; }
  int state() const { return state_; }

  V force() const {
    return SimpleActuation::force(gain(), m_.actuator_dyntype[id_] == mjDYN_NONE ? ctrl_ : act_, bias());
  }

  V act_dot() const {
    const V* const prm = vectors(d_.actuator_dynprm) + mjNDYN * id_;
    switch (m_.actuator_dyntype[id_]) {
      case mjDYN_INTEGRATOR: return ctrl_;
      case mjDYN_FILTER: return (ctrl_ - act_) / (prm[0] > splat(mjMINVAL) ? prm[0] : splat(mjMINVAL));
      case mjDYN_MUSCLE:
        return each(
            [&](int lane) { return mju_muscleDynamics(ctrl_[lane], act_[lane], Parameters<2>(prm, lane).of_muscle); });
      default: return V{};  // would call mjcb_act_dyn, which the obstacle `callbacks` in stages.cpp excludes
    }
  }

 private:
  const V acc0_;
  V act_{};
  const int state_;

  V gain() const {
    if (m_.actuator_gaintype[id_] != mjGAIN_MUSCLE) return SimpleActuation::gain();
    return each([&](int lane) {
      return mju_muscleGain(length_[lane], velocity_[lane], lengthrange(lane).of_muscle, acc0_[lane],
                            Parameters<9>(gainprm_, lane).of_muscle);
    });
  }

  V bias() const {
    if (m_.actuator_biastype[id_] != mjBIAS_MUSCLE) return SimpleActuation::bias();
    return each([&](int lane) {
      return mju_muscleBias(length_[lane], lengthrange(lane).of_muscle, acc0_[lane],
                            Parameters<9>(biasprm_, lane).of_muscle);
    });
  }

  // Calls a function of MuJoCo for muscles, lane by lane.
  template <typename Function>
  static V each(const Function& function) {
    V result{};
    for (int lane = 0; lane < kWidth; ++lane) result[lane] = function(lane);
    return result;
  }
  template <int kCount>
  struct Parameters {
    mjtNum of_muscle[kCount];
    Parameters(const V* prm, int lane) {
      for (int i = 0; i < kCount; ++i) of_muscle[i] = prm[i][lane];
    }
  };
  Parameters<2> lengthrange(int lane) const { return {vectors(d_.actuator_lengthrange) + 2 * id_, lane}; }
};

// mj_fwdActuation
void fwdActuation(Lanes& d) {
  const mjModel& m = *d.model;
  V* const qfrc = vectors(d.qfrc_actuator);
  zero(qfrc, m.nv);
  for (int i = 0; i < m.nu; ++i) {
    const Actuation actuation(d, i);
    const Actuator& actuator = d.actuators[i];
    const V force = vectors(d.actuator_force)[i] = actuation.force();
    if (actuation.has_state()) vectors(d.act_dot)[actuation.state()] = actuation.act_dot();
    if (actuator.transmission == Actuator::Transmission::dof) {
      qfrc[actuator.dof] += vectors(d.actuator_gear)[6 * i] * force;
      continue;
    }
    for (int n = actuator.first_column; n < actuator.first_column + actuator.count; ++n)
      qfrc[d.columns[n]] += vectors(d.actuator_moment)[i * m.nv + d.columns[n]] * force;
  }
}

// Advances the states of actuators. mj_RungeKutta's sums begin at +0, and only its last stage clips the states.
void advanceActivations(Lanes& d, int stage) {
  const mjModel& m = *d.model;
  const int na = m.na;
  const V h = *vectors(d.timestep);
  const double third = 1.0 / 3.0, sixth = 1.0 / 6.0;
  V *const act = vectors(d.act), *const X = vectors(d.X_act), *const F = vectors(d.F_act);
  const V* const act_dot = vectors(d.act_dot);
  if (stage == 1) copy(X, act, na);
  if (stage > 0) copy(F + (stage - 1) * na, act_dot, na);
  for (int i = 0; i < na; ++i) {
    V change = act_dot[i];
    if (stage == 4)
      change = V{} + F[i] * sixth + F[na + i] * third + F[2 * na + i] * third + F[3 * na + i] * sixth;
    else if (stage > 0)
      change = V{} + act_dot[i] * (stage < 3 ? 0.5 : 1.0);
    if (stage > 0) act[i] = X[i];
    act[i] += change * h;
    const int actuator = i + m.nu - na;
    if ((stage == 0 || stage == 4) && m.actuator_actlimited[actuator])
      act[i] = clip(act[i], vectors(d.actuator_actrange) + 2 * actuator);
  }
}

}  // namespace
}  // namespace mjenv::core::lanes
