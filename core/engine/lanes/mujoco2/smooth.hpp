// MuJoCo 2.2.2's smooth dynamics for several rows at once: lane l of each vector belongs to row l. Each function
// repeats, in every lane, the operations of the MuJoCo function that its comment or name gives, on the same numbers and
// in the same order, so the bits are equal.
//
// Where MuJoCo branches on a number, a lane does what gives the same bits:
// - Where MuJoCo skips a zero in a sum, a lane adds it. The sum begins at +0 and so never becomes -0, and adding a zero
//   does not change it.
// - At other branches both results are computed, and each lane takes the one of its own branch.
// This is right only for finite numbers. A lane that meets other numbers is left to MuJoCo's own code.
#pragma once

#include <cmath>

#include "engine/lanes/frame/spatial.hpp"
#include "engine/lanes/mujoco2/lanes.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_util_blas.c and engine_util_spatial.c ----
// A type parameter T is V for numbers that each row has, and double for numbers of the model, which all rows share.

// mju_normalize4
inline void normalize4(V* vec) {
  const V norm = sqrt(vec[0] * vec[0] + vec[1] * vec[1] + vec[2] * vec[2] + vec[3] * vec[3]);
  const Mask is_small = norm < splat(mjMINVAL);
  const V inverse = 1.0 / norm;
  for (int i = 0; i < 4; ++i) vec[i] *= inverse;
  if (__builtin_expect(any(is_small), 0))
    for (int i = 0; i < 4; ++i) vec[i] = is_small ? splat(i == 0) : vec[i];
}

// mju_mulQuatAxis
inline void mulQuatAxis(V* res, const V* quat, const V* axis) {
  res[0] = -quat[1] * axis[0] - quat[2] * axis[1] - quat[3] * axis[2];
  res[1] = quat[0] * axis[0] + quat[2] * axis[2] - quat[3] * axis[1];
  res[2] = quat[0] * axis[1] + quat[3] * axis[0] - quat[1] * axis[2];
  res[3] = quat[0] * axis[2] + quat[1] * axis[1] - quat[2] * axis[0];
}

// mju_rotVecQuat. MuJoCo copies the vector if the quaternion is null (1, 0, 0, 0). The general formula has the same
// result, except that it turns -0 into +0.
template <typename T>
inline void rotVecQuat(V* res, const T* vec, const V* quat, bool has_negative_zeros) {
  const V tmp0 = quat[0] * vec[0] + quat[2] * vec[2] - quat[3] * vec[1];
  const V tmp1 = quat[0] * vec[1] + quat[3] * vec[0] - quat[1] * vec[2];
  const V tmp2 = quat[0] * vec[2] + quat[1] * vec[1] - quat[2] * vec[0];
  const V x = vec[0] + 2.0 * (quat[2] * tmp2 - quat[3] * tmp1);
  const V y = vec[1] + 2.0 * (quat[3] * tmp0 - quat[1] * tmp2);
  const V z = vec[2] + 2.0 * (quat[1] * tmp1 - quat[2] * tmp0);
  res[0] = x;
  res[1] = y;
  res[2] = z;
  if (__builtin_expect(has_negative_zeros, 0)) {
    const Mask null = is_null(quat);
    for (int i = 0; i < 3; ++i) res[i] = null ? splat(vec[i]) : res[i];
  }
}

// mju_mulQuat
template <typename T>
inline void mulQuat(V* res, const V* qa, const T* qb) {
  const V w = qa[0] * qb[0] - qa[1] * qb[1] - qa[2] * qb[2] - qa[3] * qb[3];
  const V x = qa[0] * qb[1] + qa[1] * qb[0] + qa[2] * qb[3] - qa[3] * qb[2];
  const V y = qa[0] * qb[2] - qa[1] * qb[3] + qa[2] * qb[0] + qa[3] * qb[1];
  const V z = qa[0] * qb[3] + qa[1] * qb[2] - qa[2] * qb[1] + qa[3] * qb[0];
  res[0] = w;
  res[1] = x;
  res[2] = y;
  res[3] = z;
}

// mju_subQuat
inline void subQuat(V* res, const V* qa, const V* qb) {
  V negative[4], dif[4];
  negQuat(negative, qb);
  mulQuat(dif, negative, qa);
  quat2Vel(res, dif);
}

