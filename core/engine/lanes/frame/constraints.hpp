// The constraints of several rows, as lanes make them, and as solvers read and change them.
#pragma once

#include <mujoco/mjmodel.h>

#include "engine/lanes/frame/width.hpp"

namespace mjenv::core::lanes {

// The shapes of two geoms whose contacts lanes compute.
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

// In models with sparse Jacobians, the dofs at which the Jacobian of a constraint between two bodies has numbers, in
// ascending order: `count` of them, from first_column on in Lanes::columns. couples: whether J' * J has an element, for
// some two of these dofs, that the inertia matrix lacks.
struct Chain {
  int first_column, count;
  bool couples;
};

struct ContactPair {
  int geom1, geom2;
  Shapes shapes;     // others: MuJoCo's function computes these contacts row by row
  int dim;           // condim: 1, 3, 4 or 6
  int root1, root2;  // body_rootid of the two bodies
  // From first_column on, Lanes::columns lists the dofs that move only the first body, then those that move only the
  // second. For dofs that move both, the Jacobian is 0.
  int first_column, count1, count2;
  Chain chain;
  // Whether MuJoCo's search may miss a contact of the pair in which the geoms overlap by little: it excludes pairs of
  // moving bodies, on 2.2.2 by float32 computations, and on 4.0 it compares boxes (needs_search).
  bool can_be_missed;
};

// How many constraints a contact of the pair makes. cone: mjOption's.
constexpr int constraints_of(const ContactPair& pair, int cone) {
  return pair.dim == 1 || cone == mjCONE_ELLIPTIC ? pair.dim : 2 * (pair.dim - 1);
}

// What mj_makeConstraint takes from a row's mjModel for one limit, pair, equality or friction. stiffness and damping
// are K and B of efc_KBIP. dmin to power are solimp. below and above are two factors that getimpedance computes:
// 1 / pow(midpoint, power - 1) and 1 / pow(1 - midpoint, power - 1).
struct ConstraintNumbers {
  double stiffness, damping;
  double dmin, dmax, width, midpoint, power, below, above;
  double diagApprox;      // that of the first constraint
  double diagApproxTurn;  // that of the rotations of a weld
  double frictionloss;
  double impratio, friction[5];
};

// Two bodies. From first_column on, Lanes::columns lists the dofs that move only body 1, those that move only body 2,
// and those that move both. negates: for dofs that move only body 1, MuJoCo negates the Jacobian instead of subtracting
// it from 0, which gives 0 another sign.
struct BodyPair {
  int body1, body2;
  int first_column, count1, count2, count_both;
  bool negates;
};

// An equality constraint between bodies, joints or tendons.
struct Equality {
  int id, type;
  int size;              // how many constraints it makes
  int object1, object2;  // object2 is -1 if a joint or tendon has no partner
  bool has_sites;        // the objects are sites
  BodyPair bodies;       // of connect and weld: object2, then object1, because MuJoCo subtracts object2's Jacobian
  Chain chain;
};

// What a limit or friction constrains.
enum class Object { dof, joint, ball, tendon };

// The equalities, friction, reached limits and contacts of several rows, in the order in which MuJoCo makes their
// constraints.
struct Contacts {
  static constexpr int kCapacity = 96;

  // A slide, hinge, ball or tendon, and the lanes, as bits, in which it has limits.
  struct Limited {
    int id;
    unsigned rows;
  };
  const Limited *joints, *tendons;
  int joint_count, tendon_count;
  const ContactPair* pairs;  // those that lanes test for contacts, in their order
  int pair_count;
  bool are_searched;  // MuJoCo would search for the pairs
  unsigned rows;      // the lanes, as bits, that take part

  struct Equal {
    const Equality* equality;
    unsigned rows;  // the lanes, as bits, in which it is active: at least one
    const ConstraintNumbers* numbers[kMaxWidth];
  };
  const Equal* equals;
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
    unsigned rows;        // the lanes, as bits, in which it makes constraints
    unsigned found_rows;  // the lanes in which it is found, perhaps beyond the margin (only 4.0)
    const ConstraintNumbers* numbers[kMaxWidth];
  };
  // Computes a pair's contacts in the lanes `rows` (bits) with MuJoCo's function. Writes contact i of each lane to
  // element i of the arrays single_..., and the lanes that have it to single_rows[i]. Returns the largest number of
  // contacts in a lane; -1 if MuJoCo fails.
  int (*collide)(void* maker, int pair, unsigned rows);
  void* maker;
  static constexpr int kMostSingle = 50;  // mjMAXCONPAIR
  unsigned single_rows[kMostSingle];
  double *single_dist, *single_pos, *single_frame;

  Limit limits[kCapacity];
  Contact contacts[kCapacity];
  int limit_count, contact_count;
  int found[kMaxWidth];        // how many contacts each lane has, also counting those that make no constraints
  int constraints[kMaxWidth];  // how many constraints each lane has

  // For each limit: its distance, and for a ball the axis [3] of its rotation. For each contact: dist, pos [3] and
  // frame [9].
  double *limit_dist, *limit_axis, *dist, *pos, *frame;
};

// What rownnz, rowadr and colind of mjCGContext say in Newton's method with sparse Jacobians: which numbers of H and of
// its Cholesky factor are part of MuJoCo's sparse matrix. of_M, of_J and filled are [nv][nv]. For each element of the
// lower triangle they hold the lanes, as bits, that have it.
struct Pattern {
  const unsigned char* of_M;  // the elements that M has: all bits
  unsigned char* of_J;        // the elements that J' * J has (mju_sqrMatTDSparse), but not M
  unsigned char* filled;      // the elements of the factor (mju_cholFactorSparse)
  int *columns, *counts;      // for each row of `filled`, the columns before the diagonal that some lane has, ascending
  // For each row: whether it has elements that M does not have, and whether these are not the same in all lanes.
  unsigned char *is_changed, *is_mixed;
  unsigned char* of_vector;  // of a rank-one update of the factor (mju_cholUpdateSparse): the elements of its vector
};

