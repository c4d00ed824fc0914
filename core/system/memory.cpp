#include "system/memory.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <fstream>

#include "system/cgroups.hpp"

namespace mjenv::core {
namespace {

// The number behind a word of a file.
double counter(const std::string& file, const std::string& word, double otherwise) {
  std::ifstream from(file);
  double value = 0;
  for (std::string key; from >> key;)
    if (key == word && from >> value) return value;
  return otherwise;
}

// What a cgroup folder leaves; it gives up files' pages that were not used for long.
double left_in(const std::string& folder) {
  double most = 0, used = 0;
  std::ifstream v2_most(folder + "/memory.max"), v2_used(folder + "/memory.current");
  std::ifstream v1_most(folder + "/memory.limit_in_bytes"), v1_used(folder + "/memory.usage_in_bytes");
  if (!(v2_most >> most && v2_used >> used) && !(v1_most >> most && v1_used >> used)) return kUnlimited;
  return std::max(0.0, most - used + counter(folder + "/memory.stat", "inactive_file", 0));
}

// Of the address space that setrlimit leaves.
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

}  // namespace mjenv::core
