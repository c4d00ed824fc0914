// What the lane code for MuJoCo 4.0 computes with: the arrays of several rows side by side, and its functions.
#pragma once

#include <mujoco/mjmodel.h>

#include "engine/lanes/frame/constraints.hpp"
#include "engine/lanes/frame/lanes_base.hpp"
#include "engine/lanes/frame/width.hpp"
#include "engine/lanes/mujoco4/arrays.hpp"

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjData_;

namespace mjenv::core::lanes {

// Whether MuJoCo divides the tangential part of a contact with an elliptic cone by its length before it multiplies.
constexpr bool kDividesFirst = true;

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
  bool has_negative_zeros;  // a jnt_axis or jnt_pos, which quaternions rotate, contains -0
  bool has_fluid;           // a row has a fluid
  bool has_wind;            // a row has wind
  unsigned damped;          // the lanes, as bits, in which mj_Euler integrates the damping of a dof implicitly
};

// The constraints of a row, which PGS solves in the row's mjData.
struct DualRow {
  static constexpr int kMost = 200;  // constraints
  static constexpr int kMostIterations = 100;
  const mjModel* model;
  mjData_* data;
  const unsigned char* order;  // for each iteration, the constraints in the order in which it visits them
  double scale;                // by what MuJoCo multiplies improvements before it compares them with the tolerance
  int iterations, since_restart;
  bool has_ended;
  double improvement, inverse[kMost], A[kMost];  // inverse: 1 / the diagonal of AR; A: 1 / inverse
  double previous[kMost], momentum[kMost];       // the forces before and after an extrapolation
};

// The contacts of several rows, in the order in which MuJoCo finds them.
struct Contacts {
  static constexpr int kCapacity = 64;
  unsigned rows;  // the lanes, as bits, that take part
  int count;
  struct {
    int pair;       // in mjModel's list
    unsigned rows;  // the lanes, as bits, that have the contact
  } list[kCapacity];
  // For each contact, in the layout of Lanes: dist, pos [3] and frame [9].
  alignas(64) double dist[kCapacity * kMaxWidth], pos[3 * kCapacity * kMaxWidth], frame[9 * kCapacity * kMaxWidth];
};

// Lists the functions of an instruction set: result, name and parameters. Those that repeat a function of MuJoCo 4.0
// are named after it.
#define MJENV_LANES_FUNCTIONS(FUNCTION)                                                                     \
  /* Call this when numbers of mjModel have changed. Computes what depends on them alone. */                \
  FUNCTION(void, adopt, (Lanes&))                                                                           \
  FUNCTION(void, kinematics, (Lanes&))                                                                      \
  FUNCTION(void, comPos, (Lanes&))                                                                          \
  FUNCTION(void, crb, (Lanes&))                                                                             \
  FUNCTION(void, factorM, (Lanes&))                                                                         \
  FUNCTION(void, comVel, (Lanes&))                                                                          \
  FUNCTION(void, rne, (Lanes&))                                                                             \
  /* Returns false if a row meets a case that is left to MuJoCo's function. */                              \
  FUNCTION(bool, collision, (const Lanes&, Contacts&))                                                      \
  FUNCTION(void, transmission, (Lanes&))                                                                    \
  FUNCTION(void, fwdActuation, (Lanes&))                                                                    \
  FUNCTION(void, passive, (Lanes&))                                                                         \
  FUNCTION(void, fwdAcceleration, (Lanes&))                                                                 \
  /* mj_referenceConstraint, and the choice of the acceleration with which a solver begins */               \
  FUNCTION(void, warmstart, (Lanes&, Constraints&))                                                         \
  /* Takes the constraints of an island, with aref and the acceleration that warmstart has found. */        \
  FUNCTION(void, begin_island, (Lanes&, Constraints&))                                                      \
  /* Call one of these two first. Computes qacc and qfrc_constraint. */                                     \
  FUNCTION(void, solNewton, (Lanes&, Constraints&))                                                         \
  FUNCTION(void, solPGS, (DualRow*, int count))                                                             \
  FUNCTION(void, dualFinish, (Lanes&))                                                                      \
  /* The sensors of accelerations, or those of positions and velocities */                                  \
  FUNCTION(void, sensors, (Lanes&, bool are_of_accelerations))                                              \
  FUNCTION(void, Euler, (Lanes&))                                                                           \
  FUNCTION(void, implicitfast, (Lanes&))                                                                    \
  /* Stages 1 to 3 set qpos and qvel to where the derivatives are evaluated next. Stage 4 ends the step. */ \
  FUNCTION(void, RungeKutta, (Lanes&, int stage))

}  // namespace mjenv::core::lanes

#include "engine/lanes/frame/code.hpp"
