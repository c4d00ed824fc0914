// The limits that control groups set to a process.
#pragma once

#include <limits>
#include <string>

namespace mjenv::core {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// The least that of(folder) is in this process's cgroup and those above it. controller: the folder of a version 1
// hierarchy; root: where proc/ and sys/ are.
double least_of_cgroups(const std::string& root, const std::string& controller,
                        double (*of)(const std::string& folder));

}  // namespace mjenv::core
