// The lane code for SSE2, which every x86-64 CPU has: two lanes.
#define MJENV_LANES_WIDTH 2
#include "engine/lanes/frame/version_code.hpp"

namespace mjenv::core::lanes {

constexpr Code sse2 = make_code();

}  // namespace mjenv::core::lanes
