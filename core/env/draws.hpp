// The values that a reset draws for a row's own arrays. The row gets them only after the reset's outputs are written,
// as if a wrapper around Gymnasium's environment drew them after its reset.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "env/randomization.hpp"
#include "env/row_constants.hpp"
#include "env/rows.hpp"

namespace mjenv::core {

class Draws {
 public:
  void reserve(std::size_t bytes) { block_.reserve(bytes); }
  void clear() { block_.clear(); }
  // Draws the values. This changes the row's random stream and nothing else of the row; `adopt` stores the values.
  // values: the row's own values before the draw.
  void draw(Rows& rows, std::int64_t row, const std::byte* values, const Randomization& randomization,
            RowConstants& constants) {
    const OwnArrays& arrays = rows.arrays();
    block_.assign(values, values + rows.block_bytes());
    arrays.clear_inputs(block_.data());
    randomization.draw(rows.head(row).rng, rows.ranges(row), block_.data());
    if (randomization.computes_constants()) constants.draw(arrays, block_.data());
  }
  // Gives the row the values that were drawn. Returns false if none were.
  bool adopt(Rows& rows, std::int64_t row) noexcept {
    if (block_.empty()) return false;
    rows.keep(row);
    rows.set_values(row, block_.data());
    rows.head(row).written = Written::by_caller;
    clear();
    return true;
  }

 private:
  std::vector<std::byte> block_;
};

}  // namespace mjenv::core
