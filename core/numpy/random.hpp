// NumPy's default_rng, bit for bit: SeedSequence, PCG64, uniform and standard_normal.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mjenv::core::np {

// One random stream. It is trivially copyable, so that an image of a row can hold it.
class Generator {
 public:
  // default_rng(seed), where the seed is an integer of `count` 32-bit digits, least significant first.
  static Generator from_digits(const std::uint32_t* digits, std::size_t count);
  static Generator from_seed(std::uint64_t seed);
  // default_rng(): seeded with 128 bits of the system's entropy.
  static Generator from_entropy();

  // The state's low and high half, then the increment's.
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
