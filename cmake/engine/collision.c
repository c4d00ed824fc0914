// Collision detection for models with few bodies. MuJoCo's search computes the eigenvectors of the geoms' covariance and
// sorts the bodies along the first; here, all pairs of bodies are compared. The contacts are the same.
#include "engine/engine_collision_driver.h"

#include <math.h>
#include <mujoco/mujoco.h>

enum { kMaxBodies = 64 };

struct box {
  mjtNum low[3], high[3];
};

static int can_collide(const mjModel* m, int geom) { return m->geom_contype[geom] || m->geom_conaffinity[geom]; }

static int is_surface(const mjModel* m, int geom) {
  return m->geom_type[geom] == mjGEOM_PLANE || m->geom_type[geom] == mjGEOM_HFIELD;
}

// Whether MuJoCo's search would find all pairs that can touch, but for rounding errors (certainly_finds).
static int is_simple(const mjModel* m) {
  if (m->nbody > kMaxBodies || m->npair > 0 || m->opt.collision == mjCOL_PAIR) return 0;
  if (m->opt.enableflags & mjENBL_OVERRIDE) return 0;
  for (int geom = 0; geom < m->ngeom; ++geom) {
    if (!(m->geom_margin[geom] >= 0)) return 0;
    if (m->geom_bodyid[geom] > 0 && (is_surface(m, geom) || !(m->geom_rbound[geom] > 0))) return 0;
  }
  return 1;
}

// Makes a box that contains the bounding spheres of a body's geoms, with room for rounding errors. Returns 0 if a number
// is not finite or too large.
static int contain(const mjModel* m, const mjData* d, int body, struct box* box) {
  for (int k = 0; k < 3; ++k) {
    box->low[k] = INFINITY;
    box->high[k] = -INFINITY;
  }
  for (int i = 0; i < m->body_geomnum[body]; ++i) {
    const int geom = m->body_geomadr[body] + i;
    const mjtNum radius = m->geom_rbound[geom] + m->geom_margin[geom];
    for (int k = 0; k < 3; ++k) {
      const mjtNum center = d->geom_xpos[3 * geom + k], extent = radius + 1e-9 * (fabs(center) + radius);
      if (!(fabs(center) + radius < 1e15)) return 0;
      box->low[k] = mjMIN(box->low[k], center - extent);
      box->high[k] = mjMAX(box->high[k], center + extent);
    }
  }
  return 1;
}

static int are_apart(const struct box* a, const struct box* b) {
  for (int k = 0; k < 3; ++k)
    if (a->low[k] > b->high[k] || b->low[k] > a->high[k]) return 1;
  return 0;
}

// Whether the bounding spheres overlap by so much that MuJoCo's search finds the pair in spite of rounding to float32.
static int certainly_finds(const mjModel* m, const mjData* d, int geom1, int geom2) {
  const mjtNum *a = d->geom_xpos + 3 * geom1, *b = d->geom_xpos + 3 * geom2;
  const mjtNum radii = m->geom_rbound[geom1] + m->geom_rbound[geom2];
  const mjtNum reach = radii + mjMAX(m->geom_margin[geom1], m->geom_margin[geom2]);
  const mjtNum scale = mju_norm3(a) + mju_norm3(b) + radii + m->geom_margin[geom1] + m->geom_margin[geom2];
  return mju_dist3(a, b) < reach - 1e-6 * scale;
}

static int is_excluded(const mjModel* m, int body1, int body2) {
  const int signature = ((body1 + 1) << 16) + body2 + 1;
  for (int i = 0; i < m->nexclude; ++i)
    if (m->exclude_signature[i] == signature) return 1;
  return 0;
}

// Tests all geoms of a body against those of another. Returns 0 if MuJoCo's search might miss a contact.
static int collide_bodies(const mjModel* m, mjData* d, int body1, int body2) {
  const int end1 = m->body_geomadr[body1] + m->body_geomnum[body1];
  const int end2 = m->body_geomadr[body2] + m->body_geomnum[body2];
  for (int geom1 = m->body_geomadr[body1]; geom1 < end1; ++geom1)
    for (int geom2 = m->body_geomadr[body2]; geom2 < end2; ++geom2) {
      const int before = d->ncon;
      mj_collideGeoms(m, d, geom1, geom2, 0, 0);
      if (d->ncon > before && body1 > 0 && !certainly_finds(m, d, geom1, geom2)) return 0;
    }
  return 1;
}

// Returns 0 if MuJoCo's search might find other contacts.
static int collide_all(const mjModel* m, mjData* d) {
  struct box boxes[kMaxBodies];
  unsigned char collides[kMaxBodies] = {0};
  for (int geom = 0; geom < m->ngeom; ++geom)
    if (can_collide(m, geom)) collides[m->geom_bodyid[geom]] = 1;
  for (int body = 1; body < m->nbody; ++body)
    if (collides[body] && !contain(m, d, body, &boxes[body])) return 0;
  for (int body1 = 0; body1 < m->nbody; ++body1)
    for (int body2 = body1 + 1; body2 < m->nbody && collides[body1]; ++body2) {
      if (!collides[body2] || (body1 > 0 && are_apart(&boxes[body1], &boxes[body2])) || is_excluded(m, body1, body2))
        continue;
      if (!collide_bodies(m, d, body1, body2)) return 0;
    }
  return 1;
}

// Whether mj_collideGeoms would certainly find that the bounding spheres are apart, which takes it longer: it computes a
// root.
static int spheres_are_apart(const mjModel* m, const mjData* d, int pair) {
  const int geom1 = m->pair_geom1[pair], geom2 = m->pair_geom2[pair];
  const mjtNum radius1 = m->geom_rbound[geom1], radius2 = m->geom_rbound[geom2];
  const mjtNum *a = d->geom_xpos + 3 * geom1, *b = d->geom_xpos + 3 * geom2,
               reach = radius1 + radius2 + m->pair_margin[pair];
  const mjtNum dif[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  const mjtNum square = dif[0] * dif[0] + dif[1] * dif[1] + dif[2] * dif[2];
  return radius1 > 0 && radius2 > 0 && square > reach * reach * (1 + 1e-9);
}

// engine_forward.c calls this in place of mj_collision.
void mjenv_collision(const mjModel* m, mjData* d) {
  const mjWarningStat before = d->warning[mjWARN_CONTACTFULL];
  d->ncon = 0;
  if (m->opt.disableflags & (mjDSBL_CONSTRAINT | mjDSBL_CONTACT) || m->nconmax == 0 || m->nbody < 2)
    return mj_collision(m, d);
  if (m->opt.collision == mjCOL_PAIR && !(m->opt.enableflags & mjENBL_OVERRIDE)) {
    for (int pair = 0; pair < m->npair; ++pair)
      if (!spheres_are_apart(m, d, pair)) mj_collideGeoms(m, d, pair, -1, 0, 0);
    return;
  }
  if (!is_simple(m)) return mj_collision(m, d);
  if (collide_all(m, d)) return;
  d->warning[mjWARN_CONTACTFULL] = before;
  mj_collision(m, d);
}
