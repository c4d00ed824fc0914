// What the lane code for MuJoCo 4.0 computes with: the arrays of several rows side by side, and its functions.
#pragma once

#include <mujoco/mjmodel.h>

#include <cmath>

#include "engine/lanes/frame/constraints.hpp"
#include "engine/lanes/frame/lanes_base.hpp"
#include "engine/lanes/frame/width.hpp"
#include "engine/lanes/mujoco4/arrays.hpp"

namespace mjenv::core::lanes {

// Whether MuJoCo divides the tangential part of a contact with an elliptic cone by its length before it multiplies.
constexpr bool kDividesFirst = true;
// Whether MuJoCo takes the rotational weights of bodies, and the scaled rotation, for the rotations of a weld.
constexpr bool kWeighsTurns = true;
// Whether mju_cholFactor sets the rest of a column to 0 whose diagonal is too small, as in most contacts with such cones.
constexpr bool kClearsLostColumns = true;

// How MuJoCo computes the powers of impedances.
static inline double power(double a, double b) { return b == 1 ? a : b == 2 ? a * a : std::pow(a, b); }

// The numbers of several rows side by side. Each array has the name of the array of mjData or mjModel that it holds.
// Number i of lane l is at [i * width + l].
struct Lanes : LanesBase {
#define MJENV_ARRAY(name, ...) double* name;
  MJENV_LANES_DATA(MJENV_ARRAY)
  MJENV_LANES_RESULTS(MJENV_ARRAY)
  MJENV_LANES_OWN(MJENV_ARRAY)
  MJENV_LANES_OWN_OPTIONS(MJENV_ARRAY)
  MJENV_LANES_OWN_FLAGS(MJENV_ARRAY)
  MJENV_LANES_OWN_FRAMES(MJENV_ARRAY)  // filled only if has_own_frames
#undef MJENV_ARRAY
  const int* columns;  // lists of dofs; first_column of a ContactPair is the index at which its list begins
  const double *pair_margin, *pair_gap;  // of Contacts::pairs
  bool has_negative_zeros;               // a jnt_axis or jnt_pos, which quaternions rotate, contains -0
  bool has_fluid;                        // a row has a fluid
  bool has_wind;                         // a row has wind
  unsigned damped;  // the lanes, as bits, in which mj_Euler integrates the damping of a dof implicitly
};

// The constraints of a row, as PGS solves them.
struct DualRow {
  static constexpr int kMost = 200;  // constraints
  static constexpr int kMostIterations = 100;
  static constexpr int kBehind = 3;  // how many numbers there is room for behind AR
  const mjModel* model;
  int size;                    // how many constraints there are
  const unsigned char* order;  // for each iteration, the constraints in the order in which it visits them
  double scale;                // by what MuJoCo multiplies improvements before it compares them with the tolerance
  int iterations, since_restart;
  bool has_ended;
  double improvement;
  double *AR, *b, *force;                   // efc_AR [size][size], efc_b and efc_force
  double inverse[kMost], A[kMost];          // inverse: 1 / the diagonal of AR; A: 1 / inverse
  double previous[kMost], momentum[kMost];  // the forces before and after an extrapolation
};

// Lists the functions of an instruction set: result, name and parameters. Those that repeat a function of MuJoCo 4.0
// are named after it.
#define MJENV_LANES_FUNCTIONS(FUNCTION)                                                                      \
  /* Call this when numbers of mjModel have changed. Computes what depends on them alone. */                 \
  FUNCTION(void, adopt, (Lanes&))                                                                            \
  FUNCTION(void, kinematics, (Lanes&))                                                                       \
  FUNCTION(void, comPos, (Lanes&))                                                                           \
  FUNCTION(void, crb, (Lanes&))                                                                              \
  FUNCTION(void, factorM, (Lanes&))                                                                          \
  FUNCTION(void, comVel, (Lanes&))                                                                           \
  FUNCTION(void, rne, (Lanes&))                                                                              \
  FUNCTION(void, tendon, (Lanes&))                                                                           \
  /* These return false if a row meets a case that is left to MuJoCo's functions. */                         \
  FUNCTION(bool, instantiateLimit, (const Lanes&, Contacts&))                                                \
  FUNCTION(bool, collision, (const Lanes&, Contacts&))                                                       \
  FUNCTION(void, makeConstraint, (Lanes&, const Contacts&, Constraints&))                                    \
  FUNCTION(void, transmission, (Lanes&))                                                                     \
  FUNCTION(void, fwdActuation, (Lanes&))                                                                     \
  FUNCTION(void, passive, (Lanes&))                                                                          \
  FUNCTION(void, fwdAcceleration, (Lanes&))                                                                  \
  /* mj_referenceConstraint, and the choice of the acceleration with which a solver begins */                \
  FUNCTION(void, warmstart, (Lanes&, Constraints&))                                                          \
  /* Takes the constraints of an island, with aref and the acceleration that warmstart has found. */         \
  FUNCTION(void, begin_island, (Lanes&, Constraints&))                                                       \
  /* Call one of these two first. Computes qacc and qfrc_constraint. */                                      \
  FUNCTION(void, solNewton, (Lanes&, Constraints&))                                                          \
  /* mj_projectConstraint, mj_referenceConstraint and the forces of the last step: AR, b and force of the */ \
  /* lanes' rows. Then their forces, and in the end qacc and qfrc_constraint. */                             \
  FUNCTION(void, projectConstraint, (Lanes&, Constraints&, DualRow * rows))                                  \
  FUNCTION(void, solPGS, (DualRow*, int count))                                                              \
  FUNCTION(void, dualFinish, (Lanes&, Constraints&))                                                         \
  /* The sensors of accelerations, or those of positions and velocities */                                   \
  FUNCTION(void, sensors, (Lanes&, bool are_of_accelerations))                                               \
  FUNCTION(void, Euler, (Lanes&))                                                                            \
  FUNCTION(void, implicitfast, (Lanes&))                                                                     \
  /* Stages 1 to 3 set qpos and qvel to where the derivatives are evaluated next. Stage 4 ends the step. */  \
  FUNCTION(void, RungeKutta, (Lanes&, int stage))

}  // namespace mjenv::core::lanes

#include "engine/lanes/frame/code.hpp"
