#include "numpy/math.hpp"

#include <strings.h>

#include <cstdlib>

namespace mjenv::core::np {

namespace {

// The kernels that OpenBLAS 0.3.29, which NumPy 2.2.6 carries, takes by name in OPENBLAS_CORETYPE, and how they round.
// It does not know SapphireRapids and then chooses by the CPU. Its kernels for CPUs before Nehalem add in another
// order, which neither rounding reproduces.
struct Kernel {
  const char* name;
  bool fused;
};
constexpr Kernel kernels[] = {
    {"SkylakeX", true},     {"Cooperlake", true},  {"Zen", false},       {"Haswell", false},     {"Excavator", false},
    {"Steamroller", false}, {"Piledriver", false}, {"Bulldozer", false}, {"Sandybridge", false}, {"Bobcat", false},
    {"Barcelona", false},   {"Atom", false},       {"Nehalem", false},
};

bool cpu_has_fused_kernel() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512vl") != 0;  // the feature that OpenBLAS asks for
#else
  return true;  // aarch64's kernels fuse, too
#endif
}

}  // namespace

Norm norm_as_numpy_here() {
  if (const char* name = std::getenv("OPENBLAS_CORETYPE"))
    for (const Kernel& kernel : kernels)
      if (strcasecmp(name, kernel.name) == 0) return Norm(kernel.fused);
  return Norm(cpu_has_fused_kernel());
}

}  // namespace mjenv::core::np
