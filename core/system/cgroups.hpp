// The limits that Linux control groups set for a process.
#pragma once

#include <limits>
#include <string>

namespace mjenv::core {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// Returns the number that follows `word` in the file.
double counter(const std::string& file, const std::string& word, double fallback);

// Calls limit_of(folder) for the control group of this process and for all groups above it. Returns the smallest
// result. controller: the controller's folder in a version 1 hierarchy. root: the folder that contains proc/ and sys/.
double smallest_limit(const std::string& root, const std::string& controller,
                      double (*limit_of)(const std::string& folder));

}  // namespace mjenv::core
