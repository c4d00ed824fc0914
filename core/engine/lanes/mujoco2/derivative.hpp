// The integrator implicit for several rows at once, with the derivatives of forces by velocities that it needs
// (engine_derivative.c). The results have MuJoCo's bits for the reasons that smooth.hpp gives. Signs of zeros in
// intermediate results do not matter: a derivative is a sum that begins at +0, and nothing divides by them.
#pragma once

#include "engine/lanes/mujoco2/actuation.hpp"
#include "engine/lanes/mujoco2/passive.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// A matrix with the elements of MuJoCo's qDeriv and qLU: those of a dof with itself and with its ancestors. Both arrays
// have the layout of qM, so the element of dof i and its n-th ancestor is at ancestor_adr[i] + n. `below` has the rows
// of the dofs and the columns of their ancestors, and the diagonal; `above` has the rows of the ancestors and the
// columns of the dofs.
struct TreeMatrix {
  V *below, *above;
};

// ---- engine_derivative.c, whose functions begin with mjd_ ----
namespace mjd {

// mjd_crossMotion_vel multiplied by a vector
inline void crossMotion_vel(V* res, const V* v, const V* vec) {
  res[0] = v[2] * vec[1] - v[1] * vec[2];
  res[1] = v[0] * vec[2] - v[2] * vec[0];
  res[2] = v[1] * vec[0] - v[0] * vec[1];
  res[3] = v[5] * vec[1] - v[4] * vec[2] + v[2] * vec[4] - v[1] * vec[5];
  res[4] = v[3] * vec[2] - v[5] * vec[0] - v[2] * vec[3] + v[0] * vec[5];
  res[5] = v[4] * vec[0] - v[3] * vec[1] + v[1] * vec[3] - v[0] * vec[4];
}

// mjd_crossForce_vel
inline void crossForce_vel(V* D, const V* f) {
  const V o{};
  const V rows[36] = {o, f[2], -f[1], o, f[5], -f[4], -f[2], o, f[0], -f[5], o, f[3], f[1], -f[0], o, f[4], -f[3], o,
                      o, f[5], -f[4], o, o,    o,     -f[5], o, f[3], o,     o, o,    f[4], -f[3], o, o,    o,     o};
  copy(D, rows, 36);
}

// mjd_crossForce_frc multiplied by a vector
inline void crossForce_frc(V* res, const V* vel, const V* f) {
  res[0] = vel[1] * f[2] - vel[2] * f[1] - vel[5] * f[4] + vel[4] * f[5];
  res[1] = vel[2] * f[0] - vel[0] * f[2] + vel[5] * f[3] - vel[3] * f[5];
  res[2] = vel[0] * f[1] - vel[1] * f[0] - vel[4] * f[3] + vel[3] * f[4];
  res[3] = vel[1] * f[5] - vel[2] * f[4];
  res[4] = vel[2] * f[3] - vel[0] * f[5];
  res[5] = vel[0] * f[4] - vel[1] * f[3];
}

// The transpose of mjd_mulInertVec_vel: its rows are the columns of MuJoCo's matrix.
inline void mulInertVec_vel(V* D, const V* i) {
  const V o{};
  const V columns[36] = {i[0],  i[3], i[4], o,     -i[8], i[7], i[3], i[1],  i[5],  i[8], o, -i[6],
                         i[4],  i[5], i[2], -i[7], i[6],  o,    o,    i[8],  -i[7], i[9], o, o,
                         -i[8], o,    i[6], o,     i[9],  o,    i[7], -i[6], o,     o,    o, i[9]};
  copy(D, columns, 36);
}

// The part of mjd_rne_vel that depends on a body alone: the derivative of cvel x (cinert * cvel) by cvel
void momentum_vel(const Lanes& d, int body, V* mat) {
  const V *const cinert = vectors(d.cinert) + 10 * body, *const cvel = vectors(d.cvel) + 6 * body;
  V momentum[6], dmul[36], column[6];
  mulInertVec(momentum, cinert, cvel);
  crossForce_vel(mat, momentum);
  mulInertVec_vel(dmul, cinert);
  for (int k = 0; k < 6; ++k) {
    crossForce_frc(column, cvel, dmul + 6 * k);
    for (int n = 0; n < 6; ++n) mat[6 * n + k] += column[n];
  }
}

// The first dof whose velocity mj_comVel has not yet added to cvel when it computes cdof_dot of `dof`.
int first_not_added(const mjModel& m, int dof) {
  const int joint = m.dof_jntid[dof], first = m.jnt_dofadr[joint], type = m.jnt_type[joint];
  if (type == mjJNT_FREE) return dof < first + 3 ? first : first + 3;
  return type == mjJNT_BALL ? first : dof;
}

// Adds to a body's Dcacc what the body's own dofs contribute. mjd_comVel_vel's derivative of cvel by the velocity of
// dof c is cdof of c, in all bodies that c moves.
void acceleration_vel(const Lanes& d, int c, int body, V* Dcacc) {
  const mjModel& m = *d.model;
  const V* const cdof = vectors(d.cdof);
  for (int j = m.body_dofadr[body]; j < m.body_dofadr[body] + m.body_dofnum[body]; ++j) {
    if (j == c) add_to(Dcacc, vectors(d.cdof_dot) + 6 * j, 6);
    if (first_not_added(m, j) <= c) continue;
    V Dcdofdot[6];
    crossMotion_vel(Dcdofdot, cdof + 6 * j, cdof + 6 * c);
    for (int k = 0; k < 6; ++k) Dcacc[k] += Dcdofdot[k] * vectors(d.qvel)[j];
  }
}

// mjd_rne_vel, for one dof's velocity after the other
void rne_vel(Lanes& d, const TreeMatrix& DfDv) {
  const mjModel& m = *d.model;
  const V* const cdof = vectors(d.cdof);
  V *const Dcacc = vectors(d.Dcacc), *const Dcfrc = vectors(d.Dcfrc_body), *const mats = vectors(d.Dmomentum);
  for (int i = 1; i < m.nbody; ++i) momentum_vel(d, i, mats + 36 * i);

  for (int c = 0; c < m.nv; ++c) {
    const int own = m.dof_bodyid[c], *const moved = d.moved_bodies + d.moved_adr[own],
              count = d.moved_adr[own + 1] - d.moved_adr[own];
    for (int n = 0; n < count; ++n) {
      const int i = moved[n];
      V* const acc = Dcacc + 6 * i;
      if (n == 0)
        zero(acc, 6);
      else
        copy(acc, Dcacc + 6 * m.body_parentid[i], 6);
      acceleration_vel(d, c, i, acc);
      V force[6];
      mulInertVec(force, vectors(d.cinert) + 10 * i, acc);
      const V* const mat = mats + 36 * i;
      for (int k = 0; k < 6; ++k) {
        V sum = mat[6 * k] * cdof[6 * c];
        for (int l = 1; l < 6; ++l) sum += mat[6 * k + l] * cdof[6 * c + l];
        Dcfrc[6 * i + k] = force[k] + sum;
      }
    }
    for (int n = count - 1; n > 0; --n) add_to(Dcfrc + 6 * m.body_parentid[moved[n]], Dcfrc + 6 * moved[n], 6);

    const auto subtract = [&](V& element, int dof, int body) {
      for (int k = 0; k < 6; ++k) element -= Dcfrc[6 * body + k] * cdof[6 * dof + k];
    };
    // The velocity of c changes the force of an ancestor of `own` only by the force that `own` passes on to it, so the
    // ancestor's Dcfrc is that of `own`.
    const int adr = d.ancestor_adr[c], depth = d.ancestor_adr[c + 1] - adr;
    subtract(DfDv.below[adr], c, own);
    for (int n = 1; n < depth; ++n) subtract(DfDv.above[adr + n], d.ancestors[adr + n], own);
    for (int n = 0; n < count; ++n)
      for (int i = m.body_dofadr[moved[n]]; i < m.body_dofadr[moved[n]] + m.body_dofnum[moved[n]]; ++i)
        if (i > c) subtract(DfDv.below[d.ancestor_adr[i + 1] - depth], i, moved[n]);
  }
}

// addJTBJ for one row of J, which may differ from 0 at these dofs (null: at the first `count`)
void addJTBJ(const Lanes& d, const TreeMatrix& DfDv, const V* J, V B, const int* dofs, int count) {
  if (!any(B != V{})) return;
  for (int n = 0; n < count; ++n) {
    const int i = dofs ? dofs[n] : n, adr = d.ancestor_adr[i];
    const V scaled = J[i] * B;
    DfDv.below[adr] += J[i] * scaled;
    for (int at = adr + 1; at < d.ancestor_adr[i + 1]; ++at) {
      const V other = J[d.ancestors[at]];
      DfDv.below[at] += other * scaled;
      DfDv.above[at] += J[i] * (other * B);
    }
  }
}

// mjd_muscleGain_vel
V muscleGain_vel(V len, V vel, const V* lengthrange, V acc0, const V* prm) {
  const auto positive = [](V x) { return splat(mjMINVAL) > x ? splat(mjMINVAL) : x; };
  const V zero{}, lmin = prm[4], lmax = prm[5], vmax = prm[6];
  const V force = prm[2] < zero ? prm[3] / positive(acc0) : prm[2];
  const V a = 0.5 * (lmin + 1.0), b = 0.5 * (1.0 + lmax);
  const V L0 = (lengthrange[1] - lengthrange[0]) / positive(prm[1] - prm[0]);
  const V length = prm[0] + (len - lengthrange[0]) / positive(L0), speed = vel / positive(L0 * vmax);
  const V x1 = (length - lmin) / positive(a - lmin), x2 = (1.0 - length) / positive(1.0 - a),
          x3 = (length - 1.0) / positive(b - 1.0), x4 = (lmax - length) / positive(lmax - b);
  V FL = length <= lmax ? 0.5 * x4 * x4 : zero;
  FL = length <= b ? 1.0 - 0.5 * x3 * x3 : FL;
  FL = length <= splat(1) ? 1.0 - 0.5 * x2 * x2 : FL;
  FL = ((length >= lmin) & (length <= a)) ? 0.5 * x1 * x1 : FL;
  const V y = prm[8] - 1.0;
  V dFV = speed <= y ? (-2.0 * speed + 2.0 * y) / positive(y) : zero;
  dFV = speed <= zero ? 2.0 * speed + 2.0 : dFV;
  dFV = speed <= splat(-1) ? zero : dFV;
  return -force * FL * dFV / positive(L0 * vmax);
}

// mjd_actuator_vel. MuJoCo multiplies by the control as the caller has set it, without clipping it.
void actuator_vel(const Lanes& d, const TreeMatrix& DfDv) {
  const mjModel& m = *d.model;
  if (m.opt.disableflags & mjDSBL_ACTUATION) return;
  for (int i = 0; i < m.nu; ++i) {
    const V* const gainprm = vectors(d.actuator_gainprm) + mjNGAIN * i;
    V bias_vel{}, gain_vel{};
    if (m.actuator_biastype[i] == mjBIAS_AFFINE) bias_vel = vectors(d.actuator_biasprm)[mjNBIAS * i + 2];
    if (m.actuator_gaintype[i] == mjGAIN_AFFINE)
      gain_vel = gainprm[2];
    else if (m.actuator_gaintype[i] == mjGAIN_MUSCLE)
      gain_vel = muscleGain_vel(vectors(d.actuator_length)[i], vectors(d.actuator_velocity)[i],
                                vectors(d.actuator_lengthrange) + 2 * i, vectors(d.actuator_acc0)[i], gainprm);
    bias_vel +=
        gain_vel * (m.actuator_dyntype[i] == mjDYN_NONE ? vectors(d.ctrl)[i] : vectors(d.act)[i - (m.nu - m.na)]);
    const V* const moment = vectors(d.actuator_moment) + i * m.nv;
    if (d.has_single_actuation) {
      addJTBJ(d, DfDv, moment, bias_vel, nullptr, m.nv);
      continue;
    }
    const Actuator& actuator = d.actuators[i];
    if (actuator.transmission == Actuator::Transmission::dof) {
      const V gear = vectors(d.actuator_gear)[6 * i];
      DfDv.below[d.ancestor_adr[actuator.dof]] += gear * (gear * bias_vel);
    } else {
      addJTBJ(d, DfDv, moment, bias_vel, d.columns + actuator.first_column, actuator.count);
    }
  }
}

// ---- Fluids ----

// One element of the matrix B in addJTBJ
struct Element {
  int row, column;
  V value;
};

// The Jacobian of a point of a body in the frame `mat`, rotation then translation, for the dofs that move the body.
// These are a dof and its ancestors.
class LocalJacobian {
 public:
  LocalJacobian(const Lanes& d, int body, const V* pos, const V* mat) : d_(d), J_(vectors(d.local_J)) {
    const mjModel& m = *d.model;
    V offset[3];
    offset_of(d, offset, body, pos);
    while (body && !m.body_dofnum[body]) body = m.body_parentid[body];
    if (!body) return;
    last_ = m.body_dofadr[body] + m.body_dofnum[body] - 1;
    first_ = d.ancestor_adr[last_];
    count_ = d.ancestor_adr[last_ + 1] - first_;
    for (int n = 0; n < count_; ++n) {
      const int dof = d.ancestors[first_ + n];
      V column[3];
      jac(d, column, dof, offset);
      rotVecMatT(J_ + 6 * n, vectors(d.cdof) + 6 * dof, mat);
      rotVecMatT(J_ + 6 * n + 3, column, mat);
    }
  }

