// The action of one row, in the caller's array and dtype.
#pragma once

#include <cstdint>

#include "mjenv/mjenv.h"

namespace mjenv::core {

struct Action {
  const void* values = nullptr;
  mjenv_dtype dtype = MJENV_DTYPE_FLOAT64;
  std::int64_t count = 0;

  double operator[](std::int64_t i) const { return dtype == MJENV_DTYPE_FLOAT32 ? narrow()[i] : wide()[i]; }
  Action part(std::int64_t first, std::int64_t length) const {
    return {dtype == MJENV_DTYPE_FLOAT32 ? static_cast<const void*>(narrow() + first) : wide() + first, dtype, length};
  }
  const float* narrow() const { return static_cast<const float*>(values); }
  const double* wide() const { return static_cast<const double*>(values); }
};

}  // namespace mjenv::core
