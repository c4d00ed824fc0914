// Calls mj_setConst for rows.
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

  // Allocate what `set` and `repeat` need, and what `draw` needs.
  void prepare();
  void prepare_draw();
  // Calls mj_setConst in the work space, which holds the row. Saves the constants to the row's own values, and to its
  // state what mj_setConst leaves in mjData (the position qpos_spring). But if mj_setConst changes arrays that rows
  // still share, saves nothing and returns their names: give each row its own, then call this again.
  std::vector<std::string> set(Work& work, Rows& rows, std::int64_t row);
  // Calls mj_setConst as `set` did: with the own values and the poses of mocap bodies that the row had then. Afterwards
  // the work space uses `scratch` instead of the row's own values.
  void repeat(Work& work, Rows& rows, std::int64_t row, std::vector<std::byte>& scratch);
  // Computes the constants that belong to the values in a block, and writes them there.
  void draw(const OwnArrays& arrays, std::byte* block);

 private:
  const Model& model_;
  std::unique_ptr<Constants> constants_;
};

}  // namespace mjenv::core
