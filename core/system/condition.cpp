#include "system/condition.hpp"

namespace mjenv::core {
namespace {

constexpr double kForever = 1e9;  // seconds: 31 years

}  // namespace

Deadline::Deadline(double seconds) : set_(seconds >= 0 && seconds < kForever) {
  if (!set_) return;
  const std::chrono::duration<double> from_now(seconds);
  time_ = std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::nanoseconds>(from_now);
}

timespec timespec_of(std::chrono::nanoseconds duration) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(duration);
  return {static_cast<time_t>(seconds.count()), static_cast<long>((duration - seconds).count())};
}

bool Deadline::passed() const { return set_ && std::chrono::steady_clock::now() >= time_; }

}  // namespace mjenv::core
