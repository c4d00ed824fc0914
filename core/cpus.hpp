#pragma once

#include <vector>

namespace mjenv {

// The CPUs that this process may run on, by its affinity.
std::vector<int> allowed_cpus();

// How many of them it may use at once: the affinity, bounded by the cgroup's quota.
int usable_cpus();

}  // namespace mjenv
