// The stage of sensors: tells which sensors lanes compute, and calls MuJoCo's own functions for the others.
#pragma once

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

// What the sensors of a model read besides positions: nothing, because there are no sensors; velocities and
// accelerations; or also contacts and constraints with their forces.
enum class SensorNeeds { nothing, motion, constraints };

SensorNeeds sensor_needs(const mjModel& m);

// Whether the sensors that mj_step1 computes read constraints.
bool reads_constraints_before_forces(const mjModel& m);

// Writes those elements of sensordata that mj_step1 writes.
void sense_state(const mjModel& m, mjData& d);

// Whether lanes compute the sensors of a model: yes, unless it has a user sensor. Rangefinders and clocks are then
// computed by sense_singly, row by row.
bool senses_in_lanes(const mjModel& m);
bool sees_from_cameras(const mjModel& m);
bool has_rangefinders(const mjModel& m);
void sense_singly(const mjModel& m, mjData& d);

// Writes sensordata as mj_forward does. holds_constraints: whether mjData holds the row's contacts and constraints.
void sense(const mjModel& m, mjData& d, bool holds_constraints);

}  // namespace mjenv::core::lanes
