// Functions of MuJoCo's engine_util_spatial.c, engine_util_blas.c and engine_core_smooth.c whose operations and their order
// are the same in every version. smooth.hpp of a version says why the bits are equal.
// A type parameter T is V for numbers that each row has, and double for numbers of the model, which all rows share.
#pragma once

#include <cmath>

#include "engine/lanes/frame/vector.hpp"
#include "engine/lanes/frame/version.hpp"

namespace mjenv::core::lanes {
namespace {

inline V dot3(const V* a, const V* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// mju_dot of six numbers
inline V dot6(const V* a, const V* b) {
  const V sum = (a[0] * b[0] + a[2] * b[2]) + (a[1] * b[1] + a[3] * b[3]);
  return sum + (a[4] * b[4] + a[5] * b[5]);
}

// mju_dot. Its four partial sums begin with a product, so they can be -0. With fewer than four products there is one
// sum, which begins at +0.
template <typename T>
inline V dot(const T* a, const V* b, int n) {
  V res{};
  int i = 0;
  if (n >= 4) {
    V res0 = a[0] * b[0], res1 = a[1] * b[1], res2 = a[2] * b[2], res3 = a[3] * b[3];
    for (i = 4; i <= n - 4; i += 4) {
      res0 += a[i] * b[i];
      res1 += a[i + 1] * b[i + 1];
      res2 += a[i + 2] * b[i + 2];
      res3 += a[i + 3] * b[i + 3];
    }
    res = (res0 + res2) + (res1 + res3);
  }
  if (n - i == 3)
    res += a[i] * b[i] + a[i + 1] * b[i + 1] + a[i + 2] * b[i + 2];
  else if (n - i == 2)
    res += a[i] * b[i] + a[i + 1] * b[i + 1];
  else if (n - i == 1)
    res += a[i] * b[i];
  return res;
}

// mju_normalize3
inline V normalize3(V* vec) {
  const V norm = sqrt(vec[0] * vec[0] + vec[1] * vec[1] + vec[2] * vec[2]);
  const Mask is_small = norm < splat(mjMINVAL);
  const V inverse = 1.0 / norm;
  for (int i = 0; i < 3; ++i) vec[i] *= inverse;
  if (__builtin_expect(any(is_small), 0))
    for (int i = 0; i < 3; ++i) vec[i] = is_small ? splat(i == 0) : vec[i];
  return norm;
}

// mju_rotVecMat
template <typename T>
inline void rotVecMat(V* res, const T* vec, const V* mat) {
  const V x = mat[0] * vec[0] + mat[1] * vec[1] + mat[2] * vec[2];
  const V y = mat[3] * vec[0] + mat[4] * vec[1] + mat[5] * vec[2];
  const V z = mat[6] * vec[0] + mat[7] * vec[1] + mat[8] * vec[2];
  res[0] = x;
  res[1] = y;
  res[2] = z;
}

// mju_rotVecMatT
inline void rotVecMatT(V* res, const V* vec, const V* mat) {
  const V x = mat[0] * vec[0] + mat[3] * vec[1] + mat[6] * vec[2];
  const V y = mat[1] * vec[0] + mat[4] * vec[1] + mat[7] * vec[2];
  const V z = mat[2] * vec[0] + mat[5] * vec[1] + mat[8] * vec[2];
  res[0] = x;
  res[1] = y;
  res[2] = z;
}

inline Mask is_null(const V* quat) {
  return (quat[0] == splat(1)) & (quat[1] == V{}) & (quat[2] == V{}) & (quat[3] == V{});
}

// mju_negQuat
inline void negQuat(V* res, const V* quat) {
  res[0] = quat[0];
  for (int k = 1; k < 4; ++k) res[k] = -quat[k];
}

// mju_axisAngle2Quat, given the sine and cosine of half the angle.
template <typename T>
inline void axisAngle2Quat(V* res, const T* axis, V angle, V sine, V cosine) {
  const Mask is_zero = angle == V{};
  res[0] = is_zero ? splat(1) : cosine;
  for (int i = 0; i < 3; ++i) res[i + 1] = is_zero ? V{} : axis[i] * sine;
}

// Computes the sines and cosines of half the angles by the C library, as MuJoCo does.
inline void half_sines(double* sine, double* cosine, const double* angle, int count) {
  for (int i = 0; i < count * kWidth; ++i) {
    const double half = angle[i] * 0.5;
    sine[i] = std::sin(half);
    cosine[i] = std::cos(half);
  }
}

// mju_quat2Vel with dt = 1. The C library computes the angle of each lane.
inline void quat2Vel(V* res, const V* quat) {
  V axis[3];
  copy(axis, quat + 1, 3);
  const V sine = normalize3(axis);
  V speed{};
  for (int lane = 0; lane < kWidth; ++lane) speed[lane] = 2 * std::atan2(sine[lane], quat[0][lane]);
  speed = speed > splat(mjPI) ? speed - 2 * mjPI : speed;
  for (int k = 0; k < 3; ++k) res[k] = axis[k] * speed;
}

// mju_cross
inline void cross(V* res, const V* a, const V* b) {
  const V x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
  res[0] = x;
  res[1] = y;
  res[2] = z;
}

// mju_crossMotion. It writes -x + y where `cross` has y - x; the bits are the same.
inline void crossMotion(V* res, const V* vel, const V* v) {
  cross(res, vel, v);
  V turn[3], shift[3];
  cross(turn, vel, v + 3);
  cross(shift, vel + 3, v);
  for (int i = 0; i < 3; ++i) res[i + 3] = turn[i] + shift[i];
}

// mju_crossForce
inline void crossForce(V* res, const V* vel, const V* f) {
  V turn[3], shift[3];
  cross(turn, vel, f);
  cross(shift, vel + 3, f + 3);
  cross(res + 3, vel, f + 3);
  for (int i = 0; i < 3; ++i) res[i] = turn[i] + shift[i];
}

// mju_inertCom
inline void inertCom(V* res, const V* inert, const V* mat, const V* dif, V mass) {
  const V tmp[9] = {mat[0] * inert[0], mat[3] * inert[0], mat[6] * inert[0], mat[1] * inert[1], mat[4] * inert[1],
                    mat[7] * inert[1], mat[2] * inert[2], mat[5] * inert[2], mat[8] * inert[2]};
  res[0] = mat[0] * tmp[0] + mat[1] * tmp[3] + mat[2] * tmp[6] + mass * (dif[1] * dif[1] + dif[2] * dif[2]);
  res[1] = mat[3] * tmp[1] + mat[4] * tmp[4] + mat[5] * tmp[7] + mass * (dif[0] * dif[0] + dif[2] * dif[2]);
  res[2] = mat[6] * tmp[2] + mat[7] * tmp[5] + mat[8] * tmp[8] + mass * (dif[0] * dif[0] + dif[1] * dif[1]);
  res[3] = mat[0] * tmp[1] + mat[1] * tmp[4] + mat[2] * tmp[7] - mass * dif[0] * dif[1];
  res[4] = mat[0] * tmp[2] + mat[1] * tmp[5] + mat[2] * tmp[8] - mass * dif[0] * dif[2];
  res[5] = mat[3] * tmp[2] + mat[4] * tmp[5] + mat[5] * tmp[8] - mass * dif[1] * dif[2];
  for (int i = 0; i < 3; ++i) res[i + 6] = mass * dif[i];
  res[9] = mass;
}

// mju_mulInertVec
inline void mulInertVec(V* res, const V* i, const V* v) {
  res[0] = i[0] * v[0] + i[3] * v[1] + i[4] * v[2] - i[8] * v[4] + i[7] * v[5];
  res[1] = i[3] * v[0] + i[1] * v[1] + i[5] * v[2] + i[8] * v[3] - i[6] * v[5];
  res[2] = i[4] * v[0] + i[5] * v[1] + i[2] * v[2] - i[7] * v[3] + i[6] * v[4];
  res[3] = i[8] * v[1] - i[7] * v[2] + i[9] * v[3];
  res[4] = i[6] * v[2] - i[8] * v[0] + i[9] * v[4];
  res[5] = i[7] * v[0] - i[6] * v[1] + i[9] * v[5];
}

// mju_mulDofVec. For two or more columns MuJoCo calls mju_mulMatTVec, whose sums begin at +0.
inline void mulDofVec(V* res, const V* dof, const V* vec, int n) {
  if (n == 1) {
    for (int k = 0; k < 6; ++k) res[k] = dof[k] * vec[0];
    return;
  }
  zero(res, 6);
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < 6; ++k) res[k] += dof[6 * i + k] * vec[i];
}

// mju_transformSpatial of a motion
inline void transformMotion(V* res, const V* vec, const V* newpos, const V* oldpos, const V* rotation) {
  V shift[3], turned[3], moved[3];
  for (int i = 0; i < 3; ++i) shift[i] = newpos[i] - oldpos[i];
  cross(turned, shift, vec);
  for (int i = 0; i < 3; ++i) moved[i] = vec[i + 3] - turned[i];
  rotVecMatT(res, vec, rotation);
  rotVecMatT(res + 3, moved, rotation);
}

// mju_clip
inline V clip(V x, const V* range) { return x < range[0] ? range[0] : (x > range[1] ? range[1] : x); }

// The column of mj_jac for a dof that moves the body: the velocity that the dof gives to a point. offset: from the
// centre of mass of the body's tree to the point.
inline void jac(const Lanes& d, V* res, int dof, const V* offset) {
  V shift[3];
  const V* const cdof = vectors(d.cdof) + 6 * dof;
  cross(shift, cdof, offset);
  for (int k = 0; k < 3; ++k) res[k] = cdof[3 + k] + shift[k];
}

// The offset of a point from the centre of mass of a body's tree
inline void offset_of(const Lanes& d, V* res, int body, const V* point) {
  const V* const com = vectors(d.subtree_com) + 3 * d.model->body_rootid[body];
  for (int k = 0; k < 3; ++k) res[k] = point[k] - com[k];
}

// The last dof that moves a body; negative if there is none.
inline int last_dof(const mjModel& m, int body) {
  while (body && !m.body_dofnum[body]) body = m.body_parentid[body];
  return m.body_dofadr[body] + m.body_dofnum[body] - 1;
}

// mj_applyFT: adds to qfrc what a force and a torque on a point of a body do to the dofs.
void applyFT(Lanes& d, const V* force, const V* torque, const V* point, int body, V* qfrc) {
  const mjModel& m = *d.model;
  const V* const cdof = vectors(d.cdof);
  V offset[3];
  offset_of(d, offset, body, point);
  // mj_jac, then mju_mulMatTVec for the force and for the torque, column by column
  for (int i = last_dof(m, body); i >= 0; i = m.dof_parentid[i]) {
    V column[3];
    jac(d, column, i, offset);
    qfrc[i] += V{} + column[0] * force[0] + column[1] * force[1] + column[2] * force[2];
    qfrc[i] += V{} + cdof[6 * i] * torque[0] + cdof[6 * i + 1] * torque[1] + cdof[6 * i + 2] * torque[2];
  }
}

// mju_dist3
inline V distance(const V* from, const V* to) {
  V dif[3];
  for (int k = 0; k < 3; ++k) dif[k] = to[k] - from[k];
  return sqrt(dot3(dif, dif));
}

// Calls use(dof, part) for each dof that moves one of two bodies. part: by how much the dof moves two points of them apart,
// as mj_tendon computes it.
template <typename Use>
void stretch(const Lanes& d, int body1, int body2, const V* point1, const V* point2, const Use& use) {
  const mjModel& m = *d.model;
  V direction[3], offset1[3], offset2[3];
  for (int k = 0; k < 3; ++k) direction[k] = point2[k] - point1[k];
  normalize3(direction);
  offset_of(d, offset1, body1, point1);
  offset_of(d, offset2, body2, point2);
  for (int dof1 = last_dof(m, body1), dof2 = last_dof(m, body2); dof1 >= 0 || dof2 >= 0;) {
    const int dof = dof1 > dof2 ? dof1 : dof2;
    V jac1[3]{}, jac2[3]{}, part{};
    if (dof1 == dof) jac(d, jac1, dof, offset1), dof1 = m.dof_parentid[dof];
    if (dof2 == dof) jac(d, jac2, dof, offset2), dof2 = m.dof_parentid[dof];
    for (int k = 0; k < 3; ++k) part += (jac2[k] - jac1[k]) * direction[k];
    use(dof, part);
  }
}

// The length that mj_tendon computes of a tendon along joints
inline V length_along_joints(const Lanes& d, int tendon) {
  const mjModel& m = *d.model;
  V length{};
  for (int j = m.tendon_adr[tendon]; j < m.tendon_adr[tendon] + m.tendon_num[tendon]; ++j)
    length += vectors(d.wrap_prm)[j] * vectors(d.qpos)[m.jnt_qposadr[m.wrap_objid[j]]];
  return length;
}

// The positions and orientations of the lanes if rows have their own, otherwise those of the model.
template <bool kAreOwn>
auto frames_of(const double* own, const double* shared) {
  if constexpr (kAreOwn)
    return vectors(own);
  else
    return shared;
}

// The second half of mj_comPos, which begins when subtree_com is computed. The numbers of cinert and cdof that are always
// 0 are 0 from the beginning (Memory).
inline void inertias_and_axes(Lanes& d) {
  const mjModel& m = *d.model;
  const V *const com = vectors(d.subtree_com), *const xipos = vectors(d.xipos), *const xmat = vectors(d.xmat),
                 *const xaxis = vectors(d.xaxis);
  V* const cdof = vectors(d.cdof);

  for (int i = 1; i < m.nbody; ++i) {
    V offset[3];
    for (int k = 0; k < 3; ++k) offset[k] = xipos[3 * i + k] - com[3 * m.body_rootid[i] + k];
    inertCom(vectors(d.cinert) + 10 * i, vectors(d.body_inertia) + 3 * i, vectors(d.ximat) + 9 * i, offset,
             vectors(d.body_mass)[i]);
  }

  for (int j = 0; j < m.njnt; ++j) {
    V* res = cdof + 6 * m.jnt_dofadr[j];
    const int body = m.jnt_bodyid[j];
    V offset[3];
    for (int k = 0; k < 3; ++k) offset[k] = com[3 * m.body_rootid[body] + k] - vectors(d.xanchor)[3 * j + k];
    switch (m.jnt_type[j]) {
      case mjJNT_FREE:
        for (int k = 0; k < 3; ++k) res[3 + 7 * k] = splat(1);
        res += 18;
        [[fallthrough]];
      case mjJNT_BALL:
        for (int i = 0; i < 3; ++i, res += 6) {
          for (int k = 0; k < 3; ++k) res[k] = xmat[9 * body + i + 3 * k];
          cross(res + 3, res, offset);
        }
        break;
      case mjJNT_SLIDE: copy(res + 3, xaxis + 3 * j, 3); break;
      default: copy(res, xaxis + 3 * j, 3); cross(res + 3, res, offset);
    }
  }
}

// mj_comVel. From the beginning, the velocity of the world is 0, and so is cdof_dot of the translations of free joints.
void comVel(Lanes& d) {
  const mjModel& m = *d.model;
  V *const cvel = vectors(d.cvel), *const cdof_dot = vectors(d.cdof_dot);
  const V *const cdof = vectors(d.cdof), *const qvel = vectors(d.qvel);

  for (int i = 1; i < m.nbody; ++i) {
    V vel[6], tmp[6];
    copy(vel, cvel + 6 * m.body_parentid[i], 6);
    const int end = m.body_dofadr[i] + m.body_dofnum[i];
    for (int j = m.body_dofadr[i]; j < end;) {
      switch (m.jnt_type[m.dof_jntid[j]]) {
        case mjJNT_FREE:
          mulDofVec(tmp, cdof + 6 * j, qvel + j, 3);
          add_to(vel, tmp, 6);
          j += 3;
          [[fallthrough]];
        case mjJNT_BALL:
          for (int k = j; k < j + 3; ++k) crossMotion(cdof_dot + 6 * k, vel, cdof + 6 * k);
          mulDofVec(tmp, cdof + 6 * j, qvel + j, 3);
          add_to(vel, tmp, 6);
          j += 3;
          break;
        default:
          crossMotion(cdof_dot + 6 * j, vel, cdof + 6 * j);
          mulDofVec(tmp, cdof + 6 * j, qvel + j, 1);
          add_to(vel, tmp, 6);
          ++j;
      }
    }
    copy(cvel + 6 * i, vel, 6);
  }
}

// mj_rne with flg_acc = 0: without qacc. Of the world's numbers in cacc, only those of gravity are written; the others
// are 0 from the beginning.
void rne(Lanes& d) {
  const mjModel& m = *d.model;
  V *const cacc = vectors(d.rne_cacc), *const cfrc = vectors(d.rne_cfrc_body);
  const V *const cinert = vectors(d.cinert), *const cvel = vectors(d.cvel);

  if (!(m.opt.disableflags & mjDSBL_GRAVITY))
    for (int k = 0; k < 3; ++k) cacc[k + 3] = vectors(d.gravity)[k] * -1.0;
  for (int i = 1; i < m.nbody; ++i) {
    const int first = m.body_dofadr[i], count = m.body_dofnum[i];
    V tmp[6], momentum[6], turned[6], acc[6];
    zero(tmp, 6);
    if (count > 0) mulDofVec(tmp, vectors(d.cdof_dot) + 6 * first, vectors(d.qvel) + first, count);
    for (int k = 0; k < 6; ++k) acc[k] = cacc[6 * m.body_parentid[i] + k] + tmp[k];
    copy(cacc + 6 * i, acc, 6);
    mulInertVec(tmp, cinert + 10 * i, acc);
    mulInertVec(momentum, cinert + 10 * i, cvel + 6 * i);
    crossForce(turned, cvel + 6 * i, momentum);
    for (int k = 0; k < 6; ++k) cfrc[6 * i + k] = tmp[k] + turned[k];
  }
  for (int i = m.nbody - 1; i > 0; --i)
    if (m.body_parentid[i] > 0) add_to(cfrc + 6 * m.body_parentid[i], cfrc + 6 * i, 6);
  for (int i = 0; i < m.nv; ++i) vectors(d.qfrc_bias)[i] = dot6(vectors(d.cdof) + 6 * i, cfrc + 6 * m.dof_bodyid[i]);
}

}  // namespace
}  // namespace mjenv::core::lanes
