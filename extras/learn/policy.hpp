// Deterministic policies and their text.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "environment.hpp"
#include "kernels/kernels.hpp"
#include "network.hpp"
#include "settings.hpp"

namespace mjenv::learn {

// What a policy tells of the environment in which it was trained.
struct Description {
  std::string about;  // a line of JSON of the caller's own; empty: none
  Terms terms;        // of the observation; empty: unknown

  // Throws if `about` is not one line of printable ASCII, or if the terms have bad or equal names, or not `observations`
  // numbers.
  void check(std::size_t observations) const;
};

// The text of a learner's policy: an actor, and how observations are normalised. docs/training.md has the format.
std::string policy_text(const Settings& settings, const Spaces& spaces, const Network& actor, const float* parameters,
                        const std::vector<double>& mean, const std::vector<double>& scale, double clip,
                        const Description& description);

class Policy {
 public:
  // Throws if the text is no policy.
  explicit Policy(std::string_view text);

  const std::string& id() const { return id_; }
  std::size_t observations() const { return mean_.size(); }
  std::size_t actuators() const { return low_.size(); }

  // Their arrays belong to this policy.
  mjenv_policy_spec spec() const;
  mjenv_policy_layer layer(std::int64_t index) const;
  mjenv_policy_input input(std::int64_t index) const;

  // obs: [rows][observations()]; actions: [rows][actuators()].
  void act(mjenv_precision precision, std::size_t rows, const double* obs, float* actions) const;

  // Where the numbers that this policy sees are in an observation of these terms. Throws if it lacks some.
  std::vector<std::size_t> find(const Terms& terms) const;

 private:
  struct PolicyLayer {
    Activation activation;
    int inputs, outputs, padded_outputs;
    std::vector<double> weights, bias;  // [inputs][outputs]
    // [padded_inputs][padded_outputs], those of the last layer [outputs][padded_inputs]
    std::vector<float> weights32, bias32;

    int padded_inputs() const { return padded(inputs, kLaneBlock); }
  };

  // A term of the observation that the policy sees.
  struct Input {
    std::string name;
    std::size_t count;                   // of the whole term
    std::vector<std::int64_t> elements;  // those that it sees; empty: all
  };

  std::string id_, about_;
  std::vector<Input> inputs_;  // empty: unknown
  std::vector<double> mean_, scale_, low_, high_;
  double clip_ = 0;
  std::vector<PolicyLayer> layers_;

  class Parser;
  static void activate64(Activation activation, std::vector<double>& values);
  void act64(std::size_t rows, const double* obs, float* actions) const;
  void act32(std::size_t rows, const double* obs, float* actions) const;
};

// Plays the episodes 0 to episodes - 1. Episode k begins with a reset by seed + k. returns and lengths may be null.
void evaluate_policy(Environment& env, const Policy& policy, mjenv_precision precision, std::uint64_t seed,
                     std::int64_t episodes, double* returns, std::int64_t* lengths);

}  // namespace mjenv::learn
