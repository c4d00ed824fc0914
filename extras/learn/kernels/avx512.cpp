// Vectors of 16 floats: AVX-512.
#define MJENV_LEARN_WIDTH 16
#include "kernels/code.hpp"

namespace mjenv::learn {

extern const Kernels avx512_kernels;
constexpr Kernels avx512_kernels = make_kernels("avx512");

}  // namespace mjenv::learn
