// What the methods of NumPy's Generator and of its RandomState have in common.
#pragma once

#include <cstdint>

namespace mjenv::core::np {

// The least number 2^n - 1 that is not less than max. NumPy draws as many bits until the number is not above max.
inline std::uint64_t mask_over(std::uint64_t max) {
  for (unsigned shift = 1; shift < 64; shift *= 2) max |= max >> shift;
  return max;
}

// choice(count, p=p), where `drawn` is the number in [0, 1) that it draws.
inline std::int64_t chosen_by(double drawn, std::int64_t count, const double* p) {
  double total = 0;
  for (std::int64_t i = 0; i < count; ++i) total += p[i];
  double sum = 0;
  for (std::int64_t i = 0; i < count; ++i)
    if (drawn < (sum += p[i]) / total) return i;
  return count;  // not reached, because the last quotient is 1
}

}  // namespace mjenv::core::np
