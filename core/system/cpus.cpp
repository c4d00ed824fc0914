#include "system/cpus.hpp"

#include <algorithm>
#include <cmath>

#include "system/platform.hpp"

namespace mjenv::core {

std::vector<int> allowed_cpus() {
  std::vector<int> cpus = platform::allowed_cpus();
  if (cpus.empty()) cpus.push_back(0);
  return cpus;
}

int usable_cpus() {
  const auto allowed = static_cast<double>(allowed_cpus().size());
  return static_cast<int>(std::max(1.0, std::min(allowed, std::ceil(platform::cpu_quota("")))));
}

bool cpu_lacks_avx512() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512vl") == 0;
#else
  return false;
#endif
}

}  // namespace mjenv::core
