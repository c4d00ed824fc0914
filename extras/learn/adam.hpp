#pragma once

#include <cmath>
#include <cstddef>
#include <functional>
#include <vector>

#include "archive.hpp"
#include "kernels/kernels.hpp"
#include "system/pool.hpp"

namespace mjenv::learn {

// Adam (Kingma and Ba 2015) with beta1 = 0.9, beta2 = 0.999 and epsilon = 1e-5, after clipping the gradient's norm.
class Adam {
 public:
  explicit Adam(std::size_t size) : first_(size), second_(size) {}

  // Changes the parameters, and returns the gradient's norm before it was clipped. max_norm 0: the gradient is not
  // clipped. Each thread of the pool changes one share of the parameters. With two threads and networks of equal sizes,
  // this is nearly the share whose gradient the thread has computed, so it is in the cache of the thread's CPU.
  double step(const Kernels& kernels, core::Pool& pool, double rate, double max_norm,
              const std::vector<float>& gradient, std::vector<float>& parameters) {
    power1_ *= kBeta1;
    power2_ *= kBeta2;
    AdamStep step{};
    step.rate = static_cast<float>(rate / (1 - power1_));
    step.second_root = static_cast<float>(1 / std::sqrt(1 - power2_));
    step.beta1 = static_cast<float>(kBeta1);
    step.beta2 = static_cast<float>(kBeta2);
    step.epsilon = 1e-5F;
    SumOfSquares squares;
    const auto job = [&](int worker) {
      const auto blocks = parameters.size() / kLaneBlock, threads = static_cast<std::size_t>(pool.threads());
      const auto start = [&](std::size_t share) { return blocks * share / threads * kLaneBlock; };
      const std::size_t at = start(static_cast<std::size_t>(worker));
      const std::size_t count = start(static_cast<std::size_t>(worker) + 1) - at;
      pool.take_turns(worker, [&] { squares.add(kernels, gradient.data() + at, count); });
      const double norm = std::sqrt(squares.total());
      AdamStep mine = step;
      mine.scale = max_norm > 0 && norm > max_norm ? static_cast<float>(max_norm / (norm + 1e-6)) : 1.0F;
      kernels.adam(mine, gradient.data() + at, first_.data() + at, second_.data() + at, parameters.data() + at, count);
    };
    pool.run(std::cref(job));
    return std::sqrt(squares.total());
  }

  template <typename Archive>
  void archive(Archive& a) {
    a(first_, kFinite);
    a(second_, {0, __builtin_inf()});  // the square of a finite number can be infinite
    a(power1_, {0, 1});
    a(power2_, {0, 1});
  }
  const std::vector<float>& first() const { return first_; }
  const std::vector<float>& second() const { return second_; }

 private:
  static constexpr double kBeta1 = 0.9, kBeta2 = 0.999;
  std::vector<float> first_, second_;  // the running first and second moments of the gradient
  double power1_ = 1, power2_ = 1;     // beta1^t and beta2^t
};

}  // namespace mjenv::learn
