// The forces between bodies and the sensors of several rows at once, as mj_rnePostConstraint and engine_sensor.c
// compute them. The results have MuJoCo's bits for the reasons that smooth.hpp gives.
#pragma once

#include <mujoco/mujoco.h>

#include "engine/lanes/mujoco2/places.hpp"

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

// mju_transformSpatial for a force, with a rotation unless it is null
inline void transformForce(V* res, const V* vec, const V* newpos, const V* oldpos, const V* rotation = nullptr) {
  V shift[3], turned[3], moved[3];
  for (int k = 0; k < 3; ++k) shift[k] = newpos[k] - oldpos[k];
  cross(turned, shift, vec + 3);
  for (int k = 0; k < 3; ++k) moved[k] = vec[k] - turned[k];
  if (rotation) {
    rotVecMatT(res, moved, rotation);
    rotVecMatT(res + 3, vec + 3, rotation);
  } else {
    copy(res, moved, 3);
    copy(res + 3, vec + 3, 3);
  }
}

// Computes the forces between bodies from the constraints that a solver has solved.
class Forces {
 public:
  Forces(Lanes& d, const Contacts& contacts, const Constraints& c)
      : d_(d), contacts_(contacts), c_(c), m_(*d.model), com_(vectors(d.subtree_com)) {}

  // mj_rnePostConstraint. computes_forces: if false, only accelerations are computed. In a lane without a force on a
  // body, zeros are added to +0, which changes nothing.
  void rnePostConstraint(bool computes_forces) {
    V *const cacc = vectors(d_.cacc), *const cfrc_int = vectors(d_.cfrc_int), *const cfrc_ext = vectors(d_.cfrc_ext);
    const V *const cinert = vectors(d_.cinert), *const cvel = vectors(d_.cvel);
    if (computes_forces) {
      zero(cfrc_ext, 6 * m_.nbody);
      if (d_.has_forces) add_applied();
      add_contacts();
      add_equalities();
    }
    // Of the world's numbers in cacc, only those of gravity are written; the others are 0 from the beginning.
    if (!(m_.opt.disableflags & mjDSBL_GRAVITY))
      for (int k = 0; k < 3; ++k) cacc[k + 3] = vectors(d_.gravity)[k] * -1.0;
    zero(cfrc_int, 6);
    for (int i = 1; i < m_.nbody; ++i) {
      const int first = m_.body_dofadr[i], count = m_.body_dofnum[i];
      V tmp[6]{}, momentum[6], turned[6];
      V* const acc = cacc + 6 * i;
      if (count > 0) mulDofVec(tmp, vectors(d_.cdof_dot) + 6 * first, vectors(d_.qvel) + first, count);
      for (int k = 0; k < 6; ++k) acc[k] = cacc[6 * m_.body_parentid[i] + k] + tmp[k];
      if (count > 0) mulDofVec(tmp, vectors(d_.cdof) + 6 * first, vectors(d_.qacc) + first, count);
      add_to(acc, tmp, 6);
      if (!computes_forces) continue;
      mulInertVec(tmp, cinert + 10 * i, acc);
      mulInertVec(momentum, cinert + 10 * i, cvel + 6 * i);
      crossForce(turned, cvel + 6 * i, momentum);
      for (int k = 0; k < 6; ++k) cfrc_int[6 * i + k] = tmp[k] + turned[k] - cfrc_ext[6 * i + k];
    }
    for (int i = m_.nbody - 1; i > 0 && computes_forces; --i)
      add_to(cfrc_int + 6 * m_.body_parentid[i], cfrc_int + 6 * i, 6);
  }

 protected:
  Lanes& d_;
  const Contacts& contacts_;
  const Constraints& c_;
  const mjModel& m_;
  const V* const com_;

  const V* root(int body) const { return com_ + 3 * m_.body_rootid[body]; }

  // Returns for each lane the element of `array` at this lane's place.
  V at(const double* array, const int* places) const {
    V result{};
    for (int lane = 0; lane < kWidth; ++lane) result[lane] = array[places[lane] * kWidth + lane];
    return result;
  }

  // mj_contactForce for the contact whose constraints are at these places
  void contactForce(V* res, const Contacts::Contact& contact, const Places& places) const {
    const int dim = contacts_.pairs[contact.pair].dim;
    zero(res, 6);
    if (dim == 1 || m_.opt.cone == mjCONE_ELLIPTIC) {
      for (int k = 0; k < dim; ++k) res[k] = at(c_.force, places.of(k));
      return;
    }
    for (int k = 0; k < 2 * (dim - 1); ++k) res[0] += at(c_.force, places.of(k));
    for (int k = 0; k < dim - 1; ++k) {
      V friction{};
      for (int lane = 0; lane < kWidth; ++lane) friction[lane] = contact.numbers[lane]->friction[k];
      res[k + 1] = (at(c_.force, places.of(2 * k)) - at(c_.force, places.of(2 * k + 1))) * friction;
    }
  }

