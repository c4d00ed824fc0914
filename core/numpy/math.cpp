#include "numpy/math.hpp"

#include <strings.h>

#include <cstdlib>

namespace mjenv::core::np {

double power2(double x) {
  volatile double two = 2;  // volatile, as compilers turn pow(x, 2) into x * x
  return std::pow(x, two);
}

namespace {

bool has_avx512() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512vl") != 0;  // the feature that OpenBLAS asks for
#else
  return true;  // aarch64's kernels fuse, too
#endif
}

}  // namespace

Norm Norm::as_numpy_here() {
  const char* forced = std::getenv("OPENBLAS_CORETYPE");
  const auto is = [&](const char* kernel) { return forced && strcasecmp(forced, kernel) == 0; };
  if (is("SkylakeX") || is("Cooperlake") || is("SapphireRapids")) return Norm(true);
  if (is("Haswell") || is("Zen") || is("Sandybridge") || is("Nehalem")) return Norm(false);
  return Norm(has_avx512());
}

}  // namespace mjenv::core::np
