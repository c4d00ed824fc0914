#include "system/memory.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "error.hpp"
#include "system/cgroups.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

// Smaller allocations are not checked, because the check reads files, and small allocations rarely fail.
constexpr double kSmall = 1 << 26;

// How many bytes a control group may still use. The kernel drops inactive pages of files when it needs memory, so they
// count as free.
double bytes_left(const std::string& folder) {
  double max = 0, used = 0;
  std::ifstream v2_max(folder + "/memory.max"), v2_used(folder + "/memory.current");
  std::ifstream v1_max(folder + "/memory.limit_in_bytes"), v1_used(folder + "/memory.usage_in_bytes");
  if (!(v2_max >> max && v2_used >> used) && !(v1_max >> max && v1_used >> used)) return kUnlimited;
  return std::max(0.0, max - used + counter(folder + "/memory.stat", "inactive_file", 0));
}

}  // namespace

double free_memory(const std::string& root) {
  return std::min(platform::available_memory(root), smallest_limit(root, "memory", bytes_left));
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
