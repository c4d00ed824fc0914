// Steps the rows that mjenv_send hands over. Until mjenv_recv reports them, they are "under way". The environment's
// other threads step them; the calling thread helps inside mjenv_recv.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "env/episodes.hpp"
#include "env/failures.hpp"
#include "env/outputs.hpp"
#include "env/rows.hpp"
#include "env/schema.hpp"
#include "env/workers.hpp"
#include "system/condition.hpp"

namespace mjenv::core {

class Pipeline {
 public:
  Pipeline(const Schema& schema, const Rows& rows, const Episodes& episodes, Workers& workers);
  // Stops the workers. Rows that still wait are not stepped.
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  // How many rows are under way.
  std::int64_t count() const { return count_; }
  // Copies the actions and returns without waiting. rows: null means all rows; row_count must then be the environment's
  // number of rows.
  void send(const std::int64_t* rows, std::int64_t row_count, const Action& actions);
  // Steps rows, together with the other threads, until `least` are done or `timeout` seconds have passed (negative: no
  // timeout). Reports up to `capacity` of them. Then throws if a row has failed since the last call, reported or not.
  void receive(std::int64_t least, double timeout, std::int64_t* rows, std::int64_t capacity, std::int64_t* count,
               const mjenv_batch& out);

 private:
  const Schema& schema_;
  const Rows& rows_;
  const Episodes& episodes_;
  Workers& workers_;
  const std::int64_t action_count_;

  std::mutex mutex_;
  Condition sent_, done_;
  std::vector<std::int64_t> waiting_;  // a ring buffer: waiting_count_ rows to step, beginning at index first_
  std::size_t first_ = 0, waiting_count_ = 0;
  std::vector<std::int64_t> ready_;  // rows that were stepped but not yet reported
  std::vector<std::uint8_t> under_way_;
  std::vector<double> actions_;  // [rows][action_count_]; a float32 action fills the first half of its row
  std::vector<mjenv_dtype> dtypes_;
  std::optional<Outputs> outputs_;
  std::int64_t count_ = 0;  // how many rows are under way; only the calling thread uses it
  // True from the first send until all rows are reported. While it is true, the pool's threads run `serve`.
  bool open_ = false;
  Failures failures_;

  void allocate();
  void check(const std::int64_t* rows, std::int64_t row_count, const Action& actions);
  // Steps waiting rows until enough() is true (called under the lock), the deadline passes, or the pipeline is closed.
  void serve(Team& team, Deadline deadline, const std::function<bool()>& enough);
  void step_next(Team& team, std::unique_lock<std::mutex>& lock);
};

}  // namespace mjenv::core
