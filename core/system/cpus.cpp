#include "system/cpus.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

#include "system/cgroups.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

double ratio(double quota, double period) { return quota > 0 && period > 0 ? quota / period : kUnlimited; }

// How many CPUs a control group may use; infinite if it sets no quota.
double quota_of(const std::string& folder) {
  double quota = 0, period = 0;
  if (std::ifstream v2(folder + "/cpu.max"); v2 >> quota >> period)
    return ratio(quota, period);  // "max" is not a number
  std::ifstream v1_quota(folder + "/cpu.cfs_quota_us"), v1_period(folder + "/cpu.cfs_period_us");
  return v1_quota >> quota && v1_period >> period ? ratio(quota, period) : kUnlimited;
}

}  // namespace

double cpu_quota(const std::string& root) { return smallest_limit(root, "cpu", quota_of); }

std::vector<int> allowed_cpus() {
  std::vector<int> cpus = platform::allowed_cpus();
  if (cpus.empty()) cpus.push_back(0);
  return cpus;
}

int usable_cpus() {
  const auto allowed = static_cast<double>(allowed_cpus().size());
  return static_cast<int>(std::max(1.0, std::min(allowed, std::ceil(cpu_quota()))));
}

bool cpu_lacks_avx512() {
#if defined(__x86_64__)
  return __builtin_cpu_supports("avx512vl") == 0;
#else
  return false;
#endif
}

}  // namespace mjenv::core
