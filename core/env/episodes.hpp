// How a row plays its episodes: resets, steps, termination, truncation and automatic resets.
#pragma once

#include <cstdint>
#include <string>

#include "env/action_transform.hpp"
#include "env/frames.hpp"
#include "env/perturbation.hpp"
#include "env/place.hpp"
#include "env/randomization.hpp"
#include "env/rows.hpp"
#include "env/schema.hpp"
#include "env/team.hpp"
#include "env/worker.hpp"
#include "task/options.hpp"
#include "task/task.hpp"

namespace mjenv::core {

// Each function concerns one row, or the rows of a team. Threads call them at the same time for different rows.
class Episodes {
 public:
  Episodes(const Options& options, const Task& task, const Schema& schema, const Randomization& randomization,
           const Perturbation& perturbation, const Frames& frames, const ActionTransform& transform, Rows& rows);

  // Begins an episode and writes the outputs of a reset.
  void reset(Worker& worker, std::int64_t row, const Place& place) const;
  // Plays the steps of the team's turns and writes their outputs. An automatic reset replaces the step (next_step) or
  // follows it (same_step). Failures are collected in the team's first worker.
  void step(Team& team) const;
  // Plays up to `steps` steps of the rows from `first` to `last - 1`, without resets. After the end of its episode a
  // row keeps its state. Writes the outputs of step t to element row * steps + t. The actions are those of all rows of
  // the environment.
  void rollout(Team& team, std::int64_t first, std::int64_t last, const Action& actions, std::int64_t steps,
               const mjenv_batch& out) const;
  // The parts of a reset or step whose outputs the caller computes. begin_given and advance_given simulate
  // and write the exported arrays. act writes the action that the task sees in the row's next step. finish writes the
  // other outputs, for what the caller has computed. give_up ends a step without these.
  void begin_given(Worker& worker, std::int64_t row, const Initial& initial, const Place& place) const;
  void act(Worker& worker, std::int64_t row, const Action& action, void* seen) const;
  void advance_given(Team& team) const;
  void finish(Writer& writer, std::int64_t row, const Place& given, const Place& place) const;
  void give_up(std::int64_t row) const;
  // Throws if the caller has computed NaN, unless "strict" is 0.
  void check_given(Writer& writer, std::int64_t row, const Place& given) const;
  // Throws unless the numbers of an array of this row are finite, or "strict" is 0.
  void check_given(const char* array, std::int64_t row, const double* values, std::int64_t count) const;
  // Writes the observation and the exported arrays of the row's present state.
  void observe(Worker& worker, std::int64_t row, const Place& place) const;

  // True if a step resets rows whose episode has ended.
  bool autoresets() const { return autoreset_ != Autoreset::disabled; }
  // True if the step that ends an episode also resets the row.
  bool autoresets_in_same_step() const { return autoreset_ == Autoreset::same_step; }
  // True if the next step resets the row. In same_step mode this happens only after a step that ended the episode but
  // failed to reset the row, or after a rollout in which the episode ended.
  bool awaits_reset(std::int64_t row) const { return autoresets() && rows_.head(row).ended; }
  // Throws if no reset or set_state gave the row a state, or, with "strict" 1, its episode ended and `resets` is false.
  void check_steppable(std::int64_t row, bool resets) const;
  // Throws if the action is not finite, unless "strict" is 0 or the step resets the row, which ignores the action.
  void check_finite(std::int64_t row, const Action& action) const;

 private:
  enum class Autoreset { disabled, next_step, same_step };
  struct Ends {
    bool terminated, truncated;
    bool any() const { return terminated || truncated; }
  };

  std::string id_;
  const Task& task_;
  const Schema& schema_;
  const Randomization& randomization_;
  const Perturbation& perturbation_;
  const Frames& frames_;
  const ActionTransform& transform_;
  Rows& rows_;
  std::int64_t max_episode_steps_;
  bool strict_, ends_on_divergence_;
  Autoreset autoreset_;

  // Whether noise, delays and pushes act on the row: they do from its first reset after mjenv_randomize.
  bool is_perturbed(std::int64_t row) const {
    return rows_.has_perturbation() && Perturbation::has_begun(rows_.perturbation(row));
  }
  void begin(Worker& worker, std::int64_t row, const Initial& initial = {}) const;
  [[noreturn]] void refuse(std::int64_t row, const std::string& why) const;
  void reset_row(Worker& worker, std::int64_t row, const Place& place) const;
  // Calls body(i) for the team's turns, given as bits. Clears the bits of those that fail, and writes their status.
  template <typename Body>
  void for_turns(Team& team, std::uint32_t& turns, const Body& body) const;
  // A step has three parts: begin_step transforms and delays the action and draws its noise and the pushes, advance
  // simulates the turns that have begun (as bits), and end_step calls the task and saves the new state.
  void begin_step(Worker& worker, Turn& turn) const;
  void advance(Team& team, std::uint32_t& moving) const;
  Ends end_step(Worker& worker, Turn& turn) const;
  // Saves the new state, and returns what the task's step has computed.
  mjenv_outcome commit(Worker& worker, Turn& turn) const;
  // Counts the step, and writes its reward, flags and status.
  Ends count_step(std::int64_t row, const Place& place, double reward, bool terminated, bool diverged) const;
  void end_step_and_reset(Worker& worker, Turn& turn) const;
  // Writes the outputs of a rollout's step after the end of the episode: the row keeps the state in which the episode
  // ended.
  void stay(Worker& worker, const Turn& turn, Ends ends) const;
  Turn rollout_turn(std::int64_t row, const Action& actions, std::int64_t steps, std::int64_t t,
                    const mjenv_batch& out) const;
  void write_reset(Worker& worker, std::int64_t row, const Place& place) const;
  // Returns what the caller sees of this observation of a new state: with noise, delay, time and history.
  const double* seen(std::int64_t row, const double* observation, Writer& writer) const;
  // Returns what the caller sees in the row's present state. observation() computes the task's own, if it is needed.
  template <typename Observation>
  const double* present(std::int64_t row, const Observation& observation, Writer& writer) const;
  // Writes the row's observation, with noise and delay if the row is perturbed, the time and the history.
  void write_observation(Worker& worker, std::int64_t row, void* to, const Place& place) const;
};

}  // namespace mjenv::core
