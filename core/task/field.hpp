// Describes one named part of an observation or an info, or one readable array.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mjenv/mjenv.h"

namespace mjenv::core {

// The library's own form of a mjenv_field. It comes from a task's mjenv_task_field or from the environment itself.
struct Field {
  mjenv_role role;
  std::string name, doc;
  mjenv_dtype type = MJENV_DTYPE_FLOAT64;
  std::vector<std::int64_t> shape;  // a length is -1 until build sets it
  std::int64_t offset = 0, count = 1;
  std::string group{};  // the group to which a term of the observation belongs; empty: none
};

}  // namespace mjenv::core
