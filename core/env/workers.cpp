#include "env/workers.hpp"

#include <atomic>
#include <new>

#include "engine/thread_locals.hpp"
#include "system/memory.hpp"

namespace mjenv::core {

Workers::Workers(const Task& task, Rows& rows, int threads, int lanes, bool pinned) {
  const int size = std::max(lanes, 1);
  check_memory(threads, " thread(s)", Team::bytes(*task.model, lanes));
  for (int i = 0; i < threads; ++i) teams_.push_back(std::make_unique<Team>(i * size, task, rows, lanes));
  pool_ = std::make_unique<Pool>(threads, pinned);
  std::atomic<bool> prepared{true};
  pool_->run([&](int) {
    if (!prepare_thread_locals()) prepared = false;
  });
  if (!prepared) throw std::bad_alloc();
}

void Workers::prepare(const Schema& schema, const Frames& frames) {
  for_each([&](Worker& worker) { worker.prepare(schema, frames); });
}

void Workers::forget(std::int64_t row) {
  for_each([&](Worker& worker) { worker.forget(row); });
}

void Workers::raise() {
  Failures failures;
  for_each([&](Worker& worker) { failures.take(worker.failures); });
  failures.raise();
}

void Workers::release() {
  for_each([](Worker& worker) { worker.release(); });
}

}  // namespace mjenv::core
