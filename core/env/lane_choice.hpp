// How many rows each thread of an environment steps together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"
#include "task/options.hpp"

namespace mjenv::core {

struct LaneChoice {
  int width = 0;       // 0: one row after the other
  std::string reason;  // why rows are stepped one after the other; "" if none is
};

// Decides by the option "lanes". Throws if the option says a number that cannot be had. The environment variable
// MJENV_LANES must be a number that this CPU can do, but is for all environments of a process, so it has no effect on
// those without lanes.
LaneChoice choose_lanes(const Options& options, const Model& model, std::int64_t rows, int threads);

// The arrays of mjModel among these of which lanes cannot compute with a row's own values.
std::vector<std::string> beyond_lanes(const OwnArrays& arrays);
// Whether the block has a number that is not 0 in an input of mjData that lanes take for 0, such as xfrc_applied.
bool has_forces(const OwnArrays& arrays, const std::byte* block);

}  // namespace mjenv::core
