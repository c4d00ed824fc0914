// The arrays of Lanes, each once, as in mujoco2/arrays.hpp.
#pragma once

namespace mjenv::core::lanes {

// Those who read and write the mjData of rows: MuJoCo's functions, row by row, and whoever sees the rows between steps.
enum Party : unsigned {
  kNobody = 0,
  kState = 1 << 0,          // a step reads a row's state, and leaves the new one; callbacks see it before each mj_step
  kCallback = 1 << 1,       // a task's before_substep
  kForces = 1 << 2,         // the same, and rows with forces of their own
  kShown = 1 << 3,          // what callbacks see after a step, except the state, sensors and what is computed on demand
  kWhole = 1 << 4,          // whoever reads any other array after a step
  kBetweenBodies = 1 << 5,  // the same: what mj_rnePostConstraint computes
  kPlaces = 1 << 6,         // mj_kinematics and mj_comPos
  kInertia = 1 << 7,        // mj_makeM and mj_factorM
  kVelocities = 1 << 8,     // mj_comVel and mj_rne
  kMiddle = 1 << 9,         // mj_tendon and mj_camlight
  kAcceleration = 1 << 10,  // mj_fwdAcceleration
  kConstraints = 1 << 11,   // mj_fwdConstraint
  kIntegration = 1 << 12,   // the integrator
  kFactor = 1 << 13,        // whoever reads the matrix that mj_Euler factorises
  kSolved = 1 << 14,        // whoever reads mjData after an evaluation, such as sensors
  kActuation = 1 << 15,     // mj_transmission and mj_fwdActuation, which come after kMiddle and read what it reads, too
  kPassive = 1 << 16,       // mj_passive, which does the same
  kContacts = 1 << 17,      // mj_collision, mj_makeConstraint and mj_referenceConstraint, which do the same
  kMaking = 1 << 18,        // mj_makeConstraint, for limits and contacts
  kSensed = 1 << 19,        // whoever reads sensordata after a step
  kCameras = 1 << 20,       // mj_camlight
};
constexpr int kParties = 21;

// ARRAY(name in mjData, its count in a model m, who writes it there beside lanes, who reads it there)
#define MJENV_LANES_DATA(ARRAY)                                                               \
  ARRAY(qpos, m.nq, kState | kIntegration, kState | kPlaces | kMiddle | kActuation | kMaking) \
  ARRAY(qvel, m.nv, kState | kIntegration, kState | kVelocities | kMiddle | kMaking)          \
  ARRAY(act, m.na, kState | kIntegration, kState)                                             \
  ARRAY(mocap_pos, 3 * m.nmocap, kState, kNobody)                                             \
  ARRAY(mocap_quat, 4 * m.nmocap, kState, kNobody)                                            \
  ARRAY(qacc_warmstart, m.nv, kState | kIntegration, kState | kConstraints)                   \
  ARRAY(ctrl, m.nu, kState | kCallback, kNobody)                                              \
  ARRAY(qfrc_applied, m.nv, kForces, kNobody)                                                 \
  ARRAY(xfrc_applied, 6 * m.nbody, kForces, kNobody)                                          \
  ARRAY(xpos, 3 * m.nbody, kPlaces, kMiddle | kShown)                                         \
  ARRAY(xquat, 4 * m.nbody, kPlaces, kMiddle | kShown)                                        \
  ARRAY(xmat, 9 * m.nbody, kPlaces, kMiddle | kShown)                                         \
  ARRAY(xipos, 3 * m.nbody, kPlaces, kMiddle | kShown)                                        \
  ARRAY(xiquat, 4 * m.nbody, kPlaces, kSolved | kShown)                                       \
  ARRAY(ximat, 9 * m.nbody, kPlaces, kMiddle | kShown)                                        \
  ARRAY(xanchor, 3 * m.njnt, kPlaces, kMiddle | kShown)                                       \
  ARRAY(xaxis, 3 * m.njnt, kPlaces, kMiddle | kShown)                                         \
  ARRAY(geom_xpos, 3 * m.ngeom, kPlaces, kMiddle)                                             \
  ARRAY(geom_xquat, 4 * m.ngeom, kPlaces, kMiddle)                                            \
  ARRAY(geom_xmat, 9 * m.ngeom, kPlaces, kMiddle)                                             \
  ARRAY(site_xpos, 3 * m.nsite, kPlaces, kMiddle | kShown)                                    \
  ARRAY(site_xquat, 4 * m.nsite, kPlaces, kMiddle)                                            \
  ARRAY(site_xmat, 9 * m.nsite, kPlaces, kMiddle | kShown)                                    \
  ARRAY(subtree_com, 3 * m.nbody, kPlaces, kMiddle | kShown | kMaking)                        \
  ARRAY(cdof, 6 * m.nv, kPlaces, kMiddle | kMaking)                                           \
  ARRAY(ten_length, m.ntendon, kMiddle, kMiddle | kShown | kMaking)                           \
  ARRAY(ten_J, m.nJten, kMiddle, kMiddle | kMaking)                                           \
  ARRAY(ten_velocity, m.ntendon, kMiddle, kMiddle | kShown)                                   \
  ARRAY(cinert, 10 * m.nbody, kPlaces, kSolved | kShown)                                      \
  ARRAY(crb, 10 * m.nbody, kInertia, kSolved)                                                 \
  ARRAY(M, m.nC, kInertia, kConstraints | kSolved)                                            \
  ARRAY(qLD, m.nC, kInertia, kConstraints | kSolved)                                          \
  ARRAY(qLDiagInv, m.nv, kInertia, kConstraints | kSolved)                                    \
  ARRAY(cvel, 6 * m.nbody, kVelocities, kMiddle | kShown)                                     \
  ARRAY(cdof_dot, 6 * m.nv, kVelocities, kContacts | kConstraints | kSolved)                  \
  ARRAY(qfrc_bias, m.nv, kVelocities, kSolved | kShown)                                       \
  ARRAY(qfrc_spring, m.nv, kPassive, kSolved)                                                 \
  ARRAY(qfrc_damper, m.nv, kPassive, kSolved)                                                 \
  ARRAY(qfrc_fluid, m.nv, kPassive, kSolved)                                                  \
  ARRAY(qfrc_gravcomp, m.nv, kPassive, kSolved)                                               \
  ARRAY(qfrc_passive, m.nv, kPassive, kSolved | kShown)                                       \
  ARRAY(actuator_length, m.nout, kActuation, kShown)                                          \
  ARRAY(actuator_velocity, m.nout, kActuation, kSolved | kShown)                              \
  ARRAY(actuator_force, m.nout, kActuation, kSolved | kShown)                                 \
  ARRAY(qfrc_actuator, m.nv, kActuation, kSolved | kShown)                                    \
  ARRAY(qfrc_smooth, m.nv, kAcceleration, kConstraints | kSolved)                             \
  ARRAY(qacc_smooth, m.nv, kAcceleration, kConstraints | kSolved)                             \
  ARRAY(qacc, m.nv, kConstraints, kSolved | kShown)                                           \
  ARRAY(qfrc_constraint, m.nv, kConstraints, kSolved | kShown)                                \
  ARRAY(qH, m.nC, kNobody, kFactor)                                                           \
  ARRAY(qHDiagInv, m.nv, kNobody, kFactor)                                                    \
  ARRAY(cam_xpos, 3 * m.ncam, kCameras, kNobody)                                              \
  ARRAY(cam_xmat, 9 * m.ncam, kCameras, kNobody)                                              \
  ARRAY(sensordata, m.nsensordata, kNobody, kSensed)

// ARRAY(name, count): results that lanes keep for themselves: angles of hinges with their sines and cosines; what MuJoCo
// keeps on its stack, cacc and cfrc_body of mj_rne, qacc of mj_Euler, X, F and dX of mj_RungeKutta; for sensors,
// accelerations of bodies and velocities of subtrees; and for each body
// 1 / (mass of its subtree), or 0 if that mass is too small, and the factors by which
// mj_inertiaBoxFluidModel multiplies velocities: for viscosity, one for torque and one for force; for drag, one for each
// axis.
#define MJENV_LANES_RESULTS(ARRAY)   \
  ARRAY(angle, m.njnt)               \
  ARRAY(sine, m.njnt)                \
  ARRAY(cosine, m.njnt)              \
  ARRAY(rne_cacc, 6 * m.nbody)       \
  ARRAY(rne_cfrc_body, 6 * m.nbody)  \
  ARRAY(qacc_integrated, m.nv)       \
  ARRAY(X_qpos, m.nq)                \
  ARRAY(X_qvel, 4 * m.nv)            \
  ARRAY(F, 4 * m.nv)                 \
  ARRAY(dX, 2 * m.nv)                \
  ARRAY(cacc, 6 * m.nbody)           \
  ARRAY(body_vel, 6 * m.nbody)       \
  ARRAY(subtree_linvel, 3 * m.nbody) \
  ARRAY(subtree_angmom, 3 * m.nbody) \
  ARRAY(com_scale, m.nbody)          \
  ARRAY(viscous_torque, m.nbody)     \
  ARRAY(viscous_force, m.nbody)      \
  ARRAY(torque_drag, 3 * m.nbody)    \
  ARRAY(force_drag, 3 * m.nbody)

// The numbers that rows may have of their own (Limit).
#define MJENV_LANES_OWN(ARRAY)                             \
  ARRAY(body_mass, m.nbody, kModerate)                     \
  ARRAY(body_subtreemass, m.nbody, kModerate)              \
  ARRAY(body_inertia, 3 * m.nbody, kModerate)              \
  ARRAY(body_ipos, 3 * m.nbody, kModerate)                 \
  ARRAY(jnt_stiffness, m.njnt, kModerate)                  \
  ARRAY(jnt_actfrcrange, 2 * m.njnt, kUnlimited)           \
  ARRAY(jnt_range, 2 * m.njnt, kUnlimited)                 \
  ARRAY(jnt_margin, m.njnt, kUnlimited)                    \
  ARRAY(tendon_range, 2 * m.ntendon, kUnlimited)           \
  ARRAY(tendon_margin, m.ntendon, kUnlimited)              \
  ARRAY(tendon_stiffness, m.ntendon, kUnlimited)           \
  ARRAY(tendon_damping, m.ntendon, kUnlimited)             \
  ARRAY(tendon_lengthspring, 2 * m.ntendon, kUnlimited)    \
  ARRAY(wrap_prm, m.nwrap, kModerate)                      \
  ARRAY(tendon_length0, m.ntendon, kUnlimited)             \
  ARRAY(eq_data, mjNEQDATA* m.neq, kUnlimited)             \
  ARRAY(qpos_spring, m.nq, kModerate)                      \
  ARRAY(dof_armature, m.nv, kModerate)                     \
  ARRAY(dof_damping, m.nv, kUnlimited)                     \
  ARRAY(dof_M0, m.nv, kModerate)                           \
  ARRAY(sensor_cutoff, m.nsensor, kUnlimited)              \
  ARRAY(cam_quat, 4 * m.ncam, kUnlimited)                  \
  ARRAY(actuator_gainprm, mjNGAIN* m.nactuator, kModerate) \
  ARRAY(actuator_biasprm, mjNBIAS* m.nactuator, kModerate) \
  ARRAY(actuator_gear, 6 * m.nout, kModerate)              \
  ARRAY(actuator_ctrlrange, 2 * m.nu, kModerate)           \
  ARRAY(actuator_forcerange, 2 * m.nactuator, kUnlimited)

// The same, of mjOption.
#define MJENV_LANES_OWN_OPTIONS(ARRAY) \
  ARRAY(timestep, 1, kModerate)        \
  ARRAY(gravity, 3, kModerate)         \
  ARRAY(magnetic, 3, kUnlimited)       \
  ARRAY(wind, 3, kModerate)            \
  ARRAY(density, 1, kModerate)         \
  ARRAY(viscosity, 1, kModerate)

// Flags of mjModel, which lanes hold as the numbers 0 and 1.
#define MJENV_LANES_OWN_FLAGS(ARRAY)            \
  ARRAY(actuator_ctrllimited, m.nu, kUnlimited) \
  ARRAY(actuator_forcelimited, m.nactuator, kUnlimited)

}  // namespace mjenv::core::lanes
