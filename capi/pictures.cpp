// The part of the C interface that draws.
#include <memory>

#include "firewall.hpp"
#include "render/renderer.hpp"

using namespace mjenv;
using namespace mjenv::firewall;

namespace mjenv {

struct HeldRenderer {
  Renderer renderer;
  std::shared_ptr<Link> link;

  HeldRenderer(const HeldEnv& env, const mjenv_render_settings& settings)
      : renderer(env.env.shared_model(), settings), link(env.link) {}
};

}  // namespace mjenv

struct mjenv_renderer : Slot<HeldRenderer> {
  static constexpr const char* kName = "renderer";
  static constexpr const char* kThing = "renderer";
  static constexpr bool kReadersSeeChanges = false;
};

namespace {

mjenv_render_settings defaults_of(const HeldEnv& env) { return render_defaults(env.env.model(), env.env.camera()); }

// Settings from the caller, who may know less or more of them than this library.
mjenv_render_settings taken(const HeldEnv& env, const mjenv_render_settings* from) {
  mjenv_render_settings settings = defaults_of(env);
  if (!from) return settings;
  checked_size(from->struct_size, sizeof settings, "settings");
  std::memcpy(&settings, from, sizeof settings);
  return settings;
}

void check_room(const char* name, const void* to, std::size_t count, std::size_t needed) {
  if (to && count < needed)
    fail(MJENV_E_SIZE, std::string(name) + " has room for " + std::to_string(count) + ", but " +
                           std::to_string(needed) + " are needed");
}

// Threads that draw wait for each other here, but not for one that steps.
void look_at(HeldRenderer& r, std::int64_t row) {
  const std::lock_guard lock(r.link->mutex);
  if (!r.link->env || !r.link->env->object) fail(MJENV_E_STATE, "the environment that is to be drawn was destroyed");
  const Entered env(r.link->env);
  (*env).env.show(row, [&](mjData_* data) { r.renderer.look_at(data); });
}

}  // namespace

mjenv_status mjenv_render_defaults(const mjenv_env* env, mjenv_render_settings* settings) {
  return guard([&] { hand_out(settings, "settings", defaults_of(*Reading(env))); });
}

mjenv_status mjenv_renderer_create(mjenv_env* env, const mjenv_render_settings* settings, mjenv_renderer** renderer) {
  return guard([&] {
    const Reading e(env);
    need(renderer, "renderer");
    *renderer = handles<mjenv_renderer>.add(std::make_unique<HeldRenderer>(*e, taken(*e, settings)));
  });
}

void mjenv_renderer_destroy(mjenv_renderer* renderer) {
  guard([&] { handles<mjenv_renderer>.destroy(renderer); });
}

const char* mjenv_renderer_gl(const mjenv_renderer* renderer) {
  return renderer ? answer<const char*>(nullptr, [&] { return (*Reading(renderer)).renderer.gl().c_str(); }) : nullptr;
}

mjenv_status mjenv_render(mjenv_renderer* renderer, std::int64_t row, std::uint8_t* rgb, std::size_t rgb_count,
                          float* depth, std::size_t depth_count) {
  return guard([&] {
    const Entered held(renderer);
    HeldRenderer& r = *held;
    r.renderer.check_here();
    if (!rgb && !depth) fail(MJENV_E_ARGUMENT, "rgb and depth are NULL");
    check_room("rgb", rgb, rgb_count, 3 * r.renderer.pixels());
    check_room("depth", depth, depth_count, r.renderer.pixels());
    look_at(r, row);
    r.renderer.draw(rgb, depth);
  });
}
