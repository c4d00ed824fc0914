// The contacts of planes, spheres, capsules, cylinders and boxes, and frames of contacts, as every version of MuJoCo computes
// them, for several rows at once.
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

// mjc_PlaneCylinder. kSquares: as of SphereSphere.
template <bool kSquares>
inline void PlaneCylinder(Contact* con, V margin, const Geom& plane, const Geom& cylinder) {
  V normal[3], axis[3], vec[3], vec1[3];
  plane.axis(normal, 1);
  cylinder.axis(axis, 1);
  V prjaxis = dot3(normal, axis);
  const Mask is_away = prjaxis > V{};
  for (int k = 0; k < 3; ++k) axis[k] = is_away ? axis[k] * -1.0 : axis[k];
  prjaxis = is_away ? -prjaxis : prjaxis;
  for (int k = 0; k < 3; ++k) vec[k] = cylinder.pos[k] - plane.pos[k];
  const V dist0 = dot3(vec, normal);

  for (int k = 0; k < 3; ++k) vec[k] = axis[k] * prjaxis - normal[k];
  const V square = dot3(vec, vec), len = sqrt(square), scale = cylinder.size[0] / len;
  const Mask is_parallel = ~(kSquares ? square >= splat(mjMINVAL * mjMINVAL) : len >= splat(mjMINVAL));
  for (int k = 0; k < 3; ++k) vec[k] = is_parallel ? cylinder.mat[3 * k] * cylinder.size[0] : vec[k] * scale;
  const V prjvec = dot3(vec, normal), prjvec1 = -prjvec * 0.5;
  for (int k = 0; k < 3; ++k) axis[k] *= cylinder.size[1];
  prjaxis *= cylinder.size[1];

  cross(vec1, vec, axis);
  normalize3(vec1);
  const V side = cylinder.size[0] * std::sqrt(3.0) / 2.0;
  for (int k = 0; k < 3; ++k) vec1[k] *= side;

  // The two ends of the line on the cylinder that is nearest to the plane, and two more points on the circle that is
  // nearer to the plane.
  con[0].dist = dist0 + prjaxis + prjvec;
  con[1].dist = dist0 - prjaxis + prjvec;
  con[2].dist = con[3].dist = dist0 + prjaxis + prjvec1;
  const Mask is_near = con[0].dist <= margin;
  for (int i = 0; i < 4; ++i) {
    con[i].is_there = is_near & (con[i].dist <= margin);
    for (int k = 0; k < 3; ++k) {
      const V* const from = cylinder.pos;
      V at = i < 2 ? from[k] + vec[k] : (i == 2 ? from[k] + vec1[k] : from[k] - vec1[k]);
      at = i == 1 ? at - axis[k] : at + axis[k];
      if (i > 1) at += vec[k] * -0.5;
      con[i].pos[k] = at + normal[k] * (-con[i].dist * 0.5);
    }
    copy(con[i].frame, normal, 3);
    zero(con[i].frame + 3, 3);
  }
}

// ---- engine_collision_box.c ----

// _SphereBox. kDepth: of a sphere whose centre is in the box, MuJoCo takes the depth of the centre, as since MuJoCo 3.
template <bool kDepth>
inline void SphereBox(Contact& con, V margin, const Geom& sphere, const Geom& box) {
  V tmp[3], center[3], clamped[3], pos[3];
  for (int k = 0; k < 3; ++k) tmp[k] = sphere.pos[k] - box.pos[k];
  rotVecMatT(center, tmp, box.mat);
  for (int k = 0; k < 3; ++k) {
    const V limit = box.size[k];
    clamped[k] = center[k] < -limit ? -limit : (center[k] > limit ? limit : center[k]);
    tmp[k] = clamped[k] - center[k];
  }
  const V dist = normalize3(tmp);
  con.dist = dist - sphere.size[0];
  con.is_there = ~(con.dist > margin);
  for (int k = 0; k < 3; ++k) {
    const V deepest = center[k] + tmp[k] * sphere.size[0];
    pos[k] = V{} + clamped[k] * 0.5 + deepest * 0.5;
  }
  const Mask is_inside = dist <= splat(mjMINVAL);
  if (__builtin_expect(any(is_inside), 0)) {
    V closest = (box.size[0] + box.size[1] + box.size[2]) * 2.0, nearest[3] = {};
    for (int i = 0; i < 6; ++i) {
      const V far = abs((i % 2 ? 1.0 : -1.0) * box.size[i / 2] - center[i / 2]);
      const Mask is_closer = closest > far;
      closest = is_closer ? far : closest;
      for (int k = 0; k < 3; ++k) nearest[k] = is_closer ? splat(k == i / 2 ? (i % 2 ? -1 : 1) : 0) : nearest[k];
    }
    const V scale = (sphere.size[0] - closest) * 0.5;
    for (int k = 0; k < 3; ++k) {
      pos[k] = is_inside ? center[k] + nearest[k] * scale : pos[k];
      tmp[k] = is_inside ? nearest[k] : tmp[k];
    }
    if constexpr (kDepth) con.dist = is_inside ? -closest - sphere.size[0] : con.dist;
  }
  rotVecMat(con.frame, tmp, box.mat);
  rotVecMat(con.pos, pos, box.mat);
  add_to(con.pos, box.pos, 3);
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
