// The workers of an environment and their threads. Worker 0 runs on the thread that calls the library.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "env/worker.hpp"
#include "error.hpp"
#include "system/pool.hpp"

namespace mjenv::core {

class Workers {
 public:
  Workers(const Task& task, int threads, bool pinned);

  Worker& operator[](std::size_t index) { return *workers_[index]; }
  // The worker that last computed the row.
  Worker& of(const Rows::Head& head) { return *workers_[static_cast<std::size_t>(head.worker)]; }
  std::size_t count() const { return workers_.size(); }
  Pool& pool() { return *pool_; }
  const Pool& pool() const { return *pool_; }
  // Leaks the pool. A forked child calls this, because it has none of the threads that the destructor would join.
  void abandon() noexcept { static_cast<void>(pool_.release()); }
  void prepare(const Schema& schema);
  // Call this when the row was changed without a worker: no work space agrees with the row any more.
  void forget(std::int64_t row);
  // Call this before rows' own values move in memory, because work spaces point to them.
  void release();

  // Calls body(worker, row) for rows 0 to count - 1 on all threads. If rows fail, the others are computed all the same;
  // then this throws one error for all that failed.
  template <typename Body>
  void for_rows(std::int64_t count, const Body& body);
  // Throws one error for all that failed in the workers.
  void raise();
  // Calls body(worker, row). If it throws, adds the error to the worker's failures.
  template <typename Body>
  static void attempt(Worker& worker, std::int64_t row, const Body& body) noexcept;

 private:
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<Pool> pool_;  // last: its threads use the workers
};

// Each worker computes its own block of rows, then helps with the blocks that the others have not finished.
template <typename Body>
void Workers::for_rows(std::int64_t count, const Body& body) {
  const auto threads = static_cast<std::int64_t>(workers_.size());
  const auto first = [&](std::int64_t index) { return count * index / threads; };
  // How many rows a worker takes at once. If chunks were larger, workers would wait for each other at the end.
  const std::int64_t chunk = threads == 1 ? count : std::clamp<std::int64_t>(count / (128 * threads), 1, 64);
  for (std::int64_t i = 0; i < threads; ++i) workers_[i]->next.store(first(i), std::memory_order_relaxed);
  const auto job = [&](int index) {
    const ErrorTrap trap;
    for (std::int64_t i = 0; i < threads; ++i) {
      const std::int64_t block = (index + i) % threads, end = first(block + 1);
      auto& next = workers_[block]->next;
      for (std::int64_t row; (row = next.fetch_add(chunk, std::memory_order_relaxed)) < end;)
        for (const std::int64_t last = std::min(row + chunk, end); row < last; ++row)
          attempt(*workers_[index], row, body);
    }
  };
  pool_->run(std::cref(job));
  raise();
}

template <typename Body>
void Workers::attempt(Worker& worker, std::int64_t row, const Body& body) noexcept {
  const auto failed = [&](mjenv_status status, const char* what) {
    worker.release();
    try {
      worker.failures.add(status, in_row(row, what));
    } catch (const std::exception&) {  // no memory for the text
      worker.failures.add(MJENV_E_MEMORY, "");
    }
  };
  try {
    body(worker, row);
  } catch (const std::bad_alloc&) {
    failed(MJENV_E_MEMORY, "out of memory");
  } catch (const Error& error) {
    failed(error.status(), error.what());
  } catch (const std::exception& error) {
    failed(MJENV_E_INTERNAL, error.what());
  }
}

}  // namespace mjenv::core
