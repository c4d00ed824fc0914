// The forces of a fluid on bodies as on boxes, for several rows at once: mj_inertiaBoxFluidModel, whose operations are
// the same in every version.
#pragma once

#include "engine/lanes/frame/spatial.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- What follows from the fluid and the bodies alone ----

inline V fourth_power(V x) { return x * x * x * x; }

// One edge of the box in mj_inertiaBoxFluidModel. sum: the moments of inertia about the two other axes minus the one
// about the axis of the edge.
inline V edge_of_box(V sum, V mass) { return sqrt((splat(mjMINVAL) > sum ? splat(mjMINVAL) : sum) / mass * 6.0); }

// Where MuJoCo computes the forces of a fluid: in a fluid with density or viscosity, on bodies with a mass.
struct Fluid {
  explicit Fluid(const Lanes& d)
      : density(*vectors(d.density)),
        viscosity(*vectors(d.viscosity)),
        is_dense(density > V{}),
        is_viscous(viscosity > V{}) {}
  const V density, viscosity;
  const Mask is_dense, is_viscous;
  Mask is_there() const { return is_dense | is_viscous; }
};
inline Mask is_heavy(const Lanes& d, int body) { return ~(vectors(d.body_mass)[body] < splat(mjMINVAL)); }

// Computes what mj_inertiaBoxFluidModel computes from a body and the fluid alone. A factor is 0 where MuJoCo adds
// nothing.
inline void adopt_box(Lanes& d, const Fluid& fluid, int body) {
  const V zero{}, mass = vectors(d.body_mass)[body], *const inertia = vectors(d.body_inertia) + 3 * body;
  const V box[3] = {edge_of_box(inertia[1] + inertia[2] - inertia[0], mass),
                    edge_of_box(inertia[0] + inertia[2] - inertia[1], mass),
                    edge_of_box(inertia[0] + inertia[1] - inertia[2], mass)};
  const V diam = (box[0] + box[1] + box[2]) / 3.0;
  const auto set = [&](double* factors, int index, Mask is_there, V factor) {
    vectors(factors)[index] = is_there & is_heavy(d, body) ? factor : zero;
  };
  set(d.viscous_torque, body, fluid.is_viscous, -mjPI * diam * diam * diam * fluid.viscosity);
  set(d.viscous_force, body, fluid.is_viscous, -3.0 * mjPI * diam * fluid.viscosity);
  for (int k = 0; k < 3; ++k) {
    const V first = box[k == 0 ? 1 : 0], second = box[k == 2 ? 1 : 2];
    set(d.torque_drag, 3 * body + k, fluid.is_dense,
        fluid.density * box[k] * (fourth_power(first) + fourth_power(second)));
    set(d.force_drag, 3 * body + k, fluid.is_dense, 0.5 * fluid.density * first * second);
  }
}

// Calls adopt_body(fluid, body) for each body on which a fluid may act.
template <typename AdoptBody>
inline void adopt_fluid(Lanes& d, const AdoptBody& adopt_body) {
  const Fluid fluid(d);
  d.has_fluid = any(fluid.is_there());
  const V* const wind = vectors(d.wind);
  d.has_wind = any((wind[0] != V{}) | (wind[1] != V{}) | (wind[2] != V{}));
  for (int body = 1; body < d.model->nbody && d.has_fluid; ++body) adopt_body(fluid, body);
}

// ---- Forces ----

// What both models of fluids share. The velocity, in the frame of a body or geom, relative to the fluid. Without wind,
// MuJoCo subtracts zeros from it. That can only change the signs of zeros, which do not matter, because applyFT's sums
// begin at +0.
inline void velocity_in_fluid(const Lanes& d, V* vel, int body, const V* pos, const V* mat) {
  const V* const com = vectors(d.subtree_com) + 3 * d.model->body_rootid[body];
  transformMotion(vel, vectors(d.cvel) + 6 * body, pos, com, mat);  // mj_objectVelocity
  if (!d.has_wind) return;
  V wind[6], local_wind[6];
  zero(wind, 3);
  copy(wind + 3, vectors(d.wind), 3);
  transformMotion(local_wind, wind, pos, com, mat);
  for (int k = 3; k < 6; ++k) vel[k] -= local_wind[k];
}

// Applies a torque [3] and a force [3] that are given in the frame of a body or geom.
inline void apply_local(Lanes& d, const V* local, int body, const V* pos, const V* mat, V* qfrc) {
  V torque[3], force[3];
  rotVecMat(torque, local, mat);
  rotVecMat(force, local + 3, mat);
  applyFT(d, force, torque, pos, body, qfrc);
}

inline void inertiaBoxFluidModel(Lanes& d, int body, V* qfrc) {
  const V viscous_torque = vectors(d.viscous_torque)[body], viscous_force = vectors(d.viscous_force)[body],
          *const torque_drag = vectors(d.torque_drag) + 3 * body, *const force_drag = vectors(d.force_drag) + 3 * body;
  const V *const pos = vectors(d.xipos) + 3 * body, *const mat = vectors(d.ximat) + 9 * body;
  V vel[6], force[6];
  velocity_in_fluid(d, vel, body, pos, mat);
  // Where MuJoCo adds nothing, this adds zeros.
  for (int k = 0; k < 3; ++k) {
    force[k] = vel[k] * viscous_torque - torque_drag[k] * abs(vel[k]) * vel[k] / 64.0;
    force[k + 3] = vel[k + 3] * viscous_force - force_drag[k] * abs(vel[k + 3]) * vel[k + 3];
  }
  apply_local(d, force, body, pos, mat, qfrc);
}

}  // namespace
}  // namespace mjenv::core::lanes
