#pragma once

#include <cstddef>
#include <vector>

namespace mjenv::learn {

// What an update needs from the steps of a rollout. Arrays are [steps][rows]: step t of row i is at t * rows + i.
struct Rollout {
  Rollout(std::size_t step_count, std::size_t row_count, std::size_t stride, std::size_t actuators, std::size_t spare)
      : steps(step_count),
        rows(row_count),
        inputs(((steps + 1) * rows + spare) * stride),
        actions(steps * rows * actuators),
        log_probabilities(steps * rows),
        values((steps + 1) * rows),
        rewards(steps * rows),
        continues(steps * rows),
        advantages(steps * rows),
        returns(steps * rows) {}

  std::size_t steps, rows;
  std::vector<float> inputs;   // [steps + 1][rows][stride] normalised observations, followed by rows of padding
  std::vector<float> actions;  // [steps][rows][actuators] before they are clipped
  std::vector<float> log_probabilities;
  std::vector<float> values;  // [steps + 1][rows] what the critic estimates
  // Normalised; if a step truncated the episode, plus gamma times the value of its last observation.
  std::vector<float> rewards;
  std::vector<float> continues;  // 0 if the episode ended with this step, otherwise 1
  std::vector<float> advantages, returns;

  // Generalized advantage estimation (Schulman et al. 2016), from the last step to the first.
  void estimate_advantages(float gamma, float lambda) {
    for (std::size_t i = 0; i < rows; ++i) {
      float ahead = 0;
      for (std::size_t t = steps; t-- > 0;) {
        const std::size_t at = t * rows + i;
        const float error = rewards[at] + gamma * values[at + rows] * continues[at] - values[at];
        ahead = error + gamma * lambda * continues[at] * ahead;
        advantages[at] = ahead;
        returns[at] = ahead + values[at];
      }
    }
  }

  // 1 - var(returns - values) / var(returns); NaN if the returns are all equal.
  double explained_variance() const {
    const std::size_t count = steps * rows;
    double mean = 0, error = 0;
    for (std::size_t i = 0; i < count; ++i) {
      mean += returns[i];
      error += returns[i] - values[i];
    }
    mean /= static_cast<double>(count);
    error /= static_cast<double>(count);
    double variance = 0, unexplained = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const double distance = returns[i] - mean, residual = (returns[i] - values[i]) - error;
      variance += distance * distance;
      unexplained += residual * residual;
    }
    return variance > 0 ? 1 - unexplained / variance : static_cast<double>(__builtin_nan(""));
  }
};

}  // namespace mjenv::learn
