// A condition variable whose waits can have a deadline.
#pragma once

#include <pthread.h>

#include <chrono>
#include <mutex>

namespace mjenv::core {

// A point in time on the monotonic clock, or never.
class Deadline {
 public:
  Deadline() = default;
  // This many seconds from now; never if the number is negative or more than 31 years.
  explicit Deadline(double seconds);

  bool is_set() const { return set_; }
  bool passed() const;
  std::chrono::steady_clock::time_point time() const { return time_; }

 private:
  bool set_ = false;
  std::chrono::steady_clock::time_point time_;
};

// Replaces std::condition_variable, for which gcc 12 needs symbols that older systems lack. The file of each system
// (platform.hpp) implements the constructor and wait.
class Condition {
 public:
  Condition();
  ~Condition() { pthread_cond_destroy(&condition_); }
  Condition(const Condition&) = delete;
  Condition& operator=(const Condition&) = delete;

  void notify_one() { pthread_cond_signal(&condition_); }
  void notify_all() { pthread_cond_broadcast(&condition_); }
  // Returns when notified, at the deadline, or spuriously.
  void wait(std::unique_lock<std::mutex>& lock, const Deadline& deadline = {});
  template <typename Predicate>
  void wait_until(std::unique_lock<std::mutex>& lock, const Predicate& fulfilled) {
    while (!fulfilled()) wait(lock);
  }

 private:
  pthread_cond_t condition_;
};

// Converts a duration for the functions of pthreads.
timespec timespec_of(std::chrono::nanoseconds duration);

}  // namespace mjenv::core
