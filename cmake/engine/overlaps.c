// The work on the geoms of a model that may touch. The compiler ends with a step of the model, which takes hours if thousands
// of geoms overlap.
#include <mujoco/mujoco.h>

#include "engine/engine_collision_convex.h"
#include "engine/engine_collision_primitive.h"
#include "engine/engine_core_constraint.h"

// Microseconds, measured with MuJoCo's own library of 2.2.2 in one thread: two spheres 0.12, two boxes 0.63, a capsule and a
// box 0.54, two ellipsoids 4.4, and 7.2 with mpr_tolerance="0"; a prism of a height field at most 0.8. For two meshes whose
// hulls are two fans of 7,900 vertices each, 445: no hull was found that takes more for each vertex, and spheres of
// 20,000 take 94.
static const double kSimple = 0.12, kBoxes = 0.7, kConvex = 7, kPrism = 1, kVertex = 0.03;

// How many intervals of a height field, of `count` over its whole length, lie within `radius` of `center`.
static double intervals(mjtNum center, mjtNum radius, mjtNum half, int count) {
  const mjtNum shared = mju_min(center + radius, half) - mju_max(center - radius, -half);
  return mju_max(0, shared) / (2 * half) * count + 2;
}

static double prisms(const mjModel* m, const mjData* d, int field, int geom, mjtNum margin) {
  const int id = m->geom_dataid[field];
  const mjtNum *size = m->hfield_size + 4 * id, radius = m->geom_rbound[geom] + margin;
  mjtNum apart[3], center[3];
  mju_sub3(apart, d->geom_xpos + 3 * geom, d->geom_xpos + 3 * field);
  mju_rotVecMatT(center, apart, d->geom_xmat + 9 * field);
  return 2 * intervals(center[0], radius, size[0], m->hfield_ncol[id]) *
         intervals(center[1], radius, size[1], m->hfield_nrow[id]);
}

// The microseconds for the vertices of a mesh among which a contact is sought.
static double vertices(const mjModel* m, int geom) {
  const int id = m->geom_dataid[geom];
  if (m->geom_type[geom] != mjGEOM_MESH) return 0;
  return kVertex * (m->mesh_graphadr[id] < 0 ? m->mesh_vertnum[id] : m->mesh_graph[m->mesh_graphadr[id]]);
}

static double work_of_pair(const mjModel* m, const mjData* d, int a, int b, mjtNum margin) {
  if (m->geom_type[a] > m->geom_type[b]) return work_of_pair(m, d, b, a, margin);
  const mjtNum reach = m->geom_rbound[a] + m->geom_rbound[b] + mj_assignMargin(m, margin);
  if (m->geom_rbound[a] > 0 && m->geom_rbound[b] > 0 && mju_dist3(d->geom_xpos + 3 * a, d->geom_xpos + 3 * b) > reach)
    return 0;
  const mjfCollision function = mjCOLLISIONFUNC[m->geom_type[a]][m->geom_type[b]];
  if (!function) return 0;
  const double meshes = vertices(m, a) + vertices(m, b);
  if (function == mjc_ConvexHField) return (kPrism + meshes) * prisms(m, d, a, b, mj_assignMargin(m, margin));
  if (function == mjc_Convex) return (kConvex + meshes) * (m->opt.enableflags & mjENBL_MULTICCD ? 5 : 1);
  return (function == mjc_BoxBox || function == mjc_CapsuleBox ? kBoxes : kSimple) + meshes;
}

static int can_touch(const mjModel* m, int a, int b) {
  if (m->body_weldid[m->geom_bodyid[a]] == m->body_weldid[m->geom_bodyid[b]]) return 0;
  return (m->geom_contype[a] & m->geom_conaffinity[b]) || (m->geom_contype[b] & m->geom_conaffinity[a]);
}

// Returns the microseconds for the contacts of a step in the model's first state, at most about as many as `enough`.
double mjenv_contact_work(const mjModel* m, mjData* d, double enough) {
  const int stages = m->opt.integrator == mjINT_RK4 ? 4 : 1;
  double work = 0;
  if (m->opt.disableflags & (mjDSBL_CONSTRAINT | mjDSBL_CONTACT)) return 0;
  mj_kinematics(m, d);
  for (int i = 0; i < m->npair && m->opt.collision != mjCOL_DYNAMIC; ++i)
    work += work_of_pair(m, d, m->pair_geom1[i], m->pair_geom2[i], m->pair_margin[i]);
  for (int a = 0; a < m->ngeom && m->opt.collision != mjCOL_PAIR && stages * work <= enough; ++a)
    for (int b = 0; b < a; ++b)
      if (can_touch(m, a, b)) work += work_of_pair(m, d, a, b, mju_max(m->geom_margin[a], m->geom_margin[b]));
  return stages * work;
}
