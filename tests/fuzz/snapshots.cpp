// Images of rows: damaged anywhere, and with a checksum that fits the damage.
#include <array>
#include <cstring>
#include <map>

#include "hash.hpp"
#include "target.hpp"

namespace {

constexpr std::size_t kHeader = 48, kChecksum = 40;

// On MuJoCo 4.0, with the histories of delays.
const char* const kDelays =
    R"(<mujoco><worldbody><body><joint name="j"/><geom size="0.1" pos="0.2 0 0"/></body></worldbody>
  <actuator><motor joint="j" delay="0.01" nsample="4" interp="cubic"/></actuator>
  <sensor><jointpos joint="j" delay="0.01" nsample="3" interval="0.005"/></sensor></mujoco>)";

struct Sample {
  EnvHandle env;
  std::vector<unsigned char> one, all;
};

Sample& sample_of(std::size_t index) {
  static std::map<std::size_t, Sample> samples;
  Sample& sample = samples[index];
  if (sample.env) return sample;
  static const bool is_4 = std::strstr(mjenv_version(), "(MuJoCo 4.") != nullptr;
  static const char* const ids[] = {
      "Ant-v5", "Hopper-v4", "Humanoid-v5", "Reacher-v5", "InvertedDoublePendulum-v4", is_4 ? "Model-v0" : "Ant-v4"};
  const OptionsHandle options = options_of(ids[index]);
  if (index == 5 && is_4) REQUIRE(mjenv_options_set_string(options.get(), "xml_string", kDelays) == MJENV_OK);
  REQUIRE(mjenv_options_set_integer(options.get(), "strict", 0) == MJENV_OK);
  sample.env = create(options, 2);
  REQUIRE(mjenv_reset(sample.env.get(), nullptr, nullptr) == MJENV_OK);
  sample.one = image_of(sample.env.get(), 0);
  sample.all = image_of(sample.env.get(), MJENV_ALL_ROWS);
  return sample;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  Sample& sample = sample_of(bytes.below(6));
  mjenv_env* env = sample.env.get();
  const bool all = bytes.flag(), fits = bytes.flag();
  std::vector<unsigned char> image = all ? sample.all : sample.one;
  image.resize(bytes.flag() ? image.size() : bytes.take<std::uint16_t>());
  while (bytes.left() > 0 && !image.empty()) {
    const std::size_t at = bytes.take<std::uint16_t>() % image.size();
    const auto patch = bytes.list<unsigned char>(std::min<std::size_t>(bytes.below(9), image.size() - at));
    std::copy(patch.begin(), patch.end(), image.begin() + static_cast<std::ptrdiff_t>(at));
  }
  if (fits && image.size() >= kHeader) {
    const std::uint64_t sum = mjenv::core::hash(image.data() + kHeader, image.size() - kHeader);
    std::memcpy(&image[kChecksum], &sum, sizeof sum);
  }
  const std::int64_t row = all ? MJENV_ALL_ROWS : 1;
  if (check(mjenv_restore(env, row, image.data(), image.size())) == MJENV_OK) {
    Outputs out(env, 2);
    const std::vector<double> action(2 * static_cast<std::size_t>(mjenv_field_count(env, MJENV_ROLE_ACTION)));
    check(mjenv_observe(env, &out.batch));
    check(mjenv_step(env, nullptr, action.data(), action.size(), MJENV_DTYPE_FLOAT64, &out.batch));
    std::size_t count = 0;
    check(mjenv_read(env, 1, "xpos", nullptr, 0, &count));
    std::vector<double> values(count);
    check(mjenv_read(env, 1, "xpos", values.data(), count, &count));
    check(mjenv_reset(env, nullptr, nullptr));
  }
  // Whatever it was, the environment takes a good image.
  REQUIRE(mjenv_restore(env, MJENV_ALL_ROWS, sample.all.data(), sample.all.size()) == MJENV_OK);
  return 0;
}
