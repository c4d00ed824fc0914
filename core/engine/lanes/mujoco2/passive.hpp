// The passive forces of several rows at once: springs, dampers, and fluids. The results have MuJoCo's bits for the
// reasons that smooth.hpp gives.
#pragma once

#include "engine/lanes/frame/fluid.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- What follows from the fluid and the bodies alone ----

inline V square(V x) { return x * x; }
inline V squared_twice(V x) { return square(x * x); }  // rounds otherwise than fourth_power

// What mj_ellipsoidFluidModel computes from a geom and the fluid alone. The comments name its variables.
struct Ellipsoid {
  V scale;          // geom_interaction_coef; 0 where MuJoCo adds nothing
  V density;        // that of the fluid
  V mass[3];        // density * virtual_mass
  V inertia[3];     // density * virtual_inertia
  V magnus, kutta;  // density * magnus_lift_coef * volume, density * kutta_lift_coef
  V blunt_drag_coef, slender_drag_coef;
  V axes[3];          // for each axis, the product of the two other semi-axes
  V A_max;            // the largest projected area
  V moment[3];        // the factors of mom_visc
  V linear, angular;  // viscosity * lin_visc_force_coef, viscosity * lin_visc_torq_coef
};
static_assert(sizeof(Ellipsoid) == kEllipsoidNumbers * sizeof(V));
inline Ellipsoid& ellipsoid_of(const Lanes& d, int geom) { return reinterpret_cast<Ellipsoid*>(d.ellipsoids)[geom]; }

// mju_geomSemiAxes
inline void geomSemiAxes(const Lanes& d, int geom, V* semiaxes) {
  const V* const size = vectors(d.geom_size) + 3 * geom;
  const int type = d.model->geom_type[geom];
  const bool is_round = type == mjGEOM_SPHERE || type == mjGEOM_CAPSULE || type == mjGEOM_CYLINDER;
  semiaxes[0] = size[0];
  semiaxes[1] = size[is_round ? 0 : 1];
  semiaxes[2] = type == mjGEOM_SPHERE    ? size[0]
                : type == mjGEOM_CAPSULE ? size[1] + size[0]
                                         : size[type == mjGEOM_CYLINDER ? 1 : 2];
}

// The sizes of an ellipsoid, with MuJoCo's names
struct Dimensions {
  Dimensions(const Lanes& d, int geom) {
    const auto larger = [](V a, V b) { return a >= b ? a : b; };
    const auto smaller = [](V a, V b) { return a <= b ? a : b; };
    geomSemiAxes(d, geom, size);
    d_max = larger(larger(size[0], size[1]), size[2]);
    const V d_min = smaller(smaller(size[0], size[1]), size[2]);
    d_mid = size[0] + size[1] + size[2] - d_max - d_min;
    eq_sphere_D = 2.0 / 3.0 * (size[0] + size[1] + size[2]);
    for (int k = 0; k < 3; ++k)
      II[k] = 8.0 / 15.0 * mjPI * size[k] * squared_twice(larger(size[(k + 1) % 3], size[(k + 2) % 3]));
  }
  V size[3], d_max, d_mid, eq_sphere_D, II[3];
};

void adopt_ellipsoid(Lanes& d, const Fluid& fluid, int geom) {
  Ellipsoid& e = ellipsoid_of(d, geom);
  // readFluidGeomInteraction
  const V* const coef = vectors(d.geom_fluid) + mjNFLUID * geom;
  const V ang_drag_coef = coef[3], kutta_lift_coef = coef[4], magnus_lift_coef = coef[5];
  const V *const virtual_mass = coef + 6, *const virtual_inertia = coef + 9;
  e.scale = fluid.is_there() & is_heavy(d, d.model->geom_bodyid[geom]) ? coef[0] : V{};
  e.density = fluid.density;
  e.blunt_drag_coef = coef[1];
  e.slender_drag_coef = coef[2];

  const Dimensions of(d, geom);
  const V volume = 4.0 / 3.0 * mjPI * of.size[0] * of.size[1] * of.size[2];
  const V I_max = 8.0 / 15.0 * mjPI * of.d_mid * squared_twice(of.d_max);
  for (int k = 0; k < 3; ++k) {
    e.mass[k] = fluid.density * virtual_mass[k];
    e.inertia[k] = fluid.density * virtual_inertia[k];
    e.axes[k] = of.size[(k + 1) % 3] * of.size[(k + 2) % 3];
    e.moment[k] = ang_drag_coef * of.II[k] + e.slender_drag_coef * (I_max - of.II[k]);
  }
  e.magnus = magnus_lift_coef * fluid.density * volume;
  e.kutta = kutta_lift_coef * fluid.density;
  e.A_max = mjPI * of.d_max * of.d_mid;
  e.linear = fluid.viscosity * (3.0 * mjPI * of.eq_sphere_D);
  e.angular = fluid.viscosity * (mjPI * of.eq_sphere_D * of.eq_sphere_D * of.eq_sphere_D);
}

void adopt_fluid(Lanes& d) {
  const mjModel& m = *d.model;
  adopt_fluid(d, [&](const Fluid& fluid, int body) {
    if (!d.has_ellipsoids[body]) return adopt_box(d, fluid, body);
    for (int i = 0; i < m.body_geomnum[body]; ++i) adopt_ellipsoid(d, fluid, m.body_geomadr[body] + i);
  });
}

// ---- engine_core_smooth.c ----

inline V norm3(const V* vec) { return sqrt(dot3(vec, vec)); }