// mju_quat2Mat. MuJoCo returns the identity for a null quaternion (1, 0, 0, 0). The general formula gives the same
// except for signs of zeros.
inline void quat2Mat(V* res, const V* quat) {
  const V q00 = quat[0] * quat[0], q01 = quat[0] * quat[1], q02 = quat[0] * quat[2], q03 = quat[0] * quat[3];
  const V q11 = quat[1] * quat[1], q12 = quat[1] * quat[2], q13 = quat[1] * quat[3];
  const V q22 = quat[2] * quat[2], q23 = quat[2] * quat[3], q33 = quat[3] * quat[3];
  const Mask null = is_null(quat);
  res[0] = q00 + q11 - q22 - q33;
  res[4] = q00 - q11 + q22 - q33;
  res[8] = q00 - q11 - q22 + q33;
  res[1] = 2.0 * (q12 - q03);
  res[2] = 2.0 * (q13 + q02);
  res[3] = 2.0 * (q12 + q03);
  res[5] = 2.0 * (q23 - q01);
  res[6] = 2.0 * (q13 - q02);
  res[7] = 2.0 * (q23 + q01);
  if (__builtin_expect(any(null), 0))
    for (int i = 0; i < 9; ++i) res[i] = null ? splat(i % 4 == 0) : res[i];
}

// mju_quatIntegrate
inline void quatIntegrate(V* quat, const V* vel, V scale) {
  V tmp[4], rotation[4];
  copy(tmp, vel, 3);
  const V angle = scale * normalize3(tmp);
  V sine{}, cosine{};
  half_sines(reinterpret_cast<double*>(&sine), reinterpret_cast<double*>(&cosine),
             reinterpret_cast<const double*>(&angle), 1);
  axisAngle2Quat(rotation, tmp, angle, sine, cosine);
  mulQuat(tmp, quat, rotation);
  normalize4(tmp);
  copy(quat, tmp, 4);
}

// ---- engine_support.c ----

// mj_local2Global. Compilers would not inline it by themselves, because it has several instances.
template <typename T, typename U>
inline __attribute__((always_inline)) void local2Global(const Lanes& d, V* xpos, V* xmat, const T* pos, const U* quat,
                                                        int body, int sameframe) {
  if (sameframe == 0) {
    rotVecMat(xpos, pos, vectors(d.xmat) + 9 * body);
    add_to(xpos, vectors(d.xpos) + 3 * body, 3);
    V tmp[4];
    mulQuat(tmp, vectors(d.xquat) + 4 * body, quat);
    quat2Mat(xmat, tmp);
  } else {
    copy(xpos, vectors(sameframe == 1 ? d.xpos : d.xipos) + 3 * body, 3);
    copy(xmat, vectors(sameframe == 1 ? d.xmat : d.ximat) + 9 * body, 9);
  }
}

// mj_integratePos
void integratePos(const mjModel& m, V* qpos, const V* qvel, V dt) {
  for (int j = 0; j < m.njnt; ++j) {
    V* q = qpos + m.jnt_qposadr[j];
    const V* v = qvel + m.jnt_dofadr[j];
    switch (m.jnt_type[j]) {
      case mjJNT_FREE:
        for (int i = 0; i < 3; ++i) q[i] += dt * v[i];
        quatIntegrate(q + 3, v + 3, dt);
        break;
      case mjJNT_BALL: quatIntegrate(q, v, dt); break;
      default: q[0] += dt * v[0];
    }
  }
}

// A number of a pair of geoms: the rows' own, or that of the shared model.
inline V pair_number(const Lanes& d, int pair, const double* own, double PairNumbers::*shared) {
  return d.has_own_pairs ? vectors(own)[pair] : splat(d.pairs[pair].numbers.*shared);
}
inline V includemargin(const Lanes& d, int pair) {
  return pair_number(d, pair, d.pair_includemargin, &PairNumbers::includemargin);
}

// ---- engine_core_smooth.c: positions ----

