#include "env/workers.hpp"

#include <atomic>
#include <new>

#include "engine/thread_locals.hpp"
#include "system/memory.hpp"

namespace mjenv::core {

Workers::Workers(const Task& task, int threads, bool pinned) {
  check_memory(threads, " thread(s)", task.model->work_bytes());
  for (int i = 0; i < threads; ++i) workers_.push_back(std::make_unique<Worker>(i, task));
  pool_ = std::make_unique<Pool>(threads, pinned);
  std::atomic<bool> prepared{true};
  pool_->run([&](int) {
    if (!prepare_thread_locals()) prepared = false;
  });
  if (!prepared) throw std::bad_alloc();
}

void Workers::prepare(const Schema& schema) {
  for (auto& worker : workers_) worker->prepare(schema);
}

void Workers::forget(std::int64_t row) {
  for (auto& worker : workers_) worker->forget(row);
}

void Workers::raise() {
  Failures failures;
  for (auto& worker : workers_) failures.take(worker->failures);
  failures.raise();
}

void Workers::release() {
  for (auto& worker : workers_) worker->release();
}

}  // namespace mjenv::core
