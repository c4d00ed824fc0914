// What the learner is made of: gradients against PyTorch and finite differences, Adam, advantages and normalisation against
// their formulas in float64, and functions that give the same bits in every instruction set.
//   test_learn_parts [bits]    bits: writes the kernels' results to stdout, to be compared with those of another CPU
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <functional>
#include <map>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "adam.hpp"
#include "agent.hpp"
#include "loss.hpp"
#include "normalizer.hpp"
#include "random.hpp"
#include "rollout.hpp"
#include "system/pool.hpp"

// Last: it defines a macro `fail`, and does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

namespace {

using namespace mjenv::learn;

using Doubles = std::vector<double>;

// Fails unless the two numbers agree to `tolerance`, relative to the greater one of `want` and `unit`.
void check_near(const std::string& what, double got, double want, double tolerance, double unit = 0) {
  if (std::fabs(got - want) <= tolerance * std::max(std::fabs(want), unit)) return;
  fail_msg("%s is %.17g, not %.17g", what.c_str(), got, want);
}

std::vector<float> randoms(std::size_t count, double std, Random& random) {
  std::vector<float> values(count);
  for (float& value : values) value = static_cast<float>(std * random.normal());
  return values;
}

// ---- Kernels ----

void check_same_bits(const char* what, const std::vector<float>& got, const std::vector<float>& want) {
  assert_int_equal(got.size(), want.size());
  for (std::size_t i = 0; i < got.size(); ++i)
    if (std::memcmp(&got[i], &want[i], sizeof got[i]) != 0)
      fail_msg("%s: element %zu is %.9g, not %.9g", what, i, static_cast<double>(got[i]), static_cast<double>(want[i]));
}

// What every kernel writes for the same inputs, of sizes with and without whole tiles.
std::vector<float> outputs_of(const Kernels& kernels) {
  std::vector<float> all;
  const auto keep = [&](const std::vector<float>& values) { all.insert(all.end(), values.begin(), values.end()); };
  for (const int outputs : {16, 32, 48, 64, 80, 112}) {
    for (const int inputs : {4, 12, 36}) {
      constexpr int kRows = 24;
      Random random(static_cast<std::uint64_t>(outputs * 100 + inputs));
      const auto count = [](int a, int b) { return static_cast<std::size_t>(a) * static_cast<std::size_t>(b); };
      const auto x = randoms(count(kRows, inputs), 1, random), w = randoms(count(inputs, outputs), 1, random);
      const auto bias = randoms(static_cast<std::size_t>(outputs), 1, random);
      std::vector<float> y(count(kRows, outputs)), z = y, g = w, h = bias;
      kernels.product(x.data(), inputs, kRows, inputs, w.data(), outputs, bias.data(), y.data());
      keep(y);
      for (const bool adds : {true, false}) {
        kernels.gradient(x.data(), inputs, kRows, inputs, y.data(), outputs, adds, g.data());
        kernels.sum_rows(y.data(), kRows, outputs, adds, h.data());
        keep(g);
        keep(h);
      }
      kernels.dots(y.data(), kRows, outputs, w.data(), std::min(inputs, outputs), bias.data(), outputs, z.data());
      keep(z);
      kernels.product(x.data(), inputs, kRows, inputs, w.data(), outputs, nullptr, y.data());
      keep(y);
      for (const Activation activation : {Activation::kTanh, Activation::kRelu, Activation::kElu}) {
        auto d = y;
        z = y;
        kernels.activate(activation, z.data(), z.size());
        kernels.derive(activation, z.data(), d.data(), d.size());
        keep(z);
        keep(d);
      }
      SumOfSquares squares;
      squares.add(kernels, y.data(), y.size());
      all.push_back(static_cast<float>(squares.total()));
      auto m = randoms(y.size(), 0.1, random), v = y, p = y, sum = y;
      for (float& value : v) value *= value;
      kernels.adam({0.7F, 1e-3F, 1.5F, 0.9F, 0.999F, 1e-5F}, y.data(), m.data(), v.data(), p.data(), p.size());
      keep(m);
      keep(v);
      keep(p);
      kernels.add(y.data(), sum.data(), sum.size());
      keep(sum);
      kernels.exp(y.data(), y.size());
      keep(y);
    }
  }
  return all;
}

void test_instruction_sets(void**) {
  const auto usable = usable_kernels();
  const auto want = outputs_of(*usable.front());
  for (const Kernels* kernels : usable) check_same_bits(kernels->name, outputs_of(*kernels), want);
  std::string names;
  for (const Kernels* kernels : usable) names += std::string(" ") + kernels->name;
  print_message("equal:%s\n", names.c_str());
}

// Units in the last place of a float32 at `want`.
double ulps(float got, double want) {
  const int exponent = std::max(std::ilogb(want == 0 ? 1e-300 : want), -126);
  return std::fabs(got - want) / std::ldexp(1.0, exponent - 23);
}

void check_function(const char* name, double low, double high, double most,
                    const std::function<void(std::vector<float>&)>& ours, const std::function<double(double)>& theirs) {
  constexpr std::size_t kCount = 1 << 18;
  std::vector<float> x(kCount);
  for (std::size_t i = 0; i < kCount; ++i)
    x[i] = static_cast<float>(low + (high - low) * static_cast<double>(i) / kCount);
  auto y = x;
  ours(y);
  double worst = 0;
  for (std::size_t i = 0; i < kCount; ++i) worst = std::max(worst, ulps(y[i], theirs(x[i])));
  print_message("%s: at most %.2f units in the last place\n", name, worst);
  if (!(worst <= most)) fail_msg("%s is wrong by %g units in the last place", name, worst);
}

void test_functions(void**) {
  const Kernels& kernels = *usable_kernels().back();
  const auto by = [&](Activation activation) {
    return [&kernels, activation](std::vector<float>& x) { kernels.activate(activation, x.data(), x.size()); };
  };
  for (const double range : {1e-6, 1e-3, 1.0, 20.0})
    check_function("tanh", -range, range, 3, by(Activation::kTanh), [](double x) { return std::tanh(x); });
  for (const double range : {1e-6, 1e-3, 1.0, 80.0})
    check_function("elu", -range, range, 1.5, by(Activation::kElu), [](double x) { return x > 0 ? x : std::expm1(x); });
  check_function(
      "exp", -87, 88, 1.5, [&](std::vector<float>& x) { kernels.exp(x.data(), x.size()); },
      [](double x) { return std::exp(x); });
  std::vector<float> far(kLaneBlock, -1e30F);
  far[1] = 1e30F;
  kernels.activate(Activation::kTanh, far.data(), far.size());
  assert_true(far[0] == -1 && far[1] == 1);
  Random random(1);
  for (int i = 0; i < 10000; ++i) {
    const double x = std::exp(100 * (random.uniform() - 0.5));
    check_near("log", natural_log(x), std::log(x), 4e-16, 1);
  }
}

// The first four moments of a million standard normal numbers are within five standard errors of 0, 1, 0 and 3.
void test_random(void**) {
  constexpr int kCount = 1'000'000;
  Random random(7);
  Doubles sums(5);
  for (int i = 0; i < kCount; ++i) {
    double power = 1;
    const double x = random.normal();
    for (double& sum : sums) {
      sum += power;
      power *= x;
    }
  }
  const Doubles want = {1, 0, 1, 0, 3}, variance = {0, 1, 2, 15, 96};  // of x^k: E x^2k - (E x^k)^2
  for (std::size_t k = 1; k < sums.size(); ++k)
    if (std::fabs(sums[k] / kCount - want[k]) > 5 * std::sqrt(variance[k] / kCount))
      fail_msg("moment %zu is %g", k, sums[k] / kCount);
  std::vector<int> counts(10);
  for (int i = 0; i < kCount; ++i) ++counts[random.below(10)];
  for (const int count : counts) assert_in_range(count, 98500, 101500);
}

// ---- Gradients ----

// A loss to differentiate: a network, steps that were played, and the settings.
struct Problem {
  Problem(const Settings& given, std::size_t observations, std::size_t actuators, std::size_t count)
      : settings(given),
        spaces(space(observations, zeros), space(actuators, bounds)),
        agent(settings, spaces),
        rollout(count, 1, agent.stride(), actuators, kRowBlock),
        parameters(agent.size),
        order(count) {
    std::iota(order.begin(), order.end(), 0);
  }

