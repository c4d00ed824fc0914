// The contacts of planes, spheres and capsules, for several rows at once. What functions.hpp says of bits holds here, too.
#pragma once

#include "engine/lanes/constraints.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_collision_primitive.c ----

// A contact in the lanes of a mask.
struct Contact {
  V dist, pos[3], frame[9];
  Mask is_there;
};

struct Geom {
  const V *pos, *mat;
  const double* size;

  // The z-axis
  void axis(V* res, double scale) const {
    for (int k = 0; k < 3; ++k) res[k] = mat[3 * k + 2] * scale;
  }
};

// _PlaneSphere, with the sphere's place and radius
inline void PlaneSphere(Contact& con, double margin, const Geom& plane, const V* pos, double radius) {
  V tmp[3];
  plane.axis(con.frame, 1);
  for (int k = 0; k < 3; ++k) tmp[k] = pos[k] - plane.pos[k];
  const V cdist = dot3(tmp, con.frame);
  con.is_there = ~(cdist > splat(margin + radius));
  con.dist = cdist - radius;
  const V scale = -con.dist * 0.5 - radius;
  for (int k = 0; k < 3; ++k) con.pos[k] = pos[k] + con.frame[k] * scale;
  zero(con.frame + 3, 3);
}

// mjc_PlaneCapsule
inline void PlaneCapsule(Contact* con, double margin, const Geom& plane, const Geom& capsule) {
  V pos[3], axis[3];
  capsule.axis(axis, 1);
  for (int end = 0; end < 2; ++end) {
    for (int k = 0; k < 3; ++k) {
      const V segment = axis[k] * capsule.size[1];
      pos[k] = end == 0 ? capsule.pos[k] + segment : capsule.pos[k] - segment;
    }
    PlaneSphere(con[end], margin, plane, pos, capsule.size[0]);
    copy(con[end].frame + 3, axis, 3);
  }
}

// _SphereSphere, with the spheres' places
inline void SphereSphere(Contact& con, double margin, const Geom& g1, const V* pos1, const Geom& g2, const V* pos2) {
  V dif[3];
  for (int k = 0; k < 3; ++k) dif[k] = pos1[k] - pos2[k];
  const V cdist = sqrt(dot3(dif, dif));
  con.is_there = ~(cdist > splat(margin + g1.size[0] + g2.size[0]));
  con.dist = cdist - g1.size[0] - g2.size[0];
  for (int k = 0; k < 3; ++k) con.frame[k] = pos2[k] - pos1[k];
  const Mask is_same = normalize3(con.frame) < splat(mjMINVAL);
  if (__builtin_expect(any(is_same), 0)) {
    V axis1[3], axis2[3], normal[3];
    g1.axis(axis1, 1);
    g2.axis(axis2, 1);
    cross(normal, axis1, axis2);
    normalize3(normal);
    for (int k = 0; k < 3; ++k) con.frame[k] = is_same ? normal[k] : con.frame[k];
  }
  const V scale = g1.size[0] + con.dist * 0.5;
  for (int k = 0; k < 3; ++k) con.pos[k] = con.frame[k] * scale + pos1[k];
  zero(con.frame + 3, 3);
}

inline V clip_to_segment(V x) { return x > splat(1) ? splat(1) : (x < splat(-1) ? splat(-1) : x); }

// mjc_SphereCapsule
inline void SphereCapsule(Contact& con, double margin, const Geom& sphere, const Geom& capsule) {
  V axis[3], vec[3];
  capsule.axis(axis, capsule.size[1]);
  for (int k = 0; k < 3; ++k) vec[k] = sphere.pos[k] - capsule.pos[k];
  const V x = clip_to_segment(dot3(axis, vec) / dot3(axis, axis));
  for (int k = 0; k < 3; ++k) vec[k] = axis[k] * x + capsule.pos[k];
  SphereSphere(con, margin, sphere, sphere.pos, capsule, vec);
}

// mjc_CapsuleCapsule, of axes that are not parallel. Returns in which lanes they are.
inline Mask CapsuleCapsule(Contact& con, double margin, const Geom& g1, const Geom& g2) {
  V axis1[3], axis2[3], dif[3], vec1[3], vec2[3];
  g1.axis(axis1, g1.size[1]);
  g2.axis(axis2, g2.size[1]);
  for (int k = 0; k < 3; ++k) dif[k] = g1.pos[k] - g2.pos[k];
  const V ma = dot3(axis1, axis1), mb = -dot3(axis1, axis2), mc = dot3(axis2, axis2);
  const V u = -dot3(axis1, dif), v = dot3(axis2, dif), det = ma * mc - mb * mb;

  V x1 = (mc * u - mb * v) / det, x2 = (ma * v - mb * u) / det;
  const Mask is_above1 = x1 > splat(1), is_below1 = x1 < splat(-1);
  x2 = is_above1 ? (v - mb) / mc : (is_below1 ? (v + mb) / mc : x2);
  x1 = clip_to_segment(x1);
  const Mask is_above2 = x2 > splat(1), is_below2 = x2 < splat(-1);
  x1 = is_above2 ? clip_to_segment((u - mb) / ma) : (is_below2 ? clip_to_segment((u + mb) / ma) : x1);
  x2 = clip_to_segment(x2);

  for (int k = 0; k < 3; ++k) {
    vec1[k] = axis1[k] * x1 + g1.pos[k];
    vec2[k] = axis2[k] * x2 + g2.pos[k];
  }
  SphereSphere(con, margin, g1, vec1, g2, vec2);
  return ~(abs(det) >= splat(mjMINVAL));
}