  // addJTBJ. MuJoCo adds the elements in this order.
  void addJTBJ(const TreeMatrix& DfDv, const Element* elements, int count) const {
    for (int n = 0; n < count_; ++n) {
      const V* const J = J_ + 6 * n;
      const int adr = d_.ancestor_adr[d_.ancestors[first_ + n]];
      for (int k = n; k < count_; ++k) {
        const V* const other = J_ + 6 * k;
        V &below = DfDv.below[adr + k - n], &above = DfDv.above[adr + k - n];
        V row = below, column = above;
        for (const Element* e = elements; e < elements + count; ++e) {
          row += other[e->column] * (J[e->row] * e->value);
          column += J[e->column] * (other[e->row] * e->value);
        }
        below = row;
        above = column;
      }
    }
  }

 private:
  const Lanes& d_;
  V* const J_;
  int last_ = 0, first_ = 0, count_ = 0;
};

// mjd_inertiaBoxFluid
void inertiaBoxFluid(const Lanes& d, const TreeMatrix& DfDv, int body) {
  const V *const torque_drag = vectors(d.torque_drag) + 3 * body, *const force_drag = vectors(d.force_drag) + 3 * body;
  const V *const pos = vectors(d.xipos) + 3 * body, *const mat = vectors(d.ximat) + 9 * body;
  V vel[6];
  velocity_in_fluid(d, vel, body, pos, mat);
  Element elements[12];
  for (int k = 0; k < 3; ++k) {
    elements[k] = {k, k, vectors(d.viscous_torque)[body]};
    elements[3 + k] = {3 + k, 3 + k, vectors(d.viscous_force)[body]};
    elements[6 + k] = {k, k, -torque_drag[k] * 2.0 * abs(vel[k]) / 64.0};
    elements[9 + k] = {3 + k, 3 + k, -force_drag[k] * 2.0 * abs(vel[3 + k])};
  }
  LocalJacobian(d, body, pos, mat).addJTBJ(DfDv, elements, 12);
}

// mjd_cross: given b, the derivative of a x b by a; given -a, the derivative by b.
inline void cross(V* D, const V* vec) {
  const V o{};
  const V matrix[9] = {o, vec[2], -vec[1], -vec[2], o, vec[0], vec[1], -vec[0], o};
  copy(D, matrix, 9);
}

// The matrix B of mjd_ellipsoidFluid for one geom, and the functions that add to it
class FluidDerivative {
 public:
  FluidDerivative(const Lanes& d, int geom, const V* vel)
      : of_(d, geom),
        viscosity_(*vectors(d.viscosity)),
        e_(ellipsoid_of(d, geom)),
        coef_(vectors(d.geom_fluid) + mjNFLUID * geom),
        ang_(vel),
        lin_(vel + 3) {
    for (int k = 0; k < 3; ++k) squares_[k] = lin_[k] * lin_[k];
    for (int k = 0; k < 3; ++k) {
      a_[k] = square(e_.axes[k]);
      aa_[k] = a_[k] * a_[k];
    }
    proj_denom_ = aa_[0] * squares_[0] + aa_[1] * squares_[1] + aa_[2] * squares_[2];
    proj_num_ = a_[0] * squares_[0] + a_[1] * squares_[1] + a_[2] * squares_[2];
    speed2_ = squares_[0] + squares_[1] + squares_[2];
    magnus_force();
    kutta_lift();
    viscous_drag();
    viscous_torque();
    addedMassForces();
  }

