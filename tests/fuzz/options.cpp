// Option names and values of every kind, for every id; what they make must reset and step.
#include "target.hpp"

namespace {

// What a step, a thread or a picture costs must not slow the fuzzer down.
void keep_cheap(const OptionsHandle& options) {
  for (const auto& [name, most] : {std::pair{"frame_skip", 3}, {"num_threads", 2}}) {
    std::int64_t value = 0;
    if (mjenv_options_get_integer(options.get(), name, &value) == MJENV_OK && (value > most || value == 0))
      REQUIRE(mjenv_options_set_integer(options.get(), name, most) == MJENV_OK);
  }
}

std::string name_of(Bytes& bytes, const OptionsHandle& options) {
  const std::size_t index = bytes.below(40);
  mjenv_option option = MJENV_OPTION_INIT;
  if (mjenv_options_at(options.get(), static_cast<std::int64_t>(index), &option) == MJENV_OK) return option.name;
  return bytes.text(20);
}

void set(Bytes& bytes, const OptionsHandle& options, const std::string& name) {
  static const std::int64_t integers[] = {0, 1, -1, 2, 7, 1024, INT32_MAX, INT64_MAX, INT64_MIN};
  static const char* const texts[] = {"",          "auto",      "fused",
                                      "same_step", "next_step", "terminate",
                                      "torso",     "ant.xml",   "./x.xml",
                                      "~",         "/",         "xpos sensordata",
                                      "qpos qM",   "<mujoco/>", "cfrc_ext",
                                      "plain",     "continue",  "%s%n",
                                      "qvel=3",    "zero",      "policy=2 qpos=900000000000000000"};
  switch (bytes.below(5)) {
    case 0: check(mjenv_options_set_integer(options.get(), name.c_str(), bytes.one_of(integers))); break;
    case 1: check(mjenv_options_set_integer(options.get(), name.c_str(), bytes.take<std::int64_t>())); break;
    case 2: {
      const std::size_t count = bytes.below(4);
      check(mjenv_options_set_reals(options.get(), name.c_str(), bytes.list<double>(count).data(), count));
      break;
    }
    case 3: check(mjenv_options_set_string(options.get(), name.c_str(), bytes.one_of(texts))); break;
    default: check(mjenv_options_set_string(options.get(), name.c_str(), bytes.text(30).c_str()));
  }
}

void get(const OptionsHandle& options, const std::string& name) {
  std::int64_t integer = 0;
  const char* text = nullptr;
  double reals[2];
  std::int64_t count = 0;
  check(mjenv_options_get_integer(options.get(), name.c_str(), &integer));
  check(mjenv_options_get_string(options.get(), name.c_str(), &text));
  check(mjenv_options_get_reals(options.get(), name.c_str(), reals, 2, &count));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const OptionsHandle options =
      options_of(mjenv_id_at(static_cast<std::int64_t>(bytes.below(static_cast<std::size_t>(mjenv_id_count())))));
  for (int i = 0; i < 12 && bytes.left() > 0; ++i) {
    const std::string name = name_of(bytes, options);
    set(bytes, options, name);
    get(options, name);
  }
  keep_cheap(options);
  const EnvHandle env = create(options, 2);
  if (!env) return 0;
  Outputs out(env.get(), 2);
  check(mjenv_reset(env.get(), nullptr, &out.batch));
  const std::vector<float> action(2 * static_cast<std::size_t>(mjenv_field_count(env.get(), MJENV_ROLE_ACTION)), 0.5F);
  for (int step = 0; step < 3; ++step)
    check(mjenv_step(env.get(), nullptr, action.data(), action.size(), MJENV_DTYPE_FLOAT32, &out.batch));
  return 0;
}
