// A pool of threads that run one job at a time, together with the calling thread. Between jobs they sleep.
#pragma once

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
  // `threads` includes the calling thread, which is worker 0. pinned: each other thread is pinned to one CPU.
  Pool(int threads, bool pinned);
  // Joins the threads. Must run in the process that created the pool.
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  // True in the process that created the pool. A forked child has none of its threads.
  bool here() const;
  // Throws unless here().
  void check_here() const;
  int threads() const { return static_cast<int>(threads_.size()) + 1; }

  // Calls job(worker) on every thread of the pool and returns at once. The job must not throw.
  void start(std::function<void(int)> job);
  // Waits until the job has returned on all threads.
  void finish();
  // start, job(0), finish.
  void run(const std::function<void(int)>& job);

 private:
  const std::int32_t owner_;  // the id of the process that created the pool
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
