// AVX2: four lanes.
#define MJENV_LANES_WIDTH 4
#include "engine/lanes/code.hpp"

namespace mjenv::core::lanes {

constexpr Code avx2 = code_where([] { return __builtin_cpu_supports("avx2") > 0; });

}  // namespace mjenv::core::lanes
