// The rows that a call is about.
#pragma once

#include <cstdint>
#include <cstring>

namespace mjenv::core {

// Of rows first to first + count - 1 those that the mask selects; null selects all.
struct Selection {
  const std::uint8_t* mask;
  std::int64_t first, count;

  // Returns the first of them from `row` on, or `end` if there is none before. Eight rows at a time, so that a call for one
  // row among many takes hardly longer than for one among few.
  std::int64_t next(std::int64_t row, std::int64_t end) const {
    if (!mask) return row;
    for (std::uint64_t eight = 0; row + 8 <= end; row += 8) {
      std::memcpy(&eight, mask + row, sizeof eight);
      if (eight != 0) break;
    }
    while (row < end && mask[row] == 0) ++row;
    return row;
  }

  // Calls body(row, row - first) for each of them.
  template <typename Body>
  void for_each(const Body& body) const {
    const std::int64_t end = first + count;
    for (std::int64_t row = next(first, end); row < end; row = next(row + 1, end)) body(row, row - first);
  }
};

}  // namespace mjenv::core