  static mjenv_space space(std::size_t count, Doubles& bound) {
    bound.assign(count, 1.0);
    mjenv_space made = MJENV_SPACE_INIT;
    made.count = static_cast<std::int64_t>(count);
    made.low = made.high = bound.data();
    return made;
  }

  Doubles zeros, bounds;
  Settings settings;
  Spaces spaces;
  Agent agent;
  Rollout rollout;
  std::vector<float> parameters;
  std::vector<std::int32_t> order;

  // The gradient, by `threads` threads.
  std::vector<float> gradient(const Kernels& kernels, int threads, LossTerms& terms) {
    mjenv::core::Pool pool(threads, false);
    Loss loss(agent, kernels, pool);
    const Minibatch batch(order.data(), static_cast<int>(order.size()), rollout, settings.normalize_advantage);
    terms = loss.differentiate(parameters, rollout, batch, settings);
    return loss.gradient();
  }
};

// A case of gradients.txt: its numbers by the names of the lines, in order.
struct Recorded {
  std::string activation;
  double clip = 0, value_clip = 0, value_coef = 0, entropy_coef = 0;
  std::map<std::string, std::vector<Doubles>> numbers;
};

std::vector<Recorded> read_recorded() {
  std::ifstream file(PROJECT_FOLDER "/extras/learn/tests/gradients.txt");
  std::vector<Recorded> cases;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name;
    words >> name;
    if (name == "case") {
      Recorded& one = cases.emplace_back();
      words >> one.activation >> one.clip >> one.value_clip >> one.value_coef >> one.entropy_coef;
      continue;
    }
    Doubles values;
    for (double value = 0; words >> value;) values.push_back(value);
    cases.back().numbers[name].push_back(values);
  }
  return cases;
}

