// NumPy's default_rng: SeedSequence -> PCG64 -> uniform and standard_normal, bit for bit.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mjenv::core::np {

// One random stream; plain memory, so that a row's image can hold it.
class Generator {
 public:
  // default_rng(seed) for the integer whose 32-bit digits are given, least significant first.
  static Generator from_digits(const std::uint32_t* digits, std::size_t count);
  static Generator from_seed(std::uint64_t seed);
  // From 128 bits of the system's entropy, as default_rng() does.
  static Generator from_entropy();

  // State low and high, increment low and high.
  using Words = std::array<std::uint64_t, 4>;
  static Generator from_words(const Words& words);
  Words words() const { return {state_low_, state_high_, inc_low_, inc_high_}; }

  std::uint64_t next();
  // In [0, 1).
  double random() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double uniform(double low, double high) {
    const double range = high - low;
    return low + range * random();
  }
  double normal();

 private:
  std::uint64_t state_high_ = 0, state_low_ = 0;
  std::uint64_t inc_high_ = 0, inc_low_ = 0;

  double normal_tail(bool negative);
};

}  // namespace mjenv::core::np
