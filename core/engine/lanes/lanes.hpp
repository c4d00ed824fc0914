// What the lane code computes with: the arrays of several rows side by side, and the functions of one instruction set.
#pragma once

#include <mujoco/mjmodel.h>

#include <vector>

namespace mjenv::core::lanes {

constexpr int kMaxWidth = 8;

// Two geoms of which MuJoCo first compares the distance of their bounding spheres, or of a plane and a bounding sphere.
// They are apart if the square of the distance, or the distance from the plane, is greater than the limit.
struct GeomPair {
  int geom1, geom2;
  bool has_plane;
  int boxes;  // the number of their BoxPair, -1 if their bounding boxes are not compared
  double limit;
};

// A box with rounded edges that contains a geom, in the geom's frame: its middle, its half sizes without the radius of the
// edges, and this radius.
struct GeomBox {
  double middle[3], half[3], round;
};

// Geoms are apart if their boxes without the radii are farther from each other than the limit, the part of it that grows
// with the coordinates (kRounding), and kCollinear / (distance of the geoms' centres). For MuJoCo's search for contacts of
// convex shapes takes a product of two lengths for zero if it is less than 1.5e-8.
struct BoxPair {
  static constexpr double kRounding = 1e-12, kCollinear = 1e-7;
  double limit;
  bool is_ground;  // the first geom is a height field
};

// Two geoms whose contacts lanes compute.
enum class Shapes {
  others,
  plane_sphere,
  plane_capsule,
  plane_ellipsoid,
  plane_cylinder,
  plane_box,
  sphere_sphere,
  sphere_capsule,
  sphere_box,
  capsule_capsule
};

struct ContactPair {
  int geom1, geom2;
  Shapes shapes;  // others: MuJoCo's function computes these contacts row by row
  int dim;        // condim: 1, 3, 4 or 6
  int root1, root2;
  // In Lanes::columns: the dofs that move only the first body, then those that move only the second. Dofs that move
  // both have a Jacobian of 0.
  int first_column, count1, count2;
  double margin, includemargin;
  // Whether neither body is the world. Then MuJoCo's search may miss a contact of the pair: it excludes bodies by float32
  // computations, which can be wrong only where the bounding spheres overlap by less than about 1e-7 of the size of the
  // numbers. reach: the distance at which the spheres, with their margin, touch.
  bool is_between_bodies;
  double reach;
};

// Two bodies. In Lanes::columns: the dofs that move only body 1, those that move only body 2, and those that move both.
struct BodyPair {
  int body1, body2;
  int first_column, count1, count2, count_both;
};

// An equality constraint between bodies, joints or tendons.
struct Equality {
  int id, type;
  int size;              // how many constraints it makes
  int object1, object2;  // object2 is -1 if a joint or tendon has no partner
  BodyPair bodies;       // object2 and object1, in the order in which MuJoCo subtracts their Jacobians
};

// A part of a tendon, between two sites. divisor: of the last pulley before it.
struct Segment {
  int site1, site2;
  double divisor;
  BodyPair bodies;
};

// What an actuator acts on, and which of its moments may differ from 0.
struct Actuator {
  enum class Transmission { dof, ball, free, tendon, site } transmission;
  int object;  // joint, tendon or site
  int dof;     // the first of a joint
  int first_column, count;
};

// How many constraints a contact of the pair makes. cone: mjOption's.
inline int constraints_of(const ContactPair& pair, int cone) {
  return pair.dim == 1 || cone == mjCONE_ELLIPTIC ? pair.dim : 2 * (pair.dim - 1);
}

// What mj_makeConstraint takes from a row's mjModel for the limit of a joint or the contacts of a pair: efc_KBIP's K and B,
// solimp, and 1 / pow(midpoint, power - 1) and 1 / pow(1 - midpoint, power - 1) of getimpedance.
struct ConstraintNumbers {
  double stiffness, damping;
  double dmin, dmax, width, midpoint, power, below, above;
  double diagApprox;  // of the first constraint
  double frictionloss;
  double impratio, friction[5];
};

// The arrays have MuJoCo's names (mjData). Number i of lane l is at [i * width + l]. One block of memory holds them all.
struct Lanes {
  const mjModel* model;

