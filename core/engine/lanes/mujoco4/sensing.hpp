// Tells which sensors lanes compute, and computes single ones row by row.
#pragma once

#include <string>

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

// The kind of sensors because of which MuJoCo's functions compute all sensors of the model; "" if lanes compute them.
std::string other_sensors(const mjModel& m);

// What the model's sensors read, in ascending order. nothing: there are none, or they are disabled. motion: positions and
// velocities. accelerations: these, too, or forces of actuators. constraints: also constraints with their forces; this is
// all that sensors read that MuJoCo's functions compute. early_constraints: also in mj_step1.
enum class SensorNeeds { nothing, motion, accelerations, constraints, early_constraints };

SensorNeeds sensor_needs(const mjModel& m);

// Whether a sensor reads the frame of a camera.
bool sees_from_cameras(const mjModel& m);

// Whether lanes leave out this sensor, so that sense_singly computes it: touch, or the time.
bool is_single(int type);
// pos, mat: those of the sensor's site.
mjtNum sense_singly(const mjModel& m, const mjData& d, int sensor, const mjtNum* pos, const mjtNum* mat);

}  // namespace mjenv::core::lanes
