#include "env/workers.hpp"

#include "system/memory.hpp"

namespace mjenv::core {

Workers::Workers(const Task& task, int threads, bool pinned) {
  check_memory(threads, " thread(s)", task.model->work_bytes());
  for (int i = 0; i < threads; ++i) workers_.push_back(std::make_unique<Worker>(i, task));
  pool_ = std::make_unique<Pool>(threads, pinned);
}

void Workers::prepare(const Schema& schema) {
  for (auto& worker : workers_) worker->prepare(schema);
}

void Workers::forget(std::int64_t row) {
  for (auto& worker : workers_) worker->forget(row);
}

}  // namespace mjenv::core
