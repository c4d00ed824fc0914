// How many rows each thread of an environment steps together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/own_arrays.hpp"
#include "task/options.hpp"
#include "task/task.hpp"

namespace mjenv::core {

struct LaneChoice {
  int width = 0;       // 0: one row after the other
  std::string reason;  // why rows are stepped one after the other; "" if none is
};

// Decides by the option "lanes", and throws if so many are not available. -1: the variable MJENV_LANES decides, which
// must be a number that this CPU supports; environments that cannot have so many lanes ignore it.
LaneChoice choose_lanes(const Options& options, const Task& task, std::int64_t rows, int threads);

// The names of those mjModel arrays for which lanes do not support different values in each row.
std::vector<std::string> beyond_lanes(const OwnArrays& arrays);

}  // namespace mjenv::core
