// What the lane code computes with: the arrays of several rows side by side, and the functions of one instruction set.
#pragma once

#include <mujoco/mjmodel.h>

#include <cmath>
#include <vector>

#include "engine/lanes/frame/constraints.hpp"
#include "engine/lanes/frame/lanes_base.hpp"
#include "engine/lanes/frame/width.hpp"
#include "engine/lanes/mujoco2/arrays.hpp"

namespace mjenv::core::lanes {

// How MuJoCo computes the powers of impedances.
static inline double power(double a, double b) { return std::pow(a, b); }

constexpr int kEllipsoidNumbers = 21;  // the members of Ellipsoid in passive.hpp

// Numbers that follow from the margins, gaps and bounding spheres of two geoms. limit: if the square of the distance
// between the centres is greater, MuJoCo looks for no contacts, because the bounding spheres do not touch; if the first
// geom is a plane, limit is compared with the distance from the plane to the other's centre. reach: the distance of the
// centres at which the spheres, with their margin, touch.
struct PairNumbers {
  double limit, margin, includemargin, reach;
};

// Two geoms that can collide.
struct GeomPair {
  int geom1, geom2;
  bool has_plane;
  int box_pair;  // the index in Lanes::box_pairs; -1 if their bounding boxes are not compared
  PairNumbers numbers;
};

// A box with rounded edges that contains a geom, in the geom's frame. half: its half sizes without the radius of the
// edges. round: this radius.
struct GeomBox {
  double middle[3], half[3], round;
};

// Two geoms whose GeomBoxes are compared. They do not touch if
//     gap > limit + kRounding * coordinates + kCollinear / distance
// gap: between the boxes without their round edges. limit: the radii and the margin. coordinates: their sizes, for
// rounding errors. distance: between the geoms' centres, because MuJoCo's search for contacts of convex shapes treats a
// product of two lengths as zero if it is below 1.5e-8.
struct BoxPair {
  static constexpr double kRounding = 1e-12, kCollinear = 1e-7;
  double limit;
  bool is_ground;  // the first geom is a height field
};

// A part of a tendon between two sites. divisor: that of the last pulley before this part.
struct Segment {
  int site1, site2;
  double divisor;
  int geom, side;  // the geom around which it may wrap, and the site beside the geom; -1 if there is none
};

// What an actuator acts on. From first_column on, Lanes::columns lists the dofs at which its moment may differ from 0.
struct Actuator {
  enum class Transmission { dof, ball, free, tendon, site } transmission;
  int object;  // joint, tendon or site
  int dof;     // the first dof of the joint
  int first_column, count;
};

// Whether MuJoCo divides the tangential part of a contact with an elliptic cone by its length before it multiplies.
constexpr bool kDividesFirst = false;
// Whether MuJoCo takes the rotational weights of bodies, and the scaled rotation, for the rotations of a weld.
constexpr bool kWeighsTurns = false;
// Whether mju_cholFactor sets the rest of a column to 0 whose diagonal is too small, as in most contacts with such cones.
constexpr bool kClearsLostColumns = false;

// The numbers of several rows side by side. Each array has the name of the array of mjData that it holds. Number i of
// lane l is at [i * width + l]. One block of memory holds the arrays pair_..., another one all others.
struct Lanes : LanesBase {
#define MJENV_ARRAY(name, ...) double* name;
  MJENV_LANES_DATA(MJENV_ARRAY)
  MJENV_LANES_RESULTS(MJENV_ARRAY)
  MJENV_LANES_OWN(MJENV_ARRAY)
  MJENV_LANES_OWN_OPTIONS(MJENV_ARRAY)
  MJENV_LANES_OWN_FLAGS(MJENV_ARRAY)
  MJENV_LANES_OWN_FRAMES(MJENV_ARRAY)  // filled only if has_own_frames
#undef MJENV_ARRAY
  // PairNumbers of each pair, filled only if has_own_pairs.
  double *pair_limit, *pair_margin, *pair_includemargin, *pair_reach;
  bool has_own_pairs;
  bool has_own_sizes;  // sizes or margins of geoms differ from those with which `boxes` and box_pairs were computed
  bool has_fluid;      // a model has a fluid
  bool has_wind;       // a model has wind
  bool has_negative_zeros;  // a jnt_axis or jnt_pos, which quaternions rotate, contains -0
  unsigned damped;          // the lanes, as bits, in which a dof has damping