  // Lists the elements of B. They are 0 where fluids do not act on the geom.
  void list(Element* elements) const {
    for (int i = 0; i < 36; ++i) elements[i] = {i / 6, i % 6, e_.scale != V{} ? B_[i] : V{}};
  }

 private:
  // The vectors first, because they are aligned.
  const Dimensions of_;
  const V viscosity_;
  V squares_[3], a_[3], aa_[3];  // a, b, c and aa, bb, cc of MuJoCo
  V proj_denom_, proj_num_, speed2_;
  V B_[36]{};
  const Ellipsoid& e_;
  const V* const coef_;  // geom_fluid
  const V *const ang_, *const lin_;

  static V positive(V x) { return splat(mjMINVAL) >= x ? splat(mjMINVAL) : x; }

  // addToQuadrant. rows, columns: 0 for rotation, 1 for translation.
  void add(const V* D, int rows, int columns) {
    for (int i = 0; i < 9; ++i) B_[6 * (3 * rows + i / 3) + 3 * columns + i % 3] += D[i];
  }

  // Adds the derivatives of the cross product of a momentum (factor * velocity1) and velocity2.
  void add_cross(const V* factor, const V* velocity1, const V* velocity2, int rows, int by1, int by2) {
    V negative[3], D[9];
    for (int k = 0; k < 3; ++k) negative[k] = -(factor[k] * velocity1[k]);
    cross(D, negative);
    add(D, rows, by2);
    cross(D, velocity2);
    for (int i = 0; i < 9; ++i) D[i] *= factor[i % 3];
    add(D, rows, by1);
  }

