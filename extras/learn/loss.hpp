// The loss of PPO and its gradient.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "agent.hpp"
#include "kernels/kernels.hpp"
#include "network.hpp"
#include "rollout.hpp"
#include "settings.hpp"
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
                          const Settings& settings);

  // The derivatives with respect to the parameters, in their order.
  const std::vector<float>& gradient() const { return parts_.front().gradient; }

 private:
  // One of the two networks, and the offset of its parameters.
  struct Side {
    const Network& network;
    std::size_t at;
    std::vector<float> transposed;
  };
  // Memory for the gradient of one part of a minibatch, and for the terms of each side. The parts are added in order, so
  // that the number of threads does not change any bit.
  struct Part {
    std::vector<float> gradient;
    std::array<LossTerms, 2> terms;
  };
  // Memory of one thread for the steps that it evaluates together (kChunk).
  struct Scratch {
    explicit Scratch(const Agent& agent);

    std::array<Network::Pass, 2> passes;
    std::vector<float> inputs, ratios;
  };
  // The arguments of differentiate.
  struct Task {
    const float* parameters;
    const Rollout& rollout;
    const Minibatch& batch;
    const Settings& settings;
    int parts;
  };
  // What one thread computes at a time: the gradient of one part with respect to the parameters of some sides.
  struct Job {
    int part;
    std::size_t first_side, end_side;
  };

  const Agent& agent_;
  const Kernels& kernels_;
  core::Pool& pool_;
  std::array<Side, 2> sides_;  // of the actor and of the critic
  std::vector<Part> parts_;
  std::vector<Scratch> scratch_;  // one for each thread that has jobs
  Deviations deviations_;

  void share(const Task& task, int worker);
  void differentiate(const Task& task, const Job& job, Part& part, Scratch& scratch);
  void add(const Job& job, const Part& part);
  void add_chunk(const Task& task, const Job& job, int from, int count, bool adds, Part& part, Scratch& scratch);
  void add_policy_gradient(const Task& task, const std::int32_t* steps, int count, const float* mean, Part& part,
                           Scratch& scratch);
  void add_value_gradient(const Task& task, const std::int32_t* steps, int count, const float* value, Part& part,
                          Scratch& scratch);
};

}  // namespace mjenv::learn
