// Random numbers that are the same on every machine: the only function of the C library that could round is sqrt, which
// always rounds correctly.
#pragma once

#include <cmath>
#include <cstdint>

namespace mjenv::learn {

// The natural logarithm of a positive normal number, to about 1e-15: x = 2^n m with m near 1, and log m = 2 artanh(s)
// with s = (m - 1) / (m + 1), |s| < 0.172. The terms of its series after s^19 sum to less than 1e-16.
inline double natural_log(double x) {
  int exponent = 0;
  double m = std::frexp(x, &exponent);  // 0.5 to 1
  if (m < 0.70710678118654752) {
    m *= 2;
    --exponent;
  }
  const double s = (m - 1) / (m + 1), square = s * s;
  double sum = 0;
  for (int power = 19; power >= 1; power -= 2) sum = sum * square + 1.0 / power;
  return exponent * 0.693147180559945309 + 2 * s * sum;
}

// SplitMix64 (Steele, Lea and Flood 2014): its state is a counter.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9;
    z = (z ^ (z >> 27)) * 0x94d049bb133111eb;
    return z ^ (z >> 31);
  }

  // Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

  // An integer from 0 to below - 1. Their probabilities differ by at most 2^-32.
  std::uint32_t below(std::uint32_t below) { return static_cast<std::uint32_t>(((bits() >> 32) * below) >> 32); }

  // A standard normal number, by Marsaglia's polar method, which computes two at a time.
  double normal() {
    if (has_kept_ != 0) {
      has_kept_ = 0;
      return kept_;
    }
    for (;;) {
      const double x = 2 * uniform() - 1, y = 2 * uniform() - 1, square = x * x + y * y;
      if (square >= 1 || square < 1e-300) continue;
      const double factor = std::sqrt(-2 * natural_log(square) / square);
      kept_ = y * factor;
      has_kept_ = 1;
      return x * factor;
    }
  }

  template <typename Archive>
  void archive(Archive& a) {
    a(state_, {0, 0x1p64});
    a(has_kept_, {0, 1});
    a(kept_, {-40, 40});  // sqrt(-2 log(1e-300)) is 37.2
  }

 private:
  std::uint64_t state_, has_kept_ = 0;
  double kept_ = 0;
};

}  // namespace mjenv::learn
