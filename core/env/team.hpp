// The workers of one thread. With lanes there are as many workers as lanes, and they step their rows together. Without
// lanes there is one.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "engine/action.hpp"
#include "engine/lanes/frame/stepper.hpp"
#include "env/place.hpp"
#include "env/worker.hpp"

namespace mjenv::core {

// A step that a row is to play.
struct Turn {
  std::int64_t row;
  Action action;  // the caller's; once the step has begun, the transformed one (ActionTransform)
  Place place;
  Action ctrl{};  // what the caller has made of the action (mjenv_advance); empty: nothing

  // Known when the step has begun:
  Random begun{nullptr};  // `random` after the draws of the perturbation, if the task has before_step or before_substep
  Random random{nullptr};
  Action seen{};  // the action that the task sees
  const Work::Pushes* pushes = nullptr;
  bool is_perturbed = false;
};

class Team {
 public:
  static constexpr std::size_t kMaxSize = 8;

  // How much memory a team's work spaces and lanes take.
  static std::size_t bytes(const Model& model, int lanes);

  // index: that of the first worker. lanes: how many lanes there are; 0: none.
  Team(std::int32_t index, const Task& task, Rows& rows, int lanes);

  std::atomic<std::int64_t> next{0};  // the first row of this team's block that no team has taken

  std::size_t size() const { return workers_.size(); }
  Worker& operator[](std::size_t index) { return *workers_[index]; }
  // The worker with which Workers::for_rows computes one row after the other, for example in resets. gather_failures
  // moves the failures of all workers to it.
  Worker& first() { return *workers_[0]; }

  // The steps to play next. Worker i plays the one at index i. There is room for size() of them.
  std::vector<Turn>& turns() { return turns_; }
  // Whether this team can step several rows together.
  bool steps_together() const { return stepper_ != nullptr; }
  // Advances the simulations of some turns by `frames` calls of mj_step.
  //   moving   these turns, as bits. advance clears the bits of those that fail
  //   load     load(i) makes worker i ready for the step of its turn (TaskStep::load)
  //   attempt  attempt(i, body) calls body, and returns false if it has failed
  template <typename Load, typename Attempt>
  void advance(std::uint32_t& moving, std::int64_t frames, const Load& load, const Attempt& attempt);
  // Replaces qpos and qvel of the rows from `first` to `last - 1`, at most size(). note(row) is called for those that do
  // not fail.
  void set_state(std::int64_t first, std::int64_t last, const double* qpos, const double* qvel,
                 const std::function<void(std::int64_t)>& note);
  // Moves the workers' failures to the first.
  void gather_failures();

 private:
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<lanes::Stepper> stepper_;
  std::vector<Turn> turns_;

  // Calls step(works, workers, count) for the work spaces of the ready workers (bits), unless there is only one.
  // Returns, as bits, the workers of those that it returns.
  template <typename Step>
  std::uint32_t together(std::uint32_t ready, const Step& step);
  // Advances the ready workers (bits) whose rows lanes can step, and returns these workers. The others must be loaded
  // again.
  std::uint32_t step_together(std::uint32_t ready, std::int64_t frames);
};

template <typename Load, typename Attempt>
void Team::advance(std::uint32_t& moving, std::int64_t frames, const Load& load, const Attempt& attempt) {
  const auto for_moving = [&](std::uint32_t turns, const auto& body) {
    for (std::size_t i = 0; turns >> i != 0; ++i)
      if ((turns >> i & 1) != 0 && !attempt(i, [&] { body(i); })) moving &= ~(1u << i);
  };
  std::uint32_t advanced = 0;
  if (steps_together() && (moving & (moving - 1)) != 0) {  // a single row is faster without lanes
    for_moving(moving, [&](std::size_t i) {
      workers_[i]->work().defer_forward(true);
      load(i);
    });
    advanced = step_together(moving, frames);
  }
  for_moving(moving & ~advanced, [&](std::size_t i) {
    workers_[i]->work().defer_forward(false);
    load(i);
    workers_[i]->step.advance(frames);
  });
}

}  // namespace mjenv::core
