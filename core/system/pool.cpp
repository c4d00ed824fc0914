#include "system/pool.hpp"

#include <string>

#include "error.hpp"
#include "system/cpus.hpp"
#include "system/floats.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

// Before a thread sleeps, it spins for about 50 microseconds, the time that waking it takes, so that jobs in close
// succession need no wake-up.
constexpr int kSpins = 3000;

inline void pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#endif
}

template <typename Condition>
bool spin_until(const Condition& condition) {
  for (int i = 0; i < kSpins; ++i) {
    if (condition()) return true;
    pause();
  }
  return condition();
}

}  // namespace

Pool::Pool(int threads, bool pinned) : owner_(platform::process_id()) {
  const auto cpus = pinned ? allowed_cpus() : std::vector<int>{};  // before the threads start, because this may throw
  try {
    const platform::BlockedSignals blocked;
    for (int worker = 1; worker < threads; ++worker) {
      threads_.emplace_back([this, worker] { work(worker); });
      platform::name_thread(threads_.back(), "mjenv-" + std::to_string(worker));
    }
  } catch (const std::exception&) {
    end();
    fail(MJENV_E_MEMORY, "the system does not give this process " + std::to_string(threads) +
                             " threads; set the option \"num_threads\" to a smaller number");
  }
  if (!pinned) return;
  for (std::size_t i = 0; i < threads_.size(); ++i) platform::pin_thread(threads_[i], cpus[(i + 1) % cpus.size()]);
}

Pool::~Pool() { end(); }

void Pool::end() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (auto& thread : threads_) thread.join();
}

bool Pool::here() const { return threads_.empty() || platform::process_id() == owner_; }

void Pool::check_here() const {
  if (!here())
    fail(MJENV_E_FORKED,
         "this process was forked, and the environment's threads stayed in its parent: create the environment in the "
         "child");
}

void Pool::start(std::function<void(int)> job) {
  check_here();
  job_ = std::move(job);
  running_ = static_cast<int>(threads_.size());
  {
    const std::lock_guard lock(mutex_);
    generation_.fetch_add(1);
  }
  wake_.notify_all();
}

void Pool::finish() {
  check_here();
  const auto done = [&] { return running_.load() == 0; };
  if (spin_until(done)) return;
  std::unique_lock lock(mutex_);
  done_.wait_until(lock, done);
}

void Pool::run(const std::function<void(int)>& job) {
  if (threads_.empty()) return job(0);
  start(job);
  job(0);
  finish();
}

void Pool::work(int worker) {
  std::uint64_t seen = 0;
  const auto called = [&] { return stop_.load() || generation_.load() != seen; };
  for (;;) {
    if (!spin_until(called)) {
      std::unique_lock lock(mutex_);
      wake_.wait_until(lock, called);
    }
    if (stop_) return;
    seen = generation_;
    {
      const DefaultFloats floats;
      job_(worker);
    }
    if (running_.fetch_sub(1) == 1) {
      const std::lock_guard lock(mutex_);
      done_.notify_all();
    }
  }
}

}  // namespace mjenv::core
