#include "numpy/random.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_set>
#include <utility>
#include <vector>

#include "error.hpp"
#include "numpy/shared_draws.hpp"
#include "numpy/ziggurat.hpp"
#include "system/platform.hpp"

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

// SeedSequence(entropy).generate_state(4, uint64). NumPy hashes the 32-bit digits of an integer without leading zeros.
std::array<std::uint64_t, 4> seed_words(const std::uint64_t* entropy, std::size_t words_of_entropy) {
  const auto digit = [&](std::size_t i) { return static_cast<std::uint32_t>(entropy[i / 2] >> (i % 2 ? 32 : 0)); };
  std::size_t count = 2 * words_of_entropy;
  while (count > 1 && digit(count - 1) == 0) --count;
  Hash absorb{0x43b0d7e5, 0x931e8875};
  std::array<std::uint32_t, 4> pool{};
  for (std::size_t i = 0; i < pool.size(); ++i) pool[i] = absorb(i < count ? digit(i) : 0);
  for (std::size_t from = 0; from < pool.size(); ++from)
    for (std::size_t to = 0; to < pool.size(); ++to)
      if (to != from) pool[to] = mix(pool[to], absorb(pool[from]));
  for (std::size_t i = pool.size(); i < count; ++i)
    for (auto& word : pool) word = mix(word, absorb(digit(i)));

  Hash emit{0x8b51f9dd, 0x58f38ded};
  std::array<std::uint64_t, 4> words{};
  for (std::size_t i = 0; i < 2 * words.size(); ++i) {
    const std::uint64_t half = emit(pool[i % pool.size()]);
    words[i / 2] |= half << (i % 2 ? 32 : 0);
  }
  return words;
}

}  // namespace

Generator Generator::from_seed(const std::uint64_t* seed, std::size_t count) {
  const auto words = seed_words(seed, count);
  const uint128 inc = pair(words[2], words[3]) << 1 | 1;
  const uint128 state = (inc + pair(words[0], words[1])) * kMultiplier + inc;
  return from_words({static_cast<std::uint64_t>(state), static_cast<std::uint64_t>(state >> 64),
                     static_cast<std::uint64_t>(inc), static_cast<std::uint64_t>(inc >> 64), 0, 0});
}

void Generator::check_increment(std::uint64_t low, const std::string& of) {
  if (low % 2 == 0) fail(MJENV_E_VALUE, of + "the increment words[2] is " + std::to_string(low) + ", but must be odd");
}

Generator Generator::from_words(const Words& words) {
  Generator g;
  g.state_low_ = words[0];
  g.state_high_ = words[1];
  g.inc_low_ = words[2];
  g.inc_high_ = words[3];
  g.has_half_ = words[4] != 0;
  g.half_ = static_cast<std::uint32_t>(words[5]);
  return g;
}

Generator Generator::from_entropy() {
  std::array<std::uint64_t, 2> seed{};
  if (!platform::fill_with_entropy(seed.data(), sizeof seed))
    fail(MJENV_E_INTERNAL, "the system does not provide random numbers for a seed");
  return from_seed(seed.data(), seed.size());
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

std::uint32_t Generator::next_half() {
  if (has_half_) {
    has_half_ = 0;
    return half_;
  }
  const std::uint64_t bits = next();
  has_half_ = 1;
  half_ = static_cast<std::uint32_t>(bits >> 32);
  return static_cast<std::uint32_t>(bits);
}

// Lemire's method: the result is the upper half of draw * range. If the lower half is one of the few that would make
// some results more likely than others, draws again. For ranges up to 2^32 the draws have 32 bits.
std::uint64_t Generator::bounded(std::uint64_t max) {
  constexpr std::uint64_t max32 = std::numeric_limits<std::uint32_t>::max();
  constexpr std::uint64_t max64 = std::numeric_limits<std::uint64_t>::max();
  if (max == 0) return 0;
  if (max == max32) return next_half();
  if (max == max64) return next();
  const std::uint64_t range = max + 1;
  if (max < max32) {
    const std::uint64_t refused = (max32 - max) % range;
    for (;;) {
      const std::uint64_t product = next_half() * range;
      if ((product & max32) >= refused) return product >> 32;
    }
  }
  const std::uint64_t refused = (max64 - max) % range;
  for (;;) {
    const uint128 product = static_cast<uint128>(next()) * range;
    if (static_cast<std::uint64_t>(product) >= refused) return static_cast<std::uint64_t>(product >> 64);
  }
}

std::int64_t Generator::integers(std::int64_t low, std::int64_t high) {
  const auto first = static_cast<std::uint64_t>(low);
  return static_cast<std::int64_t>(first + bounded(static_cast<std::uint64_t>(high) - 1 - first));
}

std::int64_t Generator::choice(std::int64_t count, const double* p) {
  if (!p) return integers(0, count);
  return chosen_by(random(), count, p);
}

// Draws as NumPy's permutation does: masked draws, until one is not above max.
std::uint64_t Generator::masked(std::uint64_t max) {
  const std::uint64_t mask = mask_over(max);
  for (;;) {
    const std::uint64_t drawn = (max <= std::numeric_limits<std::uint32_t>::max() ? next_half() : next()) & mask;
    if (drawn <= max) return drawn;
  }
}

void Generator::permutation(std::int64_t count, std::int64_t* order) {
  std::iota(order, order + count, std::int64_t{0});
  for (std::int64_t i = count - 1; i > 0; --i) std::swap(order[i], order[masked(static_cast<std::uint64_t>(i))]);
}

void Generator::shuffle(std::int64_t first, std::int64_t count, std::int64_t* values) {
  for (std::int64_t i = count - 1; i >= first; --i)
    std::swap(values[i], values[bounded(static_cast<std::uint64_t>(i))]);
}

void Generator::sample(std::int64_t count, std::int64_t size, std::int64_t* chosen) {
  if (count > 10000 && size > count / 50) {
    std::vector<std::int64_t> all(static_cast<std::size_t>(count));
    std::iota(all.begin(), all.end(), std::int64_t{0});
    shuffle(std::max<std::int64_t>(count - size, 1), count, all.data());
    std::copy(all.end() - size, all.end(), chosen);
    return;
  }
  // Floyd's algorithm.
  std::unordered_set<std::int64_t> drawn_before;
  for (std::int64_t i = 0; i < size; ++i) {
    const std::int64_t max = count - size + i;
    const auto drawn = static_cast<std::int64_t>(bounded(static_cast<std::uint64_t>(max)));
    chosen[i] = drawn_before.insert(drawn).second ? drawn : max;
    drawn_before.insert(chosen[i]);
  }
  shuffle(1, size, chosen);
}

}  // namespace mjenv::core::np
