// MJCF texts: whatever loads must reset, step and be drawn; rows that step together in lanes must have the bits that
// they have one by one.
#include "target.hpp"

namespace {

constexpr std::int64_t kRows = 4;

// Rows of the model, stepped together or one by one.
struct Player {
  Player(const OptionsHandle& options, bool together) {
    REQUIRE((together ? mjenv_options_set_string(options.get(), "lanes", "auto")
                      : mjenv_options_set_integer(options.get(), "lanes", 0)) == MJENV_OK);
    env = create(options, kRows);
    if (!env) return;
    out.emplace(env.get(), kRows);
    const std::uint64_t seeds[kRows] = {1, 2, 3, 4};
    REQUIRE(mjenv_seed(env.get(), nullptr, seeds, kRows) == MJENV_OK);
  }

  EnvHandle env;
  std::optional<Outputs> out;
};

}  // namespace

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
  Player alone(options, false);
  if (!alone.env) return 0;
  Player together(options, true);
  if (!together.env) return 0;

  std::vector<float> actions(static_cast<std::size_t>(kRows * total(alone.env.get(), MJENV_ROLE_ACTION)));
  for (std::size_t i = 0; i < actions.size(); ++i) actions[i] = static_cast<float>(i % 5) / 2 - 1;
  const mjenv_status reset = check(mjenv_reset(alone.env.get(), nullptr, &alone.out->batch));
  REQUIRE(check(mjenv_reset(together.env.get(), nullptr, &together.out->batch)) == reset);
  if (reset != MJENV_OK) return 0;
  for (int step = 0; step < 3; ++step) {
    mjenv_status statuses[2];
    for (Player* player : {&alone, &together})
      statuses[player == &together] = check(mjenv_step(player->env.get(), nullptr, actions.data(), actions.size(),
                                                       MJENV_DTYPE_FLOAT32, &player->out->batch));
    REQUIRE(statuses[0] == statuses[1]);
    for (std::int64_t row = 0; row < kRows; ++row)
      REQUIRE(image_of(alone.env.get(), row) == image_of(together.env.get(), row));
  }
  draw_all(together.env);
  return 0;
}
