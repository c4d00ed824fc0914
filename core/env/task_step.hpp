// Plays a step of a row.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>

#include "env/holder.hpp"
#include "env/scratch.hpp"

namespace mjenv::core {

// In this order: load or begin, advance (or lanes), call, commit.
class TaskStep {
 public:
  TaskStep(Holder& holder, Scratch& scratch) : holder_(holder), scratch_(scratch), calls_(*holder.task().calls) {}

  // Loads the row's state and the action. If the caller has written the state or own values since the last computation,
  // first calls the callback carry. pushes: must live until commit has returned.
  void load(std::int64_t row, const Action& action, const Work::Pushes* pushes = nullptr);
  // Does the same for a task that has before_step or before_substep, and calls before_step. random: the stream for the
  // task; it must live until the step ends.
  void begin(std::int64_t row, const Action& action, const Work::Pushes* pushes, Random& random);
  // Calls mj_step `frames` times. The new state reaches the row in commit.
  void advance(std::int64_t frames) {
    holder_.work().step(frames, holder_.before(), random_ && has_before_substep() ? &before_substep_ : nullptr);
  }
  // Calls the task's before_substep before an mj_step. Only after `begin`.
  void before_substep(std::int64_t substep);
  bool has_before_substep() const { return calls_.has_before_substep(); }
  // The row's stream, for a step of the task.
  Random random(std::int64_t row) const;
  // Calls the task's step. commit saves what it writes and the stream.
  mjenv_outcome call(std::int64_t row, const Action& action, Random& random);
  // Saves the state after the step to the row, and if `call` was called with this stream, what the task has written.
  void commit(std::int64_t row, Random* random = nullptr);

 private:
  Holder& holder_;
  Scratch& scratch_;
  const Calls& calls_;
  const Work::Pushes* pushes_ = nullptr;
  bool is_kicked_ = false;  // the task's step has changed the velocities
  // The stream of the current step, if it began with `begin`; otherwise null.
  Random* random_ = nullptr;
  Action action_;
  const Work::BeforeSubstep before_substep_ = [this](std::int64_t substep) { before_substep(substep); };

  // Copies to mjData the forces that the task has written. Throws if MuJoCo cannot compute with them.
  void apply_forces();
  // Saves the inputs with which the last mj_step of the step has computed.
  void store_inputs(std::int64_t row);
  // Saves an input of mjData to the row. offset: in the row's block of own values.
  void save_input(std::int64_t row, std::size_t offset, const double* values, std::size_t bytes);
};

}  // namespace mjenv::core