// mj_kinematics. kAreOwn: rows have their own positions and orientations.
template <bool kAreOwn>
void place(Lanes& d) {
  const mjModel& m = *d.model;
  V *const qpos = vectors(d.qpos), *const xpos = vectors(d.xpos), *const xquat = vectors(d.xquat),
           *const xmat = vectors(d.xmat), *const xanchor = vectors(d.xanchor), *const xaxis = vectors(d.xaxis),
           *const angle = vectors(d.angle);
  const V *const sine = vectors(d.sine), *const cosine = vectors(d.cosine);
  const int *const jnt_type = m.jnt_type, *const jnt_qposadr = m.jnt_qposadr;
  const bool negative_zeros = d.has_negative_zeros;
  const auto qpos0 = frames_of<kAreOwn>(d.qpos0, m.qpos0), jnt_pos = frames_of<kAreOwn>(d.jnt_pos, m.jnt_pos),
             jnt_axis = frames_of<kAreOwn>(d.jnt_axis, m.jnt_axis);

  int hinges = 0;
  for (int i = 0; i < m.njnt; ++i) {
    V* q = qpos + jnt_qposadr[i];
    if (jnt_type[i] == mjJNT_FREE) normalize4(q + 3);
    if (jnt_type[i] == mjJNT_BALL) normalize4(q);
    if (jnt_type[i] == mjJNT_HINGE) angle[hinges++] = q[0] - qpos0[jnt_qposadr[i]];
  }
  half_sines(d.sine, d.cosine, d.angle, hinges);
  for (int i = 0; i < m.nmocap; ++i) normalize4(vectors(d.mocap_quat) + 4 * i);

  int hinge = 0;
  for (int i = 1; i < m.nbody; ++i) {
    V pos[3], quat[4];
    const int first = m.body_jntadr[i], count = m.body_jntnum[i];
    if (count == 1 && jnt_type[first] == mjJNT_FREE) {
      copy(pos, qpos + jnt_qposadr[first], 3);
      copy(quat, qpos + jnt_qposadr[first] + 3, 4);
      copy(xanchor + 3 * first, pos, 3);
      for (int k = 0; k < 3; ++k) xaxis[3 * first + k] = splat(k == 2);
    } else {
      const int parent = m.body_parentid[i];
      const int mocap = m.body_mocapid[i];
      V vec[3];
      if (mocap >= 0) {
        rotVecMat(vec, vectors(d.mocap_pos) + 3 * mocap, xmat + 9 * parent);
        mulQuat(quat, xquat + 4 * parent, vectors(d.mocap_quat) + 4 * mocap);
      } else {
        rotVecMat(vec, frames_of<kAreOwn>(d.body_pos, m.body_pos) + 3 * i, xmat + 9 * parent);
        mulQuat(quat, xquat + 4 * parent, frames_of<kAreOwn>(d.body_quat, m.body_quat) + 4 * i);
      }
      for (int k = 0; k < 3; ++k) pos[k] = xpos[3 * parent + k] + vec[k];
      for (int j = first; j < first + count; ++j) {
        const auto axis = jnt_axis + 3 * j;
        V anchor[3];
        rotVecQuat(xaxis + 3 * j, axis, quat, negative_zeros);
        rotVecQuat(anchor, jnt_pos + 3 * j, quat, negative_zeros);
        add_to(anchor, pos, 3);
        if (jnt_type[j] == mjJNT_SLIDE) {
          const V length = qpos[jnt_qposadr[j]] - qpos0[jnt_qposadr[j]];
          for (int k = 0; k < 3; ++k) pos[k] += xaxis[3 * j + k] * length;
        } else {
          V local[4], turned[3];
          if (jnt_type[j] == mjJNT_BALL) {
            copy(local, qpos + jnt_qposadr[j], 4);
          } else {
            axisAngle2Quat(local, axis, angle[hinge], sine[hinge], cosine[hinge]);
            ++hinge;
          }
          mulQuat(quat, quat, local);
          rotVecQuat(turned, jnt_pos + 3 * j, quat, negative_zeros);
          for (int k = 0; k < 3; ++k) pos[k] += (anchor[k] - pos[k]) - turned[k];
        }
        copy(xanchor + 3 * j, anchor, 3);
      }
    }
    normalize4(quat);
    copy(xquat + 4 * i, quat, 4);
    copy(xpos + 3 * i, pos, 3);
    quat2Mat(xmat + 9 * i, quat);
  }

  for (int i = 1; i < m.nbody; ++i)
    local2Global(d, vectors(d.xipos) + 3 * i, vectors(d.ximat) + 9 * i, vectors(d.body_ipos) + 3 * i,
                 frames_of<kAreOwn>(d.body_iquat, m.body_iquat) + 4 * i, i, m.body_sameframe[i]);
  for (int i = 0; i < m.ngeom; ++i)
    local2Global(d, vectors(d.geom_xpos) + 3 * i, vectors(d.geom_xmat) + 9 * i,
                 frames_of<kAreOwn>(d.geom_pos, m.geom_pos) + 3 * i,
                 frames_of<kAreOwn>(d.geom_quat, m.geom_quat) + 4 * i, m.geom_bodyid[i], m.geom_sameframe[i]);
  for (int i = 0; i < m.nsite; ++i)
    local2Global(d, vectors(d.site_xpos) + 3 * i, vectors(d.site_xmat) + 9 * i,
                 frames_of<kAreOwn>(d.site_pos, m.site_pos) + 3 * i,
                 frames_of<kAreOwn>(d.site_quat, m.site_quat) + 4 * i, m.site_bodyid[i], m.site_sameframe[i]);
}

