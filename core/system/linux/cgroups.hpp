// The limits that Linux control groups set for a process.
#pragma once

#include <limits>
#include <string>

namespace mjenv::core {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// Returns the number that follows `word` in the file.
double counter(const std::string& file, const std::string& word, double fallback);

// The smallest quota, in CPUs, of the control group of this process and of all groups above it; infinite if there is
// none. root: the folder that contains proc/ and sys/.
double cpu_quota_of_groups(const std::string& root);

// How many bytes these groups may still use: the smallest number.
double memory_of_groups(const std::string& root);

}  // namespace mjenv::core
