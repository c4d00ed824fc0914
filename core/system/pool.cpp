#include "system/pool.hpp"

#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <string>

#include "error.hpp"
#include "system/cpus.hpp"
#include "system/floats.hpp"

namespace mjenv::core {
namespace {

// A thread spins for about 20 microseconds before it sleeps, so that jobs in close succession need no wake-up.
constexpr int kSpins = 1000;

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

// Debuggers and top show the name. Linux allows 15 characters.
void name(std::thread& thread, int worker) {
  const std::string text = "mjenv-" + std::to_string(worker);
  pthread_setname_np(thread.native_handle(), text.c_str());
}

void pin(std::thread& thread, int cpu) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(cpu, &set);
  pthread_setaffinity_np(thread.native_handle(), sizeof set, &set);
}

}  // namespace

Pool::Pool(int threads, bool pinned) : owner_(getpid()) {
  const auto cpus =
      pinned ? allowed_cpus() : std::vector<int>{};  // before the threads start, because nothing may throw afterwards
  // The threads block all signals, so that the host's signal handlers run on the host's threads.
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  try {
    for (int worker = 1; worker < threads; ++worker) {
      threads_.emplace_back([this, worker] { work(worker); });
      name(threads_.back(), worker);
    }
  } catch (const std::exception&) {
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    end();
    fail(MJENV_E_MEMORY, "the system does not give this process " + std::to_string(threads) +
                             " threads; set the option \"num_threads\" to a smaller number");
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  if (!pinned) return;
  for (std::size_t i = 0; i < threads_.size(); ++i) pin(threads_[i], cpus[(i + 1) % cpus.size()]);
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

bool Pool::here() const { return threads_.empty() || getpid() == owner_; }

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
  const DefaultFloats floats;
  std::uint64_t seen = 0;
  const auto called = [&] { return stop_.load() || generation_.load() != seen; };
  for (;;) {
    if (!spin_until(called)) {
      std::unique_lock lock(mutex_);
      wake_.wait_until(lock, called);
    }
    if (stop_) return;
    seen = generation_;
    job_(worker);
    if (running_.fetch_sub(1) == 1) {
      const std::lock_guard lock(mutex_);
      done_.notify_all();
    }
  }
}

}  // namespace mjenv::core