void kinematics(Lanes& d) { d.has_own_frames ? place<true>(d) : place<false>(d); }

// mj_comPos
void comPos(Lanes& d) {
  const mjModel& m = *d.model;
  V* const com = vectors(d.subtree_com);
  const V* const xipos = vectors(d.xipos);

  zero(com, 3 * m.nbody);
  for (int i = m.nbody - 1; i >= 0; --i) {
    const V mass = vectors(d.body_mass)[i], scale = vectors(d.com_scale)[i];
    V sum[3];
    for (int k = 0; k < 3; ++k) sum[k] = com[3 * i + k] + xipos[3 * i + k] * mass;
    if (i > 0) add_to(com + 3 * m.body_parentid[i], sum, 3);
    for (int k = 0; k < 3; ++k) com[3 * i + k] = scale == V{} ? xipos[3 * i + k] : sum[k] * scale;
  }
  inertias_and_axes(d);
}

// mj_crb
void crb(Lanes& d) {
  const mjModel& m = *d.model;
  V *const inertia = vectors(d.crb), *const qM = vectors(d.qM);
  const V* const cdof = vectors(d.cdof);
  const int *const body_parentid = m.body_parentid, *const dof_parentid = m.dof_parentid;

  copy(inertia, vectors(d.cinert), 10 * m.nbody);
  for (int i = m.nbody - 1; i > 0; --i)
    if (body_parentid[i] > 0) add_to(inertia + 10 * body_parentid[i], inertia + 10 * i, 10);

  for (int i = m.nv - 1; i >= 0; --i) {
    int adr = m.dof_Madr[i];
    if (m.dof_simplenum[i]) {
      qM[adr] = vectors(d.dof_M0)[i];
      for (int j = dof_parentid[i]; j >= 0; j = dof_parentid[j]) qM[++adr] = V{};
      continue;
    }
    V tmp[6];
    mulInertVec(tmp, inertia + 10 * m.dof_bodyid[i], cdof + 6 * i);
    qM[adr] = vectors(d.dof_armature)[i] + dot6(cdof + 6 * i, tmp);
    // MuJoCo adds the product to a 0 in qM, so no sum is -0.
    for (int j = dof_parentid[i]; j >= 0; j = dof_parentid[j]) qM[++adr] = V{} + dot6(cdof + 6 * j, tmp);
  }
}

// mj_factorI. x - y * z has the same bits as MuJoCo's x + y * (-z).
void factorI(Lanes& d, const V* M, V* qLD, V* qLDiagInv, V* qLDiagSqrtInv) {
  const mjModel& m = *d.model;
  const int *const dof_Madr = m.dof_Madr, *const dof_parentid = m.dof_parentid, nv = m.nv;

  copy(qLD, M, m.nM);
  for (int k = nv - 1; k >= 0; --k) {
    const int Madr_kk = dof_Madr[k];
    const V diagonal = qLD[Madr_kk];
    // Lanes with a number below mjMINVAL are left to MuJoCo, because MuJoCo warns of it. The second comparison finds
    // numbers that are not finite.
    d.left_to_mujoco |= bits(~((diagonal >= splat(mjMINVAL)) & (diagonal <= splat(kHuge))));
    if (m.dof_simplenum[k]) continue;
    int Madr_ki = Madr_kk + 1;
    for (int i = dof_parentid[k]; i >= 0; i = dof_parentid[i], ++Madr_ki) {
      const V tmp = qLD[Madr_ki] / diagonal;
      V* const row = qLD + dof_Madr[i];
      const int count = dof_Madr[i + 1] - dof_Madr[i];
      for (int j = 0; j < count; ++j) row[j] -= qLD[Madr_ki + j] * tmp;
      qLD[Madr_ki] = tmp;
    }
  }
  for (int i = 0; i < nv; ++i) {
    const V diagonal = qLD[dof_Madr[i]];
    qLDiagInv[i] = 1.0 / diagonal;
    if (qLDiagSqrtInv) qLDiagSqrtInv[i] = 1.0 / sqrt(diagonal);
  }
}

