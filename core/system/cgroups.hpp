// The limits that Linux control groups set for a process.
#pragma once

#include <limits>
#include <string>

namespace mjenv::core {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// Calls of(folder) for the control group of this process and for those above it, and returns the smallest result.
// controller: the controller's folder in a version 1 hierarchy. root: the folder that holds proc/ and sys/.
double least_of_cgroups(const std::string& root, const std::string& controller,
                        double (*of)(const std::string& folder));

}  // namespace mjenv::core
