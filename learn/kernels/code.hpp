// The kernels for vectors of MJENV_LEARN_WIDTH floats. Each instruction set includes this file once, in a source file
// with compiler flags of its own. So everything here has internal linkage.
#pragma once

#if defined(__aarch64__)
#include <arm_neon.h>
#else
#include <immintrin.h>
#endif

#include <cstdint>

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

#if defined(__aarch64__)
inline V sqrt(V x) { return vsqrtq_f32(x); }
#elif MJENV_LEARN_WIDTH == 4
inline V sqrt(V x) { return _mm_sqrt_ps(x); }
#elif MJENV_LEARN_WIDTH == 8
inline V sqrt(V x) { return _mm256_sqrt_ps(x); }
#else
inline V sqrt(V x) { return _mm512_maskz_sqrt_ps(0xffff, x); }  // gcc 12 warns of _mm512_sqrt_ps
#endif

inline V min(V x, V y) { return x < y ? x : y; }
inline V max(V x, V y) { return x > y ? x : y; }

// Computes one tile of `product`: kRows rows of kVectors vectors of outputs. Their sums stay in registers.
template <int kRows, int kVectors>
inline void product_tile(const float* x, int stride, int inputs, const float* w, int outputs, const float* bias,
                         float* y) {
  V sum[kRows][kVectors];
  for (int r = 0; r < kRows; ++r)
    for (int v = 0; v < kVectors; ++v) sum[r][v] = bias ? load(bias + kWidth * v) : V{};
  for (int a = 0; a < inputs; ++a) {
    V row[kVectors];
    for (int v = 0; v < kVectors; ++v) row[v] = load(w + a * outputs + kWidth * v);
    for (int r = 0; r < kRows; ++r) {
      const V factor = splat(x[r * stride + a]);
      for (int v = 0; v < kVectors; ++v) sum[r][v] += factor * row[v];
    }
  }
  for (int r = 0; r < kRows; ++r)
    for (int v = 0; v < kVectors; ++v) store(y + r * outputs + kWidth * v, sum[r][v]);
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

// How many vectors a tile has, so that registers are left for the factors. AVX-512 has 32 registers, the others at
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
inline void gradient_tile(const float* x, int stride, int rows, const float* d, int outputs, float* g) {
  V sum[kInputs][kVectors] = {};
  for (int i = 0; i < rows; ++i) {
    V row[kVectors];
    for (int v = 0; v < kVectors; ++v) row[v] = load(d + i * outputs + kWidth * v);
    for (int a = 0; a < kInputs; ++a) {
      const V factor = splat(x[i * stride + a]);
      for (int v = 0; v < kVectors; ++v) sum[a][v] += factor * row[v];
    }
  }
  for (int a = 0; a < kInputs; ++a)
    for (int v = 0; v < kVectors; ++v) {
      float* to = g + a * outputs + kWidth * v;
      store(to, load(to) + sum[a][v]);
    }
}

void gradient(const float* x, int stride, int rows, int inputs, const float* d, int outputs, float* g, float* h) {
  int column = 0;
  for (; outputs - column >= kTile * kWidth; column += kTile * kWidth)
    for (int a = 0; a < inputs; a += kInputBlock)
      gradient_tile<kInputBlock, kTile>(x + a, stride, rows, d + column, outputs, g + a * outputs + column);
  for (; column < outputs; column += kWidth)
    for (int a = 0; a < inputs; a += kInputBlock)
      gradient_tile<kInputBlock, 1>(x + a, stride, rows, d + column, outputs, g + a * outputs + column);
  for (column = 0; column < outputs; column += kWidth) {
    V sum{};
    for (int i = 0; i < rows; ++i) sum += load(d + i * outputs + column);
    store(h + column, load(h + column) + sum);
  }
}

// 2^n for whole n between -126 and 127.
inline V power_of_two(I n) { return reinterpret_cast<V>((n + 127) << 23); }

// exp(x) - 1 = 2^n (1 + q) - 1 with the n for which |r| = |x - n log 2| <= log(2) / 2, where q = exp(r) - 1 is the
// Taylor polynomial of degree 7, whose error is less than half a unit in the last place of a float32. x must be between
// -87 and 88.
struct Reduced {
  V scale, q;  // 2^n and q
};

inline Reduced reduce(V x) {
  constexpr float kShift = 12582912.0F;  // 1.5 * 2^23: adding and subtracting it rounds to a whole number
  constexpr double kLog2 = 0.693147180559945309;
  constexpr float kLog2High = 0.693359375F, kLog2Low = static_cast<float>(kLog2 - 0.693359375);  // the first is exact
  const V whole = (x * static_cast<float>(1 / kLog2) + kShift) - kShift;
  const V r = (x - whole * kLog2High) - whole * kLog2Low;
  V q = r * (1.0F / 5040) + 1.0F / 720;
  q = q * r + 1.0F / 120;
  q = q * r + 1.0F / 24;
  q = q * r + 1.0F / 6;
  q = q * r + 0.5F;
  q = (q * r) * r + r;
  return {power_of_two(__builtin_convertvector(whole, I)), q};
}

inline V expm1(V x) {
  const Reduced part = reduce(max(x, splat(-87.0F)));
  return part.scale * part.q + (part.scale - 1.0F);
}

inline V exp(V x) {
  const Reduced part = reduce(min(max(x, splat(-87.0F)), splat(88.0F)));
  return part.scale * part.q + part.scale;
}

// (exp(2 |x|) - 1) / (exp(2 |x|) + 1) with the sign of x. From |x| = 10 on it rounds to 1.
inline V tanh(V x) {
  const V size = min(x < 0.0F ? -x : x, splat(10.0F));
  const V e = expm1(size + size);
  const V y = e / (e + 2.0F);
  return x < 0.0F ? -y : y;
}

inline V elu(V x) { return x > 0.0F ? x : expm1(min(x, V{})); }

template <typename Change>
inline void each(float* y, std::size_t count, const Change& change) {
  for (std::size_t i = 0; i < count; i += kWidth) store(y + i, change(load(y + i)));
}

void activate(mjenv_activation activation, float* y, std::size_t count) {
  if (activation == MJENV_ACTIVATION_TANH)
    each(y, count, [](V x) { return tanh(x); });
  else if (activation == MJENV_ACTIVATION_RELU)
    each(y, count, [](V x) { return max(x, V{}); });
  else
    each(y, count, [](V x) { return elu(x); });
}

template <typename Derivative>
inline void each_derivative(const float* y, float* d, std::size_t count, const Derivative& derivative) {
  for (std::size_t i = 0; i < count; i += kWidth) store(d + i, load(d + i) * derivative(load(y + i)));
}

void derive(mjenv_activation activation, const float* y, float* d, std::size_t count) {
  if (activation == MJENV_ACTIVATION_TANH)
    each_derivative(y, d, count, [](V h) { return 1.0F - h * h; });
  else if (activation == MJENV_ACTIVATION_RELU)
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

double squares(const float* x, std::size_t count) {
  constexpr int kVectors = kLaneBlock / kWidth;
  V sum[kVectors] = {};
  for (std::size_t i = 0; i < count; i += kLaneBlock)
    for (int v = 0; v < kVectors; ++v) {
      const V part = load(x + i + kWidth * v);
      sum[v] += part * part;
    }
  float lanes[kLaneBlock];
  for (int v = 0; v < kVectors; ++v) store(lanes + kWidth * v, sum[v]);
  double total = 0;
  for (const float lane : lanes) total += lane;
  return total;
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

constexpr Kernels make_kernels(mjenv_instructions instructions, const char* name) {
  return {instructions, name, product, gradient, activate, derive, exp_all, add, squares, adam};
}

}  // namespace
}  // namespace mjenv::learn
