// MuJoCo 4.0's sensors (engine_sensor.c) for several rows at once: those of motion, and forces of actuators.
#pragma once

#include "engine/lanes/frame/sensor.hpp"
#include "engine/lanes/mujoco4/smooth.hpp"

namespace mjenv::core::lanes {
namespace {

// Kinematics has these quaternions. Products of the body's would differ in the signs of zeros.
void xquat(const Lanes& d, V* res, int type, int id) {
  switch (type) {
    case mjOBJ_XBODY: return copy(res, vectors(d.xquat) + 4 * id, 4);
    case mjOBJ_BODY: return copy(res, vectors(d.xiquat) + 4 * id, 4);
    case mjOBJ_GEOM: return copy(res, vectors(d.geom_xquat) + 4 * id, 4);
    case mjOBJ_CAMERA:
      return mulQuat(res, vectors(d.xquat) + 4 * d.model->cam_bodyid[id], vectors(d.cam_quat) + 4 * id);
    default: return copy(res, vectors(d.site_xquat) + 4 * id, 4);
  }
}

class Sensors : MotionSensors {
 public:
  using MotionSensors::MotionSensors;

  // mj_sensorPos and mj_sensorVel, or mj_sensorAcc
  void run(bool are_of_accelerations) {
    bool is_prepared = false;
    for (int i = 0; i < m_.nsensor; ++i) {
      if ((m_.sensor_needstage[i] == mjSTAGE_ACC) != are_of_accelerations) continue;
      const int type = m_.sensor_type[i];
      if (!is_prepared && (is_of_subtrees(type) || reads_accelerations(type))) {
        is_prepared = true;
        are_of_accelerations ? accelerations() : subtreeVel();
      }
      V* const data = vectors(d_.sensordata) + m_.sensor_adr[i];
      sense(i, data);
      cutoff(i, data);
    }
  }

 private:
  static bool reads_accelerations(int type) {
    return type == mjSENS_ACCELEROMETER || type == mjSENS_FRAMELINACC || type == mjSENS_FRAMEANGACC;
  }

  void accelerations() {
    start_accelerations();
    for (int i = 1; i < m_.nbody; ++i) accelerate(i);
  }

  void sense(int i, V* data) const {
    const int id = m_.sensor_objid[i], dim = m_.sensor_dim[i];
    switch (m_.sensor_type[i]) {
      case mjSENS_BALLQUAT: copy(data, vectors(d_.qpos) + m_.jnt_qposadr[id], 4); return normalize4(data);
      case mjSENS_ACTUATORPOS: return copy(data, vectors(d_.actuator_length) + m_.actuator_outadr[id], dim);
      case mjSENS_ACTUATORVEL: return copy(data, vectors(d_.actuator_velocity) + m_.actuator_outadr[id], dim);
      case mjSENS_ACTUATORFRC: return copy(data, vectors(d_.actuator_force) + m_.actuator_outadr[id], dim);
      case mjSENS_JOINTACTFRC: return copy(data, vectors(d_.qfrc_actuator) + m_.jnt_dofadr[id], 1);
      default: return MotionSensors::sense(i, data);
    }
  }
};

void sensors(Lanes& d, bool are_of_accelerations) { Sensors(d).run(are_of_accelerations); }

}  // namespace
}  // namespace mjenv::core::lanes
