// Defines the table (Code) of one instruction set's functions.
#pragma once

#include "engine/lanes/actuation.hpp"
#include "engine/lanes/adopt.hpp"
#include "engine/lanes/contacts.hpp"
#include "engine/lanes/derivative.hpp"
#include "engine/lanes/functions.hpp"
#include "engine/lanes/make_constraint.hpp"
#include "engine/lanes/noslip.hpp"
#include "engine/lanes/passive.hpp"
#include "engine/lanes/pgs.hpp"
#include "engine/lanes/primal.hpp"
#include "engine/lanes/rejection.hpp"
#include "engine/lanes/sensors.hpp"

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
