// The workers of an environment and their threads. The first team runs on the thread that calls the library.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "env/selection.hpp"
#include "env/team.hpp"
#include "error.hpp"
#include "system/pool.hpp"

namespace mjenv::core {

class Workers {
 public:
  // lanes: how many rows each thread steps at once; 0: one by one.
  Workers(const Task& task, Rows& rows, int threads, int lanes, bool pinned);

  Team& team(std::size_t thread) { return *teams_[thread]; }
  // The first worker of the thread that calls the library.
  Worker& first() { return team(0).first(); }
  // The worker that last computed the row.
  Worker& of(std::int64_t row) {
    const auto index = static_cast<std::size_t>(first().rows().worker(row));
    return team(index / team_size())[index % team_size()];
  }
  std::size_t threads() const { return teams_.size(); }
  std::size_t team_size() const { return teams_[0]->size(); }
  Pool& pool() { return *pool_; }
  const Pool& pool() const { return *pool_; }
  // Leaks the pool. A forked child calls this, because it has none of the threads that the destructor would join.
  void abandon() noexcept { static_cast<void>(pool_.release()); }
  void prepare(const Schema& schema, const Frames& frames);
  // Call this when the row was changed without a worker, because the derived arrays in a work space no longer belong to
  // the row.
  void forget(std::int64_t row);
  // Call this before rows' own values move in memory, because work spaces point to them.
  void release();

  // Calls body(worker, row) for the selected rows on all threads. If rows fail, the others are still computed;
  // then this throws one error for all failures.
  template <typename Body>
  void for_rows(const Selection& selected, const Body& body);
  // Calls body(team, first, last) for groups of up to team_size() rows: those from `first` to `last - 1`. body must not
  // throw, but add errors to the workers' failures, which this throws in the end.
  template <typename Body>
  void for_groups(std::int64_t count, const Body& body);
  // Calls body(worker) for all workers, in the order of their indices.
  template <typename Body>
  void for_each(const Body& body);
  // Throws one error for all failures in the workers, if there are any.
  void raise();

 private:
  std::vector<std::unique_ptr<Team>> teams_;
  std::unique_ptr<Pool> pool_;  // declared last, so that its threads end before the workers

  template <typename Body>
  void share(std::int64_t count, std::int64_t unit, const Body& body);
};

// Divides the rows into chunks and calls body(team, first, last) for each. A chunk's size is a multiple of unit, except
// for the last one. Each team first computes its own block of rows, then chunks of the blocks that other teams have not
// finished.
template <typename Body>
void Workers::share(std::int64_t count, std::int64_t unit, const Body& body) {
  const auto threads = static_cast<std::int64_t>(teams_.size()), units = (count + unit - 1) / unit;
  const auto first = [&](std::int64_t index) { return std::min(units * index / threads * unit, count); };
  // How many rows a team takes at once. With larger chunks, threads would wait longer for each other at the end.
  const std::int64_t chunk =
      threads == 1 ? count : std::clamp<std::int64_t>(units / (128 * threads), 1, 64 / unit) * unit;
  for (std::int64_t i = 0; i < threads; ++i) teams_[i]->next.store(first(i), std::memory_order_relaxed);
  const auto job = [&](int index) {
    const ErrorTrap trap;
    for (std::int64_t i = 0; i < threads; ++i) {
      const std::int64_t block = (index + i) % threads, end = first(block + 1);
      auto& next = teams_[block]->next;
      for (std::int64_t row; (row = next.fetch_add(chunk, std::memory_order_relaxed)) < end;)
        body(*teams_[index], row, std::min(row + chunk, end));
    }
  };
  pool_->run(std::cref(job));
  raise();
}

template <typename Body>
void Workers::for_each(const Body& body) {
  for (auto& team : teams_)
    for (std::size_t i = 0; i < team->size(); ++i) body((*team)[i]);
}

template <typename Body>
void Workers::for_rows(const Selection& selected, const Body& body) {
  share(selected.count, 1, [&](Team& team, std::int64_t row, std::int64_t last) {
    Worker& worker = team.first();
    while ((row = selected.next(row, last)) < last) {
      worker.attempt(row, [&] { body(worker, row); });
      ++row;
    }
  });
}

template <typename Body>
void Workers::for_groups(std::int64_t count, const Body& body) {
  const auto size = static_cast<std::int64_t>(team_size());
  share(count, size, [&](Team& team, std::int64_t row, std::int64_t last) {
    for (; row < last; row += size) body(team, row, std::min(row + size, last));
  });
}

}  // namespace mjenv::core
