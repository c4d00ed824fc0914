// The forces between bodies and the sensors of several rows at once, as mj_rnePostConstraint and engine_sensor.c
// compute them. The results have MuJoCo's bits for the reasons that smooth.hpp gives.
#pragma once

#include <mujoco/mujoco.h>

#include "engine/lanes/frame/places.hpp"
#include "engine/lanes/frame/sensor.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

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

void xquat(const Lanes& d, V* res, int type, int id) {
  const mjModel& m = *d.model;
  const V* const of_bodies = vectors(d.xquat);
  const auto world_quat = [&](int body, const V* own, const double* shared) {
    d.has_own_frames ? mulQuat(res, of_bodies + 4 * body, own) : mulQuat(res, of_bodies + 4 * body, shared);
  };
  switch (type) {
    case mjOBJ_XBODY: return copy(res, of_bodies + 4 * id, 4);
    case mjOBJ_BODY: return world_quat(id, vectors(d.body_iquat) + 4 * id, m.body_iquat + 4 * id);
    case mjOBJ_GEOM: return world_quat(m.geom_bodyid[id], vectors(d.geom_quat) + 4 * id, m.geom_quat + 4 * id);
    case mjOBJ_CAMERA: return mulQuat(res, of_bodies + 4 * m.cam_bodyid[id], vectors(d.cam_quat) + 4 * id);
    default: return world_quat(m.site_bodyid[id], vectors(d.site_quat) + 4 * id, m.site_quat + 4 * id);
  }
}

// Computes the forces between bodies from the constraints that a solver has solved.
class Forces : protected MotionSensors {
 public:
  Forces(Lanes& d, const Contacts& contacts, const Constraints& c) : MotionSensors(d), contacts_(contacts), c_(c) {}

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
    start_accelerations();
    zero(cfrc_int, 6);
    for (int i = 1; i < m_.nbody; ++i) {
      V tmp[6], momentum[6], turned[6];
      accelerate(i);
      if (!computes_forces) continue;
      mulInertVec(tmp, cinert + 10 * i, cacc + 6 * i);
      mulInertVec(momentum, cinert + 10 * i, cvel + 6 * i);
      crossForce(turned, cvel + 6 * i, momentum);
      for (int k = 0; k < 6; ++k) cfrc_int[6 * i + k] = tmp[k] + turned[k] - cfrc_ext[6 * i + k];
    }
    for (int i = m_.nbody - 1; i > 0 && computes_forces; --i)
      add_to(cfrc_int + 6 * m_.body_parentid[i], cfrc_int + 6 * i, 6);
  }

 protected:
  const Contacts& contacts_;
  const Constraints& c_;

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
      if (!has_velocities && is_of_subtrees(type)) {
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
  void sense(int i, int type, V* data) const {
    const int id = m_.sensor_objid[i];
    switch (type) {
      case mjSENS_TENDONPOS: return copy(data, vectors(d_.ten_length) + id, 1);
      case mjSENS_BALLQUAT: return copy(data, vectors(d_.qpos) + m_.jnt_qposadr[id], 4);
      case mjSENS_ACTUATORPOS: return copy(data, vectors(d_.actuator_length) + id, 1);
      case mjSENS_TENDONVEL: return copy(data, vectors(d_.ten_velocity) + id, 1);
      case mjSENS_ACTUATORVEL: return copy(data, vectors(d_.actuator_velocity) + id, 1);
      case mjSENS_JOINTLIMITPOS:
      case mjSENS_JOINTLIMITVEL:
      case mjSENS_JOINTLIMITFRC:
      case mjSENS_TENDONLIMITPOS:
      case mjSENS_TENDONLIMITVEL:
      case mjSENS_TENDONLIMITFRC: return limit(id, type, data);
      case mjSENS_TOUCH: return touch(id, data);
      case mjSENS_FORCE: return force(id, 3, data);
      case mjSENS_TORQUE: return force(id, 0, data);
      case mjSENS_ACTUATORFRC: return copy(data, vectors(d_.actuator_force) + id, 1);
      // sense_singly computes what is left; MuJoCo leaves user sensors to a callback, which is an obstacle
      default: return MotionSensors::sense(i, data);
    }
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
