// The stage of sensors: which of them lanes compute, and MuJoCo's own functions for the others.
#pragma once

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

// What mjData must hold for the sensors of a model, besides the pose: nothing because there are none; velocities and
// accelerations; or also contacts and constraints with their forces.
enum class SensorNeeds { nothing, motion, constraints };

SensorNeeds sensor_needs(const mjModel& m);

// Whether the sensors that mj_step1 computes read constraints.
bool reads_constraints_before_forces(const mjModel& m);

// Writes what mj_step1 writes of sensordata.
void sense_state(const mjModel& m, mjData& d);

// Whether lanes compute the sensors of a model: all but those of users. Of these, sense_singly computes rangefinders and clocks.
bool senses_in_lanes(const mjModel& m);
bool sees_from_cameras(const mjModel& m);
bool has_rangefinders(const mjModel& m);
void sense_singly(const mjModel& m, mjData& d);

// Writes sensordata as mj_forward does. holds_constraints: whether mjData holds the row's contacts and constraints.
void sense(const mjModel& m, mjData& d, bool holds_constraints);

}  // namespace mjenv::core::lanes
