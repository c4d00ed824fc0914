// A work space in which a thread computes rows, and what that work space holds.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "env/failures.hpp"
#include "env/place.hpp"
#include "env/rows.hpp"
#include "env/schema.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

// The derived arrays of mjData are not part of a row. They stay in the work space of the worker that computed the row
// last, and are computed again when another row has taken their place.
class Worker {
 public:
  Worker(std::int32_t index, const Task& task);

  const std::int32_t index;
  Failures failures;
  std::atomic<std::int64_t> next{0};  // the first row of this worker's block that no worker has begun

  Work& work() { return work_; }
  const Sim& sim() const { return work_.sim(); }
  // Allocates room for an observation, and finds the arrays to export.
  void prepare(const Schema& schema);

  // The work space holds the row's derived arrays.
  bool holds(const Rows& rows, std::int64_t row) const { return resident_ == row && rows.head(row).worker == index; }
  // Computes the row's derived arrays, unless the work space holds them.
  void hold(Rows& rows, std::int64_t row);
  // From now on the work space holds no row.
  void release() { resident_ = kNone; }
  // From now on the work space does not hold this row, which was changed elsewhere.
  void forget(std::int64_t row) {
    if (resident_ == row) release();
  }

  // Writes the state that mj_resetData gives into all rows.
  void clear(Rows& rows);
  // Lets the task draw the start of an episode from `rng`, and computes that state.
  void begin(Rows& rows, std::int64_t row, Rng& rng);
  // Plays `frames` mj_steps from the row's state. The row does not change before commit.
  void step(Rows& rows, std::int64_t row, const Action& action, std::int64_t frames);
  // What the step may change beside the simulation; the row gets it in commit.
  Belongings belongings() { return {carried(), rng_}; }
  // Saves the state that the work space holds after step.
  void commit(Rows& rows, std::int64_t row);
  // Replaces qpos and qvel as Gymnasium's set_state does.
  void set_state(Rows& rows, std::int64_t row, const double* qpos, const double* qvel);

  // These write what the work space holds.
  void write_observation(void* to, const Place& place);
  void write_arrays(const Schema& schema, const Place& place);
  // The mjData array of that name, up to date; null if there is none.
  const Array* array(Rows& rows, std::int64_t row, const std::string& name);
  // Calls look with the row's mjData as Gymnasium has it after the last step. look must not change it.
  void show(Rows& rows, std::int64_t row, const std::function<void(mjData_*)>& look);

 private:
  static constexpr std::int64_t kNone = -1;

  const Task& task_;
  Work work_;
  std::int64_t resident_ = kNone;
  std::vector<double> before_;  // the state before the evaluation that is under way
  std::vector<double> observation_;
  Rng rng_;  // the row's stream during a step, for tasks that draw then
  std::vector<Array> arrays_;
  std::vector<const Array*> exported_;

  Eigen::Map<Eigen::VectorXd> carried() { return {work_.carried(), task_.carry_count}; }
  void load_carried(Rows& rows, std::int64_t row) {
    std::copy_n(rows.carried(row), task_.carry_count, work_.carried());
  }
  void save(Rows& rows, std::int64_t row, Origin origin);
  void compute(Rows& rows, std::int64_t row);
};

}  // namespace mjenv::core
