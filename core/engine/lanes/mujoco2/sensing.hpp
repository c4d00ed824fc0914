// Tells which sensors lanes compute, and calls MuJoCo's functions for the others.
#pragma once

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

// What the model's sensors read. nothing: there are none, or they are disabled. motion: positions, velocities and
// accelerations. constraints: also contacts and constraints with their forces.
enum class SensorNeeds { nothing, motion, constraints };

SensorNeeds sensor_needs(const mjModel& m);

// Whether the sensors that mj_step1 computes read constraints.
bool reads_constraints_before_forces(const mjModel& m);

// Writes those elements of sensordata that mj_step1 writes.
void sense_state(const mjModel& m, mjData& d);

// Computes the rangefinders of one row, which lanes do not compute, and copies the row's time to its clocks.
void sense_singly(const mjModel& m, mjData& d);

// Whether a sensor reads the frame of a camera.
bool sees_from_cameras(const mjModel& m);
bool has_rangefinders(const mjModel& m);

// Writes sensordata as mj_forward does. holds_constraints: whether mjData holds the row's contacts and constraints.
void sense(const mjModel& m, mjData& d, bool holds_constraints);

}  // namespace mjenv::core::lanes
