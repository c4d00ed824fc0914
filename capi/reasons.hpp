// Why calls failed: the last reason of each thread and of each handle.
#pragma once

#include <cstddef>

#include "fork_lock.hpp"

namespace mjenv::core {

// Allocates what the library keeps for this thread. Call it first in each call of the library. Returns false if there
// is no memory.
bool prepare_thread() noexcept;

// Why the last failed call on this thread failed; "" if none has failed.
const char* last_reason() noexcept;
void keep_last_reason(const char* reason) noexcept;

// Why the last failed call with a handle failed. Any thread may read or replace the reason at any time.
class Reason {
 public:
  constexpr Reason() = default;
  Reason(const Reason&) = delete;
  Reason& operator=(const Reason&) = delete;

  void keep(const char* reason) noexcept;
  void clear() noexcept;
  // Copies as much of the text as there is room for, and a NUL. Returns how many bytes the whole text with its NUL
  // needs.
  std::size_t copy(char* to, std::size_t capacity) noexcept;

 private:
  ForkLock lock_;  // of text_
  char* text_ = nullptr;

  void replace(char* text) noexcept;
};

}  // namespace mjenv::core
