#include "environment.hpp"

#include <limits>
#include <string>

#include "chars.hpp"
#include "error.hpp"

namespace mjenv::learn {

Spaces::Spaces(const mjenv_space& observation, const mjenv_space& action,
               const std::function<std::string(std::size_t)>& name_of)
    : observations(static_cast<std::size_t>(observation.count)),
      actuators(static_cast<std::size_t>(action.count)),
      low(action.low, action.low + action.count),
      high(action.high, action.high + action.count) {
  if (observations == 0 || actuators == 0)
    core::fail(MJENV_E_SIZE, "there are " + std::to_string(observations) + " observations and " +
                                 std::to_string(actuators) + " actuators; a policy needs at least one of each");
  constexpr double kLargest = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < actuators; ++i)
    if (!(-kLargest <= low[i] && low[i] <= high[i] && high[i] <= kLargest))
      core::fail(MJENV_E_VALUE, "the bounds of action " + std::to_string(i) +
                                    (name_of ? " (" + name_of(i) + ")" : std::string()) + " are " +
                                    core::number(low[i]) + " and " + core::number(high[i]) +
                                    "; a policy needs finite ones, in float32 (ctrlrange in the model)");
}

Environment::Environment(const mjenv_learn_calls& calls, mjenv_env* env, const char* autoreset_mode)
    : calls_(calls),
      env_(env),
      spaces_(space(MJENV_ROLE_OBSERVATION), space(MJENV_ROLE_ACTION),
              [this](std::size_t i) { return action_name(i); }),
      batch_() {
  mjenv_info info = MJENV_INFO_INIT;
  check(calls_.info_of(env_, &info));
  rows_ = info.rows;
  const char* mode = nullptr;
  check(calls_.options_get_string(calls_.options_of(env_), "autoreset_mode", &mode));
  if (std::string(mode) != autoreset_mode)
    core::fail(MJENV_E_VALUE, "the environment's option \"autoreset_mode\" is " + core::quoted(mode) + ", not " +
                                  core::quoted(autoreset_mode));
  const auto rows = static_cast<std::size_t>(rows_);
  obs_.resize(rows * spaces_.observations);
  final_obs_.resize(rows * spaces_.observations);
  reward_.resize(rows);
  terminated_.resize(rows);
  truncated_.resize(rows);
  batch_ = MJENV_BATCH_INIT;
  batch_.rows = rows_;
  batch_.obs_count = static_cast<std::int64_t>(spaces_.observations);
  batch_.obs = obs_.data();
  batch_.final_obs = final_obs_.data();
  batch_.reward = reward_.data();
  batch_.terminated = terminated_.data();
  batch_.truncated = truncated_.data();
}

void Environment::check(mjenv_status status) const {
  if (status != MJENV_OK) core::fail(status, calls_.last_error());
}

std::string Environment::action_name(std::size_t i) const {
  mjenv_field field = MJENV_FIELD_INIT;
  check(calls_.field_at(env_, MJENV_ROLE_ACTION, static_cast<std::int64_t>(i), &field));
  return field.name;
}

Terms Environment::terms() const {
  Terms found;
  for (std::size_t at = 0; at < spaces_.observations; at += found.back().count) {
    mjenv_field field = MJENV_FIELD_INIT;
    check(calls_.field_at(env_, MJENV_ROLE_OBSERVATION, static_cast<std::int64_t>(found.size()), &field));
    found.push_back({field.name, static_cast<std::size_t>(field.count)});
  }
  return found;
}

mjenv_space Environment::space(mjenv_role role) const {
  mjenv_space found = MJENV_SPACE_INIT;
  check(calls_.space_of(env_, role, &found));
  return found;
}

void Environment::seed(const std::vector<std::uint64_t>& seeds, const std::uint8_t* mask) {
  check(calls_.seed(env_, mask, seeds.data(), static_cast<std::int64_t>(seeds.size())));
}

void Environment::reset(const std::uint8_t* mask) { check(calls_.reset(env_, mask, &batch_)); }

void Environment::step(const std::vector<float>& actions, const std::uint8_t* mask) {
  check(
      calls_.step(env_, mask, actions.data(), static_cast<std::int64_t>(actions.size()), MJENV_DTYPE_FLOAT32, &batch_));
}

void Environment::save(std::vector<std::byte>& image, std::int64_t row) const {
  std::int64_t size = 0;
  check(calls_.snapshot(env_, row, nullptr, 0, &size));
  image.resize(static_cast<std::size_t>(size));
  check(calls_.snapshot(env_, row, image.data(), size, &size));
  image.resize(static_cast<std::size_t>(size));
}

void Environment::restore(const std::byte* image, std::size_t size, std::int64_t row) {
  check(calls_.restore(env_, row, image, static_cast<std::int64_t>(size)));
}

}  // namespace mjenv::learn
