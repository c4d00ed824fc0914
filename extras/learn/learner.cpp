#include "learner.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "archive.hpp"
#include "checkpoint.hpp"
#include "error.hpp"
#include "policy.hpp"

namespace mjenv::learn {
namespace {

constexpr int kRowsOfPass = 16;  // rows that one thread evaluates together during a rollout
// The threads share an evaluation of at least so many multiplications. A smaller one takes less time than waking them.
constexpr std::size_t kSharedWork = std::size_t{1} << 22;

constexpr double kLeastScale = 1e-5;  // of observations; it is sqrt(1e-8) for those that never change

bool is_usable(double value) { return std::abs(value) <= kLargest; }
constexpr const char* kUsable = ", not a number from -1e100 to 1e100";

mjenv_learn_report empty_report() {
  mjenv_learn_report report = MJENV_LEARN_REPORT_INIT;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  report.mean_return = report.mean_length = report.learning_rate = report.policy_loss = report.value_loss = kNone;
  report.entropy = report.approx_kl = report.clip_fraction = report.grad_norm = report.explained_variance = kNone;
  report.std = kNone;
  return report;
}

}  // namespace

Learner::Learner(const Spaces& spaces, const Settings& settings)
    : settings_(settings),
      spaces_(spaces),
      kernels_(chosen_kernels(settings.instructions)),
      pool_(static_cast<int>(settings.threads), false),
      agent_(settings, spaces),
      loss_(agent_, kernels_, pool_),
      random_(settings.seed),
      parameters_(agent_.initial_parameters(settings.initial_std, random_)),
      deviations_(agent_),
      adam_(agent_.size),
      observations_(spaces.observations, agent_.actor.input_stride(), settings.normalize_obs, settings.obs_clip),
      rewards_(rows()),
      episodes_(rows(), static_cast<std::size_t>(settings.window)),
      rollout_(static_cast<std::size_t>(settings.rollout_steps), rows(), agent_.stride(), spaces.actuators, kRowBlock),
      order_(static_cast<std::size_t>(settings.batch())),
      now_(rows() * agent_.stride()),
      bounded_(rows() * spaces.actuators),
      ended_(rows()),
      last_inputs_(kRowBlock * agent_.stride()) {
  std::iota(order_.begin(), order_.end(), 0);
  for (int i = 0; i < pool_.threads(); ++i) {
    actor_passes_.push_back(std::make_unique<Network::Pass>(agent_.actor, kRowsOfPass));
    critic_passes_.push_back(std::make_unique<Network::Pass>(agent_.critic, kRowsOfPass));
  }
  best_.actor.resize(agent_.actor.size());
  best_.mean.resize(spaces.observations);
  best_.scale.resize(spaces.observations, 1.0);
}

Learner::Learner(const mjenv_learn_calls& calls, mjenv_env* env, const Settings& settings)
    : Learner(Environment(calls, env, "same_step").spaces(), settings) {
  calls_ = calls;
  env_ = std::make_unique<Environment>(calls, env, "same_step");
  if (env_->rows() != settings.rows)
    core::fail(MJENV_E_VALUE, "settings.rows is " + std::to_string(settings.rows) + ", but the environment has " +
                                  std::to_string(env_->rows()) + " rows");
  description_.terms = env_->terms();
  begin(nullptr);
}

Learner::Learner(const Spaces& spaces, const Settings& settings, const double* obs, std::int64_t obs_count)
    : Learner(spaces, settings) {
  core::check_count("obs_count", obs_count, static_cast<std::int64_t>(rows() * spaces.observations));
  begin(obs);
}

// Begins new episodes, whose first observations are obs or come from the environment.
void Learner::begin(const double* obs) {
  if (steps_itself()) {
    std::vector<std::uint64_t> seeds(rows());
    std::iota(seeds.begin(), seeds.end(), settings_.seed);
    env_->seed(seeds);
    env_->reset();
    obs = env_->outcome().obs;
  }
  for (std::size_t i = 0; i < rows() * spaces_.observations; ++i)
    if (!is_usable(obs[i]))
      core::fail(MJENV_E_VALUE, "the first observation of row " + std::to_string(i / spaces_.observations) + ": " +
                                    core::element_is("obs", i % spaces_.observations, obs[i]) + kUsable);
  observations_.add(obs, rows());
  observations_.normalize(obs, rows(), now_.data());
  episodes_.forget_unfinished();
  rewards_.forget_returns();
  step_ = 0;
  stage_ = Stage::kAct;
  save_state();
  env_is_stale_ = false;
}

void Learner::train(std::int64_t steps) {
  if (!steps_itself())
    core::fail(MJENV_E_VALUE,
               "the caller steps the rows of this learner: use mjenv_learner_act and mjenv_learner_feed");
  if (steps < 0) core::fail(MJENV_E_VALUE, "steps is " + std::to_string(steps) + ", less than 0");
  pool_.check_here();
  if (env_is_stale_) restore_state(true);
  const std::int64_t rollouts = (steps + settings_.batch() - 1) / settings_.batch();
  try {
    for (std::int64_t done = 0; done < rollouts; ++done)
      for (std::int64_t step = 0; step < settings_.rollout_steps; ++step) {
        draw_actions();
        env_->step(bounded_);
        take(env_->outcome());
      }
  } catch (...) {
    undo();
    throw;
  }
}

// Restores the state after the last update. If the environment cannot be restored now, train() will try again.
void Learner::undo() {
  try {
    restore_state(steps_itself());
  } catch (const std::exception&) {
  }
}

void Learner::act(float* action, std::int64_t count) {
  if (steps_itself()) core::fail(MJENV_E_VALUE, "the library steps the rows of this learner: use mjenv_learner_train");
  core::check_count("count", count, static_cast<std::int64_t>(bounded_.size()));
  if (stage_ == Stage::kBroken) core::fail(MJENV_E_VALUE, "the rollout was given up: call mjenv_learner_restart first");
  if (stage_ == Stage::kFeed)
    core::fail(MJENV_E_VALUE, "the last actions have no outcome yet: call mjenv_learner_feed");
  pool_.check_here();
  draw_actions();
  std::copy(bounded_.begin(), bounded_.end(), action);
  stage_ = Stage::kFeed;
}

void Learner::feed(const mjenv_batch& out) {
  if (steps_itself()) core::fail(MJENV_E_VALUE, "the library steps the rows of this learner: use mjenv_learner_train");
  if (stage_ != Stage::kFeed) core::fail(MJENV_E_VALUE, "no actions were drawn: call mjenv_learner_act first");
  pool_.check_here();
  core::check_count("out->rows", out.rows, settings_.rows);
  core::check_count("out->obs_count", out.obs_count, static_cast<std::int64_t>(spaces_.observations));
  if (out.obs_dtype != MJENV_DTYPE_FLOAT64) core::fail(MJENV_E_VALUE, "out->obs_dtype is not MJENV_DTYPE_FLOAT64");
  if (!out.obs || !out.final_obs || !out.reward || !out.terminated || !out.truncated)
    core::fail(MJENV_E_ARGUMENT, "obs, final_obs, reward, terminated or truncated of out is NULL");
  try {
    stage_ = Stage::kAct;
    take({static_cast<const double*>(out.obs), static_cast<const double*>(out.final_obs), out.reward, out.terminated,
          out.truncated});
  } catch (...) {
    restore_state(false);
    stage_ = Stage::kBroken;
    throw;
  }
}

void Learner::restart(const double* obs, std::int64_t obs_count) {
  if (steps_itself())
    core::fail(MJENV_E_VALUE, "the library steps the rows of this learner: use mjenv_learner_set_env");
  core::check_count("obs_count", obs_count, static_cast<std::int64_t>(rows() * spaces_.observations));
  restore_state(false);
  stage_ = Stage::kBroken;  // until the observations have turned out to be valid
  begin(obs);
}

void Learner::set_env(mjenv_env* env) {
  if (!steps_itself()) core::fail(MJENV_E_VALUE, "the caller steps the rows of this learner");
  auto other = std::make_unique<Environment>(*calls_, env, "same_step");
  core::check_count("the number of rows", other->rows(), settings_.rows);
  if (!(other->spaces() == spaces_)) core::fail(MJENV_E_VALUE, "the environment has other spaces than the one before");
  std::swap(env_, other);
  try {
    begin(nullptr);
  } catch (...) {
    std::swap(env_, other);
    undo();
    throw;
  }
  description_.terms = env_->terms();
}

void Learner::describe(Description description) {
  description.check(spaces_.observations);
  if (description.terms.empty()) description.terms = std::move(description_.terms);
  description_ = std::move(description);
}

void Learner::set(std::string_view words) {
  settings_.change(words);
  observations_.set_clip(settings_.obs_clip);
}

// Calls body(worker, from, count) for blocks of rows. The threads share them if the work takes longer than waking the
// threads.
template <typename Body>
void Learner::for_row_blocks(int rows, const Network& network, const Body& body) {
  const int threads = pool_.threads();
  const auto work = [&](int worker) {
    for (int from = worker * kRowsOfPass; from < rows; from += threads * kRowsOfPass)
      body(static_cast<std::size_t>(worker), from, std::min(kRowsOfPass, rows - from));
  };
  if (static_cast<std::size_t>(rows) * network.size() >= kSharedWork)
    pool_.run(std::cref(work));
  else
    for (int worker = 0; worker < threads; ++worker) work(worker);
}

// Evaluates the actor. means: [rows][actuators].
void Learner::mean_actions(const float* inputs, int rows, float* means) {
  for_row_blocks(rows, agent_.actor, [&](std::size_t worker, int from, int count) {
    const float* x = inputs + static_cast<std::size_t>(from) * agent_.stride();
    const float* mean = actor_passes_[worker]->forward(kernels_, parameters_.data(), x, padded(count, kRowBlock));
    for (int i = 0; i < count; ++i)
      std::copy_n(mean + i * agent_.actor.output_stride(), agent_.actuators,
                  means + static_cast<std::size_t>(from + i) * agent_.actuators);
  });
}

// Evaluates the critic. values: [rows].
void Learner::estimate_values(const float* inputs, int rows, float* values) {
  for_row_blocks(rows, agent_.critic, [&](std::size_t worker, int from, int count) {
    const float *parameters = &parameters_[agent_.critic_at],
                *x = inputs + static_cast<std::size_t>(from) * agent_.stride();
    const float* value = critic_passes_[worker]->forward(kernels_, parameters, x, padded(count, kRowBlock));
    for (int i = 0; i < count; ++i) values[from + i] = value[i * agent_.critic.output_stride()];
  });
}

// Draws the actions of all rows into rollout_.actions, and converts them for the environment into bounded_.
void Learner::draw_actions() {
  const std::size_t n = rows(), actuators = agent_.actuators;
  if (step_ == 0) {
    std::copy(now_.begin(), now_.end(), rollout_.inputs.begin());
    deviations_.update(kernels_, parameters_);
  }
  float *actions = &rollout_.actions[step_ * n * actuators],
        *log_probabilities = &rollout_.log_probabilities[step_ * n];
  mean_actions(&rollout_.inputs[step_ * n * agent_.stride()], static_cast<int>(n), actions);
  const float* log_std = &parameters_[agent_.log_std_at];
  for (std::size_t i = 0; i < n; ++i) {
    float log_probability = 0;
    for (std::size_t j = 0; j < actuators; ++j) {
      const auto z = static_cast<float>(random_.normal());
      float& action = actions[i * actuators + j];
      action += deviations_.std[j] * z;
      log_probability -= 0.5F * z * z + log_std[j] + static_cast<float>(kHalfLogTwoPi);
      bounded_[i * actuators + j] = bounded(j, action);
    }
    log_probabilities[i] = log_probability;
  }
}

// Converts the network's number for actuator j to the one that is passed to the environment: scaled, and clipped to the
// bounds.
float Learner::bounded(std::size_t j, float action) const {
  const double low = spaces_.low[j], high = spaces_.high[j];
  const double wanted = settings_.scale_actions ? 0.5 * (high + low) + 0.5 * (high - low) * action : action;
  return static_cast<float>(std::min(high, std::max(low, wanted)));
}

void Learner::check_usable(const Outcome& outcome) const {
  const auto where = [&](std::size_t row) {
    const std::int64_t step = updates() * settings_.rollout_steps + static_cast<std::int64_t>(step_) + 1;
    return "row " + std::to_string(row) + ", step " + std::to_string(step) + " of the training: ";
  };
  for (std::size_t i = 0; i < rows(); ++i)
    if (!is_usable(outcome.reward[i]))
      core::fail(MJENV_E_VALUE, where(i) + "the reward is " + core::number(outcome.reward[i]) + kUsable);
  const std::size_t size = spaces_.observations;
  const auto check = [&](const double* obs, std::size_t row) {
    for (std::size_t j = 0; j < size; ++j)
      if (!is_usable(obs[row * size + j]))
        core::fail(MJENV_E_VALUE, where(row) + core::element_is("obs", j, obs[row * size + j]) + kUsable);
  };
  for (std::size_t i = 0; i < rows(); ++i) {
    check(outcome.obs, i);
    if (outcome.truncated[i] != 0 && outcome.terminated[i] == 0) check(outcome.final_obs, i);
  }
}

void Learner::take(const Outcome& outcome) {
  check_usable(outcome);
  const std::size_t n = rows(), stride = agent_.stride();
  for (std::size_t i = 0; i < n; ++i) {
    ended_[i] = outcome.terminated[i] != 0 || outcome.truncated[i] != 0;
    rollout_.continues[step_ * n + i] = ended_[i] != 0 ? 0.0F : 1.0F;
    episodes_.add_step(i, outcome.reward[i], ended_[i] != 0);
  }
  rewards_.add(outcome.reward, ended_, settings_.gamma, settings_.reward_clip, settings_.normalize_reward,
               &rollout_.rewards[step_ * n]);
  bootstrap_truncated(outcome);
  observations_.add(outcome.obs, n);
  ++step_;
  observations_.normalize(outcome.obs, n, &rollout_.inputs[step_ * n * stride]);
  if (step_ == rollout_.steps) finish_rollout();
}

// A truncated episode would have gone on. So the critic's value of its last observation, times gamma, is added to its
// last reward.
void Learner::bootstrap_truncated(const Outcome& outcome) {
  for (std::size_t i = 0; i < rows(); ++i) {
    if (outcome.truncated[i] == 0 || outcome.terminated[i] != 0) continue;
    observations_.normalize(outcome.final_obs + i * spaces_.observations, 1, last_inputs_.data());
    float value = 0;
    estimate_values(last_inputs_.data(), 1, &value);
    rollout_.rewards[step_ * rows() + i] += static_cast<float>(settings_.gamma) * value;
  }
}

void Learner::finish_rollout() {
  curve_.reserve(curve_.size() + 1 + curve_.size() / 2);  // so that push_back below allocates nothing
  const std::size_t n = rows(), stride = agent_.stride();
  const float* after = &rollout_.inputs[rollout_.steps * n * stride];
  // Not step by step, because here the threads can share all rows of the rollout.
  estimate_values(rollout_.inputs.data(), static_cast<int>((rollout_.steps + 1) * n), rollout_.values.data());
  rollout_.estimate_advantages(static_cast<float>(settings_.gamma), static_cast<float>(settings_.gae_lambda));
  if (episodes_.is_full() && episodes_.mean_return() > best_.mean_return) keep_best();
  std::copy_n(after, now_.size(), now_.begin());
  curve_.push_back(update());
  step_ = 0;
  save_state();
}

double Learner::learning_rate() const {
  const std::int64_t steps = settings_.decay_steps > 0 ? settings_.decay_steps : settings_.steps;
  const std::int64_t all = (steps + settings_.batch() - 1) / settings_.batch();  // updates
  const double done = std::min(1.0, static_cast<double>(updates()) / static_cast<double>(all));
  return settings_.learning_rate + (settings_.final_learning_rate - settings_.learning_rate) * done;
}

void Learner::shuffle() {
  for (std::size_t i = order_.size() - 1; i > 0; --i)
    std::swap(order_[i], order_[random_.below(static_cast<std::uint32_t>(i + 1))]);
}

mjenv_learn_report Learner::update() {
  mjenv_learn_report report = empty_report();
  report.updates = updates() + 1;
  report.steps = report.updates * settings_.batch();
  report.episodes = episodes_.episodes();
  report.mean_return = episodes_.mean_return();
  report.mean_length = episodes_.mean_length();
  report.learning_rate = learning_rate();
  report.explained_variance = rollout_.explained_variance();
  const auto size = static_cast<std::size_t>(settings_.minibatch_size);
  LossTerms all;
  double norms = 0;
  std::int64_t minibatches = 0;
  while (report.epochs < settings_.epochs) {
    shuffle();
    const double kl_before = all.kl;
    for (std::size_t start = 0; start < order_.size(); start += size, ++minibatches) {
      const auto count = static_cast<int>(std::min(size, order_.size() - start));
      const Minibatch batch(&order_[start], count, rollout_, settings_.normalize_advantage);
      all.add(loss_.differentiate(parameters_, rollout_, batch, settings_));
      norms +=
          adam_.step(kernels_, pool_, report.learning_rate, settings_.max_grad_norm, loss_.gradient(), parameters_);
    }
    ++report.epochs;
    const double kl = (all.kl - kl_before) / static_cast<double>(order_.size());
    if (settings_.target_kl > 0 && kl > settings_.target_kl) break;
  }
  SumOfSquares squares;
  squares.add(kernels_, parameters_.data(), parameters_.size());
  if (!std::isfinite(squares.total()))
    core::fail(MJENV_E_VALUE, "update " + std::to_string(report.updates) +
                                  " made weights of the networks infinite: a smaller settings.learning_rate may help");
  const double steps = static_cast<double>(order_.size()) * static_cast<double>(report.epochs);
  report.policy_loss = all.policy / steps;
  report.value_loss = all.value / steps;
  report.approx_kl = all.kl / steps;
  report.clip_fraction = all.clipped / steps;
  report.grad_norm = norms / static_cast<double>(minibatches);
  deviations_.update(kernels_, parameters_);
  double entropy = 0, std = 0;
  for (std::size_t j = 0; j < agent_.actuators; ++j) {
    entropy += parameters_[agent_.log_std_at + j] + 0.5 + kHalfLogTwoPi;
    std += deviations_.std[j];
  }
  report.entropy = entropy;
  report.std = std / static_cast<double>(agent_.actuators);
  return report;
}

void Learner::keep_best() {
  best_.mean_return = episodes_.mean_return();
  std::copy_n(parameters_.begin(), best_.actor.size(), best_.actor.begin());
  if (!observations_.enabled()) return;
  for (std::size_t j = 0; j < best_.mean.size(); ++j) {
    best_.mean[j] = observations_.moments().mean()[j];
    best_.scale[j] = observations_.moments().scale(j);
  }
}

mjenv_learn_report Learner::report() const {
  if (!curve_.empty()) return curve_.back();
  return empty_report();
}

mjenv_learn_report Learner::report_at(std::int64_t update) const {
  if (update < 1 || update > updates())
    core::fail(MJENV_E_VALUE, "update is " + std::to_string(update) + ", not 1 to " + std::to_string(updates()));
  return curve_[static_cast<std::size_t>(update - 1)];
}

std::string Learner::policy(mjenv_learned which) const {
  if (which != MJENV_LEARNED_LAST && which != MJENV_LEARNED_BEST)
    core::fail(MJENV_E_VALUE, "which is " + std::to_string(which) + ", not MJENV_LEARNED_LAST or MJENV_LEARNED_BEST");
  const bool best = which == MJENV_LEARNED_BEST && best_.mean_return > -__builtin_inf();
  std::vector<double> mean = best_.mean, scale = best_.scale;
  if (!best && observations_.enabled())
    for (std::size_t j = 0; j < mean.size(); ++j) {
      mean[j] = observations_.moments().mean()[j];
      scale[j] = observations_.moments().scale(j);
    }
  return policy_text(settings_, spaces_, agent_.actor, best ? best_.actor.data() : parameters_.data(), mean, scale,
                     settings_.obs_clip, description_);
}

// Lists what the next rollouts depend on, besides the curve, the settings and the environment.
template <typename Archive>
void Learner::archive(Archive& a) {
  random_.archive(a);
  a(parameters_, kFinite);
  adam_.archive(a);
  observations_.archive(a);
  rewards_.archive(a);
  episodes_.archive(a);
  a(now_, kFinite);
  a(order_, {0, static_cast<double>(settings_.batch() - 1)});
  a(best_.mean_return, {-__builtin_inf(), kSum.high});
  a(best_.actor, kFinite);
  a(best_.mean, kSum);
  a(best_.scale, {kLeastScale, kSum.high});
}

// Throws unless a learner can have the state that archive() has read, beyond the range of each number.
void Learner::check_state() const {
  for (std::size_t i = 0; i < curve_.size(); ++i) {
    const mjenv_learn_report& report = curve_[i];
    const auto update = static_cast<std::int64_t>(i) + 1;
    if (report.struct_size != sizeof report || report.reserved != 0 || report.updates != update ||
        report.steps != update * settings_.batch() || report.episodes < 0 || report.episodes > report.steps ||
        report.epochs < 1)
      Reader::fail("its curve is none");
  }
  std::vector<bool> is_in(order_.size());
  for (const std::int32_t step : order_) is_in[static_cast<std::size_t>(step)] = true;
  if (std::find(is_in.begin(), is_in.end(), false) != is_in.end()) Reader::fail("its order of steps repeats one");
  const std::vector<bool> used = agent_.used();
  for (const auto* numbers : {&parameters_, &adam_.first(), &adam_.second()})
    for (std::size_t i = 0; i < used.size(); ++i)
      if (!used[i] && (*numbers)[i] != 0) Reader::fail("it has weights where the networks have none");
  for (std::size_t i = 0; i < now_.size(); ++i)
    if (i % agent_.stride() >= spaces_.observations && now_[i] != 0)
      Reader::fail("it has inputs where the networks have none");
}

void Learner::save_state() {
  image_.clear();
  if (steps_itself()) env_->save(image_);
  spare_.clear();
  Writer writer(spare_);
  writer(curve_);
  archive(writer);
  writer(image_);
  std::swap(saved_, spare_);
}

// Restores what save_state saved.
void Learner::restore_state(bool with_env) {
  step_ = 0;
  stage_ = Stage::kAct;
  env_is_stale_ = with_env;
  Reader reader(saved_);
  reader.resize(curve_);
  archive(reader);
  reader.resize(image_);
  reader.end();
  if (with_env) env_->restore(image_.data(), image_.size());
  env_is_stale_ = false;
}

void Learner::save(const std::string& path, const std::string& note) const {
  write_checkpoint(path, settings_, spaces_, note, saved_);
}

void Learner::load(const std::string& path) {
  std::vector<std::byte> state = read_checkpoint(path, settings_, spaces_);
  std::swap(saved_, state);
  try {
    restore_state(steps_itself());
    check_state();
  } catch (...) {
    std::swap(saved_, state);
    undo();
    throw;
  }
}

}  // namespace mjenv::learn
