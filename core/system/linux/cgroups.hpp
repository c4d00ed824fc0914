// The limits that Linux control groups set for a process.
#pragma once

#include <limits>
#include <string>

namespace mjenv::core {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

// Returns the number that follows `word` in the file.
double counter(const std::string& file, const std::string& word, double fallback);

// The smallest quota in CPUs of this process's control group and those above it; infinite if none.
double cpu_quota_of_groups(const std::string& root);

// How many bytes these groups may still use: the smallest number. root: the folder that contains proc/ and sys/.
double memory_of_groups(const std::string& root);

}  // namespace mjenv::core
