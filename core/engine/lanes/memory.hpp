// The memory of arrays that lie side by side.
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "engine/lanes/lanes.hpp"

namespace mjenv::core::lanes {

// The memory of the arrays of Lanes, Dual or Primal.
template <typename Struct>
class Memory {
 public:
  // counts: how many numbers each array has in a lane
  Memory(Struct& arrays, int width, const std::vector<std::pair<double * Struct::*, int>>& counts) {
    std::size_t total = kAlignment;
    for (const auto& [array, count] : counts) total += static_cast<std::size_t>(count * width);
    block_.resize(total);
    void* start = block_.data();
    std::size_t room = total * sizeof(double);
    auto* at = static_cast<double*>(std::align(kAlignment * sizeof(double), sizeof(double), start, room));
    for (const auto& [array, count] : counts) {
      arrays.*array = at;
      at += count * width;
    }
  }

 private:
  static constexpr std::size_t kAlignment = kMaxWidth;  // in numbers
  std::vector<double> block_;
};

}  // namespace mjenv::core::lanes