// The constraints of several rows, for a solver. The arrays have an element, the "place", for each constraint; at a
// place without a constraint all numbers are 0. For Newton's method and CG, constraint i of a lane is at place i,
// unless is_aligned. For PGS, mju_dot adds whole blocks of four constraints, and then the remaining ones, at most
// three. So each lane has its whole blocks at the first places and its remaining constraints at the last three places:
// the terms of all lanes' sums are then added in the same order. PGS with elliptic cones and noslip need the
// constraints of a contact at places that follow each other, so constraint i of a lane is at place i (is_numbered).
struct Constraints {
  static constexpr int kRest = 3;
  int size;                 // how many places there are
  unsigned rows;            // the lanes, as bits, that take part
  int at_first[kMaxWidth];  // how many constraints of each lane are at the first places

  // The layout is that of Lanes. J is [size][nv]; the others up to force have a number for each place.
  double *J, *D, *vel, *aref, *b, *jar, *force;
  double *damping, *spring;  // aref is -damping * vel - spring
  bool has_references;       // MuJoCo has computed vel and aref
  // Only for equalities of bodies, since MuJoCo 3. drift: for each place before `bounded`, the change of J times qvel,
  // which aref compensates. J_dot: room for the change of a body's Jacobian.
  double *drift, *J_dot;
  double *tolerance, *meaninertia;  // a number for each lane: opt.tolerance and stat.meaninertia
  int *columns, *column_counts;     // for each place the columns of J in which a number is not 0
  int most[kMaxWidth];              // opt.iterations of each lane, at least 0
  int most_evaluations[kMaxWidth];  // of each lane's line search, if the solver has one
  double* ls_tolerance;             // of each lane: that option, since MuJoCo 3
  double* qfrc;                     // of an island: room for its part of qfrc_constraint
  int iterations[kMaxWidth];        // how many iterations each lane took

  // Equality and friction constraints are at places before `bounded`. For each of these places: low and high, between
  // which the cost is quadratic in J * qacc - aref (NaN: no bound); frictionloss; and bend, which is -R *
  // frictionloss^2 / 2. Outside of the bounds the force is frictionloss or -frictionloss. An inequality at such a place
  // has frictionloss 0.
  int bounded;
  double *low, *high, *frictionloss, *bend;

  // For Newton's method and CG with elliptic cones or sparse Jacobians (is_aligned), a place belongs to the same
  // equality, friction, limit or contact in all lanes, also in lanes that lack it. With elliptic cones, contacts begin
  // at the place `cones`; otherwise it equals `size`. dims: at the first place of an equality, friction, limit or
  // contact, how many places it has. scale: mjContact's mu at a contact's first place, and its friction at the others.
  // middle: at a contact's first place, the lanes, as bits, in which it is in the middle zone. Hcone: H plus the part
  // of the contacts in the middle zone. LTJ: the array of that name in MuJoCo's HessianCone.
  bool is_aligned;
  int cones;
  unsigned char *dims, *middle;
  double *scale, *Hcone, *LTJ;

  // Not for PGS. quad is [size][3]. quadratic: for each place, the lanes, as bits, whose cost is quadratic; old: the
  // same before the last move.
  double *Jv, *quad, *Ma, *Mv, *grad, *search;
  unsigned char *quadratic, *old;
  // Only for Newton's method. H is [nv][nv]. vec: the vector of a rank-one update of H; the update overwrites vec.
  double *vec, *H;
  // Only for CG: the gradient preconditioned by M, and its change in the last iteration.
  double *Mgrad, *Mgraddif;

  // If is_numbered, size is a multiple of four, and at_first is how many constraints each lane has.
  // starts[place].blocks[n]: the lanes, as bits, in which a group of n constraints begins at this place. A group is 1
  // constraint that PGS updates alone, 2 opposite edges of a pyramidal cone, which noslip updates together, or the 3, 4
  // or 6 constraints of a contact with an elliptic cone.
  static constexpr int kMostNumbered = 64;
  bool is_numbered;
  struct Starts {
    unsigned char blocks[7];
  };
  Starts* starts;
  int noslip_most[kMaxWidth];  // opt.noslip_iterations of each lane
  double* noslip_tolerance;    // a number for each lane

  // Only for PGS and noslip. JM2 is [size][nv], AR is [size][size].
  double *R, *JM2, *AR;
  // Only for PGS. ARinv is 1 / the diagonal of AR, and A is 1 / ARinv. least and greatest bound the force at each place
  // before `bounded`.
  double *ARinv, *A, *least, *greatest;

  // Only for sparse Jacobians. `columns` are then the dofs at which MuJoCo's sparse matrix has numbers, also if these
  // are 0, and the other numbers of J are undefined. holders: for each place, the lanes, as bits, that have the
  // constraint or take no part. couples: at the first place of an equality, friction, limit or contact, Chain::couples;
  // 0 at its others. The places whose columns contain dof k are the dof_place_counts[k] elements from dof_places[k *
  // most_places] on. products and product_lanes: the terms of a sum, and the lanes, as bits, that have them. products
  // is also room for 2 * nv vectors.
  bool is_sparse;
  int most_places;
  unsigned char *holders, *couples, *product_lanes;
  int *dof_places, *dof_place_counts;
  double* products;
  Pattern pattern;
};

}  // namespace mjenv::core::lanes
