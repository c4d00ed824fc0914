#include "engine/lanes/mujoco4/sensing.hpp"

#include <algorithm>

namespace mjenv::core::lanes {
namespace {

bool is_in_lanes(int type) {
  switch (type) {
    case mjSENS_TOUCH:
    case mjSENS_CLOCK:
    case mjSENS_MAGNETOMETER:
    case mjSENS_JOINTPOS:
    case mjSENS_ACTUATORPOS:
    case mjSENS_BALLQUAT:
    case mjSENS_FRAMEPOS:
    case mjSENS_FRAMEXAXIS:
    case mjSENS_FRAMEYAXIS:
    case mjSENS_FRAMEZAXIS:
    case mjSENS_FRAMEQUAT:
    case mjSENS_SUBTREECOM:
    case mjSENS_VELOCIMETER:
    case mjSENS_GYRO:
    case mjSENS_JOINTVEL:
    case mjSENS_ACTUATORVEL:
    case mjSENS_BALLANGVEL:
    case mjSENS_FRAMELINVEL:
    case mjSENS_FRAMEANGVEL:
    case mjSENS_SUBTREELINVEL:
    case mjSENS_SUBTREEANGMOM:
    case mjSENS_ACCELEROMETER:
    case mjSENS_FRAMELINACC:
    case mjSENS_FRAMEANGACC:
    case mjSENS_ACTUATORFRC:
    case mjSENS_JOINTACTFRC: return true;
    default: return false;
  }
}

// mju_rayGeom finds the site when the contact lies in it.
mjtNum touch(const mjModel& m, const mjData& d, int site, const mjtNum* pos, const mjtNum* mat) {
  const int body = m.site_bodyid[site];
  mjtNum sum = 0;
  for (int i = 0; i < d.ncon; ++i) {
    const mjContact& con = d.contact[i];
    const bool is_second = con.geom[1] >= 0 && m.geom_bodyid[con.geom[1]] == body;
    if (con.efc_address < 0 || (!is_second && (con.geom[0] < 0 || m.geom_bodyid[con.geom[0]] != body))) continue;
    mjtNum force[6], ray[3];
    mj_contactForce(&m, &d, i, force);
    if (force[0] <= 0) continue;
    for (int k = 0; k < 3; ++k) ray[k] = con.frame[k] * force[0];
    mju_normalize3(ray);
    for (mjtNum& x : ray) x = is_second ? -x : x;
    if (mju_rayGeom(pos, mat, m.site_size + 3 * static_cast<mjtSize>(site), con.pos, ray, m.site_type[site], nullptr) >=
        0)
      sum += force[0];
  }
  return sum;
}

}  // namespace

std::string other_sensors(const mjModel& m) {
  return std::all_of(m.sensor_type, m.sensor_type + m.nsensor, is_in_lanes)
             ? ""
             : "sensors other than those of motion, touch and forces of actuators";
}

SensorNeeds sensor_needs(const mjModel& m) {
  if (m.nsensor == 0 || m.opt.disableflags & mjDSBL_SENSOR) return SensorNeeds::nothing;
  SensorNeeds needs = SensorNeeds::motion;
  const auto raise = [&](SensorNeeds to) { needs = std::max(needs, to); };
  for (int i = 0; i < m.nsensor; ++i) switch (m.sensor_type[i]) {
      case mjSENS_JOINTLIMITPOS:
      case mjSENS_JOINTLIMITVEL:
      case mjSENS_TENDONLIMITPOS:
      case mjSENS_TENDONLIMITVEL: raise(SensorNeeds::early_constraints); break;
      default:
        if (m.sensor_needstage[i] == mjSTAGE_ACC)
          raise(is_in_lanes(m.sensor_type[i]) && m.sensor_type[i] != mjSENS_TOUCH ? SensorNeeds::accelerations
                                                                                  : SensorNeeds::constraints);
    }
  return needs;
}

bool sees_from_cameras(const mjModel& m) {
  const auto has_camera = [&](const int* types) {
    return std::any_of(types, types + m.nsensor, [](int type) { return type == mjOBJ_CAMERA; });
  };
  return has_camera(m.sensor_objtype) || has_camera(m.sensor_reftype);
}

bool is_single(int type) { return type == mjSENS_TOUCH || type == mjSENS_CLOCK; }

mjtNum sense_singly(const mjModel& m, const mjData& d, int sensor, const mjtNum* pos, const mjtNum* mat) {
  const mjtNum cutoff = m.sensor_cutoff[sensor];
  const bool is_clock = m.sensor_type[sensor] == mjSENS_CLOCK;
  const mjtNum value = is_clock ? d.time : touch(m, d, m.sensor_objid[sensor], pos, mat);
  if (cutoff <= 0) return value;
  return is_clock ? std::clamp(value, -cutoff, cutoff) : std::min(cutoff, value);
}

}  // namespace mjenv::core::lanes
