// The order in which rows are stepped in lanes. Rows that are stepped together take as long as the one with the most
// constraints. So rows are sorted by how many constraints they had in their last step.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mjenv::core {

class Order {
 public:
  // rows: how many rows there are, or 0 to keep their order. share: how many rows each thread steps. Only rows of the
  // same window, which has at most `share` rows, change places with each other. So rows that are stepped together are
  // near each other in memory, and mostly stay with their thread.
  Order(std::int64_t rows, std::int64_t share)
      : constraints_(static_cast<std::size_t>(rows)), offsets_(constraints_.size()) {
    while (window_ < kMaxWindow && 2 * static_cast<std::int64_t>(window_) <= share) window_ *= 2;
    for (std::size_t row = 0; row < offsets_.size(); ++row) offsets_[row] = static_cast<std::uint8_t>(row % window_);
  }

  // Sorts the rows of each window. Insertion sort is fast, because few rows change places from step to step.
  void arrange() {
    for (std::size_t start = 0; start < offsets_.size(); start += window_) {
      const std::uint8_t* const constraints = &constraints_[start];
      std::uint8_t* const offsets = &offsets_[start];
      const std::size_t count = std::min(window_, offsets_.size() - start);
      for (std::size_t i = 1; i < count; ++i) {
        const std::uint8_t offset = offsets[i];
        std::size_t place = i;
        for (; place > 0 && constraints[offsets[place - 1]] > constraints[offset]; --place)
          offsets[place] = offsets[place - 1];
        offsets[place] = offset;
      }
    }
  }

  // The row at a place of the order.
  std::int64_t row(std::int64_t place) const {
    if (offsets_.empty()) return place;
    const auto at = static_cast<std::size_t>(place);
    return static_cast<std::int64_t>((at & ~(window_ - 1)) + offsets_[at]);
  }

  // Records how many constraints the row had in its last step.
  void note(std::int64_t row, int constraints) {
    if (constraints_.empty()) return;
    constraints_[static_cast<std::size_t>(row)] = static_cast<std::uint8_t>(std::min(constraints, 255));
  }

 private:
  static constexpr std::size_t kMaxWindow = 64;

  std::size_t window_ = 1;  // a power of 2
  std::vector<std::uint8_t> constraints_, offsets_;
};

}  // namespace mjenv::core
