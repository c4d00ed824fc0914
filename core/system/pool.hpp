// A pool of threads that run one job at a time, together with the calling thread. Between jobs they sleep.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

#include "system/tally.hpp"

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

  // Calls job(worker) on every thread but the calling one, and returns at once. The job must not throw.
  void start(std::function<void(int)> job);
  // Waits until the job has returned on all these threads.
  void finish();
  // Calls job(worker) on every thread of the pool, the calling one included, and returns when all calls have.
  void run(const std::function<void(int)>& job);

  // Within run(), all threads must call meet() and take_turns() in the same order.

  // Returns when all threads have called it.
  void meet() {
    take_turns(0, [] {});
  }
  // Calls turn() on one thread after the other, in the order of the workers. Returns when all turns are over.
  template <typename Turn>
  void take_turns(int worker, const Turn& turn) {
    // A round of turns has one turn of each thread, so this round cannot end before this thread's turn.
    const auto all = static_cast<std::uint64_t>(threads()), before = turns_.count() / all * all;
    turns_.wait_for(before + static_cast<std::uint64_t>(worker));
    turn();
    turns_.add();
    turns_.wait_for(before + all);
  }

 private:
  const std::int32_t owner_;  // the id of the process that created the pool
  std::function<void(int)> job_;
  Tally calls_, returns_, turns_;  // how often jobs were started, and returned on another thread, and turns were taken
  std::atomic<bool> stop_{false};
  std::vector<std::thread> threads_;

  void wait();
  void work(int worker);
  void end();
};

}  // namespace mjenv::core
