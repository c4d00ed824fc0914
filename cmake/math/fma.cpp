// a * b + c, rounded once, for CPUs without such an instruction. Some C libraries round it twice. Computed in integers:
// the sum keeps 126 bits, and its last bit stands for all bits below it.
#include <cstdint>
#include <cstring>

namespace {

__extension__ typedef unsigned __int128 Bits;

constexpr int kTop = 125;  // the place of the first bit of what is added, which leaves room for a carry

// (-1)^is_negative * bits * 2^exponent
struct Number {
  bool is_negative;
  int exponent;
  Bits bits;
};

std::uint64_t word_of(double x) {
  std::uint64_t word;
  std::memcpy(&word, &x, sizeof word);
  return word;
}

double double_of(bool is_negative, std::uint64_t magnitude) {
  const std::uint64_t word = static_cast<std::uint64_t>(is_negative) << 63 | magnitude;
  double x;
  std::memcpy(&x, &word, sizeof x);
  return x;
}

bool is_finite(double x) { return (word_of(x) >> 52 & 0x7ff) != 0x7ff; }

Number number_of(double x) {
  const std::uint64_t word = word_of(x), fraction = word & 0xfffffffffffff;
  const int exponent = static_cast<int>(word >> 52 & 0x7ff);
  if (exponent == 0) return {(word >> 63) != 0, -1074, fraction};
  return {(word >> 63) != 0, exponent - 1075, fraction | std::uint64_t{1} << 52};
}

// Of bits that are not all 0.
int first_bit(Bits bits) {
  const auto high = static_cast<std::uint64_t>(bits >> 64), low = static_cast<std::uint64_t>(bits);
  return high ? 127 - __builtin_clzll(high) : 63 - __builtin_clzll(low);
}

// Drops bits at the end. The last one that stays is set if any of them was.
Bits shifted(Bits bits, int places) {
  if (places <= 0) return bits;
  if (places > 127) return bits != 0;
  const Bits dropped = bits & ((Bits{1} << places) - 1);
  return bits >> places | (dropped != 0);
}

void move_first_bit(Number& x, int place) {
  const int up = place - first_bit(x.bits);
  x.bits = up >= 0 ? x.bits << up : shifted(x.bits, -up);
  x.exponent -= up;
}

double rounded(Number x) {
  // 53 bits stay, or fewer of a number below 2^-1022, and two more, of which the last stands for all that follow.
  move_first_bit(x, kTop);
  const int lowest = x.exponent + kTop - 52 > -1074 ? x.exponent + kTop - 52 : -1074;
  const auto with_two_more = static_cast<std::uint64_t>(shifted(x.bits, lowest - 2 - x.exponent));
  std::uint64_t fraction = with_two_more >> 2;
  const std::uint64_t rest = with_two_more & 3;
  fraction += rest == 3 || (rest == 2 && (fraction & 1));
  // A carry makes the exponent larger by one, as it should be.
  const int exponent = lowest + 1074;
  if (exponent > 2045 || (exponent == 2045 && fraction >> 53))
    return double_of(x.is_negative, std::uint64_t{0x7ff} << 52);
  return double_of(x.is_negative, (static_cast<std::uint64_t>(exponent) << 52) + fraction);
}

}  // namespace

extern "C" double mjenv_fma_soft(double a, double b, double c) {
  if (!is_finite(a) || !is_finite(b) || a == 0 || b == 0) return a * b + c;
  if (!is_finite(c)) return c;  // although the product may overflow
  const Number x = number_of(a), y = number_of(b);
  Number product{x.is_negative != y.is_negative, x.exponent + y.exponent, x.bits * y.bits};
  if (c == 0) return rounded(product);
  Number sum = number_of(c);
  move_first_bit(product, kTop);
  move_first_bit(sum, kTop);
  if (sum.exponent < product.exponent || (sum.exponent == product.exponent && sum.bits < product.bits)) {
    const Number larger = product;
    product = sum;
    sum = larger;
  }
  const Bits smaller = shifted(product.bits, sum.exponent - product.exponent);
  sum.bits = sum.is_negative == product.is_negative ? sum.bits + smaller : sum.bits - smaller;
  return sum.bits == 0 ? 0.0 : rounded(sum);
}