// Calls use(index of the parameter, PyTorch's number) for each weight and bias. PyTorch's weights are [outputs][inputs].
template <typename Use>
void for_each_parameter(const Network& network, std::size_t at, const std::vector<Doubles>& theirs, const Use& use) {
  assert_int_equal(theirs.size(), 2 * network.layers().size());
  for (std::size_t l = 0; l < network.layers().size(); ++l) {
    const Layer& layer = network.layers()[l];
    const auto inputs = static_cast<std::size_t>(layer.inputs), outputs = static_cast<std::size_t>(layer.outputs);
    assert_int_equal(theirs[2 * l].size(), inputs * outputs);
    for (std::size_t o = 0; o < outputs; ++o) {
      for (std::size_t i = 0; i < inputs; ++i)
        use(at + layer.weight(static_cast<int>(i), static_cast<int>(o)), theirs[2 * l][o * inputs + i]);
      use(at + layer.bias + o, theirs[2 * l + 1][o]);
    }
  }
}

Problem problem_of(Recorded& recorded) {
  const auto numbers = [&](const char* name) { return recorded.numbers[name].at(0); };
  Settings s;
  s.activation = recorded.activation;
  s.clip = recorded.clip;
  s.value_clip = recorded.value_clip;
  s.value_coef = recorded.value_coef;
  s.entropy_coef = recorded.entropy_coef;
  const Doubles widths = numbers("hidden");
  s.hidden.assign(widths.begin(), widths.end());
  const std::size_t count = numbers("advantages").size(), actuators = numbers("log_std").size();
  const std::size_t observations = numbers("observations").size() / count;
  Problem problem(s, observations, actuators, count);
  const auto fill = [](std::vector<float>& to, const Doubles& from) {
    assert_true(to.size() >= from.size());
    for (std::size_t i = 0; i < from.size(); ++i) to[i] = static_cast<float>(from[i]);
  };
  Rollout& rollout = problem.rollout;
  const Doubles observed = numbers("observations");
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < observations; ++j)
      rollout.inputs[i * problem.agent.stride() + j] = static_cast<float>(observed[i * observations + j]);
  fill(rollout.actions, numbers("actions"));
  fill(rollout.log_probabilities, numbers("log_probabilities"));
  fill(rollout.advantages, numbers("advantages"));
  fill(rollout.returns, numbers("returns"));
  fill(rollout.values, numbers("values"));
  const auto set = [&](std::size_t index, double value) { problem.parameters[index] = static_cast<float>(value); };
  for_each_parameter(problem.agent.actor, 0, recorded.numbers["actor"], set);
  for_each_parameter(problem.agent.critic, problem.agent.critic_at, recorded.numbers["critic"], set);
  for (std::size_t j = 0; j < actuators; ++j) set(problem.agent.log_std_at + j, numbers("log_std")[j]);
  return problem;
}

