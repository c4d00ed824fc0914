#pragma once

#include <string>
#include <vector>

namespace mjenv {

// The least that of(folder) is in this process's cgroup and those above it. controller: the folder of a version 1
// hierarchy; root: where proc/ and sys/ are.
double least_of_cgroups(const std::string& root, const std::string& controller,
                        double (*of)(const std::string& folder));

// The CPUs that this process may run on, by its affinity.
std::vector<int> allowed_cpus();

// The tightest quota from this process's cgroup up to the root, in CPUs; infinite if there is none.
double cpu_quota(const std::string& root = "");

// How many of them it may use at once: the affinity, bounded by the cgroup's quota.
int usable_cpus();

}  // namespace mjenv
