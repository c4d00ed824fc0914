#include "numpy/random_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <utility>

#include "numpy/shared_draws.hpp"

namespace mjenv::core::np {

void RandomState::fill(std::uint32_t seed) {
  for (std::uint32_t i = 0; i < kWords; ++i) {
    words_[i] = seed;
    seed = 1812433253U * (seed ^ seed >> 30) + i + 1;
  }
}

RandomState RandomState::from_seed(const std::uint64_t* words, std::size_t count) {
  const auto word = [&](std::size_t i) { return static_cast<std::uint32_t>(words[i / 2] >> 32 * (i % 2)); };
  std::size_t length = 2 * count;
  while (length > 1 && word(length - 1) == 0) --length;
  RandomState made;
  made.position_ = kWords;
  made.is_new_ = 1;
  if (length <= 1) {
    made.fill(word(0));
    return made;
  }
  made.fill(19650218);
  auto& mixed = made.words_;
  std::size_t at = 1;
  const auto mix = [&](std::uint32_t factor, std::uint32_t added) {
    mixed[at] = (mixed[at] ^ (mixed[at - 1] ^ mixed[at - 1] >> 30) * factor) + added;
    if (++at < kWords) return;
    mixed[0] = mixed[kWords - 1];
    at = 1;
  };
  for (std::size_t i = 0; i < std::max(kWords, length); ++i)
    mix(1664525, word(i % length) + static_cast<std::uint32_t>(i % length));
  for (std::size_t i = 1; i < kWords; ++i) mix(1566083941, -static_cast<std::uint32_t>(at));
  mixed[0] = 0x80000000U;
  return made;
}

void RandomState::save(std::uint64_t* words) const {
  words = std::copy(words_.begin(), words_.end(), words);
  *words++ = static_cast<std::uint64_t>(position_);
  *words++ = has_gauss_ + 2U * is_new_;
  std::memcpy(words, &gauss_, sizeof gauss_);
}

bool RandomState::load(const std::uint64_t* words) {
  const std::uint64_t position = words[kWords], flags = words[kWords + 1];
  if (position > kWords || flags > 3 || (position > 0 && !is_state(words))) return false;
  if (std::any_of(words, words + kWords, [](std::uint64_t word) { return word > 0xffffffffU; })) return false;
  for (std::size_t i = 0; i < kWords; ++i) words_[i] = static_cast<std::uint32_t>(words[i]);
  position_ = static_cast<std::int32_t>(position);
  has_gauss_ = flags & 1;
  is_new_ = flags >> 1 & 1;
  std::memcpy(&gauss_, words + kWords + 2, sizeof gauss_);
  return true;
}

std::uint32_t RandomState::next() {
  is_new_ = 0;
  if (position_ == static_cast<std::int32_t>(kWords)) {
    constexpr std::size_t ahead = 397;
    for (std::size_t i = 0; i < kWords; ++i) {
      const std::uint32_t mixed = (words_[i] & 0x80000000U) | (words_[(i + 1) % kWords] & 0x7fffffffU);
      words_[i] = words_[(i + ahead) % kWords] ^ mixed >> 1 ^ ((mixed & 1) != 0 ? 0x9908b0dfU : 0);
    }
    position_ = 0;
  }
  std::uint32_t word = words_[static_cast<std::size_t>(position_++)];
  word ^= word >> 11;
  word ^= word << 7 & 0x9d2c5680U;
  word ^= word << 15 & 0xefc60000U;
  return word ^ word >> 18;
}

double RandomState::rand() {
  const std::uint32_t high = next() >> 5, low = next() >> 6;
  return (high * 67108864.0 + low) / 9007199254740992.0;
}

double RandomState::randn() {
  if (has_gauss_ != 0) {
    const double kept = gauss_;
    has_gauss_ = 0;
    gauss_ = 0;
    return kept;
  }
  double x = 0, y = 0, square = 0;
  do {
    x = 2.0 * rand() - 1.0;
    y = 2.0 * rand() - 1.0;
    square = x * x + y * y;
  } while (square >= 1.0 || square == 0.0);
  const double factor = std::sqrt(-2.0 * std::log(square) / square);
  gauss_ = factor * x;
  has_gauss_ = 1;
  return factor * y;
}

std::int64_t RandomState::randint(std::int64_t low, std::int64_t high) {
  const auto max = static_cast<std::uint32_t>(high - low - 1);
  if (max == 0) return low;
  const auto mask = static_cast<std::uint32_t>(mask_over(max));
  std::uint32_t drawn = 0;
  do drawn = next() & mask;
  while (drawn > max);
  return low + drawn;
}

std::int64_t RandomState::choice(std::int64_t count, const double* p) {
  return p ? chosen_by(rand(), count, p) : randint(0, count);
}

void RandomState::permutation(std::int64_t count, std::int64_t* order) {
  std::iota(order, order + count, std::int64_t{0});
  for (std::int64_t i = count - 1; i > 0; --i) std::swap(order[i], order[randint(0, i + 1)]);
}

}  // namespace mjenv::core::np