  void magnus_force() {
    V lin[3], ang[3], D[9];
    for (int k = 0; k < 3; ++k) {
      lin[k] = e_.magnus * lin_[k];
      ang[k] = -(e_.magnus * ang_[k]);
    }
    cross(D, lin);
    add(D, 1, 0);
    cross(D, ang);
    add(D, 1, 1);
  }

  void kutta_lift() {
    const V denom = mjPI * coef_[4] * e_.density / positive(sqrt(proj_denom_ * proj_num_ * speed2_));
    const V proj_term = proj_num_ / positive(proj_denom_), cos_term = proj_num_ / positive(speed2_);
    V D[9];
    for (int n = 0; n < 3; ++n) {
      const int first = n == 0 ? 1 : 0, second = n == 2 ? 1 : 2;
      const V df_coef = squares_[first] * (a_[n] - a_[first]) + squares_[second] * (a_[n] - a_[second]);
      for (int k = 0; k < 3; ++k) {
        V& element = D[3 * n + k] = (a_[k] - a_[n]) * (2.0 * proj_num_);
        element += (aa_[k] * proj_term - a_[k] + cos_term) * df_coef;
        element *= lin_[n] * lin_[k];
        if (k == n) element -= df_coef * proj_num_;
        element *= denom;
      }
    }
    add(D, 1, 1);
  }