  double *qpos, *qvel, *act, *act_dot, *ctrl, *qfrc_applied, *xfrc_applied, *mocap_pos, *mocap_quat, *qacc,
      *qfrc_constraint;
  double *xpos, *xquat, *xmat, *xipos, *ximat, *xanchor, *xaxis, *geom_xpos, *geom_xmat, *site_xpos, *site_xmat;
  double *subtree_com, *cdof, *cinert, *ten_length, *actuator_length, *crb, *qM, *qLD, *qLDiagInv, *qLDiagSqrtInv;
  double *ten_J, *actuator_moment, *ten_velocity, *actuator_velocity, *cvel, *cdof_dot, *qfrc_bias, *qfrc_passive;
  double *actuator_force, *qfrc_actuator, *qfrc_smooth, *qacc_smooth, *qH, *qHDiagInv;

  // What MuJoCo keeps on its stack: angles of hinges and their sines and cosines, cacc and cfrc_body of mj_rne, MhB and
  // qacc of mj_Euler, X, F and dX of mj_RungeKutta.
  double *angle, *sine, *cosine, *cacc, *cfrc_body, *MhB, *qacc_euler, *X_qpos, *X_qvel, *F, *dX, *X_act, *F_act;

  // What mj_rnePostConstraint writes, cacc being another array than mj_rne's; and of sensors, also mj_subtreeVel's body_vel.
  double *cacc_ext, *cfrc_int, *cfrc_ext, *sensordata, *cam_xpos, *cam_xmat, *subtree_linvel, *subtree_angmom,
      *body_vel;

  // Numbers of mjModel of which rows may have their own.
  double *body_mass, *body_subtreemass, *sensor_cutoff, *body_inertia, *body_ipos, *jnt_stiffness, *dof_armature,
      *dof_damping, *dof_M0, *tendon_lengthspring, *tendon_length0, *tendon_range, *tendon_margin, *eq_data,
      *actuator_gainprm, *actuator_biasprm, *actuator_acc0, *gravity, *jnt_range, *jnt_margin;
  double *wrap_prm, *cam_quat;
  // These are held only if has_own_frames.
  double *body_pos, *body_quat, *geom_pos, *geom_quat, *site_pos, *site_quat;
  bool has_own_frames;
  double* com_scale;  // for each body 1 / (mass of its subtree), or 0 if that mass is too small
  // For each of fluid_bodies, mj_inertiaBoxFluidModel's factors of the velocities: those of the fluid's viscosity for the
  // torque and for the force, and those of the drag for each axis.
  double *viscous_torque, *viscous_force, *torque_drag, *force_drag;

  // Of the model alone. Number i of these is at [i]. The dofs of tendon t, whose numbers in ten_J may differ from 0, are at
  // tendon_dofs[tendon_dof_adr[t]] to tendon_dofs[tendon_dof_adr[t + 1] - 1].
  const int *tendon_dof_adr, *tendon_dofs;
  const int* columns;       // dofs
  const Segment* segments;  // of tendon t: segments[segment_adr[t]] to segments[segment_adr[t + 1] - 1]
  const int* segment_adr;   // a tendon along joints has none
  const Actuator* actuators;
  bool has_negative_zeros;  // in the vectors that quaternions rotate
  bool has_damping;
  bool has_single_passive;               // MuJoCo computes the passive forces row by row
  bool has_single_actuation;             // MuJoCo computes tendons and actuators row by row
  const unsigned char* is_still_tendon;  // those whose Jacobian is 0 in each state
  const int* fluid_bodies;               // those on which a fluid acts
  int fluid_body_count;
  const GeomPair* pairs;
  int pair_count;
  const BoxPair* box_pairs;
  const GeomBox* boxes;  // for each geom, if there are box_pairs

  bool has_forces;      // in a lane, a number of qfrc_applied or xfrc_applied is not 0
  unsigned char* hits;  // for each pair the lanes in which the geoms may touch, as bits
  unsigned left;        // lanes, as bits, that met a number or a case which is left to MuJoCo's own code
  unsigned unlike;      // lanes, as bits, whose numbers of mjModel are left to MuJoCo's own code
};

// What has limits or friction.
enum class Object { dof, joint, ball, tendon };

// The equality constraints and the friction of several rows, the limits that they have reached, and their contacts, in the
// order of their constraints.
struct Contacts {
  static constexpr int kMost = 96;

