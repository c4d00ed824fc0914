// MJCF texts: whatever loads must reset, step and be drawn.
#include "target.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const char* const ids[] = {"Ant-v5", "InvertedPendulum-v5", "Humanoid-v5", "Swimmer-v4"};
  Bytes bytes(data, size);
  const std::string text = bytes.rest();
  // The length chooses, so that the input is nothing but MJCF.
  const OptionsHandle options = options_of(ids[text.size() % 3]);
  const mjenv_status given = check(mjenv_options_set_string(options.get(), "xml_string", text.c_str()));
  if (given != MJENV_OK) return 0;
  REQUIRE(mjenv_options_set_integer(options.get(), "strict", 0) == MJENV_OK);
  REQUIRE(mjenv_options_set_integer(options.get(), "frame_skip", 2) == MJENV_OK);
  const EnvHandle env = create(options, 1);
  if (!env) return 0;
  Outputs out(env.get(), 1);
  const std::vector<float> action(static_cast<std::size_t>(mjenv_field_count(env.get(), MJENV_ROLE_ACTION)), 1);
  if (check(mjenv_reset(env.get(), nullptr, &out.batch)) != MJENV_OK) return 0;
  for (int step = 0; step < 3; ++step)
    check(mjenv_step(env.get(), nullptr, action.data(), action.size(), MJENV_DTYPE_FLOAT32, &out.batch));
  draw_all(env);
  return 0;
}
