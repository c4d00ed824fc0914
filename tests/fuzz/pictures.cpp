// Renderers of any settings, drawing states of every bit pattern into arrays that may be too small or missing.
#include <climits>
#include <map>

#include "target.hpp"

namespace {

const EnvHandle& env_of(std::size_t index) {
  static std::map<std::size_t, EnvHandle> envs;
  EnvHandle& env = envs[index];
  if (env) return env;
  static const char* const ids[] = {"Ant-v5", "Reacher-v5", "Swimmer-v4"};
  const OptionsHandle options = options_of(ids[index]);
  REQUIRE(mjenv_options_set_integer(options.get(), "strict", 0) == MJENV_OK);
  env = create(options, 2);
  REQUIRE(env);
  return env;
}

// The defaults of a small picture, changed here and there.
mjenv_render_settings settings_of(const EnvHandle& env, Bytes& bytes) {
  static const std::int32_t integers[] = {0, 1, 2, 5, 64, 65, -1, -2, 1 << 20, INT_MAX, INT_MIN};
  static const std::int32_t sides[] = {1, 2, 7, 33, 64, 0, -1, 16'384, 1 << 16, INT_MAX};
  static const char* const cameras[] = {"track", "none", "", nullptr};
  mjenv_render_settings settings = render_defaults(env);
  settings.width = 24;
  settings.height = 16;
  for (std::size_t changes = bytes.below(4); changes > 0; --changes) {
    switch (bytes.below(15)) {
      case 0: settings.struct_size = bytes.take<std::uint8_t>(); break;
      case 1: settings.gl = bytes.one_of(integers); break;
      case 2: settings.width = bytes.one_of(sides); break;
      case 3: settings.height = bytes.one_of(sides); break;
      case 4: settings.camera = bytes.one_of(integers); break;
      case 5: settings.max_geom = bytes.one_of(integers); break;
      case 6: settings.samples = bytes.one_of(integers); break;
      case 7: settings.shadows = bytes.one_of(integers); break;
      case 8: settings.reflections = bytes.one_of(integers); break;
      case 9: settings.camera_name = bytes.one_of(cameras); break;
      case 10: settings.lookat[bytes.below(3)] = bytes.take<double>(); break;
      case 11: settings.distance = bytes.take<double>(); break;
      case 12: settings.azimuth = settings.elevation = bytes.take<double>(); break;
      case 13: {
        const auto groups = bytes.list<std::uint8_t>(sizeof settings.geomgroup);
        std::copy(groups.begin(), groups.end(), settings.geomgroup);
        std::copy(groups.begin(), groups.end(), settings.skingroup);
        break;
      }
      default: {
        const auto visual = bytes.list<std::uint8_t>(sizeof settings.visual);
        std::copy(visual.begin(), visual.end(), settings.visual);
      }
    }
  }
  return settings;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Bytes bytes(data, size);
  const EnvHandle& env = env_of(bytes.below(3));
  if (bytes.below(4)) check(mjenv_reset(env.get(), nullptr, nullptr));
  const mjenv_render_settings settings = settings_of(env, bytes);
  const RendererHandle drawing = renderer(env, settings);
  REQUIRE((mjenv_renderer_gl(drawing.get()) != nullptr) == (drawing != nullptr));
  const std::size_t pixels =
      drawing ? static_cast<std::size_t>(settings.width) * static_cast<std::size_t>(settings.height) : 0;
  std::vector<std::uint8_t> rgb(3 * pixels);
  std::vector<float> depth(pixels);
  for (int pictures = 0; pictures < 3 && bytes.left() > 0; ++pictures) {
    if (bytes.flag()) {
      const std::size_t nq = number(env.get(), "nq"), nv = number(env.get(), "nv");
      const auto qpos = bytes.list<double>(nq), qvel = bytes.list<double>(nv);
      check(mjenv_set_state(env.get(), 0, qpos.data(), nq, qvel.data(), nv));
    }
    static const std::int64_t rows[] = {0, 0, 0, 1, 1, 2, -1, INT64_MAX};
    const std::int64_t row = bytes.one_of(rows);
    // An array says how long it is, or less.
    const std::size_t rgb_count = rgb.size() - std::min<std::size_t>(rgb.size(), bytes.below(8) / 7);
    const std::size_t depth_count = depth.size() - std::min<std::size_t>(depth.size(), bytes.below(8) / 7);
    const std::vector<unsigned char> before = image_of(env.get(), MJENV_ALL_ROWS);
    check(mjenv_render(drawing.get(), row, bytes.below(6) ? rgb.data() : nullptr, rgb_count,
                       bytes.below(6) ? depth.data() : nullptr, depth_count));
    REQUIRE(image_of(env.get(), MJENV_ALL_ROWS) == before);
  }
  return 0;
}
