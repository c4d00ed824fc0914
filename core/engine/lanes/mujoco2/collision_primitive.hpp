// The contacts of planes, spheres, capsules, ellipsoids, cylinders and boxes, for several rows at once. The results
// have MuJoCo's bits for the reasons that smooth.hpp gives.
#pragma once

#include "engine/lanes/frame/collision_primitive.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_collision_primitive.c ----

constexpr int kMostFound = 4;  // the most contacts of a pair

inline V clip_to_segment(V x) { return x > splat(1) ? splat(1) : (x < splat(-1) ? splat(-1) : x); }

// mjc_SphereCapsule
inline void SphereCapsule(Contact& con, V margin, const Geom& sphere, const Geom& capsule) {
  V axis[3], vec[3];
  capsule.axis(axis, capsule.size[1]);
  for (int k = 0; k < 3; ++k) vec[k] = sphere.pos[k] - capsule.pos[k];
  const V x = clip_to_segment(dot3(axis, vec) / dot3(axis, axis));
  for (int k = 0; k < 3; ++k) vec[k] = axis[k] * x + capsule.pos[k];
  SphereSphere<false>(con, margin, sphere, sphere.pos, capsule, vec);
}

// mjc_CapsuleCapsule. Returns how many contacts of `con` it has set: one if the axes are parallel in no lane. For
// parallel capsules, it tries each of the four ends with the nearest point of the other capsule, and takes the first
// two contacts that it finds.
inline int CapsuleCapsule(Contact* con, V margin, const Geom& g1, const Geom& g2) {
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

  const auto touch = [&](Contact& contact, V along1, V along2) {
    for (int k = 0; k < 3; ++k) {
      vec1[k] = axis1[k] * along1 + g1.pos[k];
      vec2[k] = axis2[k] * along2 + g2.pos[k];
    }
    SphereSphere<false>(contact, margin, g1, vec1, g2, vec2);
  };
  touch(con[0], x1, x2);
  const Mask is_parallel = ~(abs(det) >= splat(mjMINVAL));
  if (__builtin_expect(!any(is_parallel), 1)) return 1;
  const Contact other = con[0];
  Mask has_one{}, has_two = ~is_parallel;
  for (int i = 0; i < 4; ++i) {
    const V end = splat(i % 2 == 0 ? 1 : -1);
    if (i < 2)
      touch(con[i], end, clip_to_segment((v - end * mb) / mc));
    else
      touch(con[i], clip_to_segment((u - end * mb) / ma), end);
    con[i].is_there &= ~has_two;
    has_two |= has_one & con[i].is_there;
    has_one |= con[i].is_there;
  }
  con[0].is_there = is_parallel ? con[0].is_there : other.is_there;
  con[0].dist = is_parallel ? con[0].dist : other.dist;
  for (int k = 0; k < 3; ++k) {
    con[0].pos[k] = is_parallel ? con[0].pos[k] : other.pos[k];
    con[0].frame[k] = is_parallel ? con[0].frame[k] : other.frame[k];
  }
  return 4;
}

// mjc_PlaneConvex for an ellipsoid
inline void PlaneEllipsoid(Contact& con, V margin, const Geom& plane, const Geom& ellipsoid) {
  V normal[3], away[3], dir[3], res[3], vec[3];
  plane.axis(normal, 1);
  for (int k = 0; k < 3; ++k) away[k] = -normal[k];
  rotVecMatT(dir, away, ellipsoid.mat);
  for (int k = 0; k < 3; ++k) res[k] = dir[k] * ellipsoid.size[k];
  normalize3(res);
  // mjc_PlaneConvex asks for the support point with the margin 0.
  for (int k = 0; k < 3; ++k) res[k] = res[k] * ellipsoid.size[k] + dir[k] * 0.0 / 2;
  rotVecMat(vec, res, ellipsoid.mat);
  add_to(vec, ellipsoid.pos, 3);
  for (int k = 0; k < 3; ++k) res[k] = vec[k] - plane.pos[k];
  con.dist = dot3(normal, res);
  con.is_there = ~(con.dist > margin);
  for (int k = 0; k < 3; ++k) con.pos[k] = vec[k] + normal[k] * (-0.5 * con.dist);
  copy(con.frame, normal, 3);
  zero(con.frame + 3, 3);
}

// mjc_PlaneBox. In each lane the contacts are those of the first four corners that touch, in the order of the corners.
inline void PlaneBox(Contact* con, V margin, const Geom& plane, const Geom& box) {
  V norm[3], dif[3], corner[3];
  plane.axis(norm, 1);
  for (int k = 0; k < 3; ++k) dif[k] = box.pos[k] - plane.pos[k];
  const V dist = dot3(dif, norm);
  V count{};
  for (int i = 0; i < 4; ++i) {
    con[i] = Contact{};
    copy(con[i].frame, norm, 3);
  }
  for (int i = 0; i < 8; ++i) {
    const V vec[3] = {i & 1 ? box.size[0] : -box.size[0], i & 2 ? box.size[1] : -box.size[1],
                      i & 4 ? box.size[2] : -box.size[2]};
    rotVecMat(corner, vec, box.mat);
    const V ldist = dot3(norm, corner), at = dist + ldist;
    const Mask is_there = ~((at > margin) | (ldist > V{}));
    if (!any(is_there)) continue;
    for (int slot = 0; slot < 4; ++slot) {
      const Mask is_next = is_there & (count == splat(slot));
      con[slot].is_there |= is_next;
      con[slot].dist = is_next ? at : con[slot].dist;
      for (int k = 0; k < 3; ++k)
        con[slot].pos[k] = is_next ? (corner[k] + box.pos[k]) + norm[k] * (-at * 0.5) : con[slot].pos[k];
    }
    count = is_there ? count + 1.0 : count;
  }
}

}  // namespace
}  // namespace mjenv::core::lanes
