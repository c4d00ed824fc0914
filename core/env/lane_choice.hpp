// How many rows each thread of an environment steps together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "task/options.hpp"
#include "task/task.hpp"

namespace mjenv::core {

struct LaneChoice {
  int width = 0;       // 0: one row after the other
  std::string reason;  // why rows are stepped one after the other; "" if they are not
};

// Chooses the number of lanes that the option "lanes" asks for, or throws if that many are not available. If the option
// is "auto" or "max" and the environment variable MJENV_LANES is set, the variable decides. It must be a number that this CPU
// supports; an environment that cannot have so many lanes then has none.
LaneChoice choose_lanes(const Options& options, const Task& task, std::int64_t rows, int threads);

}  // namespace mjenv::core
