// Sensors of motion (engine_sensor.c), and what they read of bodies, as every version of MuJoCo computes them, for several
// rows at once.
#pragma once

#include "engine/lanes/frame/spatial.hpp"

namespace mjenv::core::lanes {
namespace {

// mju_transformSpatial for a motion, without a rotation
inline void shiftMotion(V* res, const V* vec, const V* newpos, const V* oldpos) {
  V shift[3], turned[3];
  for (int k = 0; k < 3; ++k) shift[k] = newpos[k] - oldpos[k];
  cross(turned, shift, vec);
  copy(res, vec, 3);
  for (int k = 0; k < 3; ++k) res[k + 3] = vec[k + 3] - turned[k];
}

// mju_mulQuat, which each version defines
template <typename T>  // NOLINTNEXTLINE(readability-redundant-declaration)
void mulQuat(V* res, const V* a, const T* b);

// get_xquat, the orientation of an object, which each version defines
// NOLINTNEXTLINE(readability-redundant-declaration)
void xquat(const Lanes& d, V* res, int type, int id);

class MotionSensors {
 public:
  explicit MotionSensors(Lanes& d) : d_(d), m_(*d.model), com_(vectors(d.subtree_com)) {}

 protected:
  Lanes& d_;
  const mjModel& m_;
  const V* const com_;

  const V* root(int body) const { return com_ + 3 * m_.body_rootid[body]; }

  // Computes a sensor of motion; no other.
  void sense(int i, V* data) const {
    const int id = m_.sensor_objid[i], type = m_.sensor_type[i];
    switch (type) {
      case mjSENS_MAGNETOMETER: return magnetometer(id, data);
      case mjSENS_JOINTPOS: return copy(data, vectors(d_.qpos) + m_.jnt_qposadr[id], 1);
      case mjSENS_FRAMEPOS: return framepos(i, data);
      case mjSENS_FRAMEXAXIS:
      case mjSENS_FRAMEYAXIS:
      case mjSENS_FRAMEZAXIS: return frameaxis(i, type - mjSENS_FRAMEXAXIS, data);
      case mjSENS_FRAMEQUAT: return framequat(i, data);
      case mjSENS_SUBTREECOM: return copy(data, com_ + 3 * id, 3);
      case mjSENS_VELOCIMETER: return velocity(id, 3, data);
      case mjSENS_GYRO: return velocity(id, 0, data);
      case mjSENS_JOINTVEL: return copy(data, vectors(d_.qvel) + m_.jnt_dofadr[id], 1);
      case mjSENS_BALLANGVEL: return copy(data, vectors(d_.qvel) + m_.jnt_dofadr[id], 3);
      case mjSENS_FRAMELINVEL: return framevel(i, 3, data);
      case mjSENS_FRAMEANGVEL: return framevel(i, 0, data);
      case mjSENS_SUBTREELINVEL: return copy(data, vectors(d_.subtree_linvel) + 3 * id, 3);
      case mjSENS_SUBTREEANGMOM: return copy(data, vectors(d_.subtree_angmom) + 3 * id, 3);
      case mjSENS_ACCELEROMETER: return acceleration(frame(mjOBJ_SITE, id), true, 3, data);
      case mjSENS_FRAMELINACC: return acceleration(frame_of(i), false, 3, data);
      case mjSENS_FRAMEANGACC: return acceleration(frame_of(i), false, 0, data);
      default: return;
    }
  }

  // apply_cutoff
  void cutoff(int i, V* data) const {
    const V cutoff = vectors(d_.sensor_cutoff)[i];
    const Mask is_cut = cutoff > V{};
    if (!any(is_cut)) return;
    for (int k = 0; k < m_.sensor_dim[i]; ++k) {
      const V x = data[k];
      if (m_.sensor_datatype[i] == mjDATATYPE_REAL)
        data[k] = is_cut ? (x < -cutoff ? -cutoff : (x > cutoff ? cutoff : x)) : x;
      else if (m_.sensor_datatype[i] == mjDATATYPE_POSITIVE)
        data[k] = (is_cut & (cutoff < x)) ? cutoff : x;
    }
  }

  static bool is_of_subtrees(int type) { return type == mjSENS_SUBTREELINVEL || type == mjSENS_SUBTREEANGMOM; }

