// Vectors of 4 floats: SSE2.
#define MJENV_LEARN_WIDTH 4
#include "kernels/code.hpp"

namespace mjenv::learn {

extern const Kernels sse2_kernels;
constexpr Kernels sse2_kernels = make_kernels("sse2");

}  // namespace mjenv::learn
