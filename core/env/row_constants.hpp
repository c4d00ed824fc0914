// Calls mj_setConst for rows, and again when their derived arrays must be recomputed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/constants.hpp"
#include "engine/work.hpp"
#include "env/rows.hpp"

namespace mjenv::core {

class RowConstants {
 public:
  explicit RowConstants(const Model& model) : model_(model) {}

  // prepare allocates what `set` and `repeat` need, prepare_draw what `draw` needs.
  void prepare();
  void prepare_draw();
  // Calls mj_setConst in the work space, which must hold the row. Saves the constants to the row's own values, and what
  // mj_setConst leaves in mjData (the position qpos_spring) to the row's state. But if mj_setConst changes arrays that
  // rows still share, saves nothing and returns the names of these arrays. Then give each row its own, and call this
  // again.
  std::vector<std::string> set(Work& work, Rows& rows, std::int64_t row);
  // Repeats the call of mj_setConst that `set` made for the row, with the own values and the poses of mocap bodies that
  // the row had at that time.
  void repeat(Work& work, Rows& rows, std::int64_t row);
  // Computes the constants that belong to the values in a block, and writes them there.
  void draw(const OwnArrays& arrays, std::byte* block);

 private:
  const Model& model_;
  std::unique_ptr<Constants> constants_;
};

}  // namespace mjenv::core