  void viscous_drag() {
    const V dA_coef = mjPI / positive(sqrt(proj_num_ * proj_num_ * proj_num_ * proj_denom_));
    const V A_proj = mjPI * sqrt(proj_denom_ / positive(proj_num_));
    const V norm = sqrt(speed2_), inv_norm = 1.0 / positive(norm);
    const V lin_coef = viscosity_ * 3.0 * mjPI * of_.eq_sphere_D;
    const V quad_coef = e_.density * (A_proj * e_.blunt_drag_coef + e_.slender_drag_coef * (e_.A_max - A_proj));
    const V Aproj_coef = e_.density * norm * (e_.blunt_drag_coef - e_.slender_drag_coef);
    V dAproj_dv[3], D[9];
    for (int n = 0; n < 3; ++n) {
      const int first = n == 0 ? 1 : 0, second = n == 2 ? 1 : 2;
      dAproj_dv[n] =
          Aproj_coef * dA_coef * a_[n] * lin_[n] *
          (a_[first] * squares_[first] * (a_[n] - a_[first]) + a_[second] * squares_[second] * (a_[n] - a_[second]));
    }
    for (int n = 0; n < 3; ++n)
      for (int k = 0; k < 3; ++k) {
        V& element = D[3 * n + k] = lin_[n] * lin_[k];
        if (k == n) element += speed2_;
        element *= -quad_coef * inv_norm;
        element -= dAproj_dv[k] * lin_[n];
        if (k == n) element -= lin_coef;
      }
    add(D, 1, 1);
  }

