// Plans while it plays, with model-predictive path integral control (MPPI). mjenv_rollout plays noisy copies of the
// present plan from the present state; their mean, weighted by their returns, becomes the new plan.
//
//   plan ID STEPS SEED [CSV]        for example: plan Hopper-v5 250 1 hopper.csv
//
// Prints two returns after STEPS steps: that of the planner, and the highest of 1000 players that act at random. A
// player that falls stops earning. Writes a line for each step to CSV: the step, then the returns so far of the planner
// (planned), of the best random player (random_best), and their mean (random_mean).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <mjenv/mjenv.hpp>
#include <random>

namespace {

constexpr std::size_t kSamples = 128;
constexpr std::size_t kPlayers = 1000;
constexpr double kHorizon = 1.25;  // how far a plan looks ahead, s
constexpr double kReplan = 0.04;   // how long a plan is played before it is improved, s
constexpr double kKnot = 0.2;      // time between two knots of the noise, which is interpolated linearly, s
constexpr double kSpread = 1;      // standard deviation of the noisiest sample, in halves of an actuator's range
// The weight of a sample falls to 1/e when its score falls by kGreed times the difference between the best score and
// that of sample number kElite, so samples after number kElite hardly count.
constexpr std::size_t kElite = 16;
constexpr double kGreed = 0.1;
constexpr double kFall = 3;       // subtracted from a sample's score for each step after a fall
constexpr int kFirstRounds = 10;  // rounds of improvement before the first step; later plans take one round

// An environment whose rows were reset with the seeds seed, seed + 1, ...; only a fall ends their episodes.
mjenv::Env make(const std::string& id, std::size_t rows, std::uint64_t seed) {
  mjenv::Env env(mjenv::Options(id).set("num_threads", 0).set("max_episode_steps", 0), static_cast<std::int64_t>(rows));
  mjenv::Batch out = env.batch();
  env.seed(seed);
  env.reset(out);
  return env;
}

// The number of steps that take this long, at least one.
std::size_t steps_in(double seconds, mjenv::Env& env) {
  const double step = env.read(0, "opt.timestep")[0] * static_cast<double>(env.info().frame_skip);
  return static_cast<std::size_t>(std::max(1L, std::lround(seconds / step)));
}

// The results of playing actions [rows][steps][nu]; each array is [rows][steps].
struct Rollout {
  Rollout(std::size_t rows, std::size_t step_count)
      : reward(rows * step_count), fell(rows * step_count), steps(step_count) {}

  void play(mjenv::Env& env, const std::vector<double>& actions) {
    mjenv_batch out = MJENV_BATCH_INIT;
    out.rows = static_cast<std::int64_t>(reward.size());
    out.reward = reward.data();
    out.terminated = fell.data();
    mjenv::check(mjenv_rollout(env.handle(), actions.data(), actions.size(), MJENV_DTYPE_FLOAT64,
                               static_cast<std::int64_t>(steps), &out));
  }

  std::vector<double> reward;      // 0 after a fall
  std::vector<std::uint8_t> fell;  // 1 from a fall on
  const std::size_t steps;
};

class Planner {
 public:
  Planner(const std::string& id, std::uint64_t seed)
      : env_(make(id, kSamples, seed)),
        space_(env_.space(MJENV_ROLE_ACTION)),
        nu_(static_cast<std::size_t>(space_.count)),
        horizon_(steps_in(kHorizon, env_)),
        replan_(steps_in(kReplan, env_)),
        knot_(steps_in(kKnot, env_)),
        random_(seed),
        plan_(horizon_ * nu_),
        tried_(kSamples * plan_.size()),
        outcome_(kSamples, horizon_) {}

  // Plans from the state of a row and returns the actions to play until the next plan: [steps][nu].
  std::vector<double> next(const std::vector<std::byte>& state) {
    for (int round = rounds_; round > 0; --round) improve(state);
    rounds_ = 1;
    const auto rest = plan_.begin() + static_cast<std::ptrdiff_t>(replan_ * nu_);
    const std::vector<double> actions(plan_.begin(), rest);
    const std::vector<double> last(plan_.end() - static_cast<std::ptrdiff_t>(nu_), plan_.end());
    auto end = std::copy(rest, plan_.end(), plan_.begin());
    while (end != plan_.end()) end = std::copy(last.begin(), last.end(), end);
    return actions;
  }

 private:
  void improve(const std::vector<std::byte>& state) {
    env_.restore(state, 0);
    env_.copy_row(std::vector<std::uint8_t>(kSamples, 1), 0);
    for (std::size_t sample = 0; sample < kSamples; ++sample) disturb(sample);
    outcome_.play(env_, tried_);
    average(weights());
  }