void test_gradients_of_pytorch(void**) {
  auto cases = read_recorded();
  assert_int_equal(cases.size(), 4);
  for (Recorded& recorded : cases) {
    Problem problem = problem_of(recorded);
    LossTerms terms;
    const auto ours = problem.gradient(*usable_kernels().back(), 1, terms);
    const auto count = static_cast<double>(problem.order.size());
    check_near("the policy's loss", terms.policy / count, recorded.numbers["policy_loss"].at(0).at(0), 1e-5, 0.1);
    check_near("the value's loss", terms.value / count, recorded.numbers["value_loss"].at(0).at(0), 1e-5);
    assert_true(terms.clipped > 0);
    double greatest = 0;
    std::size_t compared = 0;
    const auto measure = [&](std::size_t, double value) { greatest = std::max(greatest, std::fabs(value)); };
    const auto check = [&](std::size_t index, double value) {
      check_near("gradient " + std::to_string(index), ours[index], value, 1e-6, greatest);
      ++compared;
    };
    for (const bool first : {true, false}) {
      const auto each = [&](std::size_t index, double value) { first ? measure(index, value) : check(index, value); };
      for_each_parameter(problem.agent.actor, 0, recorded.numbers["actor_gradient"], each);
      for_each_parameter(problem.agent.critic, problem.agent.critic_at, recorded.numbers["critic_gradient"], each);
      for (std::size_t j = 0; j < problem.agent.actuators; ++j)
        each(problem.agent.log_std_at + j, recorded.numbers["log_std_gradient"].at(0).at(j));
    }
    print_message("%s: %zu derivatives are PyTorch's\n", recorded.activation.c_str(), compared);
  }
}

// The outputs of a network in float64.
Doubles evaluate(const Network& network, Activation activation, const double* parameters, const float* x) {
  Doubles values(x, x + network.layers().front().inputs);
  for (const Layer& layer : network.layers()) {
    Doubles next(static_cast<std::size_t>(layer.outputs));
    for (std::size_t o = 0; o < next.size(); ++o) {
      double sum = parameters[layer.bias + o];
      for (std::size_t i = 0; i < values.size(); ++i)
        sum += values[i] * parameters[layer.weight(static_cast<int>(i), static_cast<int>(o))];
      if (&layer != &network.layers().back())
        sum = activation == Activation::kTanh   ? std::tanh(sum)
              : activation == Activation::kRelu ? std::max(sum, 0.0)
              : sum > 0                         ? sum
                                                : std::expm1(sum);
      next[o] = sum;
    }
    values = next;
  }
  return values;
}

// The loss in float64. The advantages are not normalised.
double loss_of(const Problem& problem, const Doubles& parameters) {
  const Settings& s = problem.settings;
  const Activation activation = activation_named(s.activation);
  const Rollout& rollout = problem.rollout;
  double total = 0;
  for (std::size_t i = 0; i < problem.order.size(); ++i) {
    const float* x = &rollout.inputs[i * problem.agent.stride()];
    const Doubles mean = evaluate(problem.agent.actor, activation, parameters.data(), x);
    const double value = evaluate(problem.agent.critic, activation, &parameters[problem.agent.critic_at], x)[0];
    double log_ratio = -rollout.log_probabilities[i];
    for (std::size_t j = 0; j < mean.size(); ++j) {
      const double log_std = parameters[problem.agent.log_std_at + j];
      const double z = (rollout.actions[i * mean.size() + j] - mean[j]) / std::exp(log_std);
      log_ratio -= 0.5 * z * z + log_std + kHalfLogTwoPi;
      total -= s.entropy_coef * (log_std + 0.5 + kHalfLogTwoPi);
    }
    const double ratio = std::exp(log_ratio), advantage = rollout.advantages[i];
    total -= std::min(ratio * advantage, std::min(1 + s.clip, std::max(1 - s.clip, ratio)) * advantage);
    total += s.value_coef * (value - rollout.returns[i]) * (value - rollout.returns[i]);
  }
  return total / static_cast<double>(problem.order.size());
}