  // Calls use(index, contact, places of its constraints) for each contact.
  template <typename Use>
  void for_contacts(const Use& use) const {
    Places places(contacts_, c_);
    places.skip_bounded();
    for (int i = 0; i < contacts_.limit_count; ++i) places.next(contacts_.limits[i].rows, 1);
    for (int i = 0; i < contacts_.contact_count; ++i) {
      const Contacts::Contact& contact = contacts_.contacts[i];
      places.next(contact.rows, constraints_of(contacts_.pairs[contact.pair], m_.opt.cone));
      use(i, contact, places);
    }
  }

 private:
  // Adds a torque and a force on a point of a body to cfrc_ext in these lanes, or subtracts them.
  void add_force(const V* cfrc, const V* pos, int body, Mask rows, bool is_subtracted) {
    if (body == 0) return;
    V spatial[6], *const sum = vectors(d_.cfrc_ext) + 6 * body;
    transformForce(spatial, cfrc, root(body), pos);
    for (int k = 0; k < 6; ++k) sum[k] = rows ? (is_subtracted ? sum[k] - spatial[k] : sum[k] + spatial[k]) : sum[k];
  }

  void add_applied() {
    for (int i = 1; i < m_.nbody; ++i) {
      const V* const xfrc = vectors(d_.xfrc_applied) + 6 * i;
      const V cfrc[6] = {xfrc[3], xfrc[4], xfrc[5], xfrc[0], xfrc[1], xfrc[2]};
      add_force(cfrc, vectors(d_.xipos) + 3 * i, i, V{} == V{}, false);
    }
  }

  void add_contacts() {
    for_contacts([&](int i, const Contacts::Contact& contact, const Places& places) {
      const ContactPair& pair = contacts_.pairs[contact.pair];
      const V *const frame = vectors(contacts_.frame) + 9 * i, *const pos = vectors(contacts_.pos) + 3 * i;
      V force[6], cfrc[6];
      contactForce(force, contact, places);
      rotVecMatT(cfrc, force + 3, frame);
      rotVecMatT(cfrc + 3, force, frame);
      const Mask rows = mask_of(contact.rows);
      add_force(cfrc, pos, m_.geom_bodyid[pair.geom1], rows, true);
      add_force(cfrc, pos, m_.geom_bodyid[pair.geom2], rows, false);
    });
  }

  void add_equalities() {
    Places places(contacts_, c_);
    for (int i = 0; i < contacts_.equality_count; ++i) {
      const Equality& equality = *contacts_.equals[i].equality;
      const unsigned rows = contacts_.equals[i].rows & contacts_.rows;
      places.next(contacts_.equals[i].rows, equality.size);
      // If no row has the equality, there may be no room for it, and its places have no numbers.
      if (rows == 0 || (equality.type != mjEQ_CONNECT && equality.type != mjEQ_WELD)) continue;
      V cfrc[6]{};
      for (int k = 0; k < 3; ++k) {
        cfrc[3 + k] = at(c_.force, places.of(k));
        if (equality.type == mjEQ_WELD) cfrc[k] = at(c_.force, places.of(3 + k));
      }
      const V* const data = vectors(d_.eq_data) + mjNEQDATA * equality.id;
      const int first = equality.type == mjEQ_WELD ? 3 : 0;
      for (const bool is_first : {true, false}) {
        const int body = is_first ? equality.object1 : equality.object2;
        V pos[3];
        rotVecMat(pos, data + (is_first ? first : 3 - first), vectors(d_.xmat) + 9 * body);
        add_to(pos, vectors(d_.xpos) + 3 * body, 3);
        add_force(cfrc, pos, body, mask_of(rows), !is_first);
      }
    }
  }
};

void rnePostConstraint(Lanes& d, const Contacts& contacts, const Constraints& c) {
  Forces(d, contacts, c).rnePostConstraint(true);
}

class Sensors : Forces {
 public:
  using Forces::Forces;

