#include "system/memory.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

// Smaller allocations are not checked: they rarely fail, and the check takes time, because it reads files.
constexpr double kSmall = 1 << 26;

}  // namespace

double free_memory() { return platform::available_memory(""); }

void check_memory(const std::string& what, double bytes) {
  if (bytes < kSmall) return;
  const double free = std::min(free_memory(), static_cast<double>(std::numeric_limits<std::size_t>::max()));
  if (bytes > free)
    fail(MJENV_E_MEMORY, what + " need " + number(std::ceil(bytes / 1e6)) + " MB, but only " +
                             number(std::floor(free / 1e6)) + " MB are free for this process");
}

void check_memory(std::int64_t count, const char* what, std::uint64_t bytes_each) {
  check_memory(std::to_string(count) + what, static_cast<double>(count) * static_cast<double>(bytes_each));
}

}  // namespace mjenv::core
