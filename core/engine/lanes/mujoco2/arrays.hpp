// The arrays of Lanes, each once. From these lists follow the members of Lanes, their memory, what is copied to a row's
// mjData before somebody reads it there, what is copied from it after somebody has written it, and which numbers of
// mjModel rows may have of their own.
#pragma once

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core::lanes {

// The counts of arrays that lanes have only for some models: of geoms, if fluids act on some of them as on ellipsoids; of
// bodies, if there are sensors; of cameras, if sensors see from them; and 1 for the integrator implicit, 0 for others.
int count_of_fluid_geoms(const mjModel_& m);
int count_of_subtrees(const mjModel_& m);
int count_of_cameras(const mjModel_& m);
int is_implicit(const mjModel_& m);

// Whether lanes need an array of moments. If MuJoCo's functions compute the moments: whether the integrator implicit
// reads them. Otherwise: whether an actuator acts on something other than a slide or a hinge.
bool has_moments(const mjModel_& m);

// Those who read and write the mjData of rows: MuJoCo's functions, row by row, and whoever sees the rows between steps.
enum Party : unsigned {
  kNobody = 0,
  kState = 1 << 0,        // a step reads a row's state, and leaves the new one; callbacks see it before each mj_step
  kCallback = 1 << 1,     // a task's before_substep
  kForces = 1 << 2,       // the same, and rows with forces of their own
  kShown = 1 << 3,        // what callbacks see after a step, except the state, sensors and what is computed on demand
  kWhole = 1 << 4,        // whoever reads any other array after a step
  kSearch = 1 << 5,       // mjenv_collision, if the model lists the pairs of geoms
  kCollision = 1 << 6,    // mj_collision
  kConstraints = 1 << 7,  // mj_makeConstraint, and mj_fwdConstraint in rows without constraints
  kBodyConstraints = 1 << 8,  // mj_makeConstraint, if there are contacts or equalities
  kTendons = 1 << 9,          // mj_makeConstraint
  kSolver = 1 << 10,          // mj_fwdConstraint
  kActuation = 1 << 11,       // mj_tendon, mj_transmission, mj_fwdActuation
  kMoments = 1 << 12,         // mj_transmission
  kPassive = 1 << 13,         // mj_passive
  kCameras = 1 << 14,         // mj_camlight
  kRays = 1 << 15,            // mjenv_ray
  kSensing = 1 << 16,        // mj_sensorPos, mj_sensorVel and mj_sensorAcc, which also read what is shown and the state
  kSensed = 1 << 17,         // whoever reads sensordata after a step
  kBetweenBodies = 1 << 18,  // whoever reads what mj_rnePostConstraint computes
  kFactor = 1 << 19,         // whoever reads the matrix that mj_Euler factorises
};
constexpr int kParties = 20;

// ARRAY(name in mjData, its count in a model m, who writes it there beside lanes, who reads it there)
#define MJENV_LANES_DATA(ARRAY)                                                                         \
  ARRAY(qpos, m.nq, kState, kState | kActuation | kConstraints)                                         \
  ARRAY(qvel, m.nv, kState, kState | kActuation | kSolver)                                              \
  ARRAY(act, m.na, kState, kState | kActuation)                                                         \
  ARRAY(mocap_pos, 3 * m.nmocap, kState, kNobody)                                                       \
  ARRAY(mocap_quat, 4 * m.nmocap, kState, kState)                                                       \
  ARRAY(qacc_warmstart, m.nv, kState | kSolver, kState | kSolver)                                       \
  ARRAY(ctrl, m.nu, kState | kCallback, kNobody)                                                        \
  ARRAY(qfrc_applied, m.nv, kForces, kNobody)                                                           \
  ARRAY(xfrc_applied, 6 * m.nbody, kForces, kNobody)                                                    \
  ARRAY(xpos, 3 * m.nbody, kNobody, kShown | kActuation | kSearch | kBodyConstraints | kCameras)        \
  ARRAY(xquat, 4 * m.nbody, kNobody, kShown | kActuation | kSearch | kBodyConstraints | kCameras)       \
  ARRAY(xmat, 9 * m.nbody, kNobody, kShown | kActuation | kSearch | kBodyConstraints | kCameras)        \
  ARRAY(xipos, 3 * m.nbody, kNobody, kShown | kActuation | kSearch)                                     \
  ARRAY(ximat, 9 * m.nbody, kNobody, kShown | kActuation | kSearch)                                     \
  ARRAY(xanchor, 3 * m.njnt, kNobody, kShown)                                                           \
  ARRAY(xaxis, 3 * m.njnt, kNobody, kShown)                                                             \
  ARRAY(geom_xpos, 3 * m.ngeom, kNobody, kWhole | kActuation | kSearch | kCollision | kSensing | kRays) \
  ARRAY(geom_xmat, 9 * m.ngeom, kNobody, kWhole | kActuation | kSearch | kCollision | kSensing | kRays) \
  ARRAY(site_xpos, 3 * m.nsite, kNobody, kShown | kActuation | kRays)                                   \
  ARRAY(site_xmat, 9 * m.nsite, kNobody, kShown | kActuation | kRays)                                   \
  ARRAY(cam_xpos, 3 * count_of_cameras(m), kCameras, kNobody)                                           \
  ARRAY(cam_xmat, 9 * count_of_cameras(m), kCameras, kNobody)                                           \
  ARRAY(subtree_com, 3 * m.nbody, kNobody, kShown | kActuation | kBodyConstraints | kCameras)           \
  ARRAY(cdof, 6 * m.nv, kNobody, kWhole | kActuation | kBodyConstraints | kSensing)                     \
  ARRAY(cinert, 10 * m.nbody, kNobody, kShown)                                                          \
  ARRAY(ten_length, m.ntendon, kActuation, kShown | kConstraints)                                       \
  ARRAY(ten_J, m.ntendon* m.nv, kActuation, kTendons)                                                   \
  ARRAY(actuator_length, m.nu, kActuation, kShown)                                                      \
  ARRAY(actuator_moment, has_moments(m) ? m.nu* m.nv : 0, kActuation, kMoments)                         \
  ARRAY(crb, 10 * m.nbody, kNobody, kWhole)                                                             \
  ARRAY(qM, m.nM, kNobody, kWhole | kSolver)                                                            \
  ARRAY(qLD, m.nM, kNobody, kWhole | kSolver)                                                           \
  ARRAY(qLDiagInv, m.nv, kNobody, kWhole | kSolver)                                                     \
  ARRAY(qLDiagSqrtInv, m.nv, kNobody, kWhole | kSolver)                                                 \
  ARRAY(ten_velocity, m.ntendon, kActuation, kShown)                                                    \
  ARRAY(actuator_velocity, m.nu, kActuation, kShown)                                                    \
  ARRAY(cvel, 6 * m.nbody, kNobody, kShown | kActuation)                                                \
  ARRAY(cdof_dot, 6 * m.nv, kNobody, kWhole | kSensing)                                                 \
  ARRAY(qfrc_bias, m.nv, kNobody, kShown)                                                               \
  ARRAY(qfrc_passive, m.nv, kPassive, kShown)                                                           \
  ARRAY(actuator_force, m.nu, kActuation, kShown)                                                       \
  ARRAY(qfrc_actuator, m.nv, kActuation, kShown)                                                        \
  ARRAY(act_dot, m.na, kActuation, kWhole)                                                              \
  ARRAY(qfrc_smooth, m.nv, kNobody, kWhole | kSolver)                                                   \
  ARRAY(qacc_smooth, m.nv, kNobody, kWhole | kConstraints)                                              \
  ARRAY(qacc, m.nv, kSolver, kShown)                                                                    \
  ARRAY(qfrc_constraint, m.nv, kSolver, kShown)                                                         \
  ARRAY(qH, m.nM, kNobody, kFactor)                                                                     \
  ARRAY(qHDiagInv, m.nv, kNobody, kFactor)                                                              \
  ARRAY(cacc, 6 * m.nbody, kNobody, kBetweenBodies)                                                     \
  ARRAY(cfrc_int, 6 * m.nbody, kNobody, kBetweenBodies)                                                 \
  ARRAY(cfrc_ext, 6 * m.nbody, kNobody, kBetweenBodies)                                                 \
  ARRAY(sensordata, m.nsensordata, kNobody, kSensed)

// ARRAY(name, count): results that lanes keep for themselves.
// - Angles of hinges with their sines and cosines.
// - What MuJoCo keeps on its stack: cacc and cfrc_body of mj_rne, MhB of mj_Euler, qacc of mj_Euler and mj_implicit, X,
//   F and dX of mj_RungeKutta.
// - For the integrator implicit: qDeriv and qLU in the layout of TreeMatrix (derivative.hpp); the derivatives Dcacc
//   and Dcfrc_body for one dof's velocity, and local_J for one body or geom; `mat` of mjd_rne_vel for each body.
// - For sensors: the velocities of subtrees, with body_vel of mj_subtreeVel.
// - com_scale: for each body 1 / (mass of its subtree), or 0 if that mass is too small.
// - For each body, the factors by which mj_inertiaBoxFluidModel multiplies velocities: for viscosity, one for torque
//   and one for force; for drag, one for each axis. For each geom, the numbers by which mj_ellipsoidFluidModel
//   multiplies.
#define MJENV_LANES_RESULTS(ARRAY)                \
  ARRAY(angle, m.njnt)                            \
  ARRAY(sine, m.njnt)                             \
  ARRAY(cosine, m.njnt)                           \
  ARRAY(rne_cacc, 6 * m.nbody)                    \
  ARRAY(rne_cfrc_body, 6 * m.nbody)               \
  ARRAY(MhB, m.nM)                                \
  ARRAY(qacc_integrated, m.nv)                    \
  ARRAY(X_qpos, m.nq)                             \
  ARRAY(X_qvel, 4 * m.nv)                         \
  ARRAY(F, 4 * m.nv)                              \
  ARRAY(dX, 2 * m.nv)                             \
  ARRAY(X_act, m.na)                              \
  ARRAY(F_act, 4 * m.na)                          \
  ARRAY(qDeriv, is_implicit(m) * m.nM)            \
  ARRAY(qDeriv_above, is_implicit(m) * m.nM)      \
  ARRAY(qLU, is_implicit(m) * m.nM)               \
  ARRAY(qLU_above, is_implicit(m) * m.nM)         \
  ARRAY(Dcacc, is_implicit(m) * 6 * m.nbody)      \
  ARRAY(Dcfrc_body, is_implicit(m) * 6 * m.nbody) \
  ARRAY(Dmomentum, is_implicit(m) * 36 * m.nbody) \
  ARRAY(local_J, is_implicit(m) * 6 * m.nv)       \
  ARRAY(body_vel, 6 * count_of_subtrees(m))       \
  ARRAY(subtree_linvel, 3 * count_of_subtrees(m)) \
  ARRAY(subtree_angmom, 3 * count_of_subtrees(m)) \
  ARRAY(com_scale, m.nbody)                       \
  ARRAY(viscous_torque, m.nbody)                  \
  ARRAY(viscous_force, m.nbody)                   \
  ARRAY(torque_drag, 3 * m.nbody)                 \
  ARRAY(force_drag, 3 * m.nbody)                  \
  ARRAY(ellipsoids, kEllipsoidNumbers* count_of_fluid_geoms(m))

// The numbers that rows may have of their own (Limit).
#define MJENV_LANES_OWN(ARRAY)                                     \
  ARRAY(body_mass, m.nbody, kModerate)                             \
  ARRAY(body_subtreemass, count_of_subtrees(m), kUnlimited)        \
  ARRAY(sensor_cutoff, m.nsensor, kUnlimited)                      \
  ARRAY(body_inertia, 3 * m.nbody, kModerate)                      \
  ARRAY(body_ipos, 3 * m.nbody, kModerate)                         \
  ARRAY(jnt_stiffness, m.njnt, kModerate)                          \
  ARRAY(qpos_spring, m.nq, kModerate)                              \
  ARRAY(dof_armature, m.nv, kModerate)                             \
  ARRAY(dof_damping, m.nv, kUnlimited)                             \
  ARRAY(dof_M0, m.nv, kModerate)                                   \
  ARRAY(tendon_stiffness, m.ntendon, kModerate)                    \
  ARRAY(tendon_damping, m.ntendon, kModerate)                      \
  ARRAY(tendon_lengthspring, m.ntendon, kModerate)                 \
  ARRAY(tendon_length0, m.ntendon, kUnlimited)                     \
  ARRAY(tendon_range, 2 * m.ntendon, kUnlimited)                   \
  ARRAY(tendon_margin, m.ntendon, kUnlimited)                      \
  ARRAY(eq_data, mjNEQDATA* m.neq, kUnlimited)                     \
  ARRAY(actuator_gainprm, mjNGAIN* m.nu, kModerate)                \
  ARRAY(actuator_biasprm, mjNBIAS* m.nu, kModerate)                \
  ARRAY(actuator_dynprm, mjNDYN* m.nu, kUnlimited)                 \
  ARRAY(actuator_gear, 6 * m.nu, kModerate)                        \
  ARRAY(actuator_ctrlrange, 2 * m.nu, kModerate)                   \
  ARRAY(actuator_forcerange, 2 * m.nu, kUnlimited)                 \
  ARRAY(actuator_actrange, 2 * m.nu, kUnlimited)                   \
  ARRAY(actuator_lengthrange, 2 * m.nu, kUnlimited)                \
  ARRAY(actuator_acc0, m.nu, kUnlimited)                           \
  ARRAY(jnt_range, 2 * m.njnt, kUnlimited)                         \
  ARRAY(jnt_margin, m.njnt, kUnlimited)                            \
  ARRAY(cam_quat, 4 * count_of_cameras(m), kUnlimited)             \
  ARRAY(wrap_prm, m.nwrap, kModerate)                              \
  ARRAY(geom_size, 3 * m.ngeom, kUnlimited)                        \
  ARRAY(geom_fluid, mjNFLUID* count_of_fluid_geoms(m), kUnlimited) \
  ARRAY(site_size, m.nsensor > 0 ? 3 * m.nsite : 0, kUnlimited)

// The same, of mjOption.
#define MJENV_LANES_OWN_OPTIONS(ARRAY) \
  ARRAY(timestep, 1, kModerate)        \
  ARRAY(gravity, 3, kModerate)         \
  ARRAY(wind, 3, kModerate)            \
  ARRAY(magnetic, 3, kUnlimited)       \
  ARRAY(density, 1, kModerate)         \
  ARRAY(viscosity, 1, kModerate)

// Flags of mjModel, which lanes hold as the numbers 0 and 1.
#define MJENV_LANES_OWN_FLAGS(ARRAY)            \
  ARRAY(actuator_ctrllimited, m.nu, kUnlimited) \
  ARRAY(actuator_forcelimited, m.nu, kUnlimited)

}  // namespace mjenv::core::lanes
