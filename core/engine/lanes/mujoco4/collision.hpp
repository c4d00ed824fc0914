// The contacts of planes, spheres, capsules, cylinders and boxes as MuJoCo 4.0 finds them, for several rows at once.
#pragma once

#include "engine/lanes/frame/collision_primitive.hpp"

namespace mjenv::core::lanes {
namespace {

constexpr int kMostFound = 4;  // the most contacts of a pair

inline V clip_to_unit(V x) { return x < V{} ? V{} : (splat(1) < x ? splat(1) : x); }

// ---- engine_collision_primitive.c ----

// mjc_SphereCapsule
inline void SphereCapsule(Contact& con, V margin, const Geom& sphere, const Geom& capsule) {
  V axis[3], vec[3];
  capsule.axis(axis, 1);
  for (int k = 0; k < 3; ++k) vec[k] = sphere.pos[k] - capsule.pos[k];
  const V range[2] = {-capsule.size[1], capsule.size[1]}, x = clip(dot3(axis, vec), range);
  for (int k = 0; k < 3; ++k) vec[k] = axis[k] * x + capsule.pos[k];
  SphereSphere<true>(con, margin, sphere, sphere.pos, capsule, vec);
}

// The nearest points of two segments, as weights along them: two pairs of points if they are parallel, the second of
// which counts only in the lanes that this returns. start: the segments' first points. to: from there to the others.
inline Mask segWeights(V (&weights)[2][2], const V* start1, const V* to1, const V* start2, const V* to2) {
  V between[3], normal[3], turned[3];
  for (int k = 0; k < 3; ++k) between[k] = start1[k] - start2[k];
  const V length1 = dot3(to1, to1), length2 = dot3(to2, to2), along1 = dot3(to1, between), along2 = dot3(to2, between);
  const V both = dot3(to1, to2), at_start = -along1 / length1, at_end = (both - along1) / length1;
  const Mask is_point1 = length1 <= splat(mjMINVAL), is_point2 = length2 <= splat(mjMINVAL);
  // Given the point on the first segment, the nearest one on the second. If that is an end, the nearest one to the end.
  const auto complete = [&](V(&pair)[2], V numerator, V on_first) {
    const V on_second = numerator / length2;
    const Mask is_before = on_second<V{}, is_after = on_second> splat(1);
    pair[0] = is_before ? clip_to_unit(at_start) : (is_after ? clip_to_unit(at_end) : on_first);
    pair[1] = is_before ? V{} : (is_after ? splat(1) : on_second);
  };
  cross(normal, to1, to2);
  cross(turned, to2, between);
  const V square = dot3(normal, normal);
  const Mask is_parallel = ~(square > length1 * 1e-8 * length2);
  const V nearest = clip_to_unit(dot3(normal, turned) / square), first = is_parallel ? V{} : nearest;
  complete(weights[0], is_parallel ? along2 : first * both + along2, first);
  complete(weights[1], along2 + both, splat(1));
  if (__builtin_expect(any(is_point1 | is_point2), 0)) {
    const V on_second = is_point2 ? V{} : clip_to_unit(along2 / length2), on_first = clip_to_unit(at_start);
    weights[0][0] = is_point1 ? V{} : (is_point2 ? on_first : weights[0][0]);
    weights[0][1] = is_point1 ? on_second : (is_point2 ? V{} : weights[0][1]);
  }
  return is_parallel & ~is_point1 & ~is_point2;
}

// mjc_CapsuleCapsule. Returns how many contacts of `con` it has set.
inline int CapsuleCapsule(Contact* con, V margin, const Geom& g1, const Geom& g2) {
  V start1[3], start2[3], to1[3], to2[3], weights[2][2];
  const auto segment = [](const Geom& geom, V* start, V* to) {
    V half[3];
    geom.axis(half, geom.size[1]);
    for (int k = 0; k < 3; ++k) {
      start[k] = geom.pos[k] - half[k];
      to[k] = (geom.pos[k] + half[k]) - start[k];
    }
  };
  segment(g1, start1, to1);
  segment(g2, start2, to2);
  const Mask has_second = segWeights(weights, start1, to1, start2, to2);
  const int count = any(has_second) ? 2 : 1;
  for (int i = 0; i < count; ++i) {
    V vec1[3], vec2[3];
    for (int k = 0; k < 3; ++k) {
      vec1[k] = to1[k] * weights[i][0] + start1[k];
      vec2[k] = to2[k] * weights[i][1] + start2[k];
    }
    SphereSphere<true>(con[i], margin, g1, vec1, g2, vec2);
  }
  con[1].is_there &= has_second;
  return count;
}

// ---- engine_collision_driver.c ----

// mj_filterSphere
inline Mask are_apart(const mjModel& m, int id1, int id2, const Geom& g1, const Geom& g2, double margin) {
  V dif[3], normal[3];
  for (int k = 0; k < 3; ++k) dif[k] = g1.pos[k] - g2.pos[k];
  const double rbound1 = m.geom_rbound[id1], rbound2 = m.geom_rbound[id2], bound = rbound1 + rbound2 + margin;
  if (rbound1 > 0 && rbound2 > 0) return dot3(dif, dif) > splat(bound * bound);
  for (V& x : dif) x = -x;  // the first geom is a plane
  g1.axis(normal, 1);
  return dot3(dif, normal) > splat(margin + rbound2);
}

inline V includemargin(const Lanes& d, int pair) { return splat(d.pair_margin[pair]); }

// The lanes, as bits, in which MuJoCo's search may miss a contact. It compares boxes, which on each axis overlap at least
// as much as geoms do. The largest errors are those of planes, boxes of 1e10 m: less than 8e-6.
inline unsigned uncertain(V dist, V reach) { return bits(~(dist < reach - 1e-5)); }

// mj_collision for the listed pairs of geoms that all rows share. Returns false if a row meets a case that is left to
// MuJoCo's function.
bool collision(const Lanes& d, Contacts& c) {
  const mjModel& m = *d.model;
  c.contact_count = 0;
  for (int lane = 0; lane < kWidth; ++lane) c.found[lane] = 0;
  for (int i = 0; i < c.pair_count; ++i) {
    const ContactPair& pair = c.pairs[i];
    const int id1 = pair.geom1, id2 = pair.geom2;
    V size1[3], size2[3];
    for (int k = 0; k < 3; ++k) {
      size1[k] = splat(m.geom_size[3 * id1 + k]);
      size2[k] = splat(m.geom_size[3 * id2 + k]);
    }
    const Geom g1{vectors(d.geom_xpos) + 3 * id1, vectors(d.geom_xmat) + 9 * id1, size1},
        g2{vectors(d.geom_xpos) + 3 * id2, vectors(d.geom_xmat) + 9 * id2, size2};
    const double reach = d.pair_margin[i] + d.pair_gap[i];
    const unsigned near = bits(~are_apart(m, id1, id2, g1, g2, reach)) & c.rows;
    if (near == 0) continue;
    const V margin = splat(reach);
    Contact found[kMostFound];
    int count = 1;
    switch (pair.shapes) {
      case Shapes::plane_sphere: PlaneSphere(found[0], margin, g1, g2.pos, g2.size[0]); break;
      case Shapes::plane_capsule:
        PlaneCapsule(found, margin, g1, g2);
        count = 2;
        break;
      case Shapes::plane_cylinder:
        PlaneCylinder<true>(found, margin, g1, g2);
        count = 4;
        break;
      case Shapes::capsule_capsule: count = CapsuleCapsule(found, margin, g1, g2); break;
      case Shapes::sphere_capsule: SphereCapsule(found[0], margin, g1, g2); break;
      case Shapes::sphere_sphere: SphereSphere<true>(found[0], margin, g1, g1.pos, g2, g2.pos); break;
      case Shapes::sphere_box: SphereBox<true>(found[0], margin, g1, g2); break;
      default: return false;
    }
    for (int k = 0; k < count; ++k) {
      Contact& con = found[k];
      const unsigned rows = bits(con.is_there) & near;
      if (rows == 0) continue;
      if (pair.can_be_missed && (uncertain(con.dist, margin) & rows) != 0) return false;
      if ((bits(makeFrame(con.frame)) & rows) != 0 || c.contact_count == Contacts::kCapacity) return false;
      const int n = c.contact_count++;
      const unsigned included = rows & bits(con.dist < includemargin(d, i));
      c.contacts[n] = {i, included, rows, {}};
      for (int lane = 0; lane < kWidth; ++lane) {
        c.found[lane] += rows >> lane & 1;
        if (included >> lane & 1) c.constraints[lane] += constraints_of(pair, m.opt.cone);
      }
      vectors(c.dist)[n] = con.dist;
      copy(vectors(c.pos) + 3 * n, con.pos, 3);
      copy(vectors(c.frame) + 9 * n, con.frame, 9);
    }
  }
  return true;
}

}  // namespace
}  // namespace mjenv::core::lanes
