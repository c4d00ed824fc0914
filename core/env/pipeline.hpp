// Rows under way between mjenv_send and mjenv_recv.
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
  // Stops the workers; rows that still wait are not stepped.
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  // Rows that were sent and not yet reported.
  std::size_t count() const { return count_; }
  // Copies the actions and lets the workers step the rows. rows: null for all of them.
  void send(const std::int64_t* rows, std::size_t row_count, const Action& actions);
  // Waits until `least` rows are done, or `timeout` seconds have passed (for ever if it is negative). Reports all rows
  // that are done, and only then throws for those that failed.
  void receive(std::size_t least, double timeout, std::int64_t* rows, std::size_t capacity, std::size_t* count,
               const mjenv_batch& out);

 private:
  const Schema& schema_;
  const Rows& rows_;
  const Episodes& episodes_;
  Workers& workers_;
  const Eigen::Index nu_;

  std::mutex mutex_;
  Condition sent_, done_;
  std::vector<std::int64_t> waiting_;  // to be stepped: a ring of waiting_count_ rows from first_ on
  std::size_t first_ = 0, waiting_count_ = 0;
  std::vector<std::int64_t> ready_;  // stepped, not yet reported
  std::vector<std::uint8_t> under_way_;
  std::vector<double> actions_;  // [rows][nu], wide enough for either dtype
  std::vector<mjenv_dtype> dtypes_;
  std::optional<Outputs> outputs_;
  std::size_t count_ = 0;
  bool open_ = false;  // the workers of the pool serve
  Failures failures_;

  void allocate();
  void check(const std::int64_t* rows, std::size_t row_count, const Action& actions);
  // Steps rows that wait until enough() holds (called under the lock), or in the pool until the pipeline is closed.
  void serve(Worker& worker, Deadline deadline, const std::function<bool()>& enough);
  void step_next(Worker& worker, std::unique_lock<std::mutex>& lock);
};

}  // namespace mjenv::core
