// The floating-point environment: rounding mode, traps, and flushing of subnormal numbers to zero.
#pragma once

#include <cfenv>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace mjenv::core {

// The default environment.
class Floats {
 public:
  static void set_default() {
    if (is_default()) return;  // this check costs a few nanoseconds, setting the environment about a hundred
    std::fesetenv(FE_DFL_ENV);
#if defined(__x86_64__)
    _mm_setcsr(kDefaultMxcsr);  // because fesetenv of older C libraries does not reset FTZ and DAZ
#endif
  }

#if defined(__x86_64__)
  // The control bits of MXCSR. The bits below them record exceptions.
  static constexpr unsigned kMxcsrControl = 0xffc0, kDefaultMxcsr = 0x1f80;
#if defined(_WIN32)
  // The precision bits are left out, because nothing here depends on them, and on Windows they differ between programs.
  static constexpr unsigned kX87Control = 0xfcff, kDefaultX87 = 0x007f;
#else
  static constexpr unsigned kX87Control = 0xffff, kDefaultX87 = 0x037f;
#endif

  static bool is_default() {
    unsigned short x87 = 0;
    __asm__ volatile("fnstcw %0" : "=m"(x87));
    return (_mm_getcsr() & kMxcsrControl) == kDefaultMxcsr && (x87 & kX87Control) == kDefaultX87;
  }
#elif defined(__aarch64__)
  static bool is_default() {
    unsigned long control = 0;
    __asm__ volatile("mrs %0, fpcr" : "=r"(control));
    return control == 0;
  }
#elif defined(__wasm__)
  static bool is_default() { return true; }  // there is no other
#else
  static bool is_default() { return false; }
#endif
};

// While the object lives, the thread has the default environment, so that the host's settings neither change results
// nor raise signals. The destructor restores the host's settings, even if other code changed them meanwhile.
class DefaultFloats {
 public:
  DefaultFloats() : changed_(!Floats::is_default()) {
    if (!changed_) return;
    std::fegetenv(&before_);
    Floats::set_default();
  }
  ~DefaultFloats() {
    if (changed_)
      std::fesetenv(&before_);
    else
      Floats::set_default();
  }
  DefaultFloats(const DefaultFloats&) = delete;
  DefaultFloats& operator=(const DefaultFloats&) = delete;

 private:
  bool changed_;
  std::fenv_t before_;
};

// Surrounds foreign code that the library calls in the default environment: callbacks, and what runs when a shared
// library is loaded. Such code may change the environment. For instance, loading a library that was built with gcc
// -Ofast makes the thread flush subnormal numbers to 0. The destructor restores the default environment.
class KeptFloats {
 public:
  KeptFloats() = default;
  ~KeptFloats() { Floats::set_default(); }
  KeptFloats(const KeptFloats&) = delete;
  KeptFloats& operator=(const KeptFloats&) = delete;
};

}  // namespace mjenv::core
