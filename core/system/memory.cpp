#include "system/memory.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "error.hpp"
#include "system/cgroups.hpp"

namespace mjenv::core {
namespace {

// Smaller needs are not checked, because the check reads files, and a small allocation rarely fails.
constexpr double kSmall = 1 << 26;

// The number that follows a word in a file.
double counter(const std::string& file, const std::string& word, double fallback) {
  std::ifstream from(file);
  double value = 0;
  for (std::string key; from >> key;)
    if (key == word && from >> value) return value;
  return fallback;
}

// What a control group's folder leaves. Pages of files that were not used for long are given up, so they count as free.
double left_in(const std::string& folder) {
  double most = 0, used = 0;
  std::ifstream v2_most(folder + "/memory.max"), v2_used(folder + "/memory.current");
  std::ifstream v1_most(folder + "/memory.limit_in_bytes"), v1_used(folder + "/memory.usage_in_bytes");
  if (!(v2_most >> most && v2_used >> used) && !(v1_most >> most && v1_used >> used)) return kUnlimited;
  return std::max(0.0, most - used + counter(folder + "/memory.stat", "inactive_file", 0));
}

// The part of the address space that setrlimit allows and that is not used yet.
double addresses_left(const std::string& root) {
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  return static_cast<double>(limit.rlim_cur) - 1024 * counter(root + "/proc/self/status", "VmSize:", 0);
}

}  // namespace

double free_memory(const std::string& root) {
  const double machine = 1024 * counter(root + "/proc/meminfo", "MemAvailable:", kUnlimited);
  return std::min({machine, addresses_left(root), least_of_cgroups(root, "memory", left_in)});
}

void check_memory(std::int64_t count, const char* what, std::size_t bytes_each) {
  const double needed = static_cast<double>(count) * static_cast<double>(bytes_each);
  if (needed < kSmall) return;
  const double free = free_memory();
  if (needed > free)
    fail(MJENV_E_MEMORY, std::to_string(count) + what + " need " + number(std::ceil(needed / 1e6)) + " MB, but only " +
                             number(std::floor(free / 1e6)) + " MB are free for this process");
}

}  // namespace mjenv::core