  // What mj_rnePostConstraint computes for accelerations of bodies: that of the world, then of each body after its parent's.
  // Of the world's numbers in cacc, only those of gravity are written; the others are 0 from the beginning.
  void start_accelerations() {
    if (!(m_.opt.disableflags & mjDSBL_GRAVITY))
      for (int k = 0; k < 3; ++k) vectors(d_.cacc)[k + 3] = vectors(d_.gravity)[k] * -1.0;
  }
  void accelerate(int i) {
    const int first = m_.body_dofadr[i], count = m_.body_dofnum[i];
    V tmp[6]{}, *const cacc = vectors(d_.cacc), *const acc = cacc + 6 * i;
    if (count > 0) mulDofVec(tmp, vectors(d_.cdof_dot) + 6 * first, vectors(d_.qvel) + first, count);
    for (int k = 0; k < 6; ++k) acc[k] = cacc[6 * m_.body_parentid[i] + k] + tmp[k];
    if (count > 0) mulDofVec(tmp, vectors(d_.cdof) + 6 * first, vectors(d_.qacc) + first, count);
    add_to(acc, tmp, 6);
  }

  // ---- engine_core_smooth.c ----

  // mj_subtreeVel
  void subtreeVel() {
    V *const linvel = vectors(d_.subtree_linvel), *const angmom = vectors(d_.subtree_angmom),
             *const body_vel = vectors(d_.body_vel);
    const V *const mass = vectors(d_.body_mass), *const subtreemass = vectors(d_.body_subtreemass),
                   *const xipos = vectors(d_.xipos), *const ximat = vectors(d_.ximat);
    for (int i = 0; i < m_.nbody; ++i) {
      globalVelocity(body_vel + 6 * i, frame(mjOBJ_BODY, i));
      V local[3];
      rotVecMatT(local, body_vel + 6 * i, ximat + 9 * i);
      for (int k = 0; k < 3; ++k) {
        linvel[3 * i + k] = body_vel[6 * i + 3 + k] * mass[i];
        local[k] *= vectors(d_.body_inertia)[3 * i + k];
      }
      rotVecMat(angmom + 3 * i, local, ximat + 9 * i);
    }
    for (int i = m_.nbody - 1; i >= 0; --i) {
      if (i > 0) add_to(linvel + 3 * m_.body_parentid[i], linvel + 3 * i, 3);
      const V scale = 1.0 / (splat(mjMINVAL) > subtreemass[i] ? splat(mjMINVAL) : subtreemass[i]);
      for (int k = 0; k < 3; ++k) linvel[3 * i + k] *= scale;
    }
    for (int i = m_.nbody - 1; i > 0; --i) {
      const int parent = m_.body_parentid[i];
      V offset[3], change[3], moment[3];
      for (int k = 0; k < 3; ++k) {
        offset[k] = xipos[3 * i + k] - com_[3 * i + k];
        change[k] = (body_vel[6 * i + 3 + k] - linvel[3 * i + k]) * mass[i];
      }
      cross(moment, offset, change);
      add_to(angmom + 3 * i, moment, 3);
      add_to(angmom + 3 * parent, angmom + 3 * i, 3);
      for (int k = 0; k < 3; ++k) {
        offset[k] = com_[3 * i + k] - com_[3 * parent + k];
        change[k] = (linvel[3 * i + k] - linvel[3 * parent + k]) * subtreemass[i];
      }
      cross(moment, offset, change);
      add_to(angmom + 3 * parent, moment, 3);
    }
  }

  struct Frame {
    int body;
    const V *pos, *mat;
  };
  // get_xpos_xmat
  Frame frame(int type, int id) const {
    switch (type) {
      case mjOBJ_XBODY: return {id, vectors(d_.xpos) + 3 * id, vectors(d_.xmat) + 9 * id};
      case mjOBJ_BODY: return {id, vectors(d_.xipos) + 3 * id, vectors(d_.ximat) + 9 * id};
      case mjOBJ_GEOM: return {m_.geom_bodyid[id], vectors(d_.geom_xpos) + 3 * id, vectors(d_.geom_xmat) + 9 * id};
      case mjOBJ_CAMERA: return {m_.cam_bodyid[id], vectors(d_.cam_xpos) + 3 * id, vectors(d_.cam_xmat) + 9 * id};
      default: return {m_.site_bodyid[id], vectors(d_.site_xpos) + 3 * id, vectors(d_.site_xmat) + 9 * id};
    }
  }
  Frame frame_of(int sensor) const { return frame(m_.sensor_objtype[sensor], m_.sensor_objid[sensor]); }
  Frame reference_of(int sensor) const { return frame(m_.sensor_reftype[sensor], m_.sensor_refid[sensor]); }
  bool has_reference(int sensor) const { return m_.sensor_refid[sensor] >= 0; }

