// Included before all else in the sources of the engine and of the core: calls of these functions go to those of
// mjenv_math. The C library's functions stay what they are for everybody else in the process.
#pragma once

#include <stddef.h>

#ifdef __cplusplus
#define MJENV_NOEXCEPT noexcept
extern "C" {
#else
#define MJENV_NOEXCEPT
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
void qsort(void*, size_t, size_t, int (*)(const void*, const void*)) __asm__("mjenv_qsort");
void qsort_r(void*, size_t, size_t, int (*)(const void*, const void*, void*), void*) __asm__("mjenv_qsort_r");

#ifdef __cplusplus
}
#endif
#undef MJENV_NOEXCEPT
