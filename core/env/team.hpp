// The workers of one thread. If rows are stepped in lanes, there are as many as lanes, and they step their rows
// together. Else there is one.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/action.hpp"
#include "engine/lanes/stepper.hpp"
#include "env/place.hpp"
#include "env/worker.hpp"

namespace mjenv::core {

// A step that a row is to play.
struct Turn {
  std::int64_t row;
  Action action;
  Place place;
};

class Team {
 public:
  static constexpr std::size_t kMaxSize = 8;

  // index: that of the first worker. lanes: how many; 0: none.
  Team(std::int32_t index, const Task& task, int lanes);

  std::atomic<std::int64_t> next{0};  // the first row of this team's block that no team has taken

  std::size_t size() const { return workers_.size(); }
  Worker& operator[](std::size_t index) { return *workers_[index]; }
  // The worker that computes rows one by one, where the team does not step them together. gather_failures moves the
  // failures of all workers to it.
  Worker& first() { return *workers_[0]; }

  // The steps to play next. Worker i plays the one at index i. There is room for size() of them.
  std::vector<Turn>& turns() { return turns_; }
  // begun: the workers, as bits, in which a step has begun. Advances their simulations, and returns, as bits, those
  // that have advanced. The others must begin the step again.
  std::uint32_t step(std::uint32_t begun, std::int64_t frames);
  // Moves the workers' failures to the first.
  void gather_failures();

 private:
  std::vector<std::unique_ptr<Worker>> workers_;
  std::unique_ptr<lanes::Stepper> stepper_;
  std::vector<Turn> turns_;
};

}  // namespace mjenv::core
