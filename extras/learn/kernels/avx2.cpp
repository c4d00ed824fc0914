// Vectors of 8 floats: AVX2.
#define MJENV_LEARN_WIDTH 8
#include "kernels/code.hpp"

namespace mjenv::learn {

extern const Kernels avx2_kernels;
constexpr Kernels avx2_kernels = make_kernels("avx2");

}  // namespace mjenv::learn
