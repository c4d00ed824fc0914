// Noise, delays and pushes (mjenv_randomize).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/action.hpp"
#include "engine/own_arrays.hpp"
#include "engine/work.hpp"
#include "env/draw_document.hpp"
#include "numpy/random.hpp"

namespace mjenv::core {

// For noise, delays and pushes each row has a record of doubles: the phase, the state of the pushes, the
// delayed actions and observations, and the last observation that the caller saw.
class Perturbation {
 public:
  // Perturbs nothing.
  Perturbation() = default;
  Perturbation(const PerturbationSettings& given, const Model& model, std::int64_t action_count,
               std::int64_t observation_count);

  // Whether pushes write xfrc_applied.
  bool applies_forces() const;
  bool changes_observations() const { return has_observations_; }
  // How many doubles a row's record has. There may be too little memory for them, so allocate them before you change
  // anything.
  std::uint64_t record_count() const { return record_count_; }
  // A hash of the settings; 0 if there are none.
  std::uint64_t fingerprint() const { return fingerprint_; }
  // Call this after rows have got their own xfrc_applied.
  void place(const OwnArrays& layout) noexcept;

  // Whether the row was reset since its record was made. Until then it is not perturbed.
  static bool has_begun(const double* record) { return record[0] != 0; }
  // Call this when the row's state was set or written.
  static void forget_observation(double* record) {
    if (has_begun(record)) record[0] = kBegun;
  }
  // The last observation that the caller saw. Null if the state was set or written since.
  const double* last_observation(const double* record) const {
    return has_observations_ && record[0] == kObserved ? record + last_ : nullptr;
  }

  // Begins an episode.
  void begin(double* record, np::Generator& rng) const;

  // What act computes for a step.
  struct Step {
    std::vector<double> doubles;  // the action that the task sees, if it is float64
    std::vector<float> floats;    // the same, if it is float32
    std::vector<double> pushes;   // the part of the record with the pushes, as it will be after the step
    Work::Pushes done;
  };
  // Allocates the memory that act uses.
  Step make_step() const;
  // Returns the action that the task sees, after delay and noise. Also draws the pushes. steps: how many steps the
  // episode has had so far.
  Action act(const double* record, std::int64_t steps, const Action& action, np::Generator& rng, Step& step) const;
  // Call this when the step has succeeded: stores the state of the pushes, and the caller's action if it is delayed.
  void commit(double* record, std::int64_t steps, const Action& action, const Step& step) const;
  // Returns the observation that the caller sees after `steps` steps of the episode: the task's, with noise and delay.
  const double* observe(double* record, std::int64_t steps, const double* observation, np::Generator& rng) const;

  // Whether the last step's pushes have left forces in the row's values. end_pushes sets these to 0.
  bool is_pushed(const double* record) const;
  void end_pushes(const double* record, std::byte* block) const;

  // Whether a row can have this record. Used to check the records in an image.
  bool is_valid(const double* record) const;

 private:
  static constexpr double kBegun = 1, kObserved = 2;  // phases

  struct Push {
    std::int32_t body;
    std::int64_t min_steps, max_steps, min_duration, max_duration;
    std::array<double, 6> low, high;
    std::int32_t dof = -1;  // the first of the free joint in qvel, if the push is a kick

    bool is_kick() const { return dof >= 0; }
  };

  std::vector<double> action_noise_, observation_noise_, first_action_;
  std::size_t actuators_ = 0, observation_count_ = 0;
  // A delay in steps, which may be drawn from the range.
  struct Delay {
    std::size_t least = 0, most = 0;
    bool is_drawn = false;

    double draw(np::Generator& rng) const;
    bool contains(double steps) const;
  };
  Delay action_delay_, observation_delay_;
  bool noise_is_uniform_ = false;
  bool redraws_delays_ = false;   // delays are drawn for each step, not at each reset
  bool begins_with_own_ = false;  // the reset's observation stands before the first delayed one, not zeros
  std::vector<bool> is_delayed_;  // each number of the observation
  std::vector<Push> pushes_;
  std::size_t xfrc_offset_ = 0;  // in a row's block of own values
  bool has_observations_ = false;
  // A record consists of
  //   - the phase
  //   - for each push: in how many steps it begins next, counted from the last step of its present force if there is
  //     one; and how many steps this force has left, including the one just played (0: it did not act in that one)
  //   - the delay of actions and that of observations, if resets draw any
  //   - the delayed actions and observations, as many as the greatest delays
  //   - the last observation
  // These are the offsets of the parts after the pushes.
  std::size_t delays_ = 0, actions_ = 0, observations_ = 0, last_ = 0;
  std::uint64_t record_count_ = 0, fingerprint_ = 0;

  void take_pushes(const PerturbationSettings& given, const Model& model);
  double noise(double scale, np::Generator& rng) const;
  static double interval(const Push& push, np::Generator& rng);
  // Decides what a push does in a step, and counts down its two numbers in the record, `left` and `lasts`.
  void push(const Push& push, double& left, double& lasts, np::Generator& rng, Work::Pushes& to) const;
  bool resets_draw_delays() const {
    return !redraws_delays_ && (action_delay_.is_drawn || observation_delay_.is_drawn);
  }
  // The delay in this step. index: 0 for actions, 1 for observations.
  std::size_t delay_now(const Delay& delay, std::size_t index, const double* record, np::Generator& rng) const;
  std::size_t offset_of(const Push& push) const {
    return xfrc_offset_ + 6 * sizeof(double) * static_cast<std::size_t>(push.body);
  }
};

}  // namespace mjenv::core
