// All functions of lanes for MuJoCo 4.0.
#pragma once

#include "engine/lanes/mujoco4/collision.hpp"
#include "engine/lanes/mujoco4/constraint.hpp"
#include "engine/lanes/mujoco4/forces.hpp"
#include "engine/lanes/mujoco4/sensor.hpp"
#include "engine/lanes/mujoco4/smooth.hpp"
#include "engine/lanes/mujoco4/solver_newton.hpp"
#include "engine/lanes/mujoco4/solver_pgs.hpp"