  // The members from here to `boxes` depend on the shared model alone, except pair_rows. The dofs at which the Jacobian
  // of tendon t may differ from 0 are tendon_dofs[tendon_dof_adr[t]] to tendon_dofs[tendon_dof_adr[t + 1] - 1].
  const int *tendon_dof_adr, *tendon_dofs;
  const int* columns;  // lists of dofs; first_column of a pair or an actuator is the index at which its list begins
  const Segment* segments;  // of tendon t: segments[segment_adr[t]] to segments[segment_adr[t + 1] - 1]
  const int* segment_adr;   // a tendon along joints has none
  // Only for the integrator implicit. In the layout of qM: ancestors[ancestor_adr[i]] is dof i, the next its parent,
  // and so on. From moved_adr[b] on, moved_bodies has the subtree of body b: b and its descendants, in ascending order.
  // ancestor_adr and moved_adr have one more element, for the end.
  const int *ancestor_adr, *ancestors, *moved_adr, *moved_bodies;
  const Actuator* actuators;
  bool has_moments;                      // there is an array of actuator_moment
  const unsigned char* has_ellipsoids;   // for each body: fluids act on its geoms as on ellipsoids
  bool needs_fluids;                     // for passive forces, or for the derivatives of mj_implicit
  bool has_single_actuation;             // MuJoCo's functions compute tendons and actuators row by row
  const unsigned char* is_still_tendon;  // for each tendon: its Jacobian is always 0
  int pair_count;
  const GeomPair* pairs;
  // For each pair, the lanes, as bits, in which contype and conaffinity let the geoms touch. Null: all lanes.
  const unsigned char* pair_rows;
  const BoxPair* box_pairs;
  const GeomBox* boxes;         // for each geom, if there are box_pairs
  const float* const* heights;  // for each lane: its row's hfield_data. Null: all rows have the model's

  unsigned char* may_touch;  // for each pair, the lanes in which the geoms may touch, as bits
};

// Lists the functions of an instruction set: result, name and parameters. Those that repeat a function of MuJoCo 2.2.2
// are named after it.
#define MJENV_LANES_FUNCTIONS(FUNCTION)                                                                              \
  /* Call this when numbers of mjModel have changed. Computes what depends on them alone. */                         \
  FUNCTION(void, adopt, (Lanes&))                                                                                    \
  FUNCTION(void, kinematics, (Lanes&))                                                                               \
  FUNCTION(void, comPos, (Lanes&))                                                                                   \
  FUNCTION(void, tendon, (Lanes&))                                                                                   \
  FUNCTION(void, crb, (Lanes&))                                                                                      \
  FUNCTION(void, factorM, (Lanes&))                                                                                  \
  FUNCTION(void, transmission, (Lanes&))                                                                             \
  FUNCTION(void, reject, (Lanes&))                                                                                   \
  FUNCTION(void, fwdVelocity, (Lanes&))                                                                              \
  FUNCTION(void, comVel, (Lanes&))                                                                                   \
  FUNCTION(void, passive, (Lanes&))                                                                                  \
  FUNCTION(void, rne, (Lanes&))                                                                                      \
  FUNCTION(void, fwdActuation, (Lanes&))                                                                             \
  /* What mj_Euler and mj_implicit (stage 0) and the stages of mj_RungeKutta do with the states of actuators. */     \
  FUNCTION(void, advanceActivations, (Lanes&, int stage))                                                            \
  FUNCTION(void, fwdAcceleration, (Lanes&))                                                                          \
  FUNCTION(void, Euler, (Lanes&))                                                                                    \
  FUNCTION(void, implicit, (Lanes&))                                                                                 \
  /* Stages 1 to 3 set qpos and qvel to where the derivatives are evaluated next. Stage 4 ends the step. */          \
  FUNCTION(void, RungeKutta, (Lanes&, int stage))                                                                    \
  /* These return false if a row meets a case that is left to MuJoCo's functions. */                                 \
  FUNCTION(bool, instantiateLimit, (const Lanes&, Contacts&))                                                        \
  FUNCTION(bool, collision, (const Lanes&, Contacts&))                                                               \
  FUNCTION(void, makeConstraint, (Lanes&, const Contacts&, Constraints&))                                            \
  /* Compute qacc and qfrc_constraint from constraints that have been made. */                                       \
  FUNCTION(void, solNewton, (Lanes&, Constraints&))                                                                  \
  FUNCTION(void, solCG, (Lanes&, Constraints&))                                                                      \
  FUNCTION(void, solPGS, (Lanes&, Constraints&))                                                                     \
  /* Call this after one of them, which must have computed the forces and b. has_AR: it has also computed AR. */     \
  FUNCTION(void, solNoSlip, (Lanes&, Constraints&, bool has_AR))                                                     \
  /* mj_sensorPos, mj_sensorVel and mj_sensorAcc, except for the sensors that sense_singly computes. Only sensors */ \
  /* of forces, torques, touch and limits read the contacts and constraints, which a solver must have solved. */     \
  FUNCTION(void, sensors, (Lanes&, const Contacts&, const Constraints&))                                             \
  FUNCTION(void, rnePostConstraint, (Lanes&, const Contacts&, const Constraints&))

}  // namespace mjenv::core::lanes

#include "engine/lanes/frame/code.hpp"
