// MuJoCo 4.0's smooth dynamics for several rows at once, as mujoco2/smooth.hpp has 2.2.2's. The order of operations is
// that of the library that MuJoCo publishes for x86-64, which differs from the source of earlier versions in products of
// quaternions, their lengths and their matrices.
#pragma once

#include "engine/lanes/frame/actuation.hpp"
#include "engine/lanes/frame/fluid.hpp"

namespace mjenv::core::lanes {
namespace {

// ---- engine_util_spatial.c ----

// mju_mulQuat
template <typename T>
inline void mulQuat(V* res, const V* a, const T* b) {
  const V w = (a[0] * b[0] - a[1] * b[1]) + (-a[2] * b[2] + -a[3] * b[3]);
  const V x = (a[0] * b[1] + a[1] * b[0]) + (a[2] * b[3] + -a[3] * b[2]);
  const V y = (a[0] * b[2] - a[1] * b[3]) + (a[2] * b[0] + a[3] * b[1]);
  const V z = (a[0] * b[3] + a[1] * b[2]) + (-a[2] * b[1] + a[3] * b[0]);
  res[0] = w;
  res[1] = x;
  res[2] = y;
  res[3] = z;
}

// mju_mulQuatAxis
inline void mulQuatAxis(V* res, const V* quat, const V* axis) {
  res[0] = -quat[1] * axis[0] - quat[2] * axis[1] - quat[3] * axis[2];
  res[1] = (quat[0] * axis[0] - quat[3] * axis[1]) + quat[2] * axis[2];
  res[2] = (quat[0] * axis[1] + quat[3] * axis[0]) - quat[1] * axis[2];
  res[3] = quat[0] * axis[2] + (quat[1] * axis[1] - quat[2] * axis[0]);
}

// mju_derivQuat
inline void derivQuat(V* res, const V* quat, const V* vel) {
  res[0] = 0.5 * (-vel[0] * quat[1] - vel[1] * quat[2] - vel[2] * quat[3]);
  res[1] = 0.5 * (vel[0] * quat[0] + vel[1] * quat[3] - vel[2] * quat[2]);
  res[2] = 0.5 * (-vel[0] * quat[3] + vel[1] * quat[0] + vel[2] * quat[1]);
  res[3] = 0.5 * (vel[0] * quat[2] - vel[1] * quat[1] + vel[2] * quat[0]);
}

// mju_normalize4, which leaves quaternions alone whose length is nearly 1.
inline void normalize4(V* quat) {
  const V norm = sqrt((quat[0] * quat[0] + quat[1] * quat[1]) + (quat[2] * quat[2] + quat[3] * quat[3]));
  const Mask is_small = norm < splat(mjMINVAL), is_unit = ~(abs(norm - 1.0) > splat(mjMINVAL));
  const V scale = is_unit ? splat(1) : 1.0 / norm;
  for (int i = 0; i < 4; ++i) quat[i] *= scale;
  if (__builtin_expect(any(is_small), 0))
    for (int i = 0; i < 4; ++i) quat[i] = is_small ? splat(i == 0) : quat[i];
}

// mju_quat2Mat. MuJoCo returns the identity for a null quaternion (1, 0, 0, 0). The general formula gives the same
// except for signs of zeros.
inline void quat2Mat(V* res, const V* quat) {
  const auto twice = [](V x) { return x + x; };
  const V q00 = quat[0] * quat[0], q11 = quat[1] * quat[1], q22 = quat[2] * quat[2], q33 = quat[3] * quat[3];
  const V q01 = quat[0] * quat[1], q02 = quat[0] * quat[2], q03 = quat[0] * quat[3];
  const V q12 = quat[1] * quat[2], q13 = quat[1] * quat[3], q23 = quat[2] * quat[3];
  const Mask null = is_null(quat);
  res[0] = (q00 - q22) + (q11 - q33);
  res[4] = (q00 + q22) - (q11 + q33);
  res[8] = (q00 - q22) - (q11 - q33);
  res[1] = twice(q12 - q03);
  res[2] = twice(q13 + q02);
  res[3] = twice(q12 + q03);
  res[5] = twice(q23 - q01);
  res[6] = twice(q13 - q02);
  res[7] = twice(q23 + q01);
  if (__builtin_expect(any(null), 0))
    for (int i = 0; i < 9; ++i) res[i] = null ? splat(i % 4 == 0) : res[i];
}

// mju_rotVecQuat. MuJoCo returns zeros for zeros, and copies the vector if the quaternion is null (1, 0, 0, 0). The
// general formula has the same results, except for signs of zeros.
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
    const V v[3] = {splat(vec[0]), splat(vec[1]), splat(vec[2])};
    const Mask null = is_null(quat), is_zero = (v[0] == V{}) & (v[1] == V{}) & (v[2] == V{});
    for (int i = 0; i < 3; ++i) res[i] = is_zero ? V{} : null ? v[i] : res[i];
  }
}

