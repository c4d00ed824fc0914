// The instruction set of aarch64.
#include "engine/lanes/mujoco2/lanes.hpp"

namespace mjenv::core::lanes {

std::vector<const Code*> codes() { return {&neon}; }

}  // namespace mjenv::core::lanes
