// One named part of an observation, an info and so on, or a readable array.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mjenv/mjenv.h"

namespace mjenv::core {

// One field of a role: what mjenv_field describes, from a mjenv_task_field or of the environment itself.
struct Field {
  mjenv_role role;
  std::string name, doc;
  mjenv_dtype type = MJENV_DTYPE_FLOAT64;
  std::vector<std::int64_t> shape;  // -1, until build has set this length
  std::int64_t offset = 0, count = 1;
  std::string group{};  // of a term of the observation; empty: none
};

}  // namespace mjenv::core
