// Proximal policy optimisation (Schulman et al. 2017).
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "adam.hpp"
#include "agent.hpp"
#include "environment.hpp"
#include "episodes.hpp"
#include "kernels/kernels.hpp"
#include "loss.hpp"
#include "network.hpp"
#include "normalizer.hpp"
#include "policy.hpp"
#include "random.hpp"
#include "rollout.hpp"
#include "settings.hpp"
#include "system/pool.hpp"

namespace mjenv::learn {

class Learner {
 public:
  // Makes a learner that steps the rows of an environment itself.
  Learner(const mjenv_learn_calls& calls, mjenv_env* env, const Settings& settings);
  // Makes a learner whose rows the caller steps. obs: [rows][observations], the first observations.
  Learner(const Spaces& spaces, const Settings& settings, const double* obs, std::int64_t obs_count);
  Learner(const Learner&) = delete;
  Learner& operator=(const Learner&) = delete;

  const Settings& settings() const { return settings_; }
  const Spaces& spaces() const { return spaces_; }

  void train(std::int64_t steps);
  void act(float* action, std::int64_t count);
  void feed(const mjenv_batch& out);
  void restart(const double* obs, std::int64_t obs_count);
  void set_env(mjenv_env* env);
  // Changes settings (Settings::change).
  void set(std::string_view words);

  mjenv_learn_report report() const;
  mjenv_learn_report report_at(std::int64_t update) const;
  void save(const std::string& path, const std::string& note) const;
  void load(const std::string& path);
  std::string policy(mjenv_learned which) const;
  // Says what policies tell of the environment. Terms that are empty stay.
  void describe(Description description);

 private:
  // The parameters and normalisation of the policy with the greatest mean return so far.
  struct Best {
    double mean_return = -__builtin_inf();
    std::vector<float> actor;
    std::vector<double> mean, scale;
  };
  enum class Stage { kAct, kFeed, kBroken };  // what the caller has to call next: act, feed, or (kBroken) restart

  Settings settings_;
  Spaces spaces_;
  std::optional<mjenv_learn_calls> calls_;
  std::unique_ptr<Environment> env_;  // null: the caller steps the rows
  const Kernels& kernels_;
  core::Pool pool_;
  Agent agent_;
  Loss loss_;
  Random random_;
  std::vector<float> parameters_;
  Deviations deviations_;  // of the actions, with the present parameters
  Adam adam_;
  ObservationNormalizer observations_;
  RewardNormalizer rewards_;
  EpisodeStatistics episodes_;
  Rollout rollout_;
  std::vector<std::int32_t> order_;  // the steps of the rollout, in the order of the last shuffle
  std::vector<float> now_;           // [rows][stride] the normalised observations from which the next actions follow
  std::vector<mjenv_learn_report> curve_;
  Best best_;
  Description description_;
  std::size_t step_ = 0;  // how many steps the rollout under way has
  Stage stage_ = Stage::kAct;
  bool env_is_stale_ = false;     // restoring the environment failed, so it must be restored before the next step
  std::vector<std::byte> saved_;  // the state after the last update
  std::vector<std::byte> spare_;  // receives the next state, then is swapped with saved_

  // Scratch memory; each line names the function that uses it.
  std::vector<float> bounded_;                                                // draw_actions
  std::vector<std::unique_ptr<Network::Pass>> actor_passes_, critic_passes_;  // for_row_blocks; one for each thread
  std::vector<unsigned char> ended_;                                          // take
  std::vector<float> last_inputs_;                                            // bootstrap_truncated
  std::vector<std::byte> image_;                                              // save_state

  Learner(const Spaces& spaces, const Settings& settings);

  std::int64_t updates() const { return static_cast<std::int64_t>(curve_.size()); }
  std::size_t rows() const { return static_cast<std::size_t>(settings_.rows); }
  bool steps_itself() const { return env_ != nullptr; }

  void begin(const double* obs);
  void draw_actions();
  float bounded(std::size_t j, float action) const;
  void mean_actions(const float* inputs, int rows, float* means);
  void estimate_values(const float* inputs, int rows, float* values);
  template <typename Body>
  void for_row_blocks(int rows, const Network& network, const Body& body);
  void check_usable(const Outcome& outcome) const;
  void take(const Outcome& outcome);
  void bootstrap_truncated(const Outcome& outcome);
  void finish_rollout();
  mjenv_learn_report update();
  void shuffle();
  void keep_best();
  double learning_rate() const;

  void save_state();
  void undo();
  void restore_state(bool with_env);
  void check_state() const;
  template <typename Archive>
  void archive(Archive& a);
};

}  // namespace mjenv::learn
