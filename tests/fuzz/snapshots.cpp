// Images of rows: damaged anywhere, and with a checksum that fits the damage.
#include <array>
#include <cstring>
#include <map>

#include "target.hpp"

namespace {

constexpr std::size_t kIds = 6, kSamples = 8;  // the last two draw their models, with noise, delays and pushes

// On MuJoCo 4.0, with the histories of delays.
const char* const kDelays =
    R"(<mujoco><worldbody><body><joint name="j"/><geom size="0.1" pos="0.2 0 0"/></body></worldbody>
  <actuator><motor joint="j" delay="0.01" nsample="4" interp="cubic"/></actuator>
  <sensor><jointpos joint="j" delay="0.01" nsample="3" interval="0.005"/></sensor></mujoco>)";

struct Sample {
  EnvHandle env;
  std::vector<unsigned char> one, all;
};

void perturb(mjenv_env* env) {
  const double numbers[] = {0.5, 1.5};
  mjenv_randomization item = MJENV_RANDOMIZATION_INIT;
  item.distribution = MJENV_DISTRIBUTION_UNIFORM;
  item.array = "body_mass";
  item.parameters = numbers;
  item.parameter_count = 2;
  item.effect = MJENV_EFFECT_SCALE;
  REQUIRE(mjenv_randomize(env, &item, 1) == MJENV_OK);
  mjenv_push push = MJENV_PUSH_INIT;
  push.body = 1;
  push.min_steps = push.max_steps = 1;
  push.high[0] = 1;
  mjenv_perturbation perturbation = MJENV_PERTURBATION_INIT;
  perturbation.action_noise = perturbation.observation_noise = numbers;
  perturbation.action_noise_count = perturbation.observation_noise_count = 1;
  perturbation.action_delay = perturbation.observation_delay = 2;
  perturbation.max_observation_delay = 4;
  perturbation.pushes = &push;
  perturbation.push_count = 1;
  REQUIRE(mjenv_perturb(env, &perturbation) == MJENV_OK);
}

Sample& sample_of(std::size_t index) {
  static std::map<std::size_t, Sample> samples;
  Sample& sample = samples[index];
  if (sample.env) return sample;
  static const bool is_4 = std::strstr(mjenv_version(), "(MuJoCo 4.") != nullptr;
  static const char* const ids[] = {
      "Ant-v5", "Hopper-v4", "Humanoid-v5", "Reacher-v5", "InvertedDoublePendulum-v4", is_4 ? "Model-v0" : "Ant-v4"};
  const OptionsHandle options = options_of(ids[index % kIds]);
  if (index == 5 && is_4) REQUIRE(mjenv_options_set_string(options.get(), "xml_string", kDelays) == MJENV_OK);
  REQUIRE(mjenv_options_set_integer(options.get(), "strict", 0) == MJENV_OK);
  sample.env = create(options, 2);
  if (index >= kIds) perturb(sample.env.get());
  REQUIRE(mjenv_reset(sample.env.get(), nullptr, nullptr) == MJENV_OK);
  sample.one = image_of(sample.env.get(), 0);
  sample.all = image_of(sample.env.get(), MJENV_ALL_ROWS);
  return sample;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  Sample& sample = sample_of(bytes.below(kSamples));
  mjenv_env* env = sample.env.get();
  const bool all = bytes.flag(), fits = bytes.flag();
  std::vector<unsigned char> image = all ? sample.all : sample.one;
  image.resize(bytes.flag() ? image.size() : bytes.take<std::uint16_t>());
  while (bytes.left() > 0 && !image.empty()) {
    const std::size_t at = bytes.take<std::uint16_t>() % image.size();
    const auto patch = bytes.list<unsigned char>(std::min<std::size_t>(bytes.below(9), image.size() - at));
    std::copy(patch.begin(), patch.end(), image.begin() + static_cast<std::ptrdiff_t>(at));
  }
  if (fits) put_checksum(image);
  const std::int64_t row = all ? MJENV_ALL_ROWS : 1;
  if (check(mjenv_restore(env, row, image.data(), image.size())) == MJENV_OK) {
    Outputs out(env, 2);
    const std::vector<double> action(2 * static_cast<std::size_t>(mjenv_field_count(env, MJENV_ROLE_ACTION)));
    check(mjenv_observe(env, &out.batch));
    check(mjenv_step(env, nullptr, action.data(), action.size(), MJENV_DTYPE_FLOAT64, &out.batch));
    std::int64_t count = 0;
    check(mjenv_read(env, 1, "xpos", nullptr, 0, &count));
    std::vector<double> values(count);
    check(mjenv_read(env, 1, "xpos", values.data(), count, &count));
    check(mjenv_reset(env, nullptr, nullptr));
  }
  // Whatever it was, the environment takes a good image.
  REQUIRE(mjenv_restore(env, MJENV_ALL_ROWS, sample.all.data(), sample.all.size()) == MJENV_OK);
  return 0;
}
