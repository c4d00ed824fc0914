// Vectors of several rows' numbers: lane l of each vector belongs to row l. Each instruction set includes this file once,
// in a source file with compiler flags of its own. So everything here has internal linkage, and no function is called
// that the linker could replace by another file's copy, which was compiled with other flags.
#pragma once

#if defined(__aarch64__)
#include <arm_neon.h>
#else
#include <immintrin.h>
#endif

#include <mujoco/mjmodel.h>  // mjMAXVAL

namespace mjenv::core::lanes {
namespace {

constexpr int kWidth = MJENV_LANES_WIDTH;
constexpr double kHuge = 1e300, kNoBound = __builtin_nan(""), kInfinite = __builtin_inf();

typedef double V __attribute__((vector_size(8 * kWidth)));
using Mask = decltype(V{} < V{});

#if defined(__aarch64__)
inline V sqrt(V x) { return vsqrtq_f64(x); }
inline unsigned bits(Mask mask) {
  return static_cast<unsigned>(vaddvq_u64(vandq_u64(reinterpret_cast<uint64x2_t>(mask), uint64x2_t{1, 2})));
}
#elif MJENV_LANES_WIDTH == 2
inline V sqrt(V x) { return _mm_sqrt_pd(x); }
inline unsigned bits(Mask mask) { return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(mask))); }
#elif MJENV_LANES_WIDTH == 4
inline V sqrt(V x) { return _mm256_sqrt_pd(x); }
inline unsigned bits(Mask mask) { return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask))); }
#else
inline V sqrt(V x) { return _mm512_maskz_sqrt_pd(0xff, x); }  // gcc 12 warns of _mm512_sqrt_pd
inline unsigned bits(Mask mask) {
  return _mm512_test_epi64_mask(reinterpret_cast<__m512i>(mask), reinterpret_cast<__m512i>(mask));
}
#endif

inline bool any(Mask mask) { return bits(mask) != 0; }
// The mask of the lanes whose bits are set.
inline Mask mask_of(unsigned rows) {
  Mask bit{}, all{};
  for (int lane = 0; lane < kWidth; ++lane) {
    bit[lane] = 1 << lane;
    all[lane] = rows;
  }
  return (all & bit) != Mask{};
}
// Returns a vector with x in each lane. Written as x - V{}, because V{} + x would turn -0 into +0.
inline V splat(double x) { return x - V{}; }
inline V splat(V x) { return x; }
inline V* vectors(double* numbers) { return reinterpret_cast<V*>(numbers); }
inline const V* vectors(const double* numbers) { return reinterpret_cast<const V*>(numbers); }

// mju_abs; adding +0 turns -0 into +0
inline V abs(V x) { return x < V{} ? -x : x + V{}; }

inline void zero(V* res, int n) {
  for (int i = 0; i < n; ++i) res[i] = V{};
}

inline void copy(V* res, const V* vec, int n) {
  for (int i = 0; i < n; ++i) res[i] = vec[i];
}

inline void add_to(V* res, const V* vec, int n) {
  for (int i = 0; i < n; ++i) res[i] += vec[i];
}

// ---- Lanes and rows ----

// mju_isBad
unsigned bad(const double* numbers, int count) {
  const V* x = vectors(numbers);
  Mask good = V{} == V{};
  for (int i = 0; i < count; ++i) good &= (x[i] <= splat(mjMAXVAL)) & (x[i] >= splat(-mjMAXVAL));
  return bits(~good);
}

#if MJENV_LANES_WIDTH >= 4
// Transposes four vectors of four numbers.
struct Square {
  __m256d rows[4];

  void transpose() {
    const __m256d low01 = _mm256_unpacklo_pd(rows[0], rows[1]), high01 = _mm256_unpackhi_pd(rows[0], rows[1]);
    const __m256d low23 = _mm256_unpacklo_pd(rows[2], rows[3]), high23 = _mm256_unpackhi_pd(rows[2], rows[3]);
    rows[0] = _mm256_permute2f128_pd(low01, low23, 0x20);
    rows[1] = _mm256_permute2f128_pd(high01, high23, 0x20);
    rows[2] = _mm256_permute2f128_pd(low01, low23, 0x31);
    rows[3] = _mm256_permute2f128_pd(high01, high23, 0x31);
  }
};
#endif

void gather(double* to, const double* const* from, int count) {
  int i = 0;
#if MJENV_LANES_WIDTH >= 4
  for (; i + 4 <= count; i += 4)
    for (int lane = 0; lane < kWidth; lane += 4) {
      Square square;
      for (int k = 0; k < 4; ++k) square.rows[k] = _mm256_loadu_pd(from[lane + k] + i);
      square.transpose();
      for (int k = 0; k < 4; ++k) _mm256_storeu_pd(to + (i + k) * kWidth + lane, square.rows[k]);
    }
#endif
  for (; i < count; ++i)
    for (int lane = 0; lane < kWidth; ++lane) to[i * kWidth + lane] = from[lane][i];
}

void scatter(double* const* to, const double* from, int count) {
  int i = 0;
#if MJENV_LANES_WIDTH >= 4
  for (; i + 4 <= count; i += 4)
    for (int lane = 0; lane < kWidth; lane += 4) {
      Square square;
      for (int k = 0; k < 4; ++k) square.rows[k] = _mm256_loadu_pd(from + (i + k) * kWidth + lane);
      square.transpose();
      for (int k = 0; k < 4; ++k) _mm256_storeu_pd(to[lane + k] + i, square.rows[k]);
    }
#endif
  for (; i < count; ++i)
    for (int lane = 0; lane < kWidth; ++lane) to[lane][i] = from[i * kWidth + lane];
}

}  // namespace
}  // namespace mjenv::core::lanes