// mj_addedMassForces
void addedMassForces(const Ellipsoid& e, const V* ang_vel, const V* lin_vel, V* force) {
  V linear[3], angular[3], torque1[3], torque2[3], added[3];
  for (int k = 0; k < 3; ++k) {
    linear[k] = e.mass[k] * lin_vel[k];
    angular[k] = e.inertia[k] * ang_vel[k];
  }
  cross(added, linear, ang_vel);
  cross(torque1, linear, lin_vel);
  cross(torque2, angular, ang_vel);
  for (int k = 0; k < 3; ++k) {
    force[k] = torque1[k] + torque2[k];
    force[k + 3] = added[k];
  }
}

// mj_viscousForces
void viscousForces(const Ellipsoid& e, const V* ang_vel, const V* lin_vel, V* force) {
  const V least = splat(mjMINVAL);
  const auto at_least = [&](V x) { return least >= x ? least : x; };
  V norm[3], mom_visc[3], proj_denom{}, proj_num{};
  for (int k = 0; k < 3; ++k) {
    const V denom = squared_twice(e.axes[k]) * square(lin_vel[k]), num = square(e.axes[k] * lin_vel[k]);
    proj_denom = k == 0 ? denom : proj_denom + denom;
    proj_num = k == 0 ? num : proj_num + num;
    norm[k] = square(e.axes[k]) * lin_vel[k];
    mom_visc[k] = ang_vel[k] * e.moment[k];
  }
  const V speed = norm3(lin_vel);
  const V A_proj = mjPI * sqrt(proj_denom / at_least(proj_num)), cos_alpha = proj_num / at_least(speed * proj_denom);
  const V circulation = e.kutta * cos_alpha * A_proj;
  V magnus_force[3], kutta_circ[3], kutta_force[3];
  cross(magnus_force, ang_vel, lin_vel);
  cross(kutta_circ, norm, lin_vel);
  for (V& x : kutta_circ) x *= circulation;
  cross(kutta_force, kutta_circ, lin_vel);
  const V drag_lin_coef =
      e.linear + e.density * speed * (A_proj * e.blunt_drag_coef + e.slender_drag_coef * (e.A_max - A_proj));
  const V drag_ang_coef = e.angular + e.density * norm3(mom_visc);
  for (int k = 0; k < 3; ++k) {
    force[k] -= drag_ang_coef * ang_vel[k];
    force[k + 3] += magnus_force[k] * e.magnus + kutta_force[k] - drag_lin_coef * lin_vel[k];
  }
}

void ellipsoidFluidModel(Lanes& d, int body) {
  const mjModel& m = *d.model;
  for (int geom = m.body_geomadr[body]; geom < m.body_geomadr[body] + m.body_geomnum[body]; ++geom) {
    const Ellipsoid& e = ellipsoid_of(d, geom);
    if (!any(e.scale != V{})) continue;
    const V *const pos = vectors(d.geom_xpos) + 3 * geom, *const mat = vectors(d.geom_xmat) + 9 * geom;
    V vel[6], force[6];
    velocity_in_fluid(d, vel, body, pos, mat);
    addedMassForces(e, vel, vel + 3, force);
    viscousForces(e, vel, vel + 3, force);
    for (V& x : force) x *= e.scale;
    apply_local(d, force, body, pos, mat, vectors(d.qfrc_passive));
  }
}

// mj_passive
void passive(Lanes& d) {
  const mjModel& m = *d.model;
  V* const qfrc = vectors(d.qfrc_passive);
  const V *const qpos = vectors(d.qpos), *const qvel = vectors(d.qvel);

  zero(qfrc, m.nv);
  if (m.opt.disableflags & mjDSBL_PASSIVE) return;
  for (int i = 0; i < m.njnt; ++i) {
    const V stiffness = vectors(d.jnt_stiffness)[i];
    int adr = m.jnt_qposadr[i], dof = m.jnt_dofadr[i];
    const bool is_free = m.jnt_type[i] == mjJNT_FREE, is_rotation = is_free || m.jnt_type[i] == mjJNT_BALL;
    if (is_rotation && !any(stiffness != V{})) continue;  // MuJoCo subtracts zeros, which changes nothing
    for (int end = dof + (is_free ? 3 : is_rotation ? 0 : 1); dof < end; ++adr, ++dof)
      qfrc[dof] -= stiffness * (qpos[adr] - vectors(d.qpos_spring)[adr]);
    if (!is_rotation) continue;
    V dif[3];
    subQuat(dif, qpos + adr, vectors(d.qpos_spring) + adr);
    for (int k = 0; k < 3; ++k) qfrc[dof + k] -= stiffness * dif[k];
  }
  for (int i = 0; i < m.nv; ++i) qfrc[i] -= vectors(d.dof_damping)[i] * qvel[i];
  for (int i = 0; i < m.ntendon; ++i) {
    const V force = -vectors(d.tendon_stiffness)[i] * (vectors(d.ten_length)[i] - vectors(d.tendon_lengthspring)[i]) -
                    vectors(d.tendon_damping)[i] * vectors(d.ten_velocity)[i];
    for (int k = d.tendon_dof_adr[i]; k < d.tendon_dof_adr[i + 1]; ++k)
      qfrc[d.tendon_dofs[k]] += vectors(d.ten_J)[i * m.nv + d.tendon_dofs[k]] * force;
  }
  for (int i = 1; i < m.nbody && d.has_fluid; ++i) {
    if (!any(is_heavy(d, i))) continue;
    if (d.has_ellipsoids[i])
      ellipsoidFluidModel(d, i);
    else
      inertiaBoxFluidModel(d, i, qfrc);
  }
}

}  // namespace
}  // namespace mjenv::core::lanes
