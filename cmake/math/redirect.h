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

// The name of mjenv_math's function in object files, where some systems put a "_" before every name in C.
#define MJENV_QUOTED(text) #text
#define MJENV_TEXT(macro) MJENV_QUOTED(macro)
#define MJENV_IS(name) __asm__(MJENV_TEXT(__USER_LABEL_PREFIX__) "mjenv_" #name)

#ifdef __cplusplus
extern "C" {
#endif

double sin(double) MJENV_NOEXCEPT MJENV_IS(sin);
double cos(double) MJENV_NOEXCEPT MJENV_IS(cos);
double tan(double) MJENV_NOEXCEPT MJENV_IS(tan);
double asin(double) MJENV_NOEXCEPT MJENV_IS(asin);
double acos(double) MJENV_NOEXCEPT MJENV_IS(acos);
double atan2(double, double) MJENV_NOEXCEPT MJENV_IS(atan2);
double exp(double) MJENV_NOEXCEPT MJENV_IS(exp);
double log(double) MJENV_NOEXCEPT MJENV_IS(log);
double expm1(double) MJENV_NOEXCEPT MJENV_IS(expm1);
double log1p(double) MJENV_NOEXCEPT MJENV_IS(log1p);
double pow(double, double) MJENV_NOEXCEPT MJENV_IS(pow);
double fma(double, double, double) MJENV_NOEXCEPT MJENV_IS(fma);
void qsort(void*, size_t, size_t, int (*)(const void*, const void*)) MJENV_IS(qsort);
void qsort_r(void*, size_t, size_t, int (*)(const void*, const void*, void*), void*) MJENV_IS(qsort_r);
#if defined(_WIN32)  // MuJoCo calls this there. The C library declares it as imported, so it goes by another name.
void mjenv_qsort_s(void*, size_t, size_t, int (*)(void*, const void*, const void*), void*);
#define qsort_s mjenv_qsort_s
#endif

#ifdef __cplusplus
}
#endif
#undef MJENV_IS
#undef MJENV_NOEXCEPT