void test_finite_differences(void**) {
  constexpr std::size_t kObservations = 7, kActuators = 2, kCount = 150;
  const Integers seen = {1, 0, 1, 1, 0, 1, 1};
  for (const char* activation : {"tanh", "elu"}) {
    Settings s("differences", "hidden=9,20 entropy_coef=0.03 normalize_advantage=false actor_obs=1,0,1,1,0,1,1");
    s.activation = activation;
    Problem problem(s, kObservations, kActuators, kCount);
    Random random(3);
    problem.parameters = problem.agent.initial_parameters(0.7, random);
    Rollout& rollout = problem.rollout;
    for (std::size_t i = 0; i < kCount; ++i)
      for (std::size_t j = 0; j < kObservations; ++j)
        rollout.inputs[i * problem.agent.stride() + j] = static_cast<float>(random.normal());
    rollout.actions = randoms(rollout.actions.size(), 0.7, random);
    rollout.advantages = randoms(kCount, 1, random);
    rollout.returns = randoms(kCount, 1, random);
    for (std::size_t i = 0; i < kCount; ++i) {  // ratios near 1, but for the bounds where the loss has kinks
      double log_probability = 0;
      for (std::size_t j = 0; j < kActuators; ++j) {
        const double z = rollout.actions[i * kActuators + j] / 0.7;
        log_probability -= 0.5 * z * z + std::log(0.7) + kHalfLogTwoPi;
      }
      rollout.log_probabilities[i] = static_cast<float>(log_probability + (i % 3 == 0 ? 0.5 : 0.05));
    }
    LossTerms terms;
    const auto ours = problem.gradient(*usable_kernels().back(), 1, terms);
    Doubles parameters(problem.parameters.begin(), problem.parameters.end());
    std::size_t moved = 0;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      constexpr double kStep = 1e-6;
      const double before = parameters[i];
      parameters[i] = before + kStep;
      const double above = loss_of(problem, parameters);
      parameters[i] = before - kStep;
      const double below = loss_of(problem, parameters);
      parameters[i] = before;
      double want = (above - below) / (2 * kStep);
      const Layer& first = problem.agent.actor.layers().front();
      const std::size_t row = i / static_cast<std::size_t>(first.padded_outputs);
      if (i < first.bias && row < kObservations &&
          seen[row] == 0) {  // what the actor does not see stays without effect
        assert_true(ours[i] == 0 && problem.parameters[i] == 0);
        continue;
      }
      if (problem.parameters[i] == 0 && ours[i] == 0) want = 0;  // padding
      check_near("derivative " + std::to_string(i), ours[i], want, 2e-5, 0.5);
      moved += ours[i] != 0;
    }
    assert_in_range(moved, 400, parameters.size());
  }
}

void test_gradients_of_threads_and_instruction_sets(void**) {
  const Settings s("threads", "hidden=64,33");
  for (const std::size_t count : {63, 64, 65, 700}) {
    Problem problem(s, 13, 5, count);
    Random random(5);
    problem.parameters = problem.agent.initial_parameters(1, random);
    for (auto* values : {&problem.rollout.inputs, &problem.rollout.actions, &problem.rollout.log_probabilities,
                         &problem.rollout.advantages, &problem.rollout.returns})
      *values = randoms(values->size(), 1, random);
    LossTerms first;
    const auto want = problem.gradient(*usable_kernels().front(), 1, first);
    for (const Kernels* kernels : usable_kernels())
      for (const int threads : {1, 2, 3, 8}) {
        LossTerms terms;
        check_same_bits(kernels->name, problem.gradient(*kernels, threads, terms), want);
        assert_memory_equal(&terms, &first, sizeof terms);
      }
  }
}

// ---- Formulas ----

void test_adam(void**) {
  constexpr std::size_t kSize = 64;
  constexpr double kRate = 1e-3, kMaxNorm = 2;
  Random random(11);
  mjenv::core::Pool pool(1, false);
  Adam adam(kSize);
  std::vector<float> parameters = randoms(kSize, 1, random);
  Doubles p(parameters.begin(), parameters.end()), m(kSize), v(kSize);
  for (int t = 1; t <= 300; ++t) {
    const auto gradient = randoms(kSize, t % 2 == 0 ? 1 : 0.1, random);
    double squares = 0;
    for (const double g : gradient) squares += g * g;
    const double norm = std::sqrt(squares), scale = std::min(1.0, kMaxNorm / (norm + 1e-6));
    for (std::size_t i = 0; i < kSize; ++i) {
      const double g = gradient[i] * scale;
      m[i] = 0.9 * m[i] + 0.1 * g;
      v[i] = 0.999 * v[i] + 0.001 * g * g;
      p[i] -= kRate * (m[i] / (1 - std::pow(0.9, t))) / (std::sqrt(v[i] / (1 - std::pow(0.999, t))) + 1e-5);
    }
    check_near("the norm", adam.step(*usable_kernels().back(), pool, kRate, kMaxNorm, gradient, parameters), norm,
               1e-6);
  }
  for (std::size_t i = 0; i < kSize; ++i) check_near("parameter " + std::to_string(i), parameters[i], p[i], 2e-5, 0.3);
}

