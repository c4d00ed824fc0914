// NumPy's RandomState, bit for bit: the Mersenne Twister and the methods that NumPy no longer changes.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace mjenv::core::np {

// One random stream of 2.5 kB. It is trivially copyable, so that an image of a row can hold it.
class RandomState {
 public:
  // RandomState(seed), where the seed is an integer of `count` 64-bit words, least significant first. NumPy refuses
  // integers of more than 32 bits. Here such a seed gives RandomState(list of its 32-bit words).
  static RandomState from_seed(const std::uint64_t* words, std::size_t count);

  // The state as NumPy's get_state() returns it: the key (624 words), the position in it, whether a normal number is
  // kept, and that number's bits. 2 is added to the word before the last if no number was drawn since the stream was
  // seeded.
  static constexpr std::size_t kStateWords = 627;
  void save(std::uint64_t* words) const;
  // Sets the state to words that `save` has written. If they are no valid state, changes nothing and returns false.
  bool load(const std::uint64_t* words);

  bool is_seeded() const { return position_ > 0; }
  // Whether no number was drawn since the stream was seeded.
  bool is_new() const { return is_new_ != 0; }
  // Whether an object that was copied from untrusted bytes is a valid stream, seeded or not.
  bool is_valid() const {
    return position_ >= 0 && position_ <= static_cast<std::int32_t>(kWords) && has_gauss_ <= 1 && is_new_ <= 1 &&
           (!is_seeded() || is_state(words_.data()));
  }

  // rand(), uniform(low, high), randn()
  double rand();
  double uniform(double low, double high) {
    const double range = high - low;
    return low + range * rand();
  }
  double randn();
  // randint(low, high): low <= number < high. high - low is at most 2^32.
  std::int64_t randint(std::int64_t low, std::int64_t high);
  // choice(count, p=p), or choice(count) if p is null. Does not check p.
  std::int64_t choice(std::int64_t count, const double* p);
  // permutation(count)
  void permutation(std::int64_t count, std::int64_t* order);

 private:
  static constexpr std::size_t kWords = 624;

  // Whether words are a state of MT19937, which does not have the lower 31 bits of the first word. A state of zeros would
  // draw zeros for ever, and randn would never find a number.
  template <typename Word>
  static bool is_state(const Word* words) {
    return (words[0] & 0x80000000U) != 0 || std::any_of(words + 1, words + kWords, [](Word word) { return word != 0; });
  }

  std::array<std::uint32_t, kWords> words_{};
  std::int32_t position_ = 0;  // of the next word. It is never 0 in a seeded stream, so 0 means: not seeded
  std::uint16_t has_gauss_ = 0, is_new_ = 0;
  double gauss_ = 0;  // the second of two normal numbers, which the next randn returns

  void fill(std::uint32_t seed);
  std::uint32_t next();
};

}  // namespace mjenv::core::np