// mj_factorM
void factorM(Lanes& d) { factorI(d, vectors(d.qM), vectors(d.qLD), vectors(d.qLDiagInv), vectors(d.qLDiagSqrtInv)); }

// mj_solveLD for one vector, in place. Where an element of x is 0, MuJoCo skips the subtraction. This code subtracts +0
// there, because subtracting a -0 could turn -0 into +0.
void solveLD(const mjModel& m, V* x, const V* qLD, const V* qLDiagInv) {
  const int *const dof_Madr = m.dof_Madr, *const dof_parentid = m.dof_parentid, nv = m.nv;
  for (int i = nv - 1; i >= 0; --i) {
    if (m.dof_simplenum[i]) continue;
    const V tmp = x[i];
    const Mask is_zero = tmp == V{};
    const V* row = qLD + dof_Madr[i];
    for (int j = dof_parentid[i]; j >= 0; j = dof_parentid[j]) {
      const V product = *++row * tmp;
      x[j] -= is_zero ? V{} : product;
    }
  }
  for (int i = 0; i < nv; ++i) x[i] *= qLDiagInv[i];
  for (int i = 0; i < nv; ++i) {
    if (m.dof_simplenum[i]) continue;
    V tmp = x[i];
    const V* row = qLD + dof_Madr[i];
    for (int j = dof_parentid[i]; j >= 0; j = dof_parentid[j]) tmp -= *++row * x[j];
    x[i] = tmp;
  }
}

// mj_mulM
void mulM(const Lanes& d, V* res, const V* vec) {
  const mjModel& m = *d.model;
  const V* const qM = vectors(d.qM);
  const int *const dof_Madr = m.dof_Madr, *const dof_parentid = m.dof_parentid, *const dof_simplenum = m.dof_simplenum;
  const int nv = m.nv;
  zero(res, nv);
  for (int i = 0; i < nv; ++i) {
    int adr = dof_Madr[i];
    const V own = vec[i];
    if (dof_simplenum[i]) {
      res[i] = qM[adr] * own;
      continue;
    }
    V sum = res[i] + qM[adr] * own;
    for (int j = dof_parentid[i]; j >= 0; j = dof_parentid[j]) {
      ++adr;
      sum += qM[adr] * vec[j];
      res[j] += qM[adr] * own;
    }
    res[i] = sum;
  }
}

// mj_addM, to the lower triangle
void addM(const Lanes& d, V* res) {
  const mjModel& m = *d.model;
  for (int i = 0; i < m.nv; ++i) {
    int adr = m.dof_Madr[i];
    for (int j = i; j >= 0; j = m.dof_simplenum[i] ? -1 : m.dof_parentid[j]) res[i * m.nv + j] += vectors(d.qM)[adr++];
  }
}

// mju_cholSolve
void cholSolve(V* res, const V* mat, const V* vec, int n) {
  copy(res, vec, n);
  for (int i = 0; i < n; ++i) res[i] = (res[i] - dot(mat + i * n, res, i)) / mat[i * (n + 1)];
  for (int i = n - 1; i >= 0; --i) {
    V sum = res[i];
    for (int j = i + 1; j < n; ++j) sum -= mat[j * n + i] * res[j];
    res[i] = sum / mat[i * (n + 1)];
  }
}

// ---- engine_forward.c: accelerations and integrators ----

// mj_xfrcAccumulate. MuJoCo skips bodies without forces. Here their zeros are added, which gives the same bits, because
// no sum in qfrc is -0.
void xfrcAccumulate(Lanes& d, V* qfrc) {
  const mjModel& m = *d.model;
  for (int i = 1; i < m.nbody; ++i) {
    const V* const xfrc = vectors(d.xfrc_applied) + 6 * i;
    Mask is_pushed{};
    for (int k = 0; k < 6; ++k) is_pushed |= xfrc[k] != V{};
    if (any(is_pushed)) applyFT(d, xfrc, xfrc + 3, vectors(d.xipos) + 3 * i, i, qfrc);
  }
}

