// Threads that do one job at a time together with the caller. They sleep between jobs.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "system/condition.hpp"

namespace mjenv::core {

class Pool {
 public:
  // `threads` counts the caller, who is worker 0; pinned threads stay on one of the allowed CPUs each.
  Pool(int threads, bool pinned);
  // In the process that made it.
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  // This process made the pool; a forked child has none of its threads.
  bool here() const;
  void check_here() const;
  int threads() const { return static_cast<int>(threads_.size()) + 1; }

  // Calls job(worker) for every worker but the caller, at once. The job must not throw.
  void start(std::function<void(int)> job);
  // Waits until all of them are done.
  void finish();
  // start, job(0), finish.
  void run(const std::function<void(int)>& job);

 private:
  const pid_t owner_;  // threads do not survive a fork
  std::function<void(int)> job_;
  std::atomic<std::uint64_t> generation_{0};
  std::atomic<int> running_{0};
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  Condition wake_, done_;
  std::vector<std::thread> threads_;

  void work(int worker);
  void end();
};

}  // namespace mjenv::core