  const int* joints;  // slides, hinges and balls with limits
  int joint_count;
  const int* tendons;  // those with limits
  int tendon_count;
  const Equality* equalities;
  const ContactPair* pairs;  // for each of Lanes::pairs
  bool are_searched;         // MuJoCo would search for the pairs
  unsigned rows;             // the lanes, as bits, that take part

  struct Equal {
    unsigned rows;  // the lanes, as bits, that have it
    const ConstraintNumbers* numbers[kMaxWidth];
  };
  const Equal* equals;  // for each of `equalities`
  int equality_count;
  struct Friction {
    Object object;
    int id;
    unsigned rows;
    const ConstraintNumbers* numbers[kMaxWidth];
  };
  const Friction* frictions;
  int friction_count;
  int bounded[kMaxWidth];  // how many constraints of equalities and friction each lane has
  struct Limit {
    Object object;
    int id, side;
    unsigned rows;
    const ConstraintNumbers* numbers[kMaxWidth];
  };
  struct Contact {
    int pair;
    unsigned rows;
    const ConstraintNumbers* numbers[kMaxWidth];
  };
  // Computes a pair's contacts in these lanes, as bits, with MuJoCo's function. Writes contact i of each lane to the numbers i
  // of the arrays `single`, and the lanes that have it to single_rows. Returns how many a lane has at most, -1 if it fails.
  int (*collide)(void* maker, int pair, unsigned rows);
  void* maker;
  static constexpr int kMostSingle = 50;  // mjMAXCONPAIR
  unsigned single_rows[kMostSingle];
  double *single_dist, *single_pos, *single_frame;

  Limit limits[kMost];
  Contact contacts[kMost];
  int limit_count, contact_count;
  int found[kMaxWidth];        // each lane's contacts, also those that make no constraints
  int constraints[kMaxWidth];  // how many each lane has

  // For each limit its distance, and [3] axis of the rotation of a ball; for each contact dist, [3] pos and [9] frame.
  double *limit_dist, *limit_axis, *dist, *pos, *frame;
};

// The constraints of several rows, for a solver. Each is at a place. At places without a constraint all numbers are 0.
// Newton's method has a lane's constraints at the first places. For PGS, row i of a lane's constraints is at place i as
// long as it is in a whole block of four, as mju_dot divides them; the up to three others are at the last three places.
// So the sums of all lanes have the same order.
struct Constraints {
  static constexpr int kRest = 3;
  int size;                 // how many places there are
  unsigned rows;            // the lanes, as bits, that take part
  int at_first[kMaxWidth];  // how many constraints of each lane are at the first places

  // As in Lanes. J is [size][nv]; the others up to force have a number for each place.
  double *J, *D, *vel, *aref, *b, *jar, *force;
  double *damping, *spring;         // aref is -damping * vel - spring
  double* warmstart;                // qacc_warmstart
  double *tolerance, *meaninertia;  // a number for each lane: opt.tolerance and stat.meaninertia
  int *columns, *column_counts;     // for each place the columns of J in which a number is not 0
  int most[kMaxWidth];              // opt.iterations of each lane, at least 0
  int iterations[kMaxWidth];        // how many there were

  // Places from this on hold neither equality constraints nor friction. For each before it: the numbers between which
  // J * qacc - aref has a quadratic cost, NaN where there is no bound; frictionloss; and -R * frictionloss^2 / 2. Beyond the
  // bounds the force is frictionloss or its negative, so inequalities have a frictionloss of 0.
  int bounded;
  double *low, *high, *frictionloss, *bend;

  // If cones are elliptic: a place belongs to the same friction, limit or contact in all lanes, also in those that lack it.
  // Contacts begin at the place `cones`, which else is `size`. dims: for the first place of a contact, how many it has.
  // scale: mjContact's mu at its first place, and its friction at the others. middle: for its first place the lanes, as
  // bits, in which it is in the middle zone. H with the cones is Hcone, and LTJ is HessianCone's.
  bool is_aligned;
  int cones;
  unsigned char *dims, *middle;
  double *scale, *Hcone, *LTJ;

  // Of Newton's method. quad is [size][3], H is [nv][nv], and vec is what a rank-one update of H consumes.
  double *Jv, *quad, *Ma, *Mv, *grad, *search, *vec, *H;
  unsigned char *quadratic,
      *old;  // for each place the lanes, as bits, that are quadratic; and that were before the last move