  // Sample 0 is the plan itself; the others add noise, from little to much.
  void disturb(std::size_t sample) {
    const double spread = kSpread * static_cast<double>(sample) / (kSamples - 1);
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < nu_; ++i) {
      double from = 0, to = normal(random_);
      for (std::size_t step = 0; step < horizon_; ++step) {
        if (step % knot_ == 0) from = std::exchange(to, normal(random_));
        const double part = static_cast<double>(step % knot_) / static_cast<double>(knot_);
        const double noise = spread * (space_.high[i] - space_.low[i]) / 2 * (from + part * (to - from));
        const std::size_t at = step * nu_ + i;
        tried_[sample * plan_.size() + at] = std::clamp(plan_[at] + noise, space_.low[i], space_.high[i]);
      }
    }
  }

  std::vector<double> weights() const {
    std::vector<double> scores(kSamples);
    for (std::size_t i = 0; i < outcome_.reward.size(); ++i)
      scores[i / horizon_] += outcome_.reward[i] - kFall * outcome_.fell[i];
    std::vector<double> sorted = scores;
    std::sort(sorted.begin(), sorted.end(), std::greater<>());
    const double temperature = kGreed * (sorted[0] - sorted[kElite - 1]) + 1e-9;
    double total = 0;
    for (double& score : scores) total += score = std::exp((score - sorted[0]) / temperature);
    for (double& score : scores) score /= total;
    return scores;
  }

  void average(const std::vector<double>& weights) {
    std::fill(plan_.begin(), plan_.end(), 0.0);
    for (std::size_t i = 0; i < tried_.size(); ++i) plan_[i % plan_.size()] += weights[i / plan_.size()] * tried_[i];
  }

  mjenv::Env env_;  // its rows are the samples
  const mjenv_space space_;
  const std::size_t nu_, horizon_, replan_, knot_;
  std::mt19937_64 random_;
  std::vector<double> plan_, tried_;  // [horizon_][nu_]; the same for each sample
  Rollout outcome_;
  int rounds_ = kFirstRounds;
};

// The return after each step; it no longer changes after a fall.
std::vector<double> planned_returns(const std::string& id, std::size_t steps, std::uint64_t seed) {
  mjenv::Env env = make(id, 1, seed);
  Planner planner(id, seed);
  std::vector<double> returns;
  double total = 0;
  for (bool fell = false; !fell && returns.size() < steps;) {
    const std::vector<double> actions = planner.next(env.snapshot(0));
    Rollout played(1, actions.size() / env.count(MJENV_ROLE_ACTION));
    played.play(env, actions);
    for (const double reward : played.reward) returns.push_back(total += reward);
    fell = played.fell.back();
  }
  returns.resize(steps, total);
  return returns;
}

struct Random {
  std::vector<double> best, mean;  // after each step
};

Random random_returns(const std::string& id, std::size_t steps, std::uint64_t seed) {
  mjenv::Env players = make(id, kPlayers, seed);
  const mjenv_space space = players.space(MJENV_ROLE_ACTION);
  const auto nu = static_cast<std::size_t>(space.count);
  std::mt19937_64 random(seed);
  std::vector<double> actions(kPlayers * steps * nu);
  for (std::size_t i = 0; i < actions.size(); ++i)
    actions[i] = std::uniform_real_distribution<double>(space.low[i % nu], space.high[i % nu])(random);
  Rollout outcome(kPlayers, steps);
  outcome.play(players, actions);

  Random returns;
  std::vector<double> totals(kPlayers);
  double best = -HUGE_VAL;
  for (std::size_t step = 0; step < steps; ++step) {
    double sum = 0;
    for (std::size_t player = 0; player < kPlayers; ++player) {
      totals[player] += outcome.reward[player * steps + step];
      sum += totals[player];
      best = std::max(best, totals[player]);
    }
    returns.best.push_back(best);
    returns.mean.push_back(sum / kPlayers);
  }
  return returns;
}

void run(const std::string& id, std::size_t steps, std::uint64_t seed, const char* csv) {
  const std::vector<double> planned = planned_returns(id, steps, seed);
  const Random random = random_returns(id, steps, seed);
  std::printf("%s %zu steps: planned %.1f, best of %zu random %.1f\n", id.c_str(), steps, planned.back(), kPlayers,
              random.best.back());
  if (!csv) return;
  std::ofstream file(csv);
  file << "step,planned,random_best,random_mean\n";
  for (std::size_t i = 0; i < steps; ++i)
    file << i + 1 << ',' << planned[i] << ',' << random.best[i] << ',' << random.mean[i] << '\n';
  if (!file.flush()) throw std::runtime_error(std::string("cannot write ") + csv);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4 || argc > 5 || std::atoi(argv[2]) < 1 || std::atoi(argv[3]) < 0) {
    std::fprintf(stderr, "usage: %s ID STEPS SEED [CSV]\n", argv[0]);
    return 2;
  }
  try {
    run(argv[1], std::stoul(argv[2]), std::stoul(argv[3]), argc == 5 ? argv[4] : nullptr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
