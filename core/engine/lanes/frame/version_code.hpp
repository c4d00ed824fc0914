// Defines the functions of one instruction set, of the version of MuJoCo for which the library is compiled.
#pragma once

#include "engine/lanes/frame/version.hpp"

#if mjVERSION_HEADER == 222
#include "engine/lanes/mujoco2/code.hpp"
#else
#include "engine/lanes/mujoco4/code.hpp"
#endif

namespace mjenv::core::lanes {
namespace {

constexpr Code make_code() {
  Code code{};
  code.width = kWidth;
#define MJENV_SET(result, name, parameters) code.name = name;
  MJENV_LANES_FUNCTIONS(MJENV_SET)
  MJENV_LANES_COPIES(MJENV_SET)
#undef MJENV_SET
  return code;
}

}  // namespace
}  // namespace mjenv::core::lanes
