// The loss of PPO and its gradient.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "agent.hpp"
#include "kernels/kernels.hpp"
#include "network.hpp"
#include "rollout.hpp"
#include "system/pool.hpp"

namespace mjenv::learn {

constexpr double kHalfLogTwoPi = 0.918938533204672742;

// The steps of a rollout from which one gradient is computed.
struct Minibatch {
  const std::int32_t* steps;  // [count] indices into the rollout
  int count;
  float mean = 0, inverse_std = 1;  // advantages are normalised as (advantage - mean) * inverse_std

  // normalize: whether the advantages get mean 0 and variance 1.
  Minibatch(const std::int32_t* first, int number, const Rollout& rollout, bool normalize);
};

// Sums over the steps of a minibatch.
struct LossTerms {
  double policy = 0, value = 0, kl = 0, clipped = 0;

  void add(const LossTerms& other);
};

class Loss {
 public:
  Loss(const Agent& agent, const Kernels& kernels, core::Pool& pool);

  // Computes the gradient of -(clipped objective) + value_coef (value - return)^2 - entropy_coef entropy, averaged over
  // the minibatch. The threads of the pool share the work.
  LossTerms differentiate(const std::vector<float>& parameters, const Rollout& rollout, const Minibatch& batch,
                          const mjenv_learn_settings& settings);

  // The derivatives with respect to the parameters, in their order.
  const std::vector<float>& gradient() const { return parts_.front()->gradient; }

 private:
  // Memory for the gradient of one part of a minibatch. The parts are added in order, so that the number of threads
  // does not change any bit.
  struct Part {
    explicit Part(const Agent& agent);

    Network::Pass actor, critic;
    std::vector<float> inputs, ratios;  // those of a chunk
    std::vector<float> gradient;
    LossTerms terms;
  };
  // The arguments of differentiate.
  struct Task {
    const float* parameters;
    const Rollout& rollout;
    const Minibatch& batch;
    const mjenv_learn_settings& settings;
  };

  const Agent& agent_;
  const Kernels& kernels_;
  core::Pool& pool_;
  std::vector<std::unique_ptr<Part>> parts_;
  std::vector<float> actor_transposed_, critic_transposed_;
  Deviations deviations_;

  void differentiate_part(const Task& task, int index, int parts, Part& part);
  void add_chunk(const Task& task, int from, int count, bool adds, Part& part);
  void add_policy_gradient(const Task& task, const std::int32_t* steps, int count, const float* mean, Part& part);
  void add_value_gradient(const Task& task, const std::int32_t* steps, int count, const float* value, Part& part);
};

}  // namespace mjenv::learn
