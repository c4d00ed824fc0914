#pragma once

#include <string>
#include <vector>

namespace mjenv::core {

// The CPUs that this process may run on, by its affinity.
std::vector<int> allowed_cpus();

// The tightest quota from this process's cgroup up to the root, in CPUs; infinite if there is none. root: where proc/
// and sys/ are.
double cpu_quota(const std::string& root = "");

// How many of them it may use at once: the affinity, bounded by the cgroup's quota.
int usable_cpus();

}  // namespace mjenv::core
