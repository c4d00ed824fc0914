#pragma once

#include <string>
#include <vector>

namespace mjenv::core {

// The CPUs that this process may run on, according to its affinity.
std::vector<int> allowed_cpus();

// The smallest quota of this process's control groups, in CPUs; infinite if there is none. root: the folder that holds
// proc/ and sys/.
double cpu_quota(const std::string& root = "");

// How many CPUs this process may use at once: those of its affinity, limited by its quota.
int usable_cpus();

}  // namespace mjenv::core
