// AVX-512: eight lanes.
#define MJENV_LANES_WIDTH 8
#include "engine/lanes/code.hpp"

namespace mjenv::core::lanes {

constexpr Code avx512 =
    code_where([] { return __builtin_cpu_supports("avx512f") > 0 && __builtin_cpu_supports("avx512dq") > 0; });

}  // namespace mjenv::core::lanes
