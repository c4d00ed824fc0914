// Collects the errors of the rows that a call computes, so that the call reports them as one error.
#pragma once

#include <cstddef>
#include <string>

#include "mjenv/mjenv.h"

namespace mjenv::core {

class Failures {
 public:
  // Adds an error. The status that is reported is the first one, or MJENV_E_MEMORY if that was added.
  void add(mjenv_status status, const std::string& what) noexcept;
  // Moves the failures of `other` here.
  void take(Failures& other) noexcept;
  // If there are failures, forgets them and throws one error, which names the first ones and counts the others.
  void raise();

 private:
  static constexpr std::size_t kMaxText = 4096;  // bytes: a million rows may fail at once

  mjenv_status status_ = MJENV_OK;
  std::string text_;
  std::size_t named_ = 0, unnamed_ = 0;  // how many failures the text names, and how many it does not

  void add(mjenv_status status, const std::string& what, std::size_t named, std::size_t unnamed) noexcept;
};

}  // namespace mjenv::core
