// The lane code for AVX-512: eight lanes.
#define MJENV_LANES_WIDTH 8
#include "engine/lanes/frame/version_code.hpp"

namespace mjenv::core::lanes {

constexpr Code avx512 = make_code();

}  // namespace mjenv::core::lanes
