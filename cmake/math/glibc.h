// Replaces the internal headers of glibc that the sources of its math functions include, and renames the functions and
// tables that these sources share. The library computes in the default floating-point environment and reads no errno,
// so what saves and sets these is left out.
#pragma once

#include <errno.h>
#include <fenv.h>
#include <float.h>
#include <stdint.h>

// ---- The compiler and the linker ----

#undef attribute_hidden
#define attribute_hidden __attribute__((visibility("hidden")))
#undef __always_inline
#define __always_inline inline __attribute__((always_inline))
#undef __glibc_unlikely
#define __glibc_unlikely(condition) __builtin_expect((condition), 0)
#define hidden_def(name)
#define strong_alias(name, other)
#define versioned_symbol(library, name, symbol, version)
#define libm_alias_double(name, symbol)
#define libm_alias_double_other(name, symbol)
#define libm_alias_finite(name, symbol)
#define LIBM_SVID_COMPAT 0
#define DIAG_PUSH_NEEDS_COMMENT
#define DIAG_POP_NEEDS_COMMENT
#define DIAG_IGNORE_Os_NEEDS_COMMENT(version, option)

// ---- The floating-point environment ----

#define SET_RESTORE_ROUND(mode) ((void)0)
#define SET_RESTORE_ROUND_53BIT(mode) ((void)0)
#define __set_errno(error) ((void)0)
#define math_force_eval(x) ((void)0)
#define math_check_force_underflow(x) ((void)0)
#define math_check_force_underflow_nonneg(x) ((void)0)
#define math_opt_barrier(x) (x)
#define math_narrow_eval(x) (x)
#define WANT_ERRNO 0

// ---- Numbers ----

#undef INFINITY
#define INFINITY __builtin_inf()
#define HIGH_ORDER_BIT_IS_SET_FOR_SNAN 0
// All platforms of this library are little-endian.
#define LITTLE_ENDI 1
#define HIGH_HALF 1
#define LOW_HALF 0
#define GET_HIGH_WORD(word, x)         \
  do {                                 \
    const union {                      \
      double number;                   \
      uint64_t bits;                   \
    } as = {(x)};                      \
    (word) = (int32_t)(as.bits >> 32); \
  } while (0)
#define GET_LOW_WORD(word, x)     \
  do {                            \
    const union {                 \
      double number;              \
      uint64_t bits;              \
    } as = {(x)};                 \
    (word) = (uint32_t)(as.bits); \
  } while (0)
#define SET_HIGH_WORD(x, word)                                           \
  do {                                                                   \
    union {                                                              \
      double number;                                                     \
      uint64_t bits;                                                     \
    } as = {(x)};                                                        \
    as.bits = (as.bits & 0xffffffff) | (uint64_t)(uint32_t)(word) << 32; \
    (x) = as.number;                                                     \
  } while (0)

// ---- Names ----

#define __sincostab mjenv_sincostab
#define __exp_data mjenv_exp_data
#define __log_data mjenv_log_data
#define __pow_log_data mjenv_pow_log_data

#ifdef __cplusplus

// With __FP_FAST_FMA, the sources call __builtin_fma where they need a fused operation. Here that is `fused`.
#undef __FP_FAST_FMA
#define __FP_FAST_FMA 1
#define __builtin_fma fused
#define double_t Real
// errors.cpp defines these.
#define __math_oflow mjenv_overflow
#define __math_uflow mjenv_underflow
#define __math_divzero mjenv_divided_by_zero
#define __math_invalid mjenv_invalid

#else

#undef __FP_FAST_FMA
#define __FP_FAST_FMA 1  // for the layout of the tables, which are compiled as C
#define double_t double
#define fabs __builtin_fabs
#define __branred mjenv_branred

#endif
