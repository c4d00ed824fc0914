#include "engine/lanes/mujoco2/sensing.hpp"

#include <algorithm>

namespace mjenv::core::lanes {
namespace {

bool needs_constraints(int type) {
  switch (type) {
    case mjSENS_JOINTLIMITPOS:
    case mjSENS_JOINTLIMITVEL:
    case mjSENS_JOINTLIMITFRC:
    case mjSENS_TENDONLIMITPOS:
    case mjSENS_TENDONLIMITVEL:
    case mjSENS_TENDONLIMITFRC:
    case mjSENS_TOUCH:
    case mjSENS_FORCE:
    case mjSENS_TORQUE: return true;
    default: return false;
  }
}

bool has_sensor(const mjModel& m, int type) {
  return std::any_of(m.sensor_type, m.sensor_type + m.nsensor, [&](int other) { return other == type; });
}

}  // namespace

bool sees_from_cameras(const mjModel& m) {
  const auto has_camera = [&](const int* types) {
    return std::any_of(types, types + m.nsensor, [](int type) { return type == mjOBJ_CAMERA; });
  };
  return has_camera(m.sensor_objtype) || has_camera(m.sensor_reftype);
}

bool has_rangefinders(const mjModel& m) { return has_sensor(m, mjSENS_RANGEFINDER); }

void sense_singly(const mjModel& m, mjData& d) {
  for (int i = 0; i < m.nsensor; ++i) {
    mjtNum& data = d.sensordata[m.sensor_adr[i]];
    const mjtNum cutoff = m.sensor_cutoff[i];
    if (m.sensor_type[i] == mjSENS_CLOCK) {
      data = cutoff > 0 ? mju_clip(d.time, -cutoff, cutoff) : d.time;
    } else if (m.sensor_type[i] == mjSENS_RANGEFINDER) {
      const int site = m.sensor_objid[i];
      const mjtNum* const mat = d.site_xmat + 9 * site;
      const mjtNum ray[3] = {mat[2], mat[5], mat[8]};
      int geom = -1;
      data = mjenv_ray(&m, &d, d.site_xpos + 3 * site, ray, nullptr, 1, m.site_bodyid[site], &geom);
      if (cutoff > 0) data = mju_min(cutoff, data);
    }
  }
}

SensorNeeds sensor_needs(const mjModel& m) {
  if (m.nsensor == 0 || (m.opt.disableflags & mjDSBL_SENSOR)) return SensorNeeds::nothing;
  return std::any_of(m.sensor_type, m.sensor_type + m.nsensor, needs_constraints) ? SensorNeeds::constraints
                                                                                  : SensorNeeds::motion;
}

bool reads_constraints_before_forces(const mjModel& m) {
  return std::any_of(m.sensor_type, m.sensor_type + m.nsensor, [](int type) {
    return type == mjSENS_JOINTLIMITPOS || type == mjSENS_JOINTLIMITVEL || type == mjSENS_TENDONLIMITPOS ||
           type == mjSENS_TENDONLIMITVEL;
  });
}

void sense_state(const mjModel& m, mjData& d) {
  if (sees_from_cameras(m)) mj_camlight(&m, &d);
  mj_sensorPos(&m, &d);
  mj_sensorVel(&m, &d);
}

// holds_constraints is false only if no sensor reads contacts or constraints. Those in mjData are then old, so this
// removes them before mj_rnePostConstraint reads them. The sensors then read only cacc, which it computes from qvel and
// qacc, without constraints. This is the first stage of RK4; the last one makes contacts and constraints again.
void sense(const mjModel& m, mjData& d, bool holds_constraints) {
  if (!holds_constraints) d.ncon = d.ne = d.nf = d.nefc = 0;
  sense_state(m, d);
  mj_sensorAcc(&m, &d);
}

}  // namespace mjenv::core::lanes
