#include "system/linux/cgroups.hpp"

#include <algorithm>
#include <fstream>

namespace mjenv::core {
namespace {

// Calls limit_of(folder) for the control group of this process and for all groups above it, and returns the smallest
// result. controller: the name of the controller's folder if the system has control groups of version 1.
double smallest_limit(const std::string& root, const std::string& controller,
                      double (*limit_of)(const std::string& folder)) {
  const std::string unified = root + "/sys/fs/cgroup", own = unified + "/" + controller;
  double smallest = std::min(limit_of(unified), limit_of(own));
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    std::string path = line.substr(line.rfind(':') + 1);
    const std::string& hierarchy = line.rfind("0::", 0) == 0 ? unified : own;
    for (; path.size() > 1 && path[0] == '/'; path.erase(path.rfind('/')))
      smallest = std::min(smallest, limit_of(hierarchy + path));
  }
  return smallest;
}

double ratio(double quota, double period) { return quota > 0 && period > 0 ? quota / period : kUnlimited; }

// How many CPUs a control group may use; infinite if it sets no quota.
double quota_of(const std::string& folder) {
  double quota = 0, period = 0;
  if (std::ifstream v2(folder + "/cpu.max"); v2 >> quota >> period) return ratio(quota, period);  // not for "max"
  std::ifstream v1_quota(folder + "/cpu.cfs_quota_us"), v1_period(folder + "/cpu.cfs_period_us");
  return v1_quota >> quota && v1_period >> period ? ratio(quota, period) : kUnlimited;
}

// How many bytes a control group may still use. Inactive pages of files count as free, because the kernel can drop
// them.
double bytes_left(const std::string& folder) {
  double max = 0, used = 0;
  std::ifstream v2_max(folder + "/memory.max"), v2_used(folder + "/memory.current");
  std::ifstream v1_max(folder + "/memory.limit_in_bytes"), v1_used(folder + "/memory.usage_in_bytes");
  if (!(v2_max >> max && v2_used >> used) && !(v1_max >> max && v1_used >> used)) return kUnlimited;
  return std::max(0.0, max - used + counter(folder + "/memory.stat", "inactive_file", 0));
}

}  // namespace

double counter(const std::string& file, const std::string& word, double fallback) {
  std::ifstream from(file);
  double value = 0;
  for (std::string key; from >> key;)
    if (key == word && from >> value) return value;
  return fallback;
}

double cpu_quota_of_groups(const std::string& root) { return smallest_limit(root, "cpu", quota_of); }
double memory_of_groups(const std::string& root) { return smallest_limit(root, "memory", bytes_left); }

}  // namespace mjenv::core
