// The locale of the C library's functions.
#pragma once

#include <locale.h>

#include <new>

namespace mjenv::core {

// On this thread and while it lives, the C library's functions read and compare text as in C's own locale, whatever the
// host sets for the process or the thread, and whenever it does.
class ClassicLocale {
 public:
  ClassicLocale() : locale_(newlocale(LC_ALL_MASK, "C", nullptr)) {
    if (!locale_) throw std::bad_alloc();
    before_ = uselocale(locale_);
  }
  ~ClassicLocale() {
    uselocale(before_);
    freelocale(locale_);
  }
  ClassicLocale(const ClassicLocale&) = delete;
  ClassicLocale& operator=(const ClassicLocale&) = delete;

 private:
  locale_t locale_, before_ = nullptr;
};

}  // namespace mjenv::core
