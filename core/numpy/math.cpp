#include "numpy/math.hpp"

#include <strings.h>

#include "system/cpus.hpp"
#include "system/platform.hpp"

namespace mjenv::core::np {

namespace {

// The values that the variable OPENBLAS_CORETYPE may have in OpenBLAS 0.3.29, which NumPy 2.2.6 contains, and whether
// their kernels fuse every multiply-add (Norm). SapphireRapids is missing because OpenBLAS does not know this value and
// chooses by the CPU. Kernels for CPUs before Nehalem are missing because they add in an order that Norm does not
// reproduce.
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
  // OpenBLAS chooses its kernel by AVX-512 on x86-64 and by SVE on aarch64. If SVE's vectors have kWide bytes or more,
  // its kernel does not fuse. It then adds in Norm's order only if there are at most 3 squares (docs/fidelity.md).
  constexpr int kWide = 32;
  return Norm(!cpu_lacks_avx512() && platform::scalable_vector_bytes() < kWide);
}

}  // namespace mjenv::core::np
