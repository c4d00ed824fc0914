// Why calls failed: the last reason of each thread and of each handle.
#pragma once

#include <cstddef>

#include "fork_lock.hpp"

namespace mjenv::core {

// Call this first on each thread. False if there is no memory for what the library keeps per thread.
bool prepare_thread() noexcept;

// The reason why the last failing call on this thread failed; "" if none did.
const char* last_reason() noexcept;
void keep_last_reason(const char* reason) noexcept;

// The reason why the last failing call with a handle failed, which any thread may read and replace at any time.
class Reason {
 public:
  constexpr Reason() = default;
  Reason(const Reason&) = delete;
  Reason& operator=(const Reason&) = delete;

  void keep(const char* reason) noexcept;
  void clear() noexcept;
  // Copies as much as there is room for, and a NUL. Returns how many bytes the whole text needs.
  std::size_t copy(char* to, std::size_t capacity) noexcept;

 private:
  ForkLock lock_;  // of text_
  char* text_ = nullptr;

  void replace(char* text) noexcept;
};

}  // namespace mjenv::core
