// The lane code for AVX2: four lanes.
#define MJENV_LANES_WIDTH 4
#include "engine/lanes/frame/version_code.hpp"

namespace mjenv::core::lanes {

constexpr Code avx2 = make_code();

}  // namespace mjenv::core::lanes
