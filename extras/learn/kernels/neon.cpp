// Vectors of 4 floats: NEON.
#define MJENV_LEARN_WIDTH 4
#include "kernels/code.hpp"

namespace mjenv::learn {

extern const Kernels neon_kernels;
constexpr Kernels neon_kernels = make_kernels("neon");

}  // namespace mjenv::learn