// mju_quatIntegrate. Only here is the quaternion normalised before it is multiplied, and not afterwards.
inline void quatIntegrate(V* quat, const V* vel, V scale) {
  V axis[3], rotation[4];
  copy(axis, vel, 3);
  const V angle = scale * normalize3(axis);
  V sine{}, cosine{};
  half_sines(reinterpret_cast<double*>(&sine), reinterpret_cast<double*>(&cosine),
             reinterpret_cast<const double*>(&angle), 1);
  axisAngle2Quat(rotation, axis, angle, sine, cosine);
  normalize4(quat);
  mulQuat(quat, quat, rotation);
}

// ---- engine_support.c ----

// mj_local2Global, and the orientation as a quaternion.
template <typename T, typename U>
inline __attribute__((always_inline)) void local2Global(const Lanes& d, V* xpos, V* xquat, V* xmat, const T* pos,
                                                        const U* quat, int body, int sameframe) {
  const V* const xmat_of_body = vectors(d.xmat) + 9 * body;
  if (sameframe == mjSAMEFRAME_BODY || sameframe == mjSAMEFRAME_INERTIA) {
    copy(xpos, vectors(sameframe == mjSAMEFRAME_BODY ? d.xpos : d.xipos) + 3 * body, 3);
  } else {
    rotVecMat(xpos, pos, xmat_of_body);
    add_to(xpos, vectors(d.xpos) + 3 * body, 3);
  }
  if (sameframe == mjSAMEFRAME_NONE) {
    mulQuat(xquat, vectors(d.xquat) + 4 * body, quat);
    quat2Mat(xmat, xquat);
  } else {
    const bool is_body = sameframe == mjSAMEFRAME_BODY || sameframe == mjSAMEFRAME_BODYROT;
    copy(xquat, vectors(is_body ? d.xquat : d.xiquat) + 4 * body, 4);
    copy(xmat, vectors(is_body ? d.xmat : d.ximat) + 9 * body, 9);
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

// ---- engine_core_smooth.c ----

// mj_kinematics. kAreOwn: rows have their own positions and orientations.
template <bool kAreOwn>
void place(Lanes& d) {
  const mjModel& m = *d.model;
  V *const xpos = vectors(d.xpos), *const xquat = vectors(d.xquat), *const xmat = vectors(d.xmat),
           *const xanchor = vectors(d.xanchor), *const xaxis = vectors(d.xaxis), *const angle = vectors(d.angle);
  const V *const qpos = vectors(d.qpos), *const sine = vectors(d.sine), *const cosine = vectors(d.cosine);
  const bool negative_zeros = d.has_negative_zeros;
  const auto qpos0 = frames_of<kAreOwn>(d.qpos0, m.qpos0), jnt_pos = frames_of<kAreOwn>(d.jnt_pos, m.jnt_pos),
             jnt_axis = frames_of<kAreOwn>(d.jnt_axis, m.jnt_axis),
             body_pos = frames_of<kAreOwn>(d.body_pos, m.body_pos),
             body_quat = frames_of<kAreOwn>(d.body_quat, m.body_quat);

  int hinges = 0;
  for (int i = 0; i < m.njnt; ++i)
    if (m.jnt_type[i] == mjJNT_HINGE) angle[hinges++] = qpos[m.jnt_qposadr[i]] - qpos0[m.jnt_qposadr[i]];
  half_sines(d.sine, d.cosine, d.angle, hinges);

  int hinge = 0;
  for (int i = 1; i < m.nbody; ++i) {
    V pos[3], quat[4];
    const int first = m.body_jntadr[i], count = m.body_jntnum[i], parent = m.body_parentid[i];
    if (count == 1 && m.jnt_type[first] == mjJNT_FREE) {
      copy(pos, qpos + m.jnt_qposadr[first], 3);
      copy(quat, qpos + m.jnt_qposadr[first] + 3, 4);  // normalised below
      copy(xanchor + 3 * first, pos, 3);
      for (int k = 0; k < 3; ++k) xaxis[3 * first + k] = splat(jnt_axis[3 * first + k]);
    } else {
      if (parent > 0) {
        rotVecMat(pos, body_pos + 3 * i, xmat + 9 * parent);
        add_to(pos, xpos + 3 * parent, 3);
        mulQuat(quat, xquat + 4 * parent, body_quat + 4 * i);
      } else if (const int mocap = m.body_mocapid[i]; mocap >= 0) {
        copy(pos, vectors(d.mocap_pos) + 3 * mocap, 3);
        copy(quat, vectors(d.mocap_quat) + 4 * mocap, 4);  // normalised below
      } else {
        for (int k = 0; k < 3; ++k) pos[k] = splat(body_pos[3 * i + k]);
        for (int k = 0; k < 4; ++k) quat[k] = splat(body_quat[4 * i + k]);
      }
      for (int j = first; j < first + count; ++j) {
        const auto axis = jnt_axis + 3 * j;
        V anchor[3];
        rotVecQuat(xaxis + 3 * j, axis, quat, negative_zeros);
        rotVecQuat(anchor, jnt_pos + 3 * j, quat, negative_zeros);
        add_to(anchor, pos, 3);
        if (m.jnt_type[j] == mjJNT_SLIDE) {
          const V length = qpos[m.jnt_qposadr[j]] - qpos0[m.jnt_qposadr[j]];
          for (int k = 0; k < 3; ++k) pos[k] += xaxis[3 * j + k] * length;
        } else {
          V local[4], turned[3];
          if (m.jnt_type[j] == mjJNT_BALL) {
            copy(local, qpos + m.jnt_qposadr[j], 4);
            normalize4(local);
          } else {
            axisAngle2Quat(local, axis, angle[hinge], sine[hinge], cosine[hinge]);
            ++hinge;
          }
          mulQuat(quat, quat, local);
          rotVecQuat(turned, jnt_pos + 3 * j, quat, negative_zeros);
          for (int k = 0; k < 3; ++k) pos[k] = anchor[k] - turned[k];
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
    local2Global(d, vectors(d.xipos) + 3 * i, vectors(d.xiquat) + 4 * i, vectors(d.ximat) + 9 * i,
                 vectors(d.body_ipos) + 3 * i, frames_of<kAreOwn>(d.body_iquat, m.body_iquat) + 4 * i, i,
                 m.body_sameframe[i]);
  for (int i = 0; i < m.ngeom; ++i)
    local2Global(d, vectors(d.geom_xpos) + 3 * i, vectors(d.geom_xquat) + 4 * i, vectors(d.geom_xmat) + 9 * i,
                 frames_of<kAreOwn>(d.geom_pos, m.geom_pos) + 3 * i,
                 frames_of<kAreOwn>(d.geom_quat, m.geom_quat) + 4 * i, m.geom_bodyid[i], m.geom_sameframe[i]);
  for (int i = 0; i < m.nsite; ++i)
    local2Global(d, vectors(d.site_xpos) + 3 * i, vectors(d.site_xquat) + 4 * i, vectors(d.site_xmat) + 9 * i,
                 frames_of<kAreOwn>(d.site_pos, m.site_pos) + 3 * i,
                 frames_of<kAreOwn>(d.site_quat, m.site_quat) + 4 * i, m.site_bodyid[i], m.site_sameframe[i]);
}

void kinematics(Lanes& d) { d.has_own_frames ? place<true>(d) : place<false>(d); }

// mj_comPos
void comPos(Lanes& d) {
  const mjModel& m = *d.model;
  V* const com = vectors(d.subtree_com);
  const V* const xipos = vectors(d.xipos);

  for (int i = 0; i < m.nbody; ++i)
    for (int k = 0; k < 3; ++k) com[3 * i + k] = xipos[3 * i + k] * vectors(d.body_mass)[i];
  for (int i = m.nbody - 1; i > 0; --i) add_to(com + 3 * m.body_parentid[i], com + 3 * i, 3);
  for (int i = 0; i < m.nbody; ++i) {
    const V scale = vectors(d.com_scale)[i];
    for (int k = 0; k < 3; ++k) com[3 * i + k] = scale == V{} ? xipos[3 * i + k] : com[3 * i + k] * scale;
  }
  inertias_and_axes(d);
}

// mj_crb. Row i of M has the ancestors of dof i in ascending order, and then i itself.
void crb(Lanes& d) {
  const mjModel& m = *d.model;
  V *const inertia = vectors(d.crb), *const M = vectors(d.M);
  const V* const cdof = vectors(d.cdof);

  copy(inertia, vectors(d.cinert), 10 * m.nbody);
  for (int i = m.nbody - 1; i > 0; --i)
    if (m.body_parentid[i] > 0) add_to(inertia + 10 * m.body_parentid[i], inertia + 10 * i, 10);

  for (int i = 0; i < m.nv; ++i) {
    if (m.dof_simplenum[i]) {
      M[m.M_rowadr[i]] = vectors(d.dof_M0)[i];
      continue;
    }
    int adr = m.M_rowadr[i] + m.M_rownnz[i] - 1;
    V tmp[6];
    mulInertVec(tmp, inertia + 10 * m.dof_bodyid[i], cdof + 6 * i);
    M[adr] = vectors(d.dof_armature)[i] + dot6(cdof + 6 * i, tmp);
    // MuJoCo adds the product to a 0 in M, so no sum is -0.
    for (int j = m.dof_parentid[i]; j >= 0; j = m.dof_parentid[j]) M[--adr] = V{} + dot6(cdof + 6 * j, tmp);
  }
}

// mj_factorI, in place. Rows with a diagonal below mjMINVAL are left to MuJoCo, which warns of it.
void factorI(Lanes& d, V* mat, V* diaginv) {
  const mjModel& m = *d.model;
  for (int k = m.nv - 1; k >= 0; --k) {
    const int start = m.M_rowadr[k], end = start + m.M_rownnz[k] - 1;
    const V inverse = 1.0 / mat[end];
    d.left_to_mujoco |= bits(~(mat[end] >= splat(mjMINVAL)));
    diaginv[k] = inverse;
    for (int adr = end - 1; adr >= start; --adr) {
      const V scale = -mat[adr] * inverse;
      const int i = m.M_colind[adr];
      for (int j = 0; j < m.M_rownnz[i]; ++j) mat[m.M_rowadr[i] + j] += mat[start + j] * scale;
    }
    for (int adr = start; adr < end; ++adr) mat[adr] *= inverse;
  }
}

// mj_factorM
void factorM(Lanes& d) {
  copy(vectors(d.qLD), vectors(d.M), static_cast<int>(d.model->nC));
  factorI(d, vectors(d.qLD), vectors(d.qLDiagInv));
}

// mju_dotSparse. Its four partial sums begin with a product, so they can be -0; the numbers after them are added one by
// one.
template <typename Row>
inline V dotSparse(const Row& a, const V* x, int n, const int* columns) {
  V res{};
  int i = 0;
  if (n >= 4) {
    V sums[4];
    for (int k = 0; k < 4; ++k) sums[k] = a[k] * x[columns[k]];
    for (i = 4; i <= n - 4; i += 4)
      for (int k = 0; k < 4; ++k) sums[k] += a[i + k] * x[columns[i + k]];
    res = (sums[0] + sums[2]) + (sums[1] + sums[3]);
  }
  for (; i < n; ++i) res += a[i] * x[columns[i]];
  return res;
}

// mj_solveLD for one vector, in place. Where an element of x is 0, MuJoCo skips the subtraction. This code subtracts +0
// there, because subtracting a -0 could turn -0 into +0.
void solveLD(const mjModel& m, V* x, const V* qLD, const V* qLDiagInv) {
  for (int i = m.nv - 1; i >= 0; --i) {
    const V tmp = x[i];
    const Mask is_zero = tmp == V{};
    const int start = m.M_rowadr[i], end = start + m.M_rownnz[i] - 1;
    for (int adr = start; adr < end; ++adr) {
      const V product = qLD[adr] * tmp;
      x[m.M_colind[adr]] -= is_zero ? V{} : product;
    }
  }
  for (int i = 0; i < m.nv; ++i) x[i] *= qLDiagInv[i];
  for (int i = 0; i < m.nv; ++i) {
    const int start = m.M_rowadr[i], count = m.M_rownnz[i] - 1;
    if (count > 0) x[i] -= dotSparse(qLD + start, x, count, m.M_colind + start);
  }
}

// mj_mulM
void mulM(const Lanes& d, V* res, const V* vec) {
  const mjModel& m = *d.model;
  for (int i = 0; i < m.nv; ++i) {
    const int diagonal = m.M_rownnz[i] - 1;
    const V* const row = vectors(d.M) + m.M_rowadr[i];
    const int* const columns = m.M_colind + m.M_rowadr[i];
    V sum = row[diagonal] * vec[i];
    for (int k = diagonal - 1; k >= 0; --k) {
      sum += row[k] * vec[columns[k]];
      res[columns[k]] += row[k] * vec[i];
    }
    res[i] = sum;
  }
}

// mju_addToSymSparse with M, to the lower triangle
void addM(const Lanes& d, V* res) {
  const mjModel& m = *d.model;
  for (int i = 0; i < m.nv; ++i)
    for (int adr = m.M_rowadr[i]; adr < m.M_rowadr[i] + m.M_rownnz[i]; ++adr)
      res[i * m.nv + m.M_colind[adr]] += vectors(d.M)[adr];
}

// mju_cholSolve, whose second pass subtracts one column of the transposed factor after the other.
void cholSolve(V* res, const V* mat, const V* vec, int n) {
  copy(res, vec, n);
  for (int i = 0; i < n; ++i) res[i] = (res[i] - dot(mat + i * n, res, i)) / mat[i * (n + 1)];
  for (int i = n - 1; i >= 0; --i) {
    const V* const row = mat + i * n;
    res[i] = res[i] / row[i];
    for (int j = 0; j < i; ++j) res[j] -= row[j] * res[i];
  }
}

// ---- engine_forward.c ----

// mj_fwdAcceleration, without forces in qfrc_applied and xfrc_applied
void fwdAcceleration(Lanes& d) {
  const mjModel& m = *d.model;
  V *const smooth = vectors(d.qfrc_smooth), *const acc = vectors(d.qacc_smooth);
  for (int i = 0; i < m.nv; ++i)
    smooth[i] = vectors(d.qfrc_passive)[i] - vectors(d.qfrc_bias)[i] + V{} + vectors(d.qfrc_actuator)[i];
  copy(acc, smooth, m.nv);
  solveLD(m, acc, vectors(d.qLD), vectors(d.qLDiagInv));
}

// mj_advance, with the acceleration in qacc_integrated
void advance(Lanes& d) {
  const mjModel& m = *d.model;
  const V timestep = *vectors(d.timestep);
  V* const qvel = vectors(d.qvel);
  for (int i = 0; i < m.nv; ++i) qvel[i] += vectors(d.qacc_integrated)[i] * timestep;
  integratePos(m, vectors(d.qpos), qvel, timestep);
  copy(vectors(d.qacc_warmstart), vectors(d.qacc), m.nv);
}

// Sets qacc_integrated to the acceleration of bodies with the inertia M, plus a number on the diagonal of each dof.
template <typename Diagonal>
void solve_implicit(Lanes& d, const Diagonal& diagonal) {
  const mjModel& m = *d.model;
  V *const qH = vectors(d.qH), *const acc = vectors(d.qacc_integrated);
  copy(qH, vectors(d.M), static_cast<int>(m.nC));
  for (int i = 0; i < m.nv; ++i) qH[m.M_rowadr[i] + m.M_rownnz[i] - 1] += diagonal(i);
  factorI(d, qH, vectors(d.qHDiagInv));
  for (int i = 0; i < m.nv; ++i) acc[i] = vectors(d.qfrc_smooth)[i] + vectors(d.qfrc_constraint)[i];
  solveLD(m, acc, qH, vectors(d.qHDiagInv));
}

// mj_Euler. MuJoCo integrates rows without damping explicitly.
void Euler(Lanes& d) {
  const mjModel& m = *d.model;
  V *const acc = vectors(d.qacc_integrated), *const qacc = vectors(d.qacc);
  if (d.damped != 0) solve_implicit(d, [&](int i) { return *vectors(d.timestep) * vectors(d.dof_damping)[i]; });
  const Mask is_damped = mask_of(d.damped);
  for (int i = 0; i < m.nv; ++i) acc[i] = is_damped ? acc[i] : qacc[i];
  advance(d);
}

// mjd_smooth_vel without the bias forces: the derivatives of forces by velocities that mj_implicit takes into account. Joints
// are hinges and slides where actuators act, so these are the diagonal of a matrix.
void smooth_vel(Lanes& d, V* derivative) {
  const mjModel& m = *d.model;
  zero(derivative, m.nv);
  for (int i = 0; i < m.nu; ++i) {
    const int joint = m.actuator_trnid[2 * i], dof = m.jnt_dofadr[joint];
    const auto is_clamped = [](V force, const V* range) { return (force <= range[0]) | (force >= range[1]); };
    Mask is_skipped = (vectors(d.actuator_forcelimited)[i] != V{}) &
                      is_clamped(vectors(d.actuator_force)[i], vectors(d.actuator_forcerange) + 2 * i);
    if (m.jnt_actfrclimited[joint])
      is_skipped |= is_clamped(vectors(d.qfrc_actuator)[dof], vectors(d.jnt_actfrcrange) + 2 * joint);
    const V bias = m.actuator_biastype[i] == mjBIAS_AFFINE ? vectors(d.actuator_biasprm)[mjNBIAS * i + 2] : V{};
    const V gain = m.actuator_gaintype[i] == mjGAIN_AFFINE ? vectors(d.actuator_gainprm)[mjNGAIN * i + 2] : V{};
    const V sum = gain == V{} ? bias : bias + gain * SimpleActuation(d, i).ctrl(),
            gear = vectors(d.actuator_gear)[6 * i];
    derivative[dof] = is_skipped | (sum == V{}) ? derivative[dof] : derivative[dof] + gear * (gear * sum);
  }
  for (int i = 0; i < m.nv && !(m.opt.disableflags & mjDSBL_DAMPER); ++i) derivative[i] -= vectors(d.dof_damping)[i];
}

// mj_implicit with the integrator implicitfast
void implicitfast(Lanes& d) {
  V* const derivative = vectors(d.F);
  smooth_vel(d, derivative);
  solve_implicit(d, [&](int i) { return derivative[i] * -*vectors(d.timestep); });
  advance(d);
}

// The factor of p x (p x v) in turn_velocity, from the square of p's length: (1 - (p/2) / tan(p/2)) / p^2, or a polynomial
// where p is short.
V turning_factor(V square) {
  constexpr double kCoefficients[] = {1.230313397310169e-14, 3.161551550077822e-13,  1.3455485951057888e-11,
                                      5.282849430384459e-10, 2.0876900642039142e-08, 8.267194907152073e-07,
                                      3.30687830944332e-05,  0.0013888888888859755,  0.08333333333333338};
  V factor = splat(kCoefficients[0]);
  for (int i = 1; i < 9; ++i) factor = square * factor + kCoefficients[i];
  for (int lane = 0; lane < kWidth; ++lane) {
    if (square[lane] < 3.0625) continue;
    const double half = std::sqrt(square[lane]) * 0.5;
    factor[lane] = (1 - half / std::tan(half)) / square[lane];
  }
  return factor;
}

// Turns the angular velocity v of a stage of mj_RungeKutta: v + p x v / 2 + c p x (p x v), where p is the rotation since the
// step began, with an angle of at most pi.
void turn_velocity(V* v, const V* rotation, V timestep) {
  V p[3], once[3], again[3];
  for (int k = 0; k < 3; ++k) p[k] = rotation[k] * timestep;
  const auto square_of = [](const V* x) { return x[0] * x[0] + x[1] * x[1] + x[2] * x[2]; };
  V square = square_of(p);
  const Mask is_long = square > splat(9.869604401089358);
  if (__builtin_expect(any(is_long), 0)) {
    for (int lane = 0; lane < kWidth; ++lane) {
      if (!is_long[lane]) continue;
      const double angle = std::sqrt(square[lane]);
      const double scale = (std::floor(angle / 6.283185307179586 + 0.5) * -6.283185307179586 + angle) / angle;
      for (V& x : p) x[lane] *= scale;
    }
    square = square_of(p);
  }
  const V factor = turning_factor(square);
  cross(once, p, v);
  cross(again, p, once);
  for (int k = 0; k < 3; ++k) v[k] = (once[k] * 0.5 + v[k]) + factor * again[k];
}

// mj_RungeKutta with four stages. Each row of its matrix A has only one number that is not 0. The
// others would add zeros to +0, so they are left out. qacc ends as the mean of the stages.
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
    for (int j = 0; j < m.njnt; ++j) {
      if (m.jnt_type[j] != mjJNT_FREE && m.jnt_type[j] != mjJNT_BALL) continue;
      const int dof = m.jnt_dofadr[j] + (m.jnt_type[j] == mjJNT_FREE ? 3 : 0);
      turn_velocity(X_qvel + stage * nv + dof, dX + dof, h);
    }
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
  copy(vectors(d.qacc_warmstart), vectors(d.qacc), nv);
  copy(vectors(d.qacc), dX + nv, nv);
}

// Computes what follows from the numbers of mjModel alone.
void adopt(Lanes& d) {
  const mjModel& m = *d.model;
  const bool is_explicit = (m.opt.disableflags & (mjDSBL_EULERDAMP | mjDSBL_DAMPER)) != 0;
  *vectors(d.xiquat) = splat(1);  // the world's
  d.unlike = d.damped = 0;
  for (int i = 0; i < m.nbody; ++i) {
    const V mass = vectors(d.body_subtreemass)[i];
    vectors(d.com_scale)[i] = mass < splat(mjMINVAL) ? V{} : 1.0 / mass;
  }
  for (int i = 0; i < m.nv && !is_explicit; ++i) d.damped |= bits(vectors(d.dof_damping)[i] > V{});
  for (int i = 0; i < m.njnt; ++i)
    if (m.jnt_type[i] == mjJNT_FREE || m.jnt_type[i] == mjJNT_BALL)
      d.unlike |= bits(vectors(d.jnt_stiffness)[i] != V{});
  if (m.opt.integrator == mjINT_IMPLICITFAST)  // whose derivatives of the forces of fluids are not written
    d.unlike |= bits((*vectors(d.density) > V{}) | (*vectors(d.viscosity) > V{}));
  adopt_fluid(d, [&](const Fluid& fluid, int body) { adopt_box(d, fluid, body); });
}

}  // namespace
}  // namespace mjenv::core::lanes
