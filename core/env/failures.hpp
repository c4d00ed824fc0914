// Collects the errors of rows that one call computes, so that the call reports them together.
#pragma once

#include <string>

#include "mjenv/mjenv.h"

namespace mjenv::core {

class Failures {
 public:
  // Keeps the first status; MJENV_E_MEMORY takes precedence over all others.
  void add(mjenv_status status, const std::string& what) noexcept;
  // Moves the other's failures here and empties it.
  void take(Failures& other) noexcept;
  // Throws one error that names all failures, and forgets them. Does nothing if there are none.
  void raise();

 private:
  mjenv_status status_ = MJENV_OK;
  std::string text_;
};

}  // namespace mjenv::core
