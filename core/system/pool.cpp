#include "system/pool.hpp"

#include <string>

#include "error.hpp"
#include "system/cpus.hpp"
#include "system/floats.hpp"
#include "system/platform.hpp"

namespace mjenv::core {
namespace {

// How often a thread looks for what it waits for before it sleeps: for about 50 microseconds, the time that waking it
// takes, so that jobs in close succession need no wake-up. Threads for which there are no CPUs sleep at once.
int spins_of(int threads) {
  constexpr int kSpins = 3000;
  return threads > 1 && threads <= usable_cpus() ? kSpins : 0;
}

}  // namespace

Pool::Pool(int threads, bool pinned)
    : owner_(platform::process_id()), calls_(spins_of(threads)), returns_(calls_.spins()), turns_(calls_.spins()) {
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
  stop_ = true;
  calls_.add();
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
  calls_.add();
}

void Pool::finish() {
  check_here();
  wait();
}

void Pool::wait() { returns_.wait_for(calls_.count() * threads_.size()); }

void Pool::run(const std::function<void(int)>& job) {
  if (threads_.empty()) return job(0);
  start(job);
  job(0);
  wait();
}

void Pool::work(int worker) {
  for (std::uint64_t call = 1;; ++call) {
    calls_.wait_for(call);
    if (stop_) return;
    {
      const DefaultFloats floats;
      job_(worker);
    }
    returns_.add();
  }
}

}  // namespace mjenv::core
