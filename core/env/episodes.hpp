// The rules by which rows play their episodes: limits, ends and automatic resets. One row at a time, on any worker.
#pragma once

#include <cstdint>

#include "env/place.hpp"
#include "env/rows.hpp"
#include "env/schema.hpp"
#include "env/worker.hpp"
#include "task/options.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

class Episodes {
 public:
  Episodes(const Options& options, const Task& task, const Schema& schema, Rows& rows);

  // Begins an episode and writes what a reset returns.
  void reset(Worker& worker, std::int64_t row, const Place& place) const;
  // Plays one step, or the automatic reset in its place or after it, and writes what the step returns.
  void step(Worker& worker, std::int64_t row, const Action& action, const Place& place) const;
  // Plays `steps` steps without any reset. The first step's outputs go to element row * steps.
  void rollout(Worker& worker, std::int64_t row, const Action& actions, std::int64_t steps,
               const mjenv_batch& out) const;
  // Writes the observation and the exported arrays of the row's present state.
  void observe(Worker& worker, std::int64_t row, const Place& place) const;

  // Finished rows are reset by a step.
  bool resets_itself() const { return autoreset_ != Autoreset::disabled; }
  // They are reset by the step that finishes them.
  bool resets_at_once() const { return autoreset_ == Autoreset::same_step; }
  // These throw when the row cannot be stepped, or not by this action. resets: the call resets finished rows.
  void check_steppable(std::int64_t row, bool resets) const;
  void check_finite(std::int64_t row, const Action& action) const;

 private:
  enum class Autoreset { disabled, next_step, same_step };
  struct Ends {
    bool terminated, truncated;
  };

  const Task& task_;
  const Schema& schema_;
  Rows& rows_;
  std::int64_t max_episode_steps_;
  bool strict_, ends_on_divergence_;
  Autoreset autoreset_;

  // The next step resets the row. In same_step mode that holds after a reset that failed, and after a rollout.
  bool awaits_reset(std::int64_t row) const { return resets_itself() && rows_.head(row).ended; }
  void begin(Worker& worker, std::int64_t row) const;
  void step_on(Worker& worker, std::int64_t row, const Action& action, const Place& place) const;
  Ends play(Worker& worker, std::int64_t row, const Action& action, const Place& place) const;
  void write_reset(Worker& worker, const Place& place) const;
};

}  // namespace mjenv::core
