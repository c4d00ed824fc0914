#include "numpy/math.hpp"

namespace mjenv::np {

double power2(double x) {
  volatile double two = 2;  // a constant exponent would be folded to x * x
  return std::pow(x, two);
}

Norm Norm::of_this_cpu() {
#if defined(__x86_64__)
  // OpenBLAS asks for AVX-512 VL before it picks one of its AVX-512 kernels.
  return Norm(__builtin_cpu_supports("avx512vl") != 0);
#else
  return Norm(true);  // aarch64: its kernels fuse
#endif
}

}  // namespace mjenv::np
