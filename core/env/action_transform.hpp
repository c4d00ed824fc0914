// What Gymnasium's wrappers ClipAction and RescaleAction make of an action: the options "clip_actions" and
// "rescale_actions". With both, actions are clipped to the range from which they are rescaled, as by ClipAction around
// RescaleAction.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/action.hpp"
#include "task/options.hpp"
#include "task/task.hpp"

namespace mjenv::core {

class ActionTransform {
 public:
  ActionTransform(const Options& options, const Task& task);

  // Whether actions stay as they are.
  bool empty() const { return !clips_ && !rescales_; }
  // The bounds of the actions that the caller gives.
  const std::vector<double>& low() const { return low_; }
  const std::vector<double>& high() const { return high_; }

  // Element i of an action, or of several actions one after the other, transformed in their dtype.
  double at(const Action& action, std::int64_t i) const;
  // The transformed action, which is written to scratch. scratch has room for the action.
  Action apply(const Action& action, std::vector<double>& scratch) const;

 private:
  bool clips_, rescales_;
  std::vector<double> low_, high_;
  std::vector<float> clip_low_, clip_high_, gradient_, intercept_;

  // Number: the action's type, in which NumPy computes.
  template <typename Number>
  Number transformed(Number value, std::size_t i) const;
};

// Declares the options of every id.
void declare_action_options(Options& options);

}  // namespace mjenv::core