  void viscous_torque() {
    const V I_max = 8.0 / 15.0 * mjPI * of_.d_mid * (of_.d_max * of_.d_max) * (of_.d_max * of_.d_max);
    V mom_coef[3], mom_visc[3], mom_sq[3], D[9];
    for (int k = 0; k < 3; ++k) {
      mom_coef[k] = coef_[3] * of_.II[k] + e_.slender_drag_coef * (I_max - of_.II[k]);
      mom_visc[k] = ang_[k] * mom_coef[k];
    }
    const V density = e_.density / positive(norm3(mom_visc));
    for (int k = 0; k < 3; ++k) mom_sq[k] = -density * ang_[k] * mom_coef[k] * mom_coef[k];
    const V diagonal = ang_[0] * mom_sq[0] + ang_[1] * mom_sq[1] + ang_[2] * mom_sq[2] - e_.angular;
    for (int i = 0; i < 9; ++i) D[i] = (i % 4 == 0 ? diagonal : V{}) + mom_sq[i % 3] * ang_[i / 3];
    add(D, 0, 0);
  }

  void addedMassForces() {
    add_cross(e_.inertia, ang_, ang_, 0, 0, 0);
    add_cross(e_.mass, lin_, lin_, 0, 1, 1);
    add_cross(e_.mass, lin_, ang_, 1, 1, 0);
  }
};

// mjd_ellipsoidFluid
void ellipsoidFluid(const Lanes& d, const TreeMatrix& DfDv, int body) {
  const mjModel& m = *d.model;
  for (int geom = m.body_geomadr[body]; geom < m.body_geomadr[body] + m.body_geomnum[body]; ++geom) {
    if (!any(ellipsoid_of(d, geom).scale != V{})) continue;
    const V *const pos = vectors(d.geom_xpos) + 3 * geom, *const mat = vectors(d.geom_xmat) + 9 * geom;
    V vel[6];
    velocity_in_fluid(d, vel, body, pos, mat);
    Element elements[36];
    FluidDerivative(d, geom, vel).list(elements);
    LocalJacobian(d, body, pos, mat).addJTBJ(DfDv, elements, 36);
  }
}

// mjd_passive_vel
void passive_vel(const Lanes& d, const TreeMatrix& DfDv) {
  const mjModel& m = *d.model;
  if (m.opt.disableflags & mjDSBL_PASSIVE) return;
  for (int i = 0; i < m.nv; ++i) DfDv.below[d.ancestor_adr[i]] -= vectors(d.dof_damping)[i];
  for (int i = 0; i < m.ntendon; ++i) {
    const V damping = vectors(d.tendon_damping)[i];
    const int first = d.tendon_dof_adr[i];
    addJTBJ(d, DfDv, vectors(d.ten_J) + i * m.nv, damping > V{} ? -damping : V{}, d.tendon_dofs + first,
            d.tendon_dof_adr[i + 1] - first);
  }
  for (int i = 1; i < m.nbody && d.has_fluid; ++i) {
    if (!any(is_heavy(d, i))) continue;
    if (d.has_ellipsoids[i])
      ellipsoidFluid(d, DfDv, i);
    else
      inertiaBoxFluid(d, DfDv, i);
  }
}

// mjd_smooth_vel
void smooth_vel(Lanes& d) {
  const TreeMatrix DfDv{vectors(d.qDeriv), vectors(d.qDeriv_above)};
  zero(DfDv.below, d.model->nM);
  zero(DfDv.above, d.model->nM);
  actuator_vel(d, DfDv);
  passive_vel(d, DfDv);
  rne_vel(d, DfDv);
}

}  // namespace mjd

