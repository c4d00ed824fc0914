// Draws for programs that compute tasks over all rows.
#pragma once

#include <cstdint>

#include "mjenv/mjenv.h"

namespace mjenv::core {

// mjenv_draw
void draw(std::uint64_t* words, std::int64_t streams, mjenv_distribution kind, double low, double high, double* values,
          std::int64_t count);

}  // namespace mjenv::core
