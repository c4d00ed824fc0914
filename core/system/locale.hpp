// The locale in which the C library reads numbers and compares text.
#pragma once

#include <locale.h>

#include <new>

namespace mjenv::core {

// Sets the locale "C" for this thread until it is destroyed. The host's own locales, also those that its other threads
// set meanwhile, then have no effect on this thread.
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
