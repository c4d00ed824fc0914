// One block of memory for all arrays of a struct.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "engine/lanes/frame/width.hpp"

namespace mjenv::core::lanes {

// For each array of a struct, how many numbers it has in each lane.
template <typename Struct>
using Counts = std::vector<std::pair<double * Struct::*, std::size_t>>;

// The memory of the arrays of a struct, which are 0 at first.
template <typename Struct>
class Memory {
 public:
  Memory(Struct& arrays, int width, const Counts<Struct>& counts) {
    std::size_t room = bytes(width, counts);
    // Most rows have far fewer constraints than there is room for. calloc's pages take no memory until they are written
    // to.
    block_.reset(std::calloc(1, room));
    if (!block_) throw std::bad_alloc();
    void* start = block_.get();
    auto* at = static_cast<double*>(std::align(kAlignment * sizeof(double), sizeof(double), start, room));
    for (const auto& [array, count] : counts) {
      arrays.*array = at;
      at += count * static_cast<std::size_t>(width);
    }
  }
  static std::size_t bytes(int width, const Counts<Struct>& counts) {
    std::size_t numbers = kAlignment;
    for (const auto& [array, count] : counts) numbers += count * static_cast<std::size_t>(width);
    return numbers * sizeof(double);
  }

 private:
  static constexpr std::size_t kAlignment = kMaxWidth;  // in numbers
  struct Free {
    void operator()(void* block) const { std::free(block); }
  };
  std::unique_ptr<void, Free> block_;
};

}  // namespace mjenv::core::lanes
