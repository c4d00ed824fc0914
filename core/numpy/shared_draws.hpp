// Steps that the methods of NumPy's Generator and RandomState share.
#pragma once

#include <cstdint>

namespace mjenv::core::np {

// The smallest number of the form 2^n - 1 that is at least max. NumPy draws n bits, again and again until they are not
// above max.
inline std::uint64_t mask_over(std::uint64_t max) {
  for (unsigned shift = 1; shift < 64; shift *= 2) max |= max >> shift;
  return max;
}

// The result of choice(count, p=p) if its draw from [0, 1) is `drawn`.
inline std::int64_t chosen_by(double drawn, std::int64_t count, const double* p) {
  double total = 0;
  for (std::int64_t i = 0; i < count; ++i) total += p[i];
  double sum = 0;
  for (std::int64_t i = 0; i < count; ++i)
    if (drawn < (sum += p[i]) / total) return i;
  return count;  // never reached, because the last quotient is 1
}

}  // namespace mjenv::core::np
