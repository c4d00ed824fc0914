// The instruction set of aarch64.
#include "engine/lanes/frame/version.hpp"

namespace mjenv::core::lanes {

std::vector<const Code*> codes() { return {&neon}; }

}  // namespace mjenv::core::lanes
