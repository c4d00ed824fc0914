#include "cpus.hpp"

#include <sched.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <string>

namespace mjenv {
namespace {

// CPUs that a cgroup folder grants, infinite if it sets no quota.
double quota_of(const std::string& folder) {
  constexpr double unlimited = std::numeric_limits<double>::infinity();
  double quota = 0, period = 0;
  if (std::ifstream v2(folder + "/cpu.max"); v2 >> quota >> period) return quota / period;  // "max" is no number
  std::ifstream v1_quota(folder + "/cpu.cfs_quota_us"), v1_period(folder + "/cpu.cfs_period_us");
  if (v1_quota >> quota && v1_period >> period && quota > 0) return quota / period;
  return unlimited;
}

// The tightest quota from this process's cgroup up to the root.
double cgroup_quota() {
  double least = std::min(quota_of("/sys/fs/cgroup"), quota_of("/sys/fs/cgroup/cpu"));
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    std::string path = line.substr(line.rfind(':') + 1);
    const bool unified = line.rfind("0::", 0) == 0;
    for (; path.size() > 1; path.erase(path.rfind('/')))
      least = std::min(least, quota_of((unified ? "/sys/fs/cgroup" : "/sys/fs/cgroup/cpu") + path));
  }
  return least;
}

}  // namespace

std::vector<int> allowed_cpus() {
  std::vector<int> cpus;
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0)
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
      if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  if (cpus.empty()) cpus.push_back(0);
  return cpus;
}

int usable_cpus() {
  const auto allowed = static_cast<double>(allowed_cpus().size());
  return static_cast<int>(std::max(1.0, std::min(allowed, std::ceil(cgroup_quota()))));
}

}  // namespace mjenv
