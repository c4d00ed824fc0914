// NumPy's RandomState, bit for bit: the Mersenne Twister and the methods that NumPy no longer changes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace mjenv::core::np {

// One random stream of 2.5 kB. It is trivially copyable, so that an image of a row can hold it.
class RandomState {
 public:
  // RandomState(seed) of an integer of `count` 64-bit words, least significant first. NumPy refuses integers of more
  // than 32 bits; here they give RandomState of the list of their 32-bit words.
  static RandomState from_seed(const std::uint64_t* words, std::size_t count);

  // What get_state() of NumPy returns: the key, its position, whether a normal number is kept, and that number's bits. The
  // word before the last has 2 more if no number was drawn since the stream was seeded.
  static constexpr std::size_t kStateWords = 627;
  void save(std::uint64_t* words) const;
  // Takes words that save has written. False, and nothing changes, if they are none.
  bool load(const std::uint64_t* words);

  bool is_seeded() const { return position_ > 0; }
  // No number was drawn since it was seeded.
  bool is_new() const { return is_new_ != 0; }
  // Whether foreign bytes are a stream, seeded or not.
  bool is_valid() const {
    return position_ >= 0 && position_ <= static_cast<std::int32_t>(kWords) && has_gauss_ <= 1 && is_new_ <= 1;
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
  // choice(count, p=p). Does not check p.
  std::int64_t choice(std::int64_t count, const double* p);

 private:
  static constexpr std::size_t kWords = 624;
  std::array<std::uint32_t, kWords> words_{};
  std::int32_t position_ = 0;  // of the next word; 0: not seeded, because 0 is skipped
  std::uint16_t has_gauss_ = 0, is_new_ = 0;
  double gauss_ = 0;  // the second of two normal numbers, which the next randn returns

  void fill(std::uint32_t seed);
  std::uint32_t next();
};

}  // namespace mjenv::core::np
