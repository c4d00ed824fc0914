// Collects the errors of rows that one call computes, so that the call reports them together.
#pragma once

#include <cstddef>
#include <string>

#include "mjenv/mjenv.h"

namespace mjenv::core {

class Failures {
 public:
  // Keeps the first status; MJENV_E_MEMORY takes precedence over all others.
  void add(mjenv_status status, const std::string& what) noexcept;
  // Moves the other's failures here and empties it.
  void take(Failures& other) noexcept;
  // If there are failures, throws one error that names the first and counts the others, and forgets them.
  void raise();

 private:
  static constexpr std::size_t kMostText = 4096;  // bytes: a million rows may fail at once

  mjenv_status status_ = MJENV_OK;
  std::string text_;
  std::size_t named_ = 0, unnamed_ = 0;  // how many failures the text names, and how many it does not

  void add(mjenv_status status, const std::string& what, std::size_t named, std::size_t unnamed) noexcept;
};

}  // namespace mjenv::core
