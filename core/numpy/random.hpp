// NumPy's default_rng, bit for bit: SeedSequence, PCG64 and methods of Generator.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace mjenv::core::np {

// One random stream. It is trivially copyable, so that an image of a row can hold it.
class Generator {
 public:
  // default_rng(seed), where the seed is an integer of `count` 64-bit words, least significant first.
  static Generator from_seed(const std::uint64_t* words, std::size_t count);
  static Generator from_seed(std::uint64_t seed) { return from_seed(&seed, 1); }
  // default_rng(): seeded with 128 bits of the system's entropy.
  static Generator from_entropy();

  // The low and high half of the state, the low and high half of the increment, has_uint32 and uinteger of PCG64.
  static constexpr std::int64_t kWords = 6;
  using Words = std::array<std::uint64_t, kWords>;
  // Fails unless the low half of an increment is odd, as NumPy's are.
  static void check_increment(std::uint64_t low, const std::string& of = "");
  static Generator from_words(const Words& words);
  Words words() const { return {state_low_, state_high_, inc_low_, inc_high_, has_half_, half_}; }

  // 64 random bits.
  std::uint64_t next();
  // random(): a number in [0, 1).
  double random() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  double uniform(double low, double high) {
    const double range = high - low;
    return low + range * random();
  }
  // standard_normal()
  double normal();
  // integers(low, high): low <= number < high.
  std::int64_t integers(std::int64_t low, std::int64_t high);
  // choice(count, p=p). Does not check p.
  std::int64_t choice(std::int64_t count, const double* p);
  // choice(count, size, replace=False) with size <= count.
  void sample(std::int64_t count, std::int64_t size, std::int64_t* chosen);
  // permutation(count)
  void permutation(std::int64_t count, std::int64_t* order);

 private:
  std::uint64_t state_high_ = 0, state_low_ = 0;
  std::uint64_t inc_high_ = 0, inc_low_ = 0;
  std::uint32_t half_ = 0, has_half_ = 0;  // the upper half of a draw whose lower half next_half returned

  double normal_tail(bool negative);
  std::uint32_t next_half();
  // These draw an integer in [0, max].
  std::uint64_t bounded(std::uint64_t max);
  std::uint64_t masked(std::uint64_t max);
  // For i from count - 1 down to first, swaps values[i] with a random one of values[0] to values[i].
  void shuffle(std::int64_t first, std::int64_t count, std::int64_t* values);
};

}  // namespace mjenv::core::np
