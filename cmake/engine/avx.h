// The few intrinsics of AVX that MuJoCo's dot products and vector functions use, for every CPU. MuJoCo's official library for
// x86-64 is compiled for AVX. There mju_dotSparse adds in another order than in the code for other CPUs, and a result
// of mju_dot that is -0 stays -0. With this file instead of immintrin.h, MuJoCo's code gives the same bits on CPUs
// without AVX.
#pragma once

#include <string.h>

typedef double __m128d __attribute__((vector_size(16)));
typedef int __m128i __attribute__((vector_size(16)));
typedef struct {
  __m128d low, high;
} __m256d;

static inline __m256d _mm256_loadu_pd(const double* from) {
  __m256d res;
  memcpy(&res.low, from, sizeof res.low);
  memcpy(&res.high, from + 2, sizeof res.high);
  return res;
}

static inline void _mm256_storeu_pd(double* to, __m256d x) {
  memcpy(to, &x.low, sizeof x.low);
  memcpy(to + 2, &x.high, sizeof x.high);
}

static inline __m256d _mm256_set_pd(double d, double c, double b, double a) {
  const __m256d res = {{a, b}, {c, d}};
  return res;
}

static inline __m256d _mm256_set1_pd(double x) { return _mm256_set_pd(x, x, x, x); }

static inline __m256d _mm256_add_pd(__m256d x, __m256d y) {
  const __m256d res = {x.low + y.low, x.high + y.high};
  return res;
}

static inline __m256d _mm256_sub_pd(__m256d x, __m256d y) {
  const __m256d res = {x.low - y.low, x.high - y.high};
  return res;
}

static inline __m256d _mm256_mul_pd(__m256d x, __m256d y) {
  const __m256d res = {x.low * y.low, x.high * y.high};
  return res;
}

static inline __m128d _mm256_castpd256_pd128(__m256d x) { return x.low; }

// The upper half; `which` is always 1.
static inline __m128d _mm256_extractf128_pd(__m256d x, int which) {
  (void)which;
  return x.high;
}

static inline __m128d _mm_add_pd(__m128d x, __m128d y) { return x + y; }

static inline __m128d _mm_unpackhi_pd(__m128d x, __m128d y) {
  const __m128d res = {x[1], y[1]};
  return res;
}

static inline __m128d _mm_add_sd(__m128d x, __m128d y) {
  const __m128d res = {x[0] + y[0], x[1]};
  return res;
}

static inline double _mm_cvtsd_f64(__m128d x) { return x[0]; }

static inline __m128i _mm_loadu_si128(const __m128i* from) {
  __m128i res;
  memcpy(&res, from, sizeof res);
  return res;
}

static inline __m128i _mm_cmpeq_epi32(__m128i x, __m128i y) { return x == y; }

// Only whether all bits are set is asked of the result.
static inline int _mm_movemask_epi8(__m128i x) { return (x[0] & x[1] & x[2] & x[3]) == -1 ? 0xFFFF : 0; }