// Also with more threads than blocks of parameters, some of which have nothing to do.
void test_adam_of_threads(void**) {
  constexpr std::size_t kSize = 5 * kLaneBlock;
  const auto run = [&](const Kernels& kernels, int threads) {
    Random random(29);
    mjenv::core::Pool pool(threads, false);
    Adam adam(kSize);
    std::vector<float> numbers = randoms(kSize, 1, random), parameters = numbers;
    for (int t = 0; t < 200; ++t)
      numbers.push_back(static_cast<float>(adam.step(kernels, pool, 1e-3, 2, randoms(kSize, 1, random), parameters)));
    numbers.insert(numbers.end(), parameters.begin(), parameters.end());
    return numbers;
  };
  const auto want = run(*usable_kernels().front(), 1);
  for (const Kernels* kernels : usable_kernels())
    for (const int threads : {1, 2, 3, 8}) check_same_bits(kernels->name, run(*kernels, threads), want);
}

// ---- Threads ----

// Each worker takes its turn after the one before it, and no thread goes on before the turns of all are over.
void test_turns(void**) {
  constexpr int kRounds = 500;
  for (const int threads : {1, 2, 3, 8}) {
    mjenv::core::Pool pool(threads, false);
    std::vector<int> order;  // without a lock, because the turns exclude each other
    bool complete = true;
    std::vector<int> seen(static_cast<std::size_t>(threads));
    const auto job = [&](int worker) {
      for (int round = 0; round < kRounds; ++round) {
        pool.take_turns(worker, [&] { order.push_back(worker); });
        seen[static_cast<std::size_t>(worker)] = static_cast<int>(order.size());
        pool.meet();
        if (worker == 0)
          for (const int size : seen) complete = complete && size == (round + 1) * threads;
        pool.meet();
      }
    };
    for (int runs = 0; runs < 2; ++runs, order.clear()) {
      pool.run(job);
      assert_int_equal(order.size(), kRounds * threads);
      for (std::size_t i = 0; i < order.size(); ++i) assert_int_equal(order[i], i % static_cast<std::size_t>(threads));
      assert_true(complete);
    }
  }
}

void test_advantages(void**) {
  constexpr std::size_t kSteps = 40, kRows = 3;
  constexpr double kGamma = 0.97, kLambda = 0.9;
  Random random(13);
  Rollout rollout(kSteps, kRows, 4, 1, kRowBlock);
  rollout.rewards = randoms(kSteps * kRows, 1, random);
  rollout.values = randoms((kSteps + 1) * kRows, 1, random);
  for (float& going : rollout.continues) going = random.uniform() < 0.9 ? 1.0F : 0.0F;
  rollout.estimate_advantages(kGamma, kLambda);
  for (std::size_t row = 0; row < kRows; ++row)
    for (std::size_t t = 0; t < kSteps; ++t) {  // the sum of the discounted errors until the episode ends
      double sum = 0, factor = 1;
      for (std::size_t k = t; k < kSteps; ++k) {
        const std::size_t at = k * kRows + row;
        const double going = rollout.continues[at];
        sum += factor * (rollout.rewards[at] + kGamma * going * rollout.values[at + kRows] - rollout.values[at]);
        if (going == 0) break;
        factor *= kGamma * kLambda;
      }
      check_near("an advantage", rollout.advantages[t * kRows + row], sum, 1e-5, 1);
      check_near("a return", rollout.returns[t * kRows + row], sum + rollout.values[t * kRows + row], 1e-5, 1);
    }
}

