// The lane code for NEON, which every aarch64 CPU has: two lanes.
#define MJENV_LANES_WIDTH 2
#include "engine/lanes/frame/version_code.hpp"

namespace mjenv::core::lanes {

constexpr Code neon = make_code();

}  // namespace mjenv::core::lanes
