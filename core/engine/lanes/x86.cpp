// The instruction sets of x86-64.
#include "engine/lanes/lanes.hpp"

namespace mjenv::core::lanes {

std::vector<const Code*> codes() { return {&sse2, &avx2, &avx512}; }

}  // namespace mjenv::core::lanes
