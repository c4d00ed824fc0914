#include "settings.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>
#include <variant>

#include "chars.hpp"
#include "error.hpp"

namespace mjenv::learn {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kPositive = std::numeric_limits<double>::denorm_min();  // the least number greater than 0
constexpr double kMaxFloat = std::numeric_limits<float>::max();
constexpr std::int64_t kMaxSteps = std::int64_t{1} << 53, kMaxWidth = 4096, kMaxLayers = 8, kMaxThreads = 64;
constexpr std::int64_t kMaxBatch = std::int64_t{1} << 26, kMaxObservations = 1 << 20;

[[noreturn]] void refuse(const char* name, const std::string& value, const std::string& wanted) {
  core::fail(MJENV_E_VALUE, "settings." + std::string(name) + " is " + value + ", not " + wanted);
}

void check_count(const char* name, std::int64_t value, std::int64_t low, std::int64_t high) {
  if (value < low || value > high)
    refuse(name, std::to_string(value), std::to_string(low) + " to " + std::to_string(high));
}

void check_number(const char* name, double value, double low, double high) {
  if (value >= low && value <= high && std::isfinite(value)) return;
  const std::string bounds = std::isinf(high) ? "a finite number from " + core::number(low) + " on"
                                              : core::number(low) + " to " + core::number(high);
  refuse(name, core::number(value), low == kPositive ? "a finite number greater than 0, in float32" : bounds);
}

// A setting that is a number, with its bounds.
using Given = mjenv_learn_settings;
struct Number {
  const char* name;
  std::variant<std::int32_t Given::*, std::int64_t Given::*, double Given::*> member;
  double low, high;
  bool fixed = false;  // whether it cannot change once the learner is created
};

constexpr Number kNumbers[] = {{"activation", &Given::activation, MJENV_ACTIVATION_TANH, MJENV_ACTIVATION_ELU, true},
                               {"rows", &Given::rows, 1, kMaxBatch, true},
                               {"steps", &Given::steps, 1, kMaxSteps},
                               {"rollout_steps", &Given::rollout_steps, 1, kMaxBatch, true},
                               {"epochs", &Given::epochs, 1, 1000},
                               {"minibatch_size", &Given::minibatch_size, 1, kMaxBatch},
                               {"decay_steps", &Given::decay_steps, 0, kMaxSteps},
                               {"learning_rate", &Given::learning_rate, 0, 1},
                               {"final_learning_rate", &Given::final_learning_rate, 0, 1},
                               {"gamma", &Given::gamma, 0, 1},
                               {"gae_lambda", &Given::gae_lambda, 0, 1},
                               {"clip", &Given::clip, kPositive, kMaxFloat},
                               {"value_clip", &Given::value_clip, 0, kInfinite},
                               {"value_coef", &Given::value_coef, 0, kInfinite},
                               {"entropy_coef", &Given::entropy_coef, 0, kInfinite},
                               {"max_grad_norm", &Given::max_grad_norm, 0, kInfinite},
                               {"target_kl", &Given::target_kl, 0, kInfinite},
                               {"initial_std", &Given::initial_std, 1e-6, 1e6},
                               {"obs_clip", &Given::obs_clip, kPositive, kMaxFloat},
                               {"reward_clip", &Given::reward_clip, kPositive, kMaxFloat},
                               {"normalize_obs", &Given::normalize_obs, 0, 1, true},
                               {"normalize_reward", &Given::normalize_reward, 0, 1},
                               {"normalize_advantage", &Given::normalize_advantage, 0, 1},
                               {"scale_actions", &Given::scale_actions, 0, 1, true},
                               {"hidden_count", &Given::hidden_count, 0, kMaxLayers},
                               {"obs_count", &Given::obs_count, 0, kMaxObservations},
                               {"threads", &Given::threads, 1, kMaxThreads, true},
                               {"window", &Given::window, 1, 1'000'000, true}};

void check_values(const Given& s) {
  for (const Number& one : kNumbers)
    std::visit(
        [&](auto member) {
          if constexpr (std::is_same_v<decltype(member), double Given::*>)
            check_number(one.name, s.*member, one.low, one.high);
          else
            check_count(one.name, s.*member, static_cast<std::int64_t>(one.low), static_cast<std::int64_t>(one.high));
        },
        one.member);
  check_count("rollout_steps", s.rollout_steps, 1, kMaxBatch / s.rows);
  check_count("minibatch_size", s.minibatch_size, 1, s.rows * s.rollout_steps);
}

std::vector<std::uint8_t> mask(const char* name, const std::uint8_t* given, std::int64_t count,
                               std::int64_t observations) {
  if (!given) return {};
  if (count != observations)
    core::fail(MJENV_E_SIZE, "settings.obs_count is " + std::to_string(count) + ", but an observation has " +
                                 std::to_string(observations) + " elements");
  std::vector<std::uint8_t> copy(given, given + count);
  bool any = false;
  for (const std::uint8_t element : copy) any = any || element != 0;
  if (!any)
    core::fail(MJENV_E_VALUE,
               "settings." + std::string(name) + " is 0 for every element, so the network would see none");
  return copy;
}

constexpr std::array<std::int64_t, 2> kHidden = {64, 64};

// Many rows, large minibatches and small standard deviations, with which a training reaches a given return in the least
// time on one CPU.
mjenv_learn_settings many_rows(std::int64_t steps) {
  mjenv_learn_settings s = MJENV_LEARN_SETTINGS_INIT;
  s.steps = steps;
  s.hidden = kHidden.data();
  s.hidden_count = static_cast<std::int64_t>(kHidden.size());
  return s;
}

// Few rows and many small minibatches, for robots that learn from few steps.
mjenv_learn_settings few_rows(std::int64_t steps, std::int64_t rollout_steps, double learning_rate) {
  mjenv_learn_settings s = many_rows(steps);
  s.rows = 8;
  s.rollout_steps = rollout_steps;
  s.epochs = 10;
  s.minibatch_size = 256;
  s.learning_rate = learning_rate;
  s.value_coef = 0.5;
  s.max_grad_norm = 0.5;
  s.initial_std = 1;
  return s;
}

template <typename Change>
mjenv_learn_settings with(mjenv_learn_settings s, const Change& change) {
  change(s);
  return s;
}

struct Tuned {
  const char* id;
  mjenv_learn_settings settings;
};

const std::vector<Tuned>& tuned() {
  static const std::vector<Tuned> all = {
      {"Ant-v5", many_rows(2'000'000)},
      {"HalfCheetah-v5", with(many_rows(2'000'000), [](auto& s) { s.gamma = 0.98; })},
      {"Hopper-v5", few_rows(1'000'000, 512, 5e-4)},
      {"Humanoid-v5", with(many_rows(2'000'000),
                           [](auto& s) {
                             s.learning_rate = 5e-4;
                             s.decay_steps = 8'000'000;
                           })},
      {"HumanoidStandup-v5", many_rows(600'000)},
      {"InvertedDoublePendulum-v5", many_rows(400'000)},
      {"InvertedPendulum-v5", with(few_rows(100'000, 256, 1e-3),
                                   [](auto& s) {
                                     s.epochs = 5;
                                     s.minibatch_size = 128;
                                   })},
      {"Pusher-v5", many_rows(1'500'000)},
      {"Reacher-v5", with(few_rows(150'000, 256, 1e-3), [](auto& s) { s.gamma = 0.9; })},
      {"Swimmer-v5", with(few_rows(1'000'000, 1024, 6e-4),
                          [](auto& s) {
                            s.gamma = 0.9999;
                            s.gae_lambda = 0.98;
                          })},
      {"Walker2d-v5", with(many_rows(1'515'520), [](auto& s) { s.decay_steps = 3'000'000; })}};
  return all;
}

}  // namespace

bool is_id(std::string_view text) {
  const auto is_printed = [](char c) { return c >= ' ' && c <= '~'; };
  return !text.empty() && text.size() <= 1000 && std::all_of(text.begin(), text.end(), is_printed);
}

Settings::Settings(const mjenv_learn_settings& given, std::int64_t observations)
    : id(given.id ? given.id : ""), values_(given) {
  check_values(given);
  if (!is_id(id)) refuse("id", core::quoted(id.substr(0, 100)), "the name of an environment");
  if (given.hidden_count > 0 && !given.hidden) core::fail(MJENV_E_ARGUMENT, "settings.hidden is NULL");
  for (std::int64_t i = 0; i < given.hidden_count; ++i) {
    check_count(("hidden[" + std::to_string(i) + "]").c_str(), given.hidden[i], 1, kMaxWidth);
    hidden.push_back(static_cast<int>(given.hidden[i]));
  }
  actor_obs = mask("actor_obs", given.actor_obs, given.obs_count, observations);
  critic_obs = mask("critic_obs", given.critic_obs, given.obs_count, observations);
  values_.id = nullptr;
  values_.hidden = nullptr;
  values_.actor_obs = values_.critic_obs = nullptr;
}

void Settings::replace(const Settings& other) {
  const auto same = [](const char* name, bool equal) {
    if (!equal)
      core::fail(MJENV_E_VALUE, "settings." + std::string(name) + " cannot change once the learner is created");
  };
  const mjenv_learn_settings &old = values_, &now = other.values_;
  for (const Number& one : kNumbers)
    if (one.fixed) std::visit([&](auto member) { same(one.name, old.*member == now.*member); }, one.member);
  same("hidden", hidden == other.hidden);
  same("actor_obs", actor_obs == other.actor_obs);
  same("critic_obs", critic_obs == other.critic_obs);
  same("seed", old.seed == now.seed);
  same("instructions", old.instructions == now.instructions);
  same("id", id == other.id);
  values_ = other.values_;
}

mjenv_learn_settings defaults_of(const std::string& id) {
  for (const Tuned& one : tuned())
    if (id == one.id) return one.settings;
  return with(many_rows(2'000'000), [](auto& s) { s.scale_actions = 1; });
}

}  // namespace mjenv::learn
