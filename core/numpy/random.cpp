#include "numpy/random.hpp"

#include <sys/random.h>

#include <array>
#include <cmath>

#include "error.hpp"
#include "numpy/ziggurat.hpp"

namespace mjenv::core::np {
namespace {

__extension__ using uint128 = unsigned __int128;

constexpr uint128 pair(std::uint64_t high, std::uint64_t low) { return static_cast<uint128>(high) << 64 | low; }

constexpr uint128 kMultiplier = pair(0x2360ED051FC65DA4, 0x4385DF649FCCF645);

// The running hash of M. E. O'Neill's seed_seq_fe.
struct Hash {
  std::uint32_t constant;
  std::uint32_t multiplier;

  std::uint32_t operator()(std::uint32_t value) {
    value ^= constant;
    constant *= multiplier;
    value *= constant;
    return value ^ value >> 16;
  }
};

std::uint32_t mix(std::uint32_t x, std::uint32_t y) {
  const std::uint32_t r = 0xca01f9ddU * x - 0x4973f715U * y;
  return r ^ r >> 16;
}

// SeedSequence(entropy).generate_state(4, uint64).
std::array<std::uint64_t, 4> seed_words(const std::uint32_t* digits, std::size_t count) {
  Hash absorb{0x43b0d7e5, 0x931e8875};
  std::array<std::uint32_t, 4> pool{};
  for (std::size_t i = 0; i < pool.size(); ++i) pool[i] = absorb(i < count ? digits[i] : 0);
  for (std::size_t from = 0; from < pool.size(); ++from)
    for (std::size_t to = 0; to < pool.size(); ++to)
      if (to != from) pool[to] = mix(pool[to], absorb(pool[from]));
  for (std::size_t i = pool.size(); i < count; ++i)
    for (auto& word : pool) word = mix(word, absorb(digits[i]));

  Hash emit{0x8b51f9dd, 0x58f38ded};
  std::array<std::uint64_t, 4> words{};
  for (std::size_t i = 0; i < 2 * words.size(); ++i) {
    const std::uint64_t half = emit(pool[i % pool.size()]);
    words[i / 2] |= half << (i % 2 ? 32 : 0);
  }
  return words;
}

}  // namespace

Generator Generator::from_digits(const std::uint32_t* digits, std::size_t count) {
  const auto words = seed_words(digits, count);
  const uint128 inc = pair(words[2], words[3]) << 1 | 1;
  const uint128 state = (inc + pair(words[0], words[1])) * kMultiplier + inc;
  return from_words({static_cast<std::uint64_t>(state), static_cast<std::uint64_t>(state >> 64),
                     static_cast<std::uint64_t>(inc), static_cast<std::uint64_t>(inc >> 64)});
}

Generator Generator::from_words(const Words& words) {
  Generator g;
  g.state_low_ = words[0];
  g.state_high_ = words[1];
  g.inc_low_ = words[2];
  g.inc_high_ = words[3];
  return g;
}

Generator Generator::from_seed(std::uint64_t seed) {
  const std::array<std::uint32_t, 2> digits{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  return from_digits(digits.data(), digits[1] ? 2 : 1);
}

Generator Generator::from_entropy() {
  std::array<std::uint32_t, 4> digits{};
  if (getrandom(digits.data(), sizeof digits, 0) != sizeof digits)
    fail(MJENV_E_INTERNAL, "the system gives no random numbers for a seed");
  return from_digits(digits.data(), digits.size());
}

std::uint64_t Generator::next() {
  const uint128 state = pair(state_high_, state_low_) * kMultiplier + pair(inc_high_, inc_low_);
  state_high_ = static_cast<std::uint64_t>(state >> 64);
  state_low_ = static_cast<std::uint64_t>(state);
  const std::uint64_t folded = state_high_ ^ state_low_;
  const unsigned rotation = static_cast<unsigned>(state_high_ >> 58);
  return folded >> rotation | folded << (-rotation & 63);
}

// Marsaglia and Tsang's ziggurat of 256 layers, in NumPy's order of draws.
double Generator::normal() {
  for (;;) {
    const std::uint64_t bits = next();
    const auto layer = static_cast<std::size_t>(bits & 0xff);
    const bool negative = bits >> 8 & 1;
    const std::uint64_t magnitude = bits >> 9 & 0x000fffffffffffff;
    const double x = static_cast<double>(magnitude) * ziggurat::wi[layer];
    const double value = negative ? -x : x;
    if (magnitude < ziggurat::ki[layer]) return value;
    if (layer == 0) return normal_tail(magnitude >> 8 & 1);
    const double height = (ziggurat::fi[layer - 1] - ziggurat::fi[layer]) * random() + ziggurat::fi[layer];
    if (height < std::exp(-0.5 * x * x)) return value;
  }
}

double Generator::normal_tail(bool negative) {
  for (;;) {
    const double x = -ziggurat::tail_inverse * std::log1p(-random());
    const double y = -std::log1p(-random());
    if (y + y > x * x) return negative ? -(ziggurat::tail_start + x) : ziggurat::tail_start + x;
  }
}

}  // namespace mjenv::core::np
