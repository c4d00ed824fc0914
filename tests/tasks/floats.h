// Changes the floating-point environment, as a library that gcc -Ofast made does when it is loaded, and more.
#pragma once

#include <fenv.h>
#include <stdint.h>
#if defined(__x86_64__)
#include <immintrin.h>
#endif

// Rounding upwards, and flushing to zero where this test knows how.
static inline void change_floats(void) {
  fesetround(FE_UPWARD);
#if defined(__x86_64__)
  _mm_setcsr(_mm_getcsr() | 0x8040);
#elif defined(__aarch64__)
  uint64_t control = 0;
  __asm__ volatile("mrs %0, fpcr" : "=r"(control));
  __asm__ volatile("msr fpcr, %0" : : "r"(control | 1u << 24));
#endif
}

// The settings, without the bits that record exceptions.
static inline uint64_t float_settings(void) {
  uint64_t settings = (uint64_t)(uint32_t)fegetround() << 32;
#if defined(__x86_64__)
  settings |= _mm_getcsr() & 0xffc0;
#elif defined(__aarch64__)
  uint64_t control = 0;
  __asm__ volatile("mrs %0, fpcr" : "=r"(control));
  settings ^= control;
#endif
  return settings;
}