  // Of PGS. JM2 is [size][nv], AR is [size][size], ARinv is 1 / its diagonal, and A is 1 / ARinv. For each place before
  // `bounded`, the least and the greatest force.
  double *R, *JM2, *AR, *ARinv, *A, *least, *greatest;
};

// The functions of an instruction set, named after those of MuJoCo 2.2.2 that they follow: their result, name and
// parameters. None needs more than what `Lanes` holds.
#define MJENV_LANES_FUNCTIONS(FUNCTION)                                                                                     \
  /* Call this when numbers of mjModel have changed. Computes what depends on them alone. */                                \
  FUNCTION(void, adopt, (Lanes&))                                                                                           \
  FUNCTION(void, kinematics, (Lanes&))                                                                                      \
  FUNCTION(void, comPos, (Lanes&))                                                                                          \
  FUNCTION(void, tendon, (Lanes&))                                                                                          \
  FUNCTION(void, crb, (Lanes&))                                                                                             \
  FUNCTION(void, factorM, (Lanes&))                                                                                         \
  FUNCTION(void, transmission, (Lanes&))                                                                                    \
  FUNCTION(void, reject, (Lanes&))                                                                                          \
  FUNCTION(void, fwdVelocity, (Lanes&))                                                                                     \
  FUNCTION(void, comVel, (Lanes&))                                                                                          \
  FUNCTION(void, passive, (Lanes&))                                                                                         \
  FUNCTION(void, rne, (Lanes&))                                                                                             \
  FUNCTION(void, fwdActuation, (Lanes&))                                                                                    \
  /* What mj_Euler (stage 0) and the stages of mj_RungeKutta do with the states of actuators. */                            \
  FUNCTION(void, advanceActivations, (Lanes&, int stage))                                                                   \
  FUNCTION(void, fwdAcceleration, (Lanes&))                                                                                 \
  FUNCTION(void, Euler, (Lanes&))                                                                                           \
  /* Stages 1 to 3 set qpos and qvel to where the derivatives are evaluated next. Stage 4 ends the step. */                 \
  FUNCTION(void, RungeKutta, (Lanes&, int stage))                                                                           \
  /* These return false if a row meets a case that is left to MuJoCo's functions. */                                        \
  FUNCTION(bool, instantiateLimit, (const Lanes&, Contacts&))                                                               \
  FUNCTION(bool, collision, (const Lanes&, Contacts&))                                                                      \
  FUNCTION(void, makeConstraint, (Lanes&, const Contacts&, Constraints&))                                                   \
  /* From the constraints that mj_makeConstraint has made to qacc and qfrc_constraint. */                                   \
  FUNCTION(void, solNewton, (Lanes&, Constraints&))                                                                         \
  FUNCTION(void, solPGS, (Lanes&, Constraints&))                                                                            \
  /* mj_sensorPos, mj_sensorVel and mj_sensorAcc of the sensors that senses_in_lanes names. The constraints are those    */ \
  /* that a solver has solved. Sensors of forces and limits alone read them.                                             */ \
  FUNCTION(void, sensors, (Lanes&, const Contacts&, const Constraints&))                                                    \
  FUNCTION(void, rnePostConstraint, (Lanes&, const Contacts&, const Constraints&))                                          \
  /* The lanes, as bits, in which one of the numbers is bad in MuJoCo's sense (mju_isBad). */                               \
  FUNCTION(unsigned, bad, (const double* numbers, int count))                                                               \
  /* Copy `count` numbers of each lane. */                                                                                  \
  FUNCTION(void, gather, (double* to, const double* const* from, int count))                                                \
  FUNCTION(void, scatter, (double* const* to, const double* from, int count))

// An instruction set: how many lanes it has, and pointers to its functions.
struct Code {
  int width;
#define MJENV_POINTER(result, name, parameters) result(*name) parameters;
  MJENV_LANES_FUNCTIONS(MJENV_POINTER)
#undef MJENV_POINTER
};

extern const Code sse2, avx2, avx512, neon;

// The instruction sets of this CPU, in ascending order of their lanes. The function is in a file that every CPU can run.
std::vector<const Code*> codes();

}  // namespace mjenv::core::lanes
