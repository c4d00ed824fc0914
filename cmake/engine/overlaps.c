// The work on the geoms of a model that may touch. The compiler ends with a step of the model, which takes hours if thousands
// of geoms overlap.
#include <mujoco/mujoco.h>

#include "engine/engine_collision_convex.h"
#include "engine/engine_collision_primitive.h"

// Microseconds for a pair, measured on one CPU: spheres and capsules 0.1, boxes 0.5, two ellipsoids 6. Large meshes take up to
// six times as long as ellipsoids. A prism of a height field is estimated.
static const double kSimple = 0.1, kBoxes = 0.5, kConvex = 6, kPrism = 1;

// How many intervals of a height field, of `count` over its whole length, lie within `radius` of `center`.
static double intervals(mjtNum center, mjtNum radius, mjtNum half, int count) {
  const mjtNum shared = mju_min(center + radius, half) - mju_max(center - radius, -half);
  return mju_max(0, shared) / (2 * half) * count + 2;
}

static double prisms(const mjModel* m, const mjData* d, int field, int geom) {
  const int id = m->geom_dataid[field];
  const mjtNum *size = m->hfield_size + 4 * id, radius = m->geom_rbound[geom] + m->geom_margin[geom];
  mjtNum apart[3], center[3];
  mju_sub3(apart, d->geom_xpos + 3 * geom, d->geom_xpos + 3 * field);
  mju_rotVecMatT(center, apart, d->geom_xmat + 9 * field);
  return 2 * intervals(center[0], radius, size[0], m->hfield_ncol[id]) *
         intervals(center[1], radius, size[1], m->hfield_nrow[id]);
}

static double work_of_pair(const mjModel* m, const mjData* d, int a, int b) {
  if (m->geom_type[a] > m->geom_type[b]) return work_of_pair(m, d, b, a);
  const mjtNum reach = m->geom_rbound[a] + m->geom_rbound[b] + mju_max(m->geom_margin[a], m->geom_margin[b]);
  if (m->geom_rbound[a] > 0 && m->geom_rbound[b] > 0 && mju_dist3(d->geom_xpos + 3 * a, d->geom_xpos + 3 * b) > reach)
    return 0;
  const mjfCollision function = mjCOLLISIONFUNC[m->geom_type[a]][m->geom_type[b]];
  if (function == mjc_ConvexHField) return kPrism * prisms(m, d, a, b);
  return function == mjc_Convex ? kConvex : function == mjc_BoxBox ? kBoxes : function ? kSimple : 0;
}

static int can_touch(const mjModel* m, int a, int b) {
  if (m->body_weldid[m->geom_bodyid[a]] == m->body_weldid[m->geom_bodyid[b]]) return 0;
  return (m->geom_contype[a] & m->geom_conaffinity[b]) || (m->geom_contype[b] & m->geom_conaffinity[a]);
}

// Returns the microseconds for the contacts in the model's first state, at most about as many as `enough`.
double mjenv_contact_work(const mjModel* m, mjData* d, double enough) {
  double work = 0;
  if (m->opt.disableflags & (mjDSBL_CONSTRAINT | mjDSBL_CONTACT)) return 0;
  mj_kinematics(m, d);
  for (int i = 0; i < m->npair && m->opt.collision != mjCOL_DYNAMIC; ++i)
    work += work_of_pair(m, d, m->pair_geom1[i], m->pair_geom2[i]);
  for (int a = 0; a < m->ngeom && m->opt.collision != mjCOL_PAIR && work <= enough; ++a)
    for (int b = 0; b < a; ++b)
      if (can_touch(m, a, b)) work += work_of_pair(m, d, a, b);
  return work;
}
