#include "env/perturbation.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "error.hpp"
#include "hash.hpp"

namespace mjenv::core {
namespace {

constexpr std::int64_t kMaxInterval = std::int64_t{1} << 52;  // so that a double can count the steps exactly
constexpr std::size_t kPushes = 1;                            // where the pushes begin in a record

bool is_count(double steps, std::int64_t least, std::int64_t most) {
  return steps >= static_cast<double>(least) && steps <= static_cast<double>(most) && steps == std::floor(steps);
}

}  // namespace

Perturbation::Perturbation(const PerturbationSettings& given, const Model& model, std::int64_t action_count,
                           std::int64_t observation_count)
    : action_noise_(given.action_noise),
      observation_noise_(given.observation_noise),
      first_action_(given.first_action),
      actuators_(static_cast<std::size_t>(action_count)),
      observation_count_(static_cast<std::size_t>(observation_count)),
      noise_is_uniform_(given.noise_is_uniform),
      redraws_delays_(given.redraws_delays),
      begins_with_own_(given.begins_with_own),
      is_delayed_(given.is_delayed) {
  const auto delay_of = [](const DelaySettings& from) {
    return Delay{static_cast<std::size_t>(from.least), static_cast<std::size_t>(from.most), from.is_drawn};
  };
  action_delay_ = delay_of(given.action_delay);
  observation_delay_ = delay_of(given.observation_delay);
  take_pushes(given, model);
  has_observations_ = !observation_noise_.empty() || observation_delay_.most > 0;
  if (action_noise_.empty() && action_delay_.most == 0 && !has_observations_ && pushes_.empty()) return;
  // Computed in 64 bits, because a delay may need more memory than 32 bits can address. Rows::make_perturbation then
  // refuses it.
  const std::uint64_t actions = std::uint64_t{action_delay_.most} * actuators_;
  const std::uint64_t observations = std::uint64_t{observation_delay_.most} * observation_count_;
  delays_ = kPushes + 2 * pushes_.size();
  actions_ = delays_ + (resets_draw_delays() ? 2 : 0);
  observations_ = actions_ + static_cast<std::size_t>(actions);
  last_ = observations_ + static_cast<std::size_t>(observations);
  record_count_ = actions_ + actions + observations + (has_observations_ ? observation_count_ : 0);
  const std::array<std::size_t, 11> sizes{
      action_delay_.least,     action_delay_.most,          action_delay_.is_drawn, observation_delay_.least,
      observation_delay_.most, observation_delay_.is_drawn, redraws_delays_,        action_noise_.size(),
      pushes_.size(),          noise_is_uniform_,           begins_with_own_};
  fingerprint_ = hash(sizes.data(), sizeof sizes);
  for (const auto* numbers : {&action_noise_, &observation_noise_, &first_action_})
    fingerprint_ = hash(numbers->data(), numbers->size() * sizeof(double), fingerprint_);
  for (const bool one : is_delayed_) fingerprint_ = hash(&one, sizeof one, fingerprint_);
  for (const Push& push : pushes_) {
    const std::array numbers{std::int64_t{push.body}, push.min_steps,    push.max_steps,
                             push.min_duration,       push.max_duration, std::int64_t{push.dof}};
    fingerprint_ = hash(numbers.data(), sizeof numbers, fingerprint_);
    fingerprint_ = hash(push.high.data(), sizeof push.high, hash(push.low.data(), sizeof push.low, fingerprint_));
  }
}

void Perturbation::take_pushes(const PerturbationSettings& given, const Model& model) {
  for (const PushSettings& one : given.pushes) {
    const auto refuse = [&](const std::string& why) { fail(MJENV_E_VALUE, one.place + ": " + why); };
    const auto check_steps = [&](const char* what, std::int64_t least, std::int64_t most) {
      if (least < 1 || least > most || most > kMaxInterval)
        refuse(std::string(what) + " is [" + std::to_string(least) + ", " + std::to_string(most) +
               "], but 1 <= least <= most <= 2^52 must hold");
    };
    for (const Push& other : pushes_)
      if (other.body == one.body && other.is_kick() == one.is_kick)
        refuse("body " + std::to_string(one.body) + " is in the list twice");
    check_steps("every", one.min_steps, one.max_steps);
    check_steps("duration", one.min_duration, one.max_duration);
    if (one.is_kick && one.max_duration != 1) refuse("a kick lasts one step");
    Push push{one.body, one.min_steps, one.max_steps, one.min_duration, one.max_duration, one.low, one.high};
    if (one.is_kick) push.dof = model.free_dof(one.body);
    if (one.is_kick && push.dof < 0)
      refuse("body " + std::to_string(one.body) + " has no free joint, so its velocity is not in qvel");
    for (std::size_t i = 0; i < push.low.size(); ++i) {
      const double range = push.high[i] - push.low[i];
      if (std::signbit(range) || !std::isfinite(range))
        refuse(element_is("low", i, push.low[i]) + " and " + element_is("high", i, push.high[i]) +
               ", but they must be finite, and low not above high");
    }
    pushes_.push_back(push);
  }
}

void Perturbation::place(const OwnArrays& layout) noexcept {
  if (const OwnArray* placed = layout.find("xfrc_applied")) xfrc_offset_ = placed->offset;
}

double Perturbation::interval(const Push& push, np::Generator& rng) {
  return static_cast<double>(rng.integers(push.min_steps, push.max_steps + 1));
}

double Perturbation::Delay::draw(np::Generator& rng) const {
  if (!is_drawn) return static_cast<double>(least);
  return static_cast<double>(rng.integers(static_cast<std::int64_t>(least), static_cast<std::int64_t>(most) + 1));
}

bool Perturbation::Delay::contains(double steps) const {
  return is_count(steps, static_cast<std::int64_t>(least), static_cast<std::int64_t>(most));
}

std::size_t Perturbation::delay_now(const Delay& delay, std::size_t index, const double* record,
                                    np::Generator& rng) const {
  if (!delay.is_drawn) return delay.least;
  return static_cast<std::size_t>(redraws_delays_ ? delay.draw(rng) : record[delays_ + index]);
}

void Perturbation::begin(double* record, np::Generator& rng) const {
  std::fill_n(record, record_count_, 0.0);
  record[0] = kBegun;
  for (std::size_t i = 0; i < pushes_.size(); ++i) record[kPushes + 2 * i] = interval(pushes_[i], rng);
  if (resets_draw_delays()) {
    record[delays_] = action_delay_.draw(rng);
    record[delays_ + 1] = observation_delay_.draw(rng);
  }
  if (first_action_.empty()) return;
  for (std::size_t i = 0; i < action_delay_.most; ++i)
    std::copy(first_action_.begin(), first_action_.end(), record + actions_ + i * actuators_);
}

double Perturbation::noise(double scale, np::Generator& rng) const {
  return noise_is_uniform_ ? rng.uniform(-scale, scale) : 0.0 + scale * rng.normal();
}

Perturbation::Step Perturbation::make_step() const {
  Step step;
  step.doubles.resize(actuators_);
  step.floats.resize(actuators_);
  step.pushes.resize(2 * pushes_.size());
  step.done.forces.reserve(pushes_.size());
  step.done.kicks.reserve(pushes_.size());
  return step;
}

void Perturbation::push(const Push& push, double& left, double& lasts, np::Generator& rng, Work::Pushes& to) const {
  if (lasts > 1) return static_cast<void>(--lasts);  // the force goes on
  const bool was_pushed = lasts != 0, is_pushed = --left == 0;
  lasts = 0;
  if (!was_pushed && !is_pushed) return;
  std::array<double, 6> drawn{};
  for (std::size_t k = 0; is_pushed && k < drawn.size(); ++k) drawn[k] = rng.uniform(push.low[k], push.high[k]);
  if (push.is_kick())
    to.kicks.push_back({push.dof, drawn});
  else
    to.forces.push_back({push.body, offset_of(push), drawn});
  if (!is_pushed) return;
  if (!push.is_kick()) lasts = static_cast<double>(rng.integers(push.min_duration, push.max_duration + 1));
  left = interval(push, rng);
}

Action Perturbation::act(const double* record, std::int64_t steps, const Action& action, np::Generator& rng,
                         Step& step) const {
  const bool is_float32 = action.dtype == MJENV_DTYPE_FLOAT32;
  const std::size_t delay = delay_now(action_delay_, 0, record, rng), most = action_delay_.most;
  const bool is_delayed = delay > 0;
  const double* delayed =
      record + actions_ + (is_delayed ? (static_cast<std::size_t>(steps) + most - delay) % most * actuators_ : 0);
  for (std::size_t i = 0; i < actuators_; ++i) {
    double value = is_delayed ? delayed[i] : action[static_cast<std::int64_t>(i)];
    if (is_float32) value = static_cast<float>(value);
    if (!action_noise_.empty()) value += noise(action_noise_[i], rng);
    step.doubles[i] = value;
    step.floats[i] = static_cast<float>(value);
  }
  step.done.clear();
  for (std::size_t i = 0; i < pushes_.size(); ++i) {
    double& left = step.pushes[2 * i] = record[kPushes + 2 * i];
    double& lasts = step.pushes[2 * i + 1] = record[kPushes + 2 * i + 1];
    push(pushes_[i], left, lasts, rng, step.done);
  }
  if (is_float32) return {step.floats.data(), action.dtype, action.count};
  return {step.doubles.data(), action.dtype, action.count};
}

void Perturbation::commit(double* record, std::int64_t steps, const Action& action, const Step& step) const {
  record[0] = kBegun;  // until observe has computed the observation of this step, since that may fail
  std::copy(step.pushes.begin(), step.pushes.end(), record + kPushes);
  if (action_delay_.most == 0) return;
  double* to = record + actions_ + static_cast<std::size_t>(steps) % action_delay_.most * actuators_;
  for (std::size_t i = 0; i < actuators_; ++i) to[i] = action[static_cast<std::int64_t>(i)];
}

const double* Perturbation::observe(double* record, std::int64_t steps, const double* observation,
                                    np::Generator& rng) const {
  double* last = record + last_;
  const std::size_t delay = delay_now(observation_delay_, 1, record, rng), most = observation_delay_.most;
  const auto slot = [&](std::size_t step) {
    return most > 0 ? record + observations_ + step % most * observation_count_ : last;
  };
  const bool begins = steps == 0 && begins_with_own_;
  double* const to = slot(static_cast<std::size_t>(steps));
  const double* const delayed = slot(static_cast<std::size_t>(steps) + most - delay);
  for (std::size_t i = 0; i < observation_count_; ++i) {
    double value = observation[i];
    if (!observation_noise_.empty()) value += noise(observation_noise_[i], rng);
    last[i] = delay > 0 && !begins && is_delayed_[i] ? delayed[i] : value;
    to[i] = value;
  }
  for (std::size_t step = 1; begins && step < most; ++step) std::copy_n(to, observation_count_, slot(step));
  record[0] = kObserved;
  return last;
}

bool Perturbation::applies_forces() const {
  return std::any_of(pushes_.begin(), pushes_.end(), [](const Push& push) { return !push.is_kick(); });
}

bool Perturbation::is_pushed(const double* record) const {
  for (std::size_t i = 0; i < pushes_.size(); ++i)
    if (record[kPushes + 2 * i + 1] != 0) return true;
  return false;
}

void Perturbation::end_pushes(const double* record, std::byte* block) const {
  for (std::size_t i = 0; i < pushes_.size(); ++i)
    if (record[kPushes + 2 * i + 1] != 0) std::memset(block + offset_of(pushes_[i]), 0, 6 * sizeof(double));
}

bool Perturbation::is_valid(const double* record) const {
  const bool has_begun = record[0] == kBegun || record[0] == kObserved;
  if (record[0] != 0 && !has_begun) return false;
  for (std::size_t i = 0; i < pushes_.size(); ++i) {
    const double left = record[kPushes + 2 * i], lasts = record[kPushes + 2 * i + 1];
    if (has_begun && !is_count(left, 1, pushes_[i].max_steps)) return false;
    if (!is_count(lasts, 0, pushes_[i].is_kick() ? 0 : pushes_[i].max_duration)) return false;
  }
  if (!has_begun || !resets_draw_delays()) return true;
  return action_delay_.contains(record[delays_]) && observation_delay_.contains(record[delays_ + 1]);
}

}  // namespace mjenv::core