// mju_makeFrame. Returns in which lanes it fails.
inline Mask makeFrame(V* frame) {
  V* const y = frame + 3;
  const Mask fails = normalize3(frame) < splat(0.5);
  const Mask is_undefined = sqrt(dot3(y, y)) < splat(0.5);
  const Mask is_free = (frame[1] < splat(0.5)) & (frame[1] > splat(-0.5));
  y[0] = is_undefined ? V{} : y[0];
  y[1] = is_undefined ? (is_free ? splat(1) : V{}) : y[1];
  y[2] = is_undefined ? (is_free ? V{} : splat(1)) : y[2];
  const V scale = dot3(frame, y);
  for (int k = 0; k < 3; ++k) y[k] -= frame[k] * scale;
  normalize3(y);
  cross(frame + 6, frame, y);
  return fails;
}

// ---- engine_collision_driver.c ----

// The lanes, as bits, in which MuJoCo's search may miss a contact of the pair.
unsigned uncertain(const ContactPair& pair, const V* pos1, const V* pos2) {
  V dif[3], size = splat(pair.reach);
  for (int k = 0; k < 3; ++k) {
    dif[k] = pos1[k] - pos2[k];
    size += abs(pos1[k]) + abs(pos2[k]);
  }
  return bits(~(sqrt(dot3(dif, dif)) < pair.reach - 1e-6 * size));
}

// Contact i that MuJoCo's function found
void take(Contact& con, const Contacts& c, int i) {
  con.dist = vectors(c.single_dist)[i];
  copy(con.pos, vectors(c.single_pos) + 3 * i, 3);
  copy(con.frame, vectors(c.single_frame) + 9 * i, 9);
  con.is_there = mask_of(c.single_rows[i]);
}

// mj_collision, of the pairs that `reject` has not excluded
bool collision(const Lanes& d, Contacts& c) {
  const mjModel& m = *d.model;
  c.contact_count = 0;
  for (int lane = 0; lane < kWidth; ++lane) c.found[lane] = 0;
  for (int i = 0; i < d.pair_count; ++i) {
    const unsigned near = d.hits[i] & c.rows;
    if (near == 0) continue;
    const ContactPair& pair = c.pairs[i];
    const auto geom = [&](int id) {
      return Geom{vectors(d.geom_xpos) + 3 * id, vectors(d.geom_xmat) + 9 * id, m.geom_size + 3 * id};
    };
    const Geom g1 = geom(pair.geom1), g2 = geom(pair.geom2);
    Contact found[2];
    int count = 1;
    Mask is_left{};
    switch (pair.shapes) {
      case Shapes::plane_sphere: PlaneSphere(found[0], pair.margin, g1, g2.pos, g2.size[0]); break;
      case Shapes::plane_capsule:
        PlaneCapsule(found, pair.margin, g1, g2);
        count = 2;
        break;
      case Shapes::sphere_sphere: SphereSphere(found[0], pair.margin, g1, g1.pos, g2, g2.pos); break;
      case Shapes::sphere_capsule: SphereCapsule(found[0], pair.margin, g1, g2); break;
      case Shapes::capsule_capsule: is_left = CapsuleCapsule(found[0], pair.margin, g1, g2); break;
      default: is_left = V{} == V{};
    }
    const bool is_single = (bits(is_left) & near) != 0;
    if (is_single) count = c.collide(c.maker, i, near);
    if (count < 0) return false;
    for (int k = 0; k < count; ++k) {
      if (is_single) take(found[0], c, k);
      Contact& con = found[is_single ? 0 : k];
      const unsigned rows = bits(con.is_there) & near;
      if (rows == 0) continue;
      if (c.are_searched && pair.is_between_bodies && (uncertain(pair, g1.pos, g2.pos) & rows) != 0) return false;
      if ((bits(makeFrame(con.frame)) & rows) != 0) return false;
      for (int lane = 0; lane < kWidth; ++lane) c.found[lane] += rows >> lane & 1;
      const unsigned included = rows & bits(con.dist < splat(pair.includemargin));
      if (included == 0) continue;
      if (c.contact_count == Contacts::kMost) return false;
      const int n = c.contact_count++;
      c.contacts[n] = {i, included, {}};
      vectors(c.dist)[n] = con.dist;
      copy(vectors(c.pos) + 3 * n, con.pos, 3);
      copy(vectors(c.frame) + 9 * n, con.frame, 9);
      const int size = constraints_of(pair, m.opt.cone);
      for (int lane = 0; lane < kWidth; ++lane)
        if (included >> lane & 1) c.constraints[lane] += size;
    }
  }
  return true;
}

}  // namespace
}  // namespace mjenv::core::lanes
