#include "kernels/kernels.hpp"

#include <string>

#include "error.hpp"

namespace mjenv::learn {

extern const Kernels sse2_kernels, avx2_kernels, avx512_kernels, neon_kernels;

std::vector<const Kernels*> usable_kernels() {
#if defined(__aarch64__)
  return {&neon_kernels};
#else
  std::vector<const Kernels*> found = {&sse2_kernels};
  if (__builtin_cpu_supports("avx2")) found.push_back(&avx2_kernels);
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq")) found.push_back(&avx512_kernels);
  return found;
#endif
}

const Kernels& chosen_kernels(const std::string& instructions) {
  const auto usable = usable_kernels();
  if (instructions == "auto") return *usable.back();
  std::vector<std::string> names;
  for (const Kernels* kernels : usable) {
    if (kernels->name == instructions) return *kernels;
    names.emplace_back(kernels->name);
  }
  core::fail(MJENV_E_VALUE, "settings.instructions is " + instructions + "; this CPU has " + core::listed(names));
}

}  // namespace mjenv::learn