// mj_fwdAcceleration
void fwdAcceleration(Lanes& d) {
  const mjModel& m = *d.model;
  V *const smooth = vectors(d.qfrc_smooth), *const acc = vectors(d.qacc_smooth);
  for (int i = 0; i < m.nv; ++i)
    smooth[i] = vectors(d.qfrc_passive)[i] - vectors(d.qfrc_bias)[i] +
                (d.has_forces ? vectors(d.qfrc_applied)[i] : V{}) + vectors(d.qfrc_actuator)[i];
  if (d.has_forces) xfrcAccumulate(d, smooth);
  copy(acc, smooth, m.nv);
  solveLD(m, acc, vectors(d.qLD), vectors(d.qLDiagInv));
}

// What mj_advance does with velocities and positions
void advance(Lanes& d, const V* acc) {
  const V timestep = *vectors(d.timestep);
  V* const qvel = vectors(d.qvel);
  for (int i = 0; i < d.model->nv; ++i) qvel[i] += acc[i] * timestep;
  integratePos(*d.model, vectors(d.qpos), qvel, timestep);
}

// mj_Euler. MuJoCo integrates rows without damping explicitly.
void Euler(Lanes& d) {
  const mjModel& m = *d.model;
  V* const acc = vectors(d.qacc_integrated);
  if (d.damped == 0) {
    copy(acc, vectors(d.qacc), m.nv);
  } else {
    V* const MhB = vectors(d.MhB);
    copy(MhB, vectors(d.qM), m.nM);
    Mask is_damped{};
    for (int i = 0; i < m.nv; ++i) {
      is_damped |= vectors(d.dof_damping)[i] > V{};
      MhB[m.dof_Madr[i]] += *vectors(d.timestep) * vectors(d.dof_damping)[i];
    }
    factorI(d, MhB, vectors(d.qH), vectors(d.qHDiagInv), nullptr);
    for (int i = 0; i < m.nv; ++i) acc[i] = vectors(d.qfrc_smooth)[i] + vectors(d.qfrc_constraint)[i];
    solveLD(m, acc, vectors(d.qH), vectors(d.qHDiagInv));
    for (int i = 0; i < m.nv; ++i) acc[i] = is_damped ? acc[i] : vectors(d.qacc)[i];
  }
  advance(d, acc);
}

// mj_RungeKutta with four stages. Each row of its matrix A has only one number that is not 0. The others would add
// zeros to +0, so they are left out.
void RungeKutta(Lanes& d, int stage) {
  const mjModel& m = *d.model;
  const int nv = m.nv;
  const V h = *vectors(d.timestep);
  V *const qpos = vectors(d.qpos), *const qvel = vectors(d.qvel), *const X_qvel = vectors(d.X_qvel),
           *const F = vectors(d.F), *const dX = vectors(d.dX);
  if (stage == 1) {
    copy(vectors(d.X_qpos), qpos, m.nq);
    copy(X_qvel, qvel, nv);
  }
  copy(F + (stage - 1) * nv, vectors(d.qacc), nv);
  copy(qpos, vectors(d.X_qpos), m.nq);
  if (stage < 4) {
    const double a = stage < 3 ? 0.5 : 1;
    for (int i = 0; i < nv; ++i) {
      dX[i] = V{} + X_qvel[(stage - 1) * nv + i] * a;
      dX[nv + i] = V{} + F[(stage - 1) * nv + i] * a;
    }
    integratePos(m, qpos, dX, h);
    for (int i = 0; i < nv; ++i) qvel[i] = X_qvel[i] + dX[nv + i] * h;
    copy(X_qvel + stage * nv, qvel, nv);
    return;
  }
  const double b[4] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  zero(dX, 2 * nv);
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < nv; ++i) {
      dX[i] += X_qvel[j * nv + i] * b[j];
      dX[nv + i] += F[j * nv + i] * b[j];
    }
  for (int i = 0; i < nv; ++i) qvel[i] = X_qvel[i] + dX[nv + i] * h;
  integratePos(m, qpos, dX, h);
}

}  // namespace
}  // namespace mjenv::core::lanes