  // mj_objectVelocity, in the object's frame
  void objectVelocity(V* res, const Frame& f) const {
    transformMotion(res, vectors(d_.cvel) + 6 * f.body, f.pos, root(f.body), f.mat);
  }
  // mj_objectVelocity, in the world's frame
  void globalVelocity(V* res, const Frame& f) const {
    shiftMotion(res, vectors(d_.cvel) + 6 * f.body, f.pos, root(f.body));
  }
  // mj_objectAcceleration, in the object's frame or the world's
  void objectAcceleration(V* res, const Frame& f, bool is_local) const {
    V vel[6], correction[3];
    const V* const acc = vectors(d_.cacc) + 6 * f.body;
    if (is_local) {
      objectVelocity(vel, f);
      transformMotion(res, acc, f.pos, root(f.body), f.mat);
    } else {
      globalVelocity(vel, f);
      shiftMotion(res, acc, f.pos, root(f.body));
    }
    cross(correction, vel, vel + 3);
    add_to(res + 3, correction, 3);
  }

  void magnetometer(int site, V* data) const {
    mulMatTVec3(data, vectors(d_.site_xmat) + 9 * site, vectors(d_.magnetic));
  }

  // mju_mulMatTVec for three rows. MuJoCo skips zeros; here they are added to a sum that begins at +0.
  static void mulMatTVec3(V* res, const V* mat, const V* vec) {
    for (int k = 0; k < 3; ++k) res[k] = V{} + mat[k] * vec[0] + mat[3 + k] * vec[1] + mat[6 + k] * vec[2];
  }

  void framepos(int i, V* data) const {
    const Frame f = frame_of(i);
    if (!has_reference(i)) return copy(data, f.pos, 3);
    const Frame reference = reference_of(i);
    V offset[3];
    for (int k = 0; k < 3; ++k) offset[k] = f.pos[k] - reference.pos[k];
    rotVecMatT(data, offset, reference.mat);
  }

  void frameaxis(int i, int axis, V* data) const {
    const V* const mat = frame_of(i).mat;
    const V global[3] = {mat[axis], mat[axis + 3], mat[axis + 6]};
    if (has_reference(i))
      rotVecMatT(data, global, reference_of(i).mat);
    else
      copy(data, global, 3);
  }

  void framequat(int i, V* data) const {
    V quat[4], reference[4];
    xquat(d_, quat, m_.sensor_objtype[i], m_.sensor_objid[i]);
    if (!has_reference(i)) return copy(data, quat, 4);
    xquat(d_, reference, m_.sensor_reftype[i], m_.sensor_refid[i]);
    negQuat(reference, reference);
    mulQuat(data, reference, quat);
  }

  // part: 0 for the angular velocity, 3 for the linear one.
  void velocity(int site, int part, V* data) const {
    V vel[6];
    objectVelocity(vel, frame(mjOBJ_SITE, site));
    copy(data, vel + part, 3);
  }

  void framevel(int i, int part, V* data) const {
    V vel[6];
    const Frame f = frame_of(i);
    globalVelocity(vel, f);
    if (has_reference(i)) {
      const Frame reference = reference_of(i);
      V other[6], offset[3], turned[3], relative[6];
      globalVelocity(other, reference);
      for (int k = 0; k < 6; ++k) relative[k] = vel[k] - other[k];
      for (int k = 0; k < 3; ++k) offset[k] = f.pos[k] - reference.pos[k];
      cross(turned, offset, other);
      add_to(relative + 3, turned, 3);
      rotVecMatT(vel, relative, reference.mat);
      rotVecMatT(vel + 3, relative + 3, reference.mat);
    }
    copy(data, vel + part, 3);
  }

  void acceleration(const Frame& f, bool is_local, int part, V* data) const {
    V acc[6];
    objectAcceleration(acc, f, is_local);
    copy(data, acc + part, 3);
  }
};

}  // namespace
}  // namespace mjenv::core::lanes
