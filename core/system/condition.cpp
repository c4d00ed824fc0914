#include "system/condition.hpp"

#include <cmath>

namespace mjenv::core {
namespace {

constexpr double kForever = 1e9;  // seconds: 31 years
constexpr long kSecond = 1'000'000'000;

timespec now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return time;
}

}  // namespace

Deadline::Deadline(double seconds) : set_(seconds >= 0 && seconds < kForever) {
  if (!set_) return;
  const double whole = std::floor(seconds);
  time_ = now();
  time_.tv_sec += static_cast<time_t>(whole);
  time_.tv_nsec += static_cast<long>((seconds - whole) * kSecond);
  if (time_.tv_nsec < kSecond) return;
  time_.tv_nsec -= kSecond;
  ++time_.tv_sec;
}

bool Deadline::passed() const {
  if (!set_) return false;
  const timespec time = now();
  return time.tv_sec > time_.tv_sec || (time.tv_sec == time_.tv_sec && time.tv_nsec >= time_.tv_nsec);
}

Condition::Condition() {
  pthread_condattr_t monotonic;
  pthread_condattr_init(&monotonic);
  pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
  pthread_cond_init(&condition_, &monotonic);
  pthread_condattr_destroy(&monotonic);
}

void Condition::wait(std::unique_lock<std::mutex>& lock, const Deadline& deadline) {
  pthread_mutex_t* mutex = lock.mutex()->native_handle();
  if (deadline.is_set())
    pthread_cond_timedwait(&condition_, mutex, &deadline.time());
  else
    pthread_cond_wait(&condition_, mutex);
}

}  // namespace mjenv::core
