// NEON, which every aarch64 has: two lanes.
#define MJENV_LANES_WIDTH 2
#include "engine/lanes/code.hpp"

namespace mjenv::core::lanes {

constexpr Code neon = code_where([] { return true; });

std::vector<const Code*> codes() { return {&neon}; }

}  // namespace mjenv::core::lanes
