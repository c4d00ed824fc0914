// Counts the bytes that a deflate stream unpacks to, without storing them: a few kilobytes can unpack to gigabytes.
#include "engine/untrusted/inflate.hpp"

#include <algorithm>
#include <array>
#include <vector>

namespace mjenv::core {
namespace {

// Thrown at the end of the stream, and where the data are damaged.
struct End {};

class Bits {
 public:
  Bits(const unsigned char* data, std::size_t size) : data_(data), size_(size) {}

  unsigned get(int count) {
    unsigned value = 0;
    for (int i = 0; i < count; ++i) value |= next() << i;
    return value;
  }
  unsigned next() {
    if (at_ / 8 >= size_) throw End();
    const unsigned bit = data_[at_ / 8] >> at_ % 8 & 1U;
    ++at_;
    return bit;
  }
  void skip_bytes(std::size_t count) {
    at_ = (at_ / 8 + count) * 8;
    if (at_ / 8 > size_) throw End();
  }
  void align() { at_ = (at_ + 7) / 8 * 8; }

 private:
  const unsigned char* data_;
  std::size_t size_, at_ = 0;
};

// A canonical Huffman code (RFC 1951, section 3.2.2). It is decoded bit by bit.
class Code {
 public:
  explicit Code(const std::vector<int>& lengths) {
    for (const int length : lengths) ++count_[static_cast<std::size_t>(length)];
    count_[0] = 0;
    std::array<int, 17> start{};
    int free = 1;
    for (std::size_t i = 1; i < 16; ++i) {
      start[i + 1] = start[i] + count_[i];
      free = 2 * free - count_[i];
      if (free < 0) throw End();
    }
    symbols_.resize(lengths.size());
    for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol)
      if (lengths[symbol])
        symbols_[static_cast<std::size_t>(start[static_cast<std::size_t>(lengths[symbol])]++)] =
            static_cast<int>(symbol);
  }

  int decode(Bits& bits) const {
    int code = 0, first = 0, index = 0;
    for (std::size_t length = 1; length < 16; ++length) {
      code |= static_cast<int>(bits.next());
      if (code - first < count_[length]) return symbols_[static_cast<std::size_t>(index + code - first)];
      index += count_[length];
      first = (first + count_[length]) * 2;
      code *= 2;
    }
    throw End();
  }

 private:
  std::array<int, 16> count_{};
  std::vector<int> symbols_;
};

struct Codes {
  Code literals, distances;
};

Codes fixed_codes() {
  std::vector<int> literals(288, 8);
  std::fill(literals.begin() + 144, literals.begin() + 256, 9);
  std::fill(literals.begin() + 256, literals.begin() + 280, 7);
  return {Code(literals), Code(std::vector<int>(30, 5))};
}

Codes dynamic_codes(Bits& bits) {
  constexpr std::array<std::size_t, 19> order{16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
  const std::size_t literals = bits.get(5) + 257, distances = bits.get(5) + 1, described = bits.get(4) + 4;
  std::vector<int> lengths(order.size());
  for (std::size_t i = 0; i < described; ++i) lengths[order[i]] = static_cast<int>(bits.get(3));
  const Code code(lengths);
  std::vector<int> all;
  while (all.size() < literals + distances) {
    const int symbol = code.decode(bits);
    if (symbol < 16) {
      all.push_back(symbol);
      continue;
    }
    if (symbol == 16 && all.empty()) throw End();
    const int repeated = symbol == 16 ? all.back() : 0;
    const unsigned times = symbol == 16 ? 3 + bits.get(2) : symbol == 17 ? 3 + bits.get(3) : 11 + bits.get(7);
    all.insert(all.end(), times, repeated);
  }
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(literals);
  return {Code({all.begin(), middle}), Code({middle, all.begin() + static_cast<std::ptrdiff_t>(literals + distances)})};
}

// Returns the number of bytes that a length symbol (257 or more) stands for (RFC 1951, section 3.2.5).
std::size_t length_of(int symbol, Bits& bits) {
  const int i = symbol - 257;
  if (i > 28) throw End();
  if (i < 8) return static_cast<std::size_t>(i) + 3;
  if (i == 28) return 258;
  const int extra = (i - 4) / 4;
  return (static_cast<std::size_t>(4 + i % 4) << extra) + 3 + bits.get(extra);
}

void skip_distance(int symbol, Bits& bits) {
  if (symbol > 29) throw End();
  if (symbol > 3) bits.get(symbol / 2 - 1);
}

// Adds the bytes that a block unpacks to. Stops when the total exceeds the limit.
void count_block(Bits& bits, const Codes& codes, std::size_t limit, std::size_t& total) {
  while (total <= limit) {
    const int symbol = codes.literals.decode(bits);
    if (symbol == 256) return;
    if (symbol < 256) {
      ++total;
      continue;
    }
    total += length_of(symbol, bits);
    skip_distance(codes.distances.decode(bits), bits);
  }
}

}  // namespace

bool inflates_within(const unsigned char* stream, std::size_t size, std::size_t limit) {
  std::size_t total = 0;
  try {
    Bits bits(stream, size);
    bits.skip_bytes(2);
    for (bool last = false; !last && total <= limit;) {
      last = bits.next() != 0;
      const unsigned kind = bits.get(2);
      if (kind == 0) {
        bits.align();
        const std::size_t length = bits.get(16);
        bits.skip_bytes(2 + length);
        total += length;
      } else if (kind == 1) {
        count_block(bits, fixed_codes(), limit, total);
      } else if (kind == 2) {
        count_block(bits, dynamic_codes(bits), limit, total);
      } else {
        break;
      }
    }
  } catch (const End&) {
  }
  return total <= limit;
}

}  // namespace mjenv::core
