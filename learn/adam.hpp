#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "kernels/kernels.hpp"

namespace mjenv::learn {

// Adam (Kingma and Ba 2015) with beta1 = 0.9, beta2 = 0.999 and epsilon = 1e-5, after clipping the gradient's norm.
class Adam {
 public:
  explicit Adam(std::size_t size) : first_(size), second_(size) {}

  // Changes the parameters, and returns the gradient's norm before it was clipped. max_norm 0: the gradient is not
  // clipped.
  double step(const Kernels& kernels, double rate, double max_norm, const std::vector<float>& gradient,
              std::vector<float>& parameters) {
    const double norm = std::sqrt(kernels.squares(gradient.data(), gradient.size()));
    power1_ *= kBeta1;
    power2_ *= kBeta2;
    AdamStep step{};
    step.scale = max_norm > 0 && norm > max_norm ? static_cast<float>(max_norm / (norm + 1e-6)) : 1.0F;
    step.rate = static_cast<float>(rate / (1 - power1_));
    step.second_root = static_cast<float>(1 / std::sqrt(1 - power2_));
    step.beta1 = static_cast<float>(kBeta1);
    step.beta2 = static_cast<float>(kBeta2);
    step.epsilon = 1e-5F;
    kernels.adam(step, gradient.data(), first_.data(), second_.data(), parameters.data(), parameters.size());
    return norm;
  }

  template <typename Archive>
  void archive(Archive& a) {
    a(first_);
    a(second_);
    a(power1_);
    a(power2_);
  }

 private:
  static constexpr double kBeta1 = 0.9, kBeta2 = 0.999;
  std::vector<float> first_, second_;  // the running first and second moments of the gradient
  double power1_ = 1, power2_ = 1;     // beta1^t and beta2^t
};

}  // namespace mjenv::learn
