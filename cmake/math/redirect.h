// Included before all else in the sources of the engine and of the core: calls of these functions go to those of
// mjenv_math. The C library's functions stay what they are for everybody else in the process.
#pragma once

#include <stddef.h>
#if defined(_WIN32)
#include <stdlib.h>
#endif

#if defined(__cplusplus) && !defined(_WIN32) && !defined(__EMSCRIPTEN__)
#define MJENV_NOEXCEPT noexcept  // as the C library declares them
#else
#define MJENV_NOEXCEPT
#endif

#ifdef __cplusplus
extern "C" {
#endif

double sin(double) MJENV_NOEXCEPT __asm__("mjenv_sin");
double cos(double) MJENV_NOEXCEPT __asm__("mjenv_cos");
double tan(double) MJENV_NOEXCEPT __asm__("mjenv_tan");
double asin(double) MJENV_NOEXCEPT __asm__("mjenv_asin");
double acos(double) MJENV_NOEXCEPT __asm__("mjenv_acos");
double atan2(double, double) MJENV_NOEXCEPT __asm__("mjenv_atan2");
double exp(double) MJENV_NOEXCEPT __asm__("mjenv_exp");
double log(double) MJENV_NOEXCEPT __asm__("mjenv_log");
double log1p(double) MJENV_NOEXCEPT __asm__("mjenv_log1p");
double pow(double, double) MJENV_NOEXCEPT __asm__("mjenv_pow");
double fma(double, double, double) MJENV_NOEXCEPT __asm__("mjenv_fma");
void qsort(void*, size_t, size_t, int (*)(const void*, const void*)) __asm__("mjenv_qsort");
void qsort_r(void*, size_t, size_t, int (*)(const void*, const void*, void*), void*) __asm__("mjenv_qsort_r");
#if defined(_WIN32)  // MuJoCo calls this there. The C library declares it as imported, so it goes by another name.
void mjenv_qsort_s(void*, size_t, size_t, int (*)(void*, const void*, const void*), void*);
#define qsort_s mjenv_qsort_s
#endif

#ifdef __cplusplus
}
#endif
#undef MJENV_NOEXCEPT