// ---- engine_util_solve.c ----

// mju_factorLUSparse. A lane in which an element of the diagonal is too small is left to MuJoCo, which fails there.
void factorLUSparse(Lanes& d, const TreeMatrix& LU) {
  for (int i = d.model->nv - 1; i >= 0; --i) {
    const int adr = d.ancestor_adr[i], depth = d.ancestor_adr[i + 1] - adr;
    V *const below = LU.below + adr, *const above = LU.above + adr;
    const V size = abs(below[0]);
    d.left_to_mujoco |= bits(~((size >= splat(mjMINVAL)) & (size <= splat(kHuge))));
    for (int n = 1; n < depth; ++n) above[n] = above[n] / below[0];
    for (int n = 1; n < depth; ++n) {
      const int other = d.ancestor_adr[d.ancestors[adr + n]];
      V *const row = LU.below + other, *const column = LU.above + other;
      row[0] -= below[n] * above[n];
      for (int k = 1; k < depth - n; ++k) {
        row[k] -= below[n + k] * above[n];
        column[k] -= below[n] * above[n + k];
      }
    }
  }
}

// mju_solveLUSparse, in place
void solveLUSparse(const Lanes& d, const TreeMatrix& LU, V* x) {
  const int nv = d.model->nv;
  for (int i = nv - 1; i >= 0; --i)
    for (int at = d.ancestor_adr[i] + 1; at < d.ancestor_adr[i + 1]; ++at) x[d.ancestors[at]] -= x[i] * LU.above[at];
  for (int i = 0; i < nv; ++i) {
    for (int at = d.ancestor_adr[i + 1] - 1; at > d.ancestor_adr[i]; --at) x[i] -= x[d.ancestors[at]] * LU.below[at];
    x[i] = x[i] / LU.below[d.ancestor_adr[i]];
  }
}

// ---- engine_forward.c ----

// mj_implicit
void implicit(Lanes& d) {
  const mjModel& m = *d.model;
  const TreeMatrix LU{vectors(d.qLU), vectors(d.qLU_above)};
  V* const acc = vectors(d.qacc_integrated);
  const V scale = -*vectors(d.timestep);
  mjd::smooth_vel(d);
  for (int i = 0; i < m.nM; ++i) {
    LU.below[i] = vectors(d.qM)[i] + vectors(d.qDeriv)[i] * scale;
    LU.above[i] = vectors(d.qM)[i] + vectors(d.qDeriv_above)[i] * scale;
  }
  factorLUSparse(d, LU);
  for (int i = 0; i < m.nv; ++i) acc[i] = vectors(d.qfrc_smooth)[i] + vectors(d.qfrc_constraint)[i];
  solveLUSparse(d, LU, acc);
  advance(d, acc);
}

}  // namespace
}  // namespace mjenv::core::lanes
