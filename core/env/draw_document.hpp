// The document of mjenv_randomize: draws, noise, delays and pushes as JSON, in which objects have their names.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/model.hpp"
#include "engine/own_array.hpp"
#include "json.hpp"
#include "task/field.hpp"

namespace mjenv::core {

// Their numbers are part of the identity of images.
enum class Distribution : std::int32_t { uniform = 1, log_uniform, normal, truncated_normal, choice };
enum class Effect : std::int32_t { value = 1, scale, offset };

// What a reset draws for one array of the mjModel.
struct DrawSettings {
  std::string place;  // in the document, for messages: "randomize.body_mass"
  OwnArray array;
  Distribution distribution = Distribution::uniform;
  std::vector<double>
      parameters;  // of the distribution: its bounds, its mean and deviation, then the bounds, or choices
  Effect effect = Effect::value;
  std::vector<std::size_t> elements;  // in the order of the draws
  bool shared = false, constants = false;
  bool repeats = false;  // reuses the draws of the item before, element by element
  double factor = 1;
};

struct PushSettings {
  std::string place;
  std::int32_t body = 0;
  bool is_kick = false;
  std::int64_t min_steps = 0, max_steps = 0, min_duration = 1, max_duration = 1;
  std::array<double, 6> low{}, high{};
};

struct DelaySettings {
  std::int64_t least = 0, most = 0;
  bool is_drawn = false;
};

// Each list of numbers is empty, or has one number for each action or element of the observation.
struct PerturbationSettings {
  std::vector<double> action_noise, observation_noise, first_action;
  DelaySettings action_delay, observation_delay;
  bool noise_is_uniform = false;  // and not normal: from minus to plus the numbers of the noise
  std::vector<bool> is_delayed;   // each number of the observation
  bool redraws_delays = false;
  bool begins_with_own = false;  // the reset's observation stands before the first delayed one, not zeros
  std::vector<PushSettings> pushes;
};

class DrawDocument {
 public:
  DrawDocument();  // draws nothing
  // A copy in which the parts that `text` has replace those of this document. A part that is null is removed; an empty
  // text removes all.
  DrawDocument with(const std::string& text) const;
  const std::string& text() const { return text_; }

  // Whether the last `with` replaced the draws, or one of the other parts.
  bool replaces_draws() const { return replaces_draws_; }
  bool replaces_perturbation() const { return replaces_perturbation_; }

  std::vector<DrawSettings> draws(const Model& model) const;
  // actions, observations: the fields of both, which have names and groups.
  PerturbationSettings perturbation(const Model& model, const std::vector<Field>& actions,
                                    const std::vector<Field>& observations) const;

 private:
  std::shared_ptr<const Json> json_;
  std::string text_ = "{}";
  bool replaces_draws_ = false, replaces_perturbation_ = false;
};

}  // namespace mjenv::core