  // mj_sensorPos, mj_sensorVel and mj_sensorAcc
  void run() {
    bool has_velocities = false, has_accelerations = false;
    for (int i = 0; i < m_.nsensor; ++i) {
      const int type = m_.sensor_type[i];
      if (!has_velocities && (type == mjSENS_SUBTREELINVEL || type == mjSENS_SUBTREEANGMOM)) {
        subtreeVel();
        has_velocities = true;
      }
      if (!has_accelerations && m_.sensor_needstage[i] == mjSTAGE_ACC && reads_accelerations(type)) {
        rnePostConstraint(has_force_sensors());
        has_accelerations = true;
      }
      V* const data = vectors(d_.sensordata) + m_.sensor_adr[i];
      sense(i, type, data);
      cutoff(i, data);
    }
  }

 private:
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

  void world_quat(V* res, const V* of_body, const V* own, const double* shared) const {
    d_.has_own_frames ? mulQuat(res, of_body, own) : mulQuat(res, of_body, shared);
  }
  // get_xquat
  void xquat(V* res, int type, int id) const {
    const V* const of_bodies = vectors(d_.xquat);
    switch (type) {
      case mjOBJ_XBODY: return copy(res, of_bodies + 4 * id, 4);
      case mjOBJ_BODY:
        return world_quat(res, of_bodies + 4 * id, vectors(d_.body_iquat) + 4 * id, m_.body_iquat + 4 * id);
      case mjOBJ_GEOM:
        return world_quat(res, of_bodies + 4 * m_.geom_bodyid[id], vectors(d_.geom_quat) + 4 * id,
                          m_.geom_quat + 4 * id);
      case mjOBJ_CAMERA: return mulQuat(res, of_bodies + 4 * m_.cam_bodyid[id], vectors(d_.cam_quat) + 4 * id);
      default:
        return world_quat(res, of_bodies + 4 * m_.site_bodyid[id], vectors(d_.site_quat) + 4 * id,
                          m_.site_quat + 4 * id);
    }
  }

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

