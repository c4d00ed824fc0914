// Transforms actions as Gymnasium's wrappers ClipAction (the option "clip_actions") and RescaleAction
// ("rescale_actions") do. If both are set, an action is first clipped to the range of "rescale_actions" and then
// rescaled, as by ClipAction(RescaleAction(env)).
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

  // Returns element i of an action, transformed in the action's dtype. `action` may be several actions, one after the
  // other.
  double at(const Action& action, std::int64_t i) const;
  // Returns the transformed action. Its numbers are in `scratch`, which must have room for an action.
  Action apply(const Action& action, std::vector<double>& scratch) const;

 private:
  bool clips_, rescales_;
  std::vector<double> low_, high_;
  std::vector<float> clip_low_, clip_high_, gradient_, intercept_;

  // Number: the action's type, in which NumPy computes.
  template <typename Number>
  Number transformed(Number value, std::size_t i) const;
};

// Declares these two options, which every id has.
void declare_action_options(Options& options);

}  // namespace mjenv::core
