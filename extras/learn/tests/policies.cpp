// Texts of policies.
#include <vector>

#include "mjenv/learn.h"
#include "target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  mjenv_policy* policy = nullptr;
  const std::vector<char> text(data, data + size);  // which ends where its bytes end
  const mjenv_status parsed = mjenv_policy_parse(size > 0 ? text.data() : "", static_cast<std::int64_t>(size), &policy);
  REQUIRE((parsed == MJENV_OK) == (policy != nullptr));
  if (parsed != MJENV_OK) {
    REQUIRE(parsed == MJENV_E_VALUE && *mjenv_learn_last_error());
    return 0;
  }
  REQUIRE(*mjenv_policy_id(policy));
  std::int64_t observations = 0, actuators = 0;
  REQUIRE(mjenv_policy_sizes(policy, &observations, &actuators) == MJENV_OK);
  mjenv_policy_spec spec = MJENV_POLICY_SPEC_INIT;
  REQUIRE(mjenv_policy_spec_of(policy, &spec) == MJENV_OK);
  for (std::int64_t i = 0; i < observations; ++i) REQUIRE(spec.scale[i] > 0);
  std::int64_t width = observations;
  for (std::int64_t i = 0; i < spec.layer_count; ++i) {
    mjenv_policy_layer layer = MJENV_POLICY_LAYER_INIT;
    REQUIRE(mjenv_policy_layer_at(policy, i, &layer) == MJENV_OK);
    REQUIRE(layer.inputs == width);
    width = layer.outputs;
    for (std::int64_t k = 0; k < layer.inputs * layer.outputs; ++k) REQUIRE(layer.weights[k] == layer.weights[k]);
  }
  REQUIRE(width == actuators);
  REQUIRE(spec.about);
  std::vector<const char*> names;
  std::vector<std::int64_t> counts, places(static_cast<std::size_t>(observations));
  std::int64_t seen = 0;
  for (std::int64_t i = 0; i < spec.input_count; ++i) {
    mjenv_policy_input input = MJENV_POLICY_INPUT_INIT;
    REQUIRE(mjenv_policy_input_at(policy, i, &input) == MJENV_OK);
    for (std::int64_t k = 0; input.elements && k < input.seen; ++k)
      REQUIRE(input.elements[k] >= 0 && input.elements[k] < input.count);
    names.push_back(input.name);
    counts.push_back(input.count);
    seen += input.seen;
  }
  REQUIRE(spec.input_count == 0 || seen == observations);
  if (spec.input_count > 0)
    REQUIRE(mjenv_policy_find(policy, names.data(), counts.data(), spec.input_count, places.data(), observations) ==
            MJENV_OK);
  constexpr std::int64_t kRows = 3;
  std::vector<double> obs(static_cast<std::size_t>(kRows * observations), 0.5);
  std::vector<float> action(static_cast<std::size_t>(kRows * actuators));
  for (const mjenv_precision precision : {MJENV_PRECISION_FLOAT64, MJENV_PRECISION_FLOAT32}) {
    REQUIRE(mjenv_policy_act(policy, precision, kRows, obs.data(), kRows * observations, action.data(),
                             kRows * actuators) == MJENV_OK);
    for (std::int64_t i = 0; i < kRows * actuators; ++i) {
      const double given = action[static_cast<std::size_t>(i)];
      const auto bound = [&](const double* of) { return static_cast<double>(static_cast<float>(of[i % actuators])); };
      REQUIRE(given != given || (given >= bound(spec.low) && given <= bound(spec.high)));  // NaN of infinite sums
    }
  }
  mjenv_policy_destroy(policy);
  return 0;
}