void test_normalisation(void**) {
  constexpr std::size_t kSize = 3, kRows = 5;
  constexpr double kPrior = 1e-4;  // the weight of the mean 0 and variance 1 before any data
  Random random(17);
  ObservationNormalizer normalizer(kSize, 4, true, 2);
  Doubles all;
  for (int batch = 0; batch < 50; ++batch) {
    Doubles data(kRows * kSize);
    for (std::size_t i = 0; i < data.size(); ++i)
      data[i] = 100.0 * static_cast<double>(i % kSize) + 3 * random.normal() + batch;
    normalizer.add(data.data(), kRows);
    all.insert(all.end(), data.begin(), data.end());
  }
  const auto count = static_cast<double>(all.size() / kSize);
  std::vector<float> got(kRows * 4);
  normalizer.normalize(all.data(), kRows, got.data());
  for (std::size_t j = 0; j < kSize; ++j) {
    double sum = 0, squares = 0;
    for (std::size_t i = j; i < all.size(); i += kSize) sum += all[i];
    const double mean = sum / (count + kPrior);
    for (std::size_t i = j; i < all.size(); i += kSize) squares += (all[i] - mean) * (all[i] - mean);
    const double variance = (squares + kPrior * (1 + mean * mean)) / (count + kPrior);
    check_near("a mean", normalizer.moments().mean()[j], mean, 1e-12);
    check_near("a scale", normalizer.moments().scale(j), std::sqrt(variance + 1e-8), 1e-12);
    for (std::size_t i = 0; i < kRows; ++i) {
      const double want = (all[i * kSize + j] - mean) / std::sqrt(variance + 1e-8);
      check_near("an input", got[i * 4 + j], std::min(2.0, std::max(-2.0, want)), 1e-6, 1);
    }
  }
}

// Rewards are divided by the standard deviation of the discounted returns so far.
void test_rewards(void**) {
  constexpr double kGamma = 0.9;
  Random random(19);
  RewardNormalizer normalizer(2);
  Doubles returns(2), seen;
  for (int step = 0; step < 60; ++step) {
    const double rewards[] = {random.normal(), 5 * random.normal()};
    const std::vector<unsigned char> ended = {static_cast<unsigned char>(step % 7 == 0), 0};
    std::vector<float> got(2);
    normalizer.add(rewards, ended, kGamma, 4, true, got.data());
    for (std::size_t i = 0; i < 2; ++i) seen.push_back(returns[i] = returns[i] * kGamma + rewards[i]);
    double mean = 0, squares = 0;
    for (const double x : seen) mean += x;
    const double count = static_cast<double>(seen.size()) + 1e-4;
    mean /= count;
    for (const double x : seen) squares += (x - mean) * (x - mean);
    const double scale = std::sqrt((squares + 1e-4 * (1 + mean * mean)) / count + 1e-8);
    for (std::size_t i = 0; i < 2; ++i) {
      check_near("a reward", got[i], std::min(4.0, std::max(-4.0, rewards[i] / scale)), 1e-6, 1);
      if (ended[i] != 0) returns[i] = 0;
    }
  }
}

void test_orthogonal(void**) {
  const Network network(30, {64, 20}, 3, Activation::kTanh, {});
  Random random(23);
  std::vector<float> parameters(network.size());
  network.initialize(parameters.data(), 0.01, random);
  for (const Layer& layer : network.layers()) {
    const bool by_inputs = layer.inputs < layer.outputs;
    const double gain = layer.last ? 0.01 : std::sqrt(2.0);
    const int count = by_inputs ? layer.inputs : layer.outputs, length = by_inputs ? layer.outputs : layer.inputs;
    const auto at = [&](int vector, int element) {
      const int input = by_inputs ? vector : element, output = by_inputs ? element : vector;
      return static_cast<double>(parameters[layer.weight(input, output)]);
    };
    for (int a = 0; a < count; ++a)
      for (int b = 0; b <= a; ++b) {
        double dot = 0;
        for (int k = 0; k < length; ++k) dot += at(a, k) * at(b, k);
        check_near("a product of weights", dot, a == b ? gain * gain : 0, 1e-6, gain * gain);
      }
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count == 2 && std::string(arguments[1]) == "bits") {
    const auto all = outputs_of(*usable_kernels().back());
    return std::fwrite(all.data(), sizeof all[0], all.size(), stdout) == all.size() && !all.empty() ? 0 : 1;
  }
  const CMUnitTest tests[] = {
      cmocka_unit_test(test_instruction_sets),
      cmocka_unit_test(test_functions),
      cmocka_unit_test(test_random),
      cmocka_unit_test(test_gradients_of_pytorch),
      cmocka_unit_test(test_finite_differences),
      cmocka_unit_test(test_gradients_of_threads_and_instruction_sets),
      cmocka_unit_test(test_adam),
      cmocka_unit_test(test_adam_of_threads),
      cmocka_unit_test(test_turns),
      cmocka_unit_test(test_advantages),
      cmocka_unit_test(test_normalisation),
      cmocka_unit_test(test_rewards),
      cmocka_unit_test(test_orthogonal),
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
