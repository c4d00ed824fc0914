// Defines the table (Code) of one instruction set's functions.
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

namespace mjenv::core::lanes {
namespace {

constexpr Code make_code() {
  Code code{};
  code.width = kWidth;
#define MJENV_SET(result, name, parameters) code.name = name;
  MJENV_LANES_FUNCTIONS(MJENV_SET)
#undef MJENV_SET
  return code;
}

}  // namespace
}  // namespace mjenv::core::lanes
