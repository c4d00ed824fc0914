#include "numpy/math.hpp"

#include <strings.h>

#include "system/cpus.hpp"
#include "system/platform.hpp"

namespace mjenv::core::np {

namespace {

// The names that OPENBLAS_CORETYPE may have in OpenBLAS 0.3.29, which NumPy 2.2.6 contains, and whether their kernels
// use fused multiply-add. OpenBLAS does not know the name SapphireRapids, so it then chooses by the CPU. Kernels for
// CPUs before Nehalem are not listed: they add in another order, which neither rounding reproduces.
struct Kernel {
  const char* name;
  bool fused;
};
constexpr Kernel kernels[] = {
    {"SkylakeX", true},     {"Cooperlake", true},  {"Zen", false},       {"Haswell", false},     {"Excavator", false},
    {"Steamroller", false}, {"Piledriver", false}, {"Bulldozer", false}, {"Sandybridge", false}, {"Bobcat", false},
    {"Barcelona", false},   {"Atom", false},       {"Nehalem", false},
};

}  // namespace

Norm norm_as_numpy_here() {
  if (const auto name = platform::environment("OPENBLAS_CORETYPE"))
    for (const Kernel& kernel : kernels)
      if (strcasecmp(name->c_str(), kernel.name) == 0) return Norm(kernel.fused);
  // OpenBLAS chooses by these on x86-64 and aarch64. A wide vector holds all elements, so there is no addition to fuse.
  constexpr int kWide = 32;
  return Norm(!cpu_lacks_avx512() && platform::scalable_vector_bytes() < kWide);
}

}  // namespace mjenv::core::np
