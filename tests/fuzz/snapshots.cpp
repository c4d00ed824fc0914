// Images of rows: damaged anywhere, and with a checksum that fits the damage.
#include <array>
#include <cstring>
#include <map>

#include "mjenv/task.h"

#include "target.hpp"

namespace {

// From kIds on, rows draw their models, with noise, delays and pushes. From kTasks on, they are those of the task below.
constexpr std::size_t kIds = 6, kTasks = 8, kSamples = 10;

// On MuJoCo 4.0, with the histories of delays.
const char* const kDelays =
    R"(<mujoco><worldbody><body><joint name="j"/><geom size="0.1" pos="0.2 0 0"/></body></worldbody>
  <actuator><motor joint="j" delay="0.01" nsample="4" interp="cubic"/></actuator>
  <sensor><jointpos joint="j" delay="0.01" nsample="3" interval="0.005"/></sensor></mujoco>)";

// ---- A task whose rows have every part that a row can have ----

constexpr double kPlaces[] = {0.5, 1.5, 2.5};
constexpr std::int64_t kHeights = 6;

std::int32_t build(mjenv_builder* builder, void* /*user*/, void** self) {
  *self = nullptr;
  mjenv_build_current(builder);
  mjenv_build_random_state(builder);
  mjenv_build_own(builder, "hfield_data");
  mjenv_build_own(builder, "qfrc_applied");
  mjenv_build_keep(builder, 0, 1);
  mjenv_build_carry_bounds(builder, 1, 1, 0, 2);  // an index of kPlaces
  mjenv_build_parameter(builder, "speed");
  return 0;
}

std::int32_t reset(const void* /*self*/, mjenv_start* start) {
  for (std::int64_t i = 0; i < kHeights; ++i) start->own[0][i] = mjenv_random_state_rand(start->random);
  start->carried[0] += 1;
  start->carried[1] = static_cast<double>(mjenv_random_integers(start->random, 0, 3));
  return 0;
}

std::int32_t observe(const void* /*self*/, const mjenv_sim* sim, double* to) {
  REQUIRE(sim->carried[1] >= 0 && sim->carried[1] <= 2);
  REQUIRE(sim->parameters[0] >= -2 && sim->parameters[0] <= 2);
  to[0] = sim->qpos[0] + sim->parameters[0] + kPlaces[static_cast<std::size_t>(sim->carried[1])];
  return 0;
}

std::int32_t step(const void* /*self*/, const mjenv_sim* /*sim*/, mjenv_outcome* outcome) {
  outcome->own[0][0] = mjenv_random_real(outcome->random);
  outcome->own[1][0] = 1;
  return 0;
}

const char* id_of_task() {
  static const char* id = nullptr;
  if (id) return id;
  mjenv_task_option speed = MJENV_TASK_OPTION_INIT;
  speed.kind = MJENV_KIND_REALS;
  speed.name = "speed";
  speed.low = -2;
  speed.high = 2;
  speed.live = 1;
  mjenv_task_field place = MJENV_TASK_FIELD_INIT;
  place.role = MJENV_ROLE_OBSERVATION;
  place.name = "place";
  mjenv_task task = MJENV_TASK_INIT;
  task.id = "Rows-v0";
  task.model_text =
      R"(<mujoco><asset><hfield name="ground" nrow="2" ncol="3" size="1 1 0.2 0.1"/></asset><worldbody>
  <geom type="hfield" hfield="ground"/><body pos="0 0 0.3"><joint name="z" type="slide" axis="0 0 1"/><geom size="0.1"/></body>
  </worldbody><actuator><motor joint="z"/></actuator></mujoco>)";
  task.frame_skip = 1;
  task.time_limit = 9;
  task.carry_count = 2;
  task.options = &speed;
  task.option_count = 1;
  task.fields = &place;
  task.field_count = 1;
  task.build = build;
  task.reset = reset;
  task.observe = observe;
  task.step = step;
  REQUIRE(mjenv_register_task(&task) == MJENV_OK);
  return id = "Rows-v0";
}

struct Sample {
  EnvHandle env;
  std::vector<unsigned char> one, all;
};

void perturb(mjenv_env* env) {
  REQUIRE(mjenv_randomize(env, R"({"randomize": {"body_mass": {"kind": "scale", "low": 0.5, "high": 1.5}},
                                   "noise": {"action": 0.5, "observation": 0.5},
                                   "delay": {"action": 2, "observation": [2, 4]},
                                   "push": {"body": 1, "every": 1, "force": [[0, 1], [0, 0], [0, 0]]}})") == MJENV_OK);
}

// Gives row 0 all that its derived arrays can be computed from.
void repeat(mjenv_env* env) {
  const double numbers[] = {0.1, 0.2}, mass[] = {0, 2}, heavier[] = {0, 3};
  REQUIRE(mjenv_step(env, nullptr, numbers, 2, MJENV_DTYPE_FLOAT64, nullptr) == MJENV_OK);
  REQUIRE(mjenv_set_state(env, 0, numbers, 1, numbers, 1) == MJENV_OK);
  REQUIRE(mjenv_write(env, nullptr, "body_mass", mass, 2) == MJENV_OK);
  REQUIRE(mjenv_set_constants(env, nullptr) == MJENV_OK);
  REQUIRE(mjenv_write(env, nullptr, "body_mass", heavier, 2) == MJENV_OK);
}

Sample& sample_of(std::size_t index) {
  static std::map<std::size_t, Sample> samples;
  Sample& sample = samples[index];
  if (sample.env) return sample;
  static const bool is_4 = std::strstr(mjenv_version(), "(MuJoCo 4.") != nullptr;
  static const char* const ids[] = {
      "Ant-v5", "Hopper-v4", "Humanoid-v5", "Reacher-v5", "InvertedDoublePendulum-v4", is_4 ? "Model-v0" : "Ant-v4"};
  const bool is_task = index >= kTasks;
  const OptionsHandle options = options_of(is_task ? id_of_task() : ids[index % kIds]);
  if (is_task) {
    REQUIRE(mjenv_options_set_integer(options.get(), "history", 3) == MJENV_OK);
    REQUIRE(mjenv_options_set_integer(options.get(), "time_aware", 1) == MJENV_OK);
  }
  if (index == 5 && is_4) REQUIRE(mjenv_options_set_string(options.get(), "xml_string", kDelays) == MJENV_OK);
  REQUIRE(mjenv_options_set_integer(options.get(), "strict", 0) == MJENV_OK);
  sample.env = create(options, 2);
  if (index >= kIds && index != kTasks) perturb(sample.env.get());
  REQUIRE(mjenv_reset(sample.env.get(), nullptr, nullptr) == MJENV_OK);
  if (is_task) repeat(sample.env.get());
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
  bytes.damage(image);
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
