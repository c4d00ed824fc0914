#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "environment.hpp"
#include "kernels/kernels.hpp"
#include "network.hpp"
#include "random.hpp"
#include "settings.hpp"

namespace mjenv::learn {

// The networks of actor and critic. One array holds their parameters and the logarithms of the actions' standard
// deviations. Each part of the array is padded to a multiple of kLaneBlock with zeros, which stay 0.
struct Agent {
  Agent(const Settings& settings, const Spaces& spaces)
      : actor(static_cast<int>(spaces.observations), settings.hidden, static_cast<int>(spaces.actuators),
              activation_named(settings.activation), settings.actor_obs),
        critic(static_cast<int>(spaces.observations), settings.hidden, 1, activation_named(settings.activation),
               settings.critic_obs),
        actuators(spaces.actuators),
        critic_at(actor.size()),
        log_std_at(critic_at + critic.size()),
        size(log_std_at + static_cast<std::size_t>(padded(static_cast<int>(actuators), kLaneBlock))) {}

  Network actor, critic;
  std::size_t actuators, critic_at, log_std_at, size;  // the actor's parameters are at 0

  // How many floats a row of both networks' inputs takes.
  std::size_t stride() const { return static_cast<std::size_t>(actor.input_stride()); }

  // Which elements are parameters: not padding, and not weights of inputs that a network does not see. The others are 0.
  std::vector<bool> used() const {
    std::vector<bool> is_used(size);
    actor.mark_used(is_used, 0);
    critic.mark_used(is_used, critic_at);
    std::fill_n(is_used.begin() + static_cast<std::ptrdiff_t>(log_std_at), actuators, true);
    return is_used;
  }

  std::vector<float> initial_parameters(double std, Random& random) const {
    std::vector<float> parameters(size);
    actor.initialize(parameters.data(), 0.01, random);
    critic.initialize(&parameters[critic_at], 1.0, random);
    std::fill_n(&parameters[log_std_at], actuators, static_cast<float>(natural_log(std)));
    return parameters;
  }
};

// The standard deviations of the actions, padded.
struct Deviations {
  explicit Deviations(const Agent& agent)
      : std(agent.size - agent.log_std_at), inverse(std.size()), log_std_at(agent.log_std_at) {}

  std::vector<float> std, inverse;  // inverse is 1 / std
  std::size_t log_std_at;

  void update(const Kernels& kernels, const std::vector<float>& parameters) {
    for (std::size_t j = 0; j < std.size(); ++j) {
      std[j] = parameters[log_std_at + j];
      inverse[j] = -std[j];
    }
    kernels.exp(std.data(), std.size());
    kernels.exp(inverse.data(), inverse.size());
  }
};

}  // namespace mjenv::learn
