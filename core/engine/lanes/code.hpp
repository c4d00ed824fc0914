// The functions of one instruction set as a table.
#pragma once

#include "engine/lanes/contacts.hpp"
#include "engine/lanes/functions.hpp"
#include "engine/lanes/newton.hpp"
#include "engine/lanes/pgs.hpp"

namespace mjenv::core::lanes {
namespace {

constexpr Code code_where(bool (*runs_here)()) {
  return {kWidth,       runs_here,       adopt,  kinematics,  comPos,           tendon,    crb,
          factorM,      transmission,    reject, fwdVelocity, comVel,           passive,   rne,
          fwdActuation, fwdAcceleration, Euler,  RungeKutta,  instantiateLimit, collision, makeConstraint,
          solNewton,    solPGS,          bad,    gather,      scatter};
}

}  // namespace
}  // namespace mjenv::core::lanes
