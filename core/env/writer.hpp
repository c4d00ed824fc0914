// Writes the outputs of the row that a worker holds.
#pragma once

#include <cstdint>
#include <vector>

#include "env/frames.hpp"
#include "env/place.hpp"
#include "env/schema.hpp"
#include "task/task.hpp"

namespace mjenv::core {

class Writer {
 public:
  Writer(const Task& task, Work& work, SimView& view) : calls_(*task.calls), work_(work), view_(view) {}

  // Allocates room for observations, and finds the arrays to export.
  void prepare(const Schema& schema, const Frames& frames, const std::vector<Array>& arrays);
  // Computes and returns the task's observation, which is valid until the next one is computed.
  const double* observation();
  // Returns the observation that the caller has computed for this element, which is 0 if it has none.
  const double* given_observation(const Place& given);
  // Writes the task's observation. Only for environments in which the caller sees it unchanged.
  void write_observation(void* to, const Place& place);
  // Writes this observation, which has as many numbers as the caller sees, instead of the task's.
  void write_observation(const double* observation, void* to, const Place& place) const {
    place.put_observation(observation, static_cast<std::int64_t>(seen_.size()), to);
  }
  // Scratch memory for the observation that the caller sees.
  std::vector<double>& scratch() { return seen_; }
  void write_arrays(const Schema& schema, const Place& place);

 private:
  const Calls& calls_;
  Work& work_;
  SimView& view_;
  std::vector<double> observation_, seen_;
  std::vector<Array> exported_;
};

}  // namespace mjenv::core
