// A count for which threads wait.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include "system/condition.hpp"

namespace mjenv::core {

class Tally {
 public:
  // spins: how often a waiting thread looks at the count before it sleeps.
  explicit Tally(int spins) : spins_(spins) {}

  int spins() const { return spins_; }
  std::uint64_t count() const { return count_.load(); }

  // If no thread sleeps, this neither locks nor calls the system. It misses no thread that is about to sleep, because
  // such a thread adds itself to sleepers_ and then looks at the count once more.
  void add() {
    count_.fetch_add(1);
    if (sleepers_.load() == 0) return;
    const std::lock_guard lock(mutex_);
    reached_.notify_all();
  }

  // Returns when the count is at least `wanted`.
  void wait_for(std::uint64_t wanted) {
    for (int i = 0; i < spins_; ++i) {
      if (count() >= wanted) return;
      pause();
    }
    std::unique_lock lock(mutex_);
    sleepers_.fetch_add(1);
    reached_.wait_until(lock, [&] { return count() >= wanted; });
    sleepers_.fetch_sub(1);
  }

 private:
  const int spins_;
  std::atomic<std::uint64_t> count_{0};
  std::atomic<int> sleepers_{0};
  std::mutex mutex_;
  Condition reached_;

  static void pause() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
  }
};

}  // namespace mjenv::core
