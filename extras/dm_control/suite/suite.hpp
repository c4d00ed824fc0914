// What the tasks of dm_control's suite have in common, with the bits of dm_control on NumPy without AVX-512.
//
// The suite is a plug-in, so that a program that does not use it does not load it, and so that it uses only what users'
// own tasks can use.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <mjenv/task.hpp>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "models.hpp"

namespace suite {

using namespace mjenv;

constexpr double kPi = 3.14159265358979323846;
constexpr std::int64_t kEpisode = 1000;  // steps, of all tasks but lqr's

// A vector of at most `max` numbers, which needs no memory of the heap.
template <int max>
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max, 1>;
using Eigen::Vector2d, Eigen::Vector3d, Eigen::Vector4d;

// ---- Rewards ----

// How a tolerance falls from 1 at the bounds to value_at_margin at the margin.
enum class Sigmoid { gaussian, linear, quadratic, long_tail };
struct Bounds {
  double lower = 0, upper = 0;
};
struct Margin {
  double width = 0;  // 0: outside of the bounds, the tolerance is 0
  Sigmoid sigmoid = Sigmoid::gaussian;
  double value_at_margin = 0.1;
};

// dm_control raises a number to a power by the C library's pow, and the elements of an array by multiplication.
inline double square(double x) { return np::power2(x); }
inline double square_of_element(double x) { return x * x; }

template <typename Square>
double sigmoid(double x, const Margin& margin, const Square& square_of) {
  const double value = margin.value_at_margin;
  switch (margin.sigmoid) {
    case Sigmoid::gaussian: return std::exp(-0.5 * square_of(x * std::sqrt(-2 * std::log(value))));
    case Sigmoid::linear: {
      const double scaled = x * (1 - value);
      return std::fabs(scaled) < 1 ? 1 - scaled : 0;
    }
    case Sigmoid::quadratic: {
      const double scaled = x * std::sqrt(1 - value);
      return std::fabs(scaled) < 1 ? 1 - square_of(scaled) : 0;
    }
    case Sigmoid::long_tail: return 1 / (square_of(x * std::sqrt(1 / value - 1)) + 1);
  }
  return 0;
}

// dm_control.utils.rewards.tolerance: 1 within the bounds, and less the farther x is from them.
template <typename Square = double (*)(double)>
double tolerance(double x, const Bounds& bounds, const Margin& margin = {}, const Square& square_of = square) {
  if (bounds.lower <= x && x <= bounds.upper) return 1;
  if (margin.width == 0) return 0;
  return sigmoid((x < bounds.lower ? bounds.lower - x : x - bounds.upper) / margin.width, margin, square_of);
}

// tolerance(v, margin).mean()
template <typename V>
double mean_tolerance(const V& v, const Margin& margin) {
  const auto term = [&](Eigen::Index i) { return tolerance(v[i], {}, margin, square_of_element); };
  return np::sum(v.size(), term) / static_cast<double>(v.size());
}

// 1 for motors at rest, and 4 / 5 for motors at full strength.
inline double small_control(const Sim& s) { return (4 + mean_tolerance(s.ctrl(), {1, Sigmoid::quadratic, 0})) / 5; }

// ---- Episodes ----

// Sets how episodes begin and what a step earns: reward(sim) returns a number, or an Outcome.
//
// With the option visualize_reward, the info of a reset has the reward by which dm_control colours the materials until
// the first step. dm_control computes this reward in its base class's initialize_episode, which most resets call at
// their end. A reset that calls it earlier is written as reset(start, random, show), and calls show() there. In most
// resets, MuJoCo has not yet computed anything from the new state at that time.
template <typename Reset, typename Reward>
void episodes(Robot& r, const Reset& reset, const Reward& reward) {
  constexpr bool is_number = std::is_arithmetic_v<decltype(reward(std::declval<const Sim&>()))>;
  const auto outcome = [=](const Sim& s) -> Outcome {
    if constexpr (is_number)
      return {reward(s), false};
    else
      return reward(s);
  };
  const bool colours = r.flag("visualize_reward", false, "put the reward that colours a reset's picture into its info");
  const Carry colour = r.carry(colours ? 1 : 0);
  r.step([=](const Sim& s, Info&) { return outcome(s); });
  r.reset([=](Start& start, RandomState& random) {
    const auto show = [&] {
      if (colours) start[colour][0] = outcome(start.sim()).reward;
    };
    if constexpr (std::is_invocable_v<Reset, Start&, RandomState&, decltype(show)>) {
      reset(start, random, show);
    } else {
      reset(start, random);
      show();
    }
  });
  r.reset_info([=](const Sim& s, Info& info) {
    if (colours) info("visualized_reward", s[colour][0]);
  });
}

// ---- Vectors ----

// v.dot(frame): a vector in the axes of a frame.
template <typename M>
Vector3d in_frame(bool fused, const Vector3d& v, const M& frame) {
  Vector3d local;
  for (int k = 0; k < 3; ++k)
    local[k] = fused ? std::fma(v[2], frame(2, k), std::fma(v[1], frame(1, k), v[0] * frame(0, k)))
                     : v[0] * frame(0, k) + v[1] * frame(1, k) + v[2] * frame(2, k);
  return local;
}
// Rounds as the option "norm" says.
template <typename M>
Vector3d in_frame(const np::Norm& norm, const Vector3d& v, const M& frame) {
  return in_frame(norm.fused(), v, frame);
}

// numpy.log1p of sensors.
template <std::size_t count>
Eigen::Matrix<double, count, 1> log1p(const Sim& s, const std::array<Sensor, count>& sensors) {
  Eigen::Matrix<double, count, 1> signals;
  for (std::size_t i = 0; i < count; ++i) signals[static_cast<Eigen::Index>(i)] = std::log1p(s.sensor(sensors[i])[0]);
  return signals;
}

// v / numpy.linalg.norm(v)
template <typename V>
V normalized(const np::Norm& norm, const V& v) {
  const double length = norm(v);
  V unit = v;
  for (double& x : unit) x /= length;
  return unit;
}

}  // namespace suite
