// A mutex that a forked child can use, too.
#pragma once

#include <atomic>
#include <cstdint>

#include "system/platform.hpp"

namespace mjenv::core {

// If a thread of the parent held the lock at the fork, the child takes it over. So what the mutex protects must be
// valid even while it is locked.
class ForkLock {
 public:
  constexpr ForkLock() = default;
  ForkLock(const ForkLock&) = delete;
  ForkLock& operator=(const ForkLock&) = delete;

  void lock() noexcept {
    const auto self = static_cast<std::uint32_t>(platform::process_id());
    for (std::uint32_t seen = kFree; !holder_.compare_exchange_strong(seen, self, std::memory_order_acquire);) {
      if (seen != self) continue;  // a thread of the parent held it at the fork: the next exchange takes it over
      platform::sleep_while(holder_, self);
      seen = kFree;
    }
  }
  void unlock() noexcept {
    holder_.store(kFree, std::memory_order_release);
    platform::wake_all(holder_);
  }

 private:
  static constexpr std::uint32_t kFree = 0;   // no process has this id
  std::atomic<std::uint32_t> holder_{kFree};  // the process whose thread has locked it
};

}  // namespace mjenv::core
