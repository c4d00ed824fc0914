// The action of one row, in the caller's array and dtype.
#pragma once

#include <cstdint>

#include "mjenv/mjenv.h"

namespace mjenv::core {

struct Action {
  const void* values = nullptr;
  mjenv_dtype dtype = MJENV_DTYPE_FLOAT64;
  std::int64_t count = 0;

  double operator[](std::int64_t i) const { return dtype == MJENV_DTYPE_FLOAT32 ? floats()[i] : doubles()[i]; }
  Action part(std::int64_t first, std::int64_t length) const {
    if (dtype == MJENV_DTYPE_FLOAT32) return {floats() + first, dtype, length};
    return {doubles() + first, dtype, length};
  }
  const float* floats() const { return static_cast<const float*>(values); }
  const double* doubles() const { return static_cast<const double*>(values); }
};

}  // namespace mjenv::core