  void sense(int i, int type, V* data) const {
    const int id = m_.sensor_objid[i];
    switch (type) {
      case mjSENS_MAGNETOMETER: return magnetometer(id, data);
      case mjSENS_JOINTPOS: return copy(data, vectors(d_.qpos) + m_.jnt_qposadr[id], 1);
      case mjSENS_TENDONPOS: return copy(data, vectors(d_.ten_length) + id, 1);
      case mjSENS_ACTUATORPOS: return copy(data, vectors(d_.actuator_length) + id, 1);
      case mjSENS_BALLQUAT: return copy(data, vectors(d_.qpos) + m_.jnt_qposadr[id], 4);
      case mjSENS_FRAMEPOS: return framepos(i, data);
      case mjSENS_FRAMEXAXIS:
      case mjSENS_FRAMEYAXIS:
      case mjSENS_FRAMEZAXIS: return frameaxis(i, type - mjSENS_FRAMEXAXIS, data);
      case mjSENS_FRAMEQUAT: return framequat(i, data);
      case mjSENS_SUBTREECOM: return copy(data, com_ + 3 * id, 3);
      case mjSENS_VELOCIMETER: return velocity(id, 3, data);
      case mjSENS_GYRO: return velocity(id, 0, data);
      case mjSENS_JOINTVEL: return copy(data, vectors(d_.qvel) + m_.jnt_dofadr[id], 1);
      case mjSENS_TENDONVEL: return copy(data, vectors(d_.ten_velocity) + id, 1);
      case mjSENS_ACTUATORVEL: return copy(data, vectors(d_.actuator_velocity) + id, 1);
      case mjSENS_BALLANGVEL: return copy(data, vectors(d_.qvel) + m_.jnt_dofadr[id], 3);
      case mjSENS_FRAMELINVEL: return framevel(i, 3, data);
      case mjSENS_FRAMEANGVEL: return framevel(i, 0, data);
      case mjSENS_SUBTREELINVEL: return copy(data, vectors(d_.subtree_linvel) + 3 * id, 3);
      case mjSENS_SUBTREEANGMOM: return copy(data, vectors(d_.subtree_angmom) + 3 * id, 3);
      case mjSENS_JOINTLIMITPOS:
      case mjSENS_JOINTLIMITVEL:
      case mjSENS_JOINTLIMITFRC:
      case mjSENS_TENDONLIMITPOS:
      case mjSENS_TENDONLIMITVEL:
      case mjSENS_TENDONLIMITFRC: return limit(id, type, data);
      case mjSENS_TOUCH: return touch(id, data);
      case mjSENS_ACCELEROMETER: return acceleration(frame(mjOBJ_SITE, id), true, 3, data);
      case mjSENS_FORCE: return force(id, 3, data);
      case mjSENS_TORQUE: return force(id, 0, data);
      case mjSENS_ACTUATORFRC: return copy(data, vectors(d_.actuator_force) + id, 1);
      case mjSENS_FRAMELINACC: return acceleration(frame_of(i), false, 3, data);
      case mjSENS_FRAMEANGACC: return acceleration(frame_of(i), false, 0, data);
      default: return;  // sense_singly computes these; MuJoCo leaves user sensors to a callback, which is an obstacle
    }
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
    xquat(quat, m_.sensor_objtype[i], m_.sensor_objid[i]);
    if (!has_reference(i)) return copy(data, quat, 4);
    xquat(reference, m_.sensor_reftype[i], m_.sensor_refid[i]);
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

  void force(int site, int part, V* data) const {
    const Frame f = frame(mjOBJ_SITE, site);
    V spatial[6];
    transformForce(spatial, vectors(d_.cfrc_int) + 6 * f.body, f.pos, root(f.body), f.mat);
    copy(data, spatial + part, 3);
  }

  // If a limit is reached on both sides, MuJoCo reports the first of the two constraints.
  void limit(int id, int type, V* data) const {
    const bool is_tendon =
        type == mjSENS_TENDONLIMITPOS || type == mjSENS_TENDONLIMITVEL || type == mjSENS_TENDONLIMITFRC;
    const bool is_pos = type == mjSENS_JOINTLIMITPOS || type == mjSENS_TENDONLIMITPOS;
    const bool is_vel = type == mjSENS_JOINTLIMITVEL || type == mjSENS_TENDONLIMITVEL;
    Places places(contacts_, c_);
    places.skip_bounded();
    unsigned left = contacts_.rows;
    V result{};
    for (int i = 0; i < contacts_.limit_count; ++i) {
      const Contacts::Limit& limit = contacts_.limits[i];
      places.next(limit.rows, 1);
      const unsigned rows = limit.rows & left;
      if (limit.id != id || (limit.object == Object::tendon) != is_tendon || rows == 0) continue;
      const V margin = vectors(is_tendon ? d_.tendon_margin : d_.jnt_margin)[id];
      const V value = is_pos ? vectors(contacts_.limit_dist)[i] - margin : at(is_vel ? c_.vel : c_.force, places.of(0));
      result = mask_of(rows) ? value : result;
      left &= ~rows;
    }
    *data = result;
  }

  void touch(int site, V* data) const {
    const int body = m_.site_bodyid[site];
    V result{};
    for_contacts([&](int i, const Contacts::Contact& contact, const Places& places) {
      const ContactPair& pair = contacts_.pairs[contact.pair];
      const bool is_second = m_.geom_bodyid[pair.geom2] == body;
      if (!is_second && m_.geom_bodyid[pair.geom1] != body) return;
      V force[6];
      contactForce(force, contact, places);
      for (int lane = 0; lane < kWidth; ++lane)
        if (contact.rows >> lane & 1 && force[0][lane] > 0 && is_in_zone(site, i, lane, force[0][lane], is_second))
          result[lane] += force[0][lane];
    });
    *data = result;
  }

  // Whether the ray from a contact along its force meets the sensor's site, in one lane, by MuJoCo's own functions.
  bool is_in_zone(int site, int contact, int lane, double force, bool is_flipped) const {
    mjtNum pos[3], mat[9], size[3], point[3], ray[3];
    for (int k = 0; k < 3; ++k) {
      pos[k] = d_.site_xpos[(3 * site + k) * kWidth + lane];
      size[k] = d_.site_size[(3 * site + k) * kWidth + lane];
      point[k] = contacts_.pos[(3 * contact + k) * kWidth + lane];
      ray[k] = contacts_.frame[(9 * contact + k) * kWidth + lane] * force;
    }
    for (int k = 0; k < 9; ++k) mat[k] = d_.site_xmat[(9 * site + k) * kWidth + lane];
    mju_normalize3(ray);
    if (is_flipped) mju_scl3(ray, ray, -1);
    return mju_rayGeom(pos, mat, size, point, ray, m_.site_type[site]) >= 0;
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

  static bool reads_accelerations(int type) {
    return type != mjSENS_TOUCH && type != mjSENS_ACTUATORFRC && type != mjSENS_JOINTLIMITFRC &&
           type != mjSENS_TENDONLIMITFRC;
  }

  bool has_force_sensors() const {
    for (int i = 0; i < m_.nsensor; ++i)
      if (m_.sensor_type[i] == mjSENS_FORCE || m_.sensor_type[i] == mjSENS_TORQUE) return true;
    return false;
  }
};

void sensors(Lanes& d, const Contacts& contacts, const Constraints& c) { Sensors(d, contacts, c).run(); }

}  // namespace
}  // namespace mjenv::core::lanes
