// All functions of lanes for MuJoCo 2.2.2.
#pragma once

#include "engine/lanes/mujoco2/actuation.hpp"
#include "engine/lanes/mujoco2/adopt.hpp"
#include "engine/lanes/mujoco2/collision_driver.hpp"
#include "engine/lanes/mujoco2/constraint.hpp"
#include "engine/lanes/mujoco2/derivative.hpp"
#include "engine/lanes/mujoco2/passive.hpp"
#include "engine/lanes/mujoco2/rejection.hpp"
#include "engine/lanes/mujoco2/sensor.hpp"
#include "engine/lanes/mujoco2/smooth.hpp"
#include "engine/lanes/mujoco2/solver_noslip.hpp"
#include "engine/lanes/mujoco2/solver_pgs.hpp"
#include "engine/lanes/mujoco2/solver_primal.hpp"
