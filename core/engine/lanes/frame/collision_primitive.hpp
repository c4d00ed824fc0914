// The contacts of planes, spheres and capsules, and frames of contacts, as every version of MuJoCo computes them, for
// several rows at once.
#pragma once

#include "engine/lanes/frame/spatial.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_collision_primitive.c ----

// A contact in the lanes of a mask.
struct Contact {
  V dist, pos[3], frame[9];
  Mask is_there;
};

struct Geom {
  const V *pos, *mat, *size;

  // The z-axis
  template <typename Scale>
  void axis(V* res, Scale scale) const {
    for (int k = 0; k < 3; ++k) res[k] = mat[3 * k + 2] * scale;
  }
};

// _PlaneSphere. pos, radius: the sphere's.
inline void PlaneSphere(Contact& con, V margin, const Geom& plane, const V* pos, V radius) {
  V tmp[3];
  plane.axis(con.frame, 1);
  for (int k = 0; k < 3; ++k) tmp[k] = pos[k] - plane.pos[k];
  const V cdist = dot3(tmp, con.frame);
  con.is_there = ~(cdist > margin + radius);
  con.dist = cdist - radius;
  const V scale = -con.dist * 0.5 - radius;
  for (int k = 0; k < 3; ++k) con.pos[k] = pos[k] + con.frame[k] * scale;
  zero(con.frame + 3, 3);
}

// mjc_PlaneCapsule
inline void PlaneCapsule(Contact* con, V margin, const Geom& plane, const Geom& capsule) {
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

// _SphereSphere. pos1, pos2: the spheres' positions. kSquares: MuJoCo compares squares of distances, as since MuJoCo 3.
template <bool kSquares>
inline void SphereSphere(Contact& con, V margin, const Geom& g1, const V* pos1, const Geom& g2, const V* pos2) {
  V dif[3];
  for (int k = 0; k < 3; ++k) dif[k] = pos1[k] - pos2[k];
  const V square = dot3(dif, dif), cdist = sqrt(square), reach = margin + g1.size[0] + g2.size[0];
  con.is_there = kSquares ? ~(square > reach * reach) : ~(cdist > reach);
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

// ---- engine_util_spatial.c ----

// mju_makeFrame. Returns the lanes in which MuJoCo's function would fail.
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

}  // namespace
}  // namespace mjenv::core::lanes
