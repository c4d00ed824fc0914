// The kernels for vectors of MJENV_LEARN_WIDTH floats. Each instruction set includes this file once, in a source file
// with compiler flags of its own. So everything here has internal linkage.
#pragma once

#if defined(__aarch64__)
#include <arm_neon.h>
#else
#include <immintrin.h>
#endif

#include <cstdint>
#include <cstring>

#include "kernels/kernels.hpp"

namespace mjenv::learn {
namespace {

constexpr int kWidth = MJENV_LEARN_WIDTH;

typedef float V __attribute__((vector_size(4 * kWidth)));
typedef float Unaligned __attribute__((vector_size(4 * kWidth), aligned(4)));
typedef std::int32_t I __attribute__((vector_size(4 * kWidth)));

inline V load(const float* from) { return *reinterpret_cast<const Unaligned*>(from); }
inline void store(float* to, V x) { *reinterpret_cast<Unaligned*>(to) = x; }
inline V splat(float x) { return x - V{}; }

// A vector of copies of the number at an address.
#if MJENV_LEARN_WIDTH == 16
// Made by the instruction for integers, because on AMD's CPUs the one for floats, which compilers choose, takes time of
// the units that add and multiply.
inline V spread(const float* from) {
  V copies;
  __asm__("vpbroadcastd %1, %0" : "=v"(copies) : "m"(*from));
  return copies;
}
#else
inline V spread(const float* from) { return splat(*from); }
#endif

// min(x, y) is x < y ? x : y, and max(x, y) is x > y ? x : y, also for NaN and -0, as the instructions of x86 have it.
#if defined(__aarch64__)
inline V sqrt(V x) { return vsqrtq_f32(x); }
inline V min(V x, V y) { return x < y ? x : y; }
inline V max(V x, V y) { return x > y ? x : y; }
#elif MJENV_LEARN_WIDTH == 4
inline V sqrt(V x) { return _mm_sqrt_ps(x); }
inline V min(V x, V y) { return _mm_min_ps(x, y); }
inline V max(V x, V y) { return _mm_max_ps(x, y); }
#elif MJENV_LEARN_WIDTH == 8
inline V sqrt(V x) { return _mm256_sqrt_ps(x); }
inline V min(V x, V y) { return _mm256_min_ps(x, y); }
inline V max(V x, V y) { return _mm256_max_ps(x, y); }
#else  // gcc 12 warns of the functions without a mask
inline V sqrt(V x) { return _mm512_maskz_sqrt_ps(0xffff, x); }
inline V min(V x, V y) { return _mm512_maskz_min_ps(0xffff, x, y); }
inline V max(V x, V y) { return _mm512_maskz_max_ps(0xffff, x, y); }
#endif

// Calls body(0) to body(kCount - 1), where the index is a constant: arrays of vectors then stay in registers.
template <int kCount, typename Body>
inline void repeat(const Body& body) {
#pragma GCC unroll 16
  for (int i = 0; i < kCount; ++i) body(i);
}

// Computes one tile of `product`: kRows rows of kVectors vectors of outputs. Their sums stay in registers.
template <int kRows, int kVectors>
inline void product_tile(const float* x, int stride, int inputs, const float* w, int outputs, const float* bias,
                         float* y) {
  V sum[kRows][kVectors];
  repeat<kRows>([&](int r) { repeat<kVectors>([&](int v) { sum[r][v] = bias ? load(bias + kWidth * v) : V{}; }); });
  for (int a = 0; a < inputs; ++a) {
    V row[kVectors];
    repeat<kVectors>([&](int v) { row[v] = load(w + a * outputs + kWidth * v); });
    repeat<kRows>([&](int r) {
      const V factor = spread(x + r * stride + a);
      repeat<kVectors>([&](int v) { sum[r][v] += factor * row[v]; });
    });
  }
  repeat<kRows>([&](int r) { repeat<kVectors>([&](int v) { store(y + r * outputs + kWidth * v, sum[r][v]); }); });
}

// Computes whole tiles from `column` on, as many as fit. Returns the first column that is left.
template <int kRows, int kVectors>
inline int product_columns(int column, const float* x, int stride, int rows, int inputs, const float* w, int outputs,
                           const float* bias, float* y) {
  for (; outputs - column >= kVectors * kWidth; column += kVectors * kWidth)
    for (int i = 0; i < rows; i += kRows)
      product_tile<kRows, kVectors>(x + i * stride, stride, inputs, w + column, outputs, bias ? bias + column : nullptr,
                                    y + i * outputs + column);
  return column;
}

// How many vectors wide a tile is, so that registers are left for the factors. AVX-512 has 32 registers, the others at
// least 16.
constexpr int kTile = kWidth == 16 ? 4 : 2;

void product(const float* x, int stride, int rows, int inputs, const float* w, int outputs, const float* bias,
             float* y) {
  constexpr int kRows = kWidth == 16 ? 8 : 4;
  int column = product_columns<4, kTile>(0, x, stride, rows, inputs, w, outputs, bias, y);
  column = product_columns<kRows, 2>(column, x, stride, rows, inputs, w, outputs, bias, y);
  product_columns<8, 1>(column, x, stride, rows, inputs, w, outputs, bias, y);
}

template <int kInputs, int kVectors>
inline void gradient_tile(const float* x, int stride, int rows, const float* d, int outputs, bool adds, float* g) {
  V sum[kInputs][kVectors];
  repeat<kInputs>([&](int a) { repeat<kVectors>([&](int v) { sum[a][v] = V{}; }); });
  for (int i = 0; i < rows; ++i) {
    V row[kVectors];
    repeat<kVectors>([&](int v) { row[v] = load(d + i * outputs + kWidth * v); });
    repeat<kInputs>([&](int a) {
      const V factor = spread(x + i * stride + a);
      repeat<kVectors>([&](int v) { sum[a][v] += factor * row[v]; });
    });
  }
  repeat<kInputs>([&](int a) {
    repeat<kVectors>([&](int v) {
      float* to = g + a * outputs + kWidth * v;
      store(to, adds ? load(to) + sum[a][v] : sum[a][v]);
    });
  });
}

template <int kVectors>
inline int gradient_columns(int column, const float* x, int stride, int rows, int inputs, const float* d, int outputs,
                            bool adds, float* g) {
  for (; outputs - column >= kVectors * kWidth; column += kVectors * kWidth)
    for (int a = 0; a < inputs; a += kInputBlock)
      gradient_tile<kInputBlock, kVectors>(x + a, stride, rows, d + column, outputs, adds, g + a * outputs + column);
  return column;
}

void gradient(const float* x, int stride, int rows, int inputs, const float* d, int outputs, bool adds, float* g) {
  const int column = gradient_columns<kTile>(0, x, stride, rows, inputs, d, outputs, adds, g);
  gradient_columns<1>(column, x, stride, rows, inputs, d, outputs, adds, g);
}

void sum_rows(const float* d, int rows, int outputs, bool adds, float* h) {
  for (int column = 0; column < outputs; column += kWidth) {
    V sum{};
    for (int i = 0; i < rows; ++i) sum += load(d + i * outputs + column);
    store(h + column, adds ? load(h + column) + sum : sum);
  }
}

// The sum of kLaneBlock lanes, whose second half is added to the first until one is left.
inline float sum_of(const V* sum) {
  typedef float Quad __attribute__((vector_size(16)));
  static_assert(kLaneBlock == 16);
  float lanes[kLaneBlock];
  Quad part[4];
  repeat<kLaneBlock / kWidth>([&](int v) { store(lanes + kWidth * v, sum[v]); });
  std::memcpy(part, lanes, sizeof part);
  const Quad last = (part[0] + part[2]) + (part[1] + part[3]);
  return (last[0] + last[2]) + (last[1] + last[3]);
}

// Computes kRows rows of one output of `dots`.
template <int kRows>
inline void dots_tile(const float* x, int inputs, const float* w, float bias, int stride, float* y) {
  constexpr int kVectors = kLaneBlock / kWidth;
  V sum[kRows][kVectors];
  repeat<kRows>([&](int r) { repeat<kVectors>([&](int v) { sum[r][v] = V{}; }); });
  for (int a = 0; a < inputs; a += kLaneBlock)
    repeat<kVectors>([&](int v) {
      const V weights = load(w + a + kWidth * v);
      repeat<kRows>([&](int r) { sum[r][v] += load(x + r * inputs + a + kWidth * v) * weights; });
    });
  repeat<kRows>([&](int r) { y[r * stride] = sum_of(sum[r]) + bias; });
}

void dots(const float* x, int rows, int inputs, const float* w, int outputs, const float* bias, int stride, float* y) {
  constexpr int kRows = kWidth == 4 ? 2 : 4;
  for (int i = 0; i < rows; i += kRows)
    for (int o = 0; o < outputs; ++o)
      dots_tile<kRows>(x + i * inputs, inputs, w + o * inputs, bias[o], stride, y + i * stride + o);
}

// x + kShift - kShift is x rounded to a whole number. The lowest bits of x + kShift contain this number.
constexpr float kShift = 12582912.0F;  // 1.5 * 2^23

// 2^n for whole n between -126 and 127. The bits of n from the tenth on are ignored.
inline V power_of_two(I n) { return reinterpret_cast<V>((n + 127) << 23); }

// exp(x) - 1 = 2^n (1 + q) - 1 with the n for which |r| = |x - n log 2| <= log(2) / 2, where q = exp(r) - 1 is the
// Taylor polynomial of degree 7, whose error is less than half a unit in the last place of a float32. x must be between
// -87 and 88.
struct Reduced {
  V scale, q;  // 2^n and q
};

inline Reduced reduce(V x) {
  constexpr double kLog2 = 0.693147180559945309;
  constexpr float kLog2High = 0.693359375F, kLog2Low = static_cast<float>(kLog2 - 0.693359375);  // the first is exact
  const V shifted = x * static_cast<float>(1 / kLog2) + kShift, whole = shifted - kShift;
  const V r = (x - whole * kLog2High) - whole * kLog2Low;
  V q = r * (1.0F / 5040) + 1.0F / 720;
  q = q * r + 1.0F / 120;
  q = q * r + 1.0F / 24;
  q = q * r + 1.0F / 6;
  q = q * r + 0.5F;
  q = (q * r) * r + r;
  return {power_of_two(reinterpret_cast<I>(shifted)), q};
}

inline V expm1(V x) {
  const Reduced part = reduce(max(x, splat(-87.0F)));
  return part.scale * part.q + (part.scale - 1.0F);
}

inline V exp(V x) {
  const Reduced part = reduce(min(max(x, splat(-87.0F)), splat(88.0F)));
  return part.scale * part.q + part.scale;
}

// tanh x with x = n log(2) / 2 + r, |r| <= log(2) / 4, follows from t = tanh r and tanh(n log(2) / 2) = (s - 1) / (s + 1)
// with s = 2^n by the addition theorem: (t (s + 1) + (s - 1)) / (t (s - 1) + (s + 1)). t is r + r^3 (a + b r^2), where a
// and b make the greatest relative error least: 6e-8. From |x| = 10 on, the result rounds to 1.
inline V tanh(V x) {
  constexpr double kHalfLog2 = 0.346573590279972655;
  constexpr float kHigh = 0.3466796875F, kLow = static_cast<float>(kHalfLog2 - 0.3466796875);  // kHigh n is exact
  constexpr float kA = -0.33331276F, kB = 0.13110795F;
  const V bounded = min(max(x, splat(-10.0F)), splat(10.0F));
  const V shifted = bounded * static_cast<float>(1 / kHalfLog2) + kShift;
  const V n = shifted - kShift;
  const V r = (bounded - n * kHigh) - n * kLow, square = r * r;
  const V t = (r * square) * (kA + square * kB) + r;
  const V s = power_of_two(reinterpret_cast<I>(shifted));
  const V below = s - 1.0F, above = s + 1.0F;
  return (t * above + below) / (t * below + above);
}

inline V elu(V x) { return x > 0.0F ? x : expm1(min(x, V{})); }

template <typename Change>
inline void each(float* y, std::size_t count, const Change& change) {
  for (std::size_t i = 0; i < count; i += kWidth) store(y + i, change(load(y + i)));
}

void activate(Activation activation, float* y, std::size_t count) {
  if (activation == Activation::kTanh)
    each(y, count, [](V x) { return tanh(x); });
  else if (activation == Activation::kRelu)
    each(y, count, [](V x) { return max(x, V{}); });
  else
    each(y, count, [](V x) { return elu(x); });
}

template <typename Derivative>
inline void each_derivative(const float* y, float* d, std::size_t count, const Derivative& derivative) {
  for (std::size_t i = 0; i < count; i += kWidth) store(d + i, load(d + i) * derivative(load(y + i)));
}

void derive(Activation activation, const float* y, float* d, std::size_t count) {
  if (activation == Activation::kTanh)
    each_derivative(y, d, count, [](V h) { return 1.0F - h * h; });
  else if (activation == Activation::kRelu)
    each_derivative(y, d, count, [](V h) { return h > 0.0F ? splat(1.0F) : V{}; });
  else
    each_derivative(y, d, count, [](V h) { return h > 0.0F ? splat(1.0F) : h + 1.0F; });
}

void exp_all(float* x, std::size_t count) {
  each(x, count, [](V value) { return exp(value); });
}

void add(const float* from, float* to, std::size_t count) {
  for (std::size_t i = 0; i < count; i += kWidth) store(to + i, load(to + i) + load(from + i));
}

void squares(const float* x, std::size_t count, float* lanes) {
  constexpr int kVectors = kLaneBlock / kWidth;
  V sum[kVectors];
  repeat<kVectors>([&](int v) { sum[v] = load(lanes + kWidth * v); });
  for (std::size_t i = 0; i < count; i += kLaneBlock)
    repeat<kVectors>([&](int v) {
      const V part = load(x + i + kWidth * v);
      sum[v] += part * part;
    });
  repeat<kVectors>([&](int v) { store(lanes + kWidth * v, sum[v]); });
}

void adam(const AdamStep& step, const float* gradient, float* first, float* second, float* parameters,
          std::size_t count) {
  for (std::size_t i = 0; i < count; i += kWidth) {
    const V g = load(gradient + i) * step.scale;
    const V m = load(first + i) * step.beta1 + g * (1.0F - step.beta1);
    const V v = load(second + i) * step.beta2 + (g * g) * (1.0F - step.beta2);
    store(first + i, m);
    store(second + i, v);
    store(parameters + i, load(parameters + i) - (m * step.rate) / (sqrt(v) * step.second_root + step.epsilon));
  }
}

constexpr Kernels make_kernels(const char* name) {
  return {name, product, dots, gradient, sum_rows, activate, derive, exp_all, add, squares, adam};
}

}  // namespace
}  // namespace mjenv::learn
