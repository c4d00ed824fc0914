// The memory of arrays that lie side by side.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "engine/lanes/lanes.hpp"

namespace mjenv::core::lanes {

// The memory of the arrays of Lanes, Contacts or Constraints. They begin as zeros.
template <typename Struct>
class Memory {
 public:
  // counts: how many numbers each array has in a lane
  Memory(Struct& arrays, int width, const std::vector<std::pair<double * Struct::*, int>>& counts) {
    std::size_t total = kAlignment;
    for (const auto& [array, count] : counts) total += static_cast<std::size_t>(count * width);
    // Most rows have far fewer constraints than there is room for. The system gives calloc's pages when they are written to.
    block_.reset(std::calloc(total, sizeof(double)));
    if (!block_) throw std::bad_alloc();
    void* start = block_.get();
    std::size_t room = total * sizeof(double);
    auto* at = static_cast<double*>(std::align(kAlignment * sizeof(double), sizeof(double), start, room));
    for (const auto& [array, count] : counts) {
      arrays.*array = at;
      at += count * width;
    }
  }

 private:
  static constexpr std::size_t kAlignment = kMaxWidth;  // in numbers
  struct Free {
    void operator()(void* block) const { std::free(block); }
  };
  std::unique_ptr<void, Free> block_;
};

}  // namespace mjenv::core::lanes
