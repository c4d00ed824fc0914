// The part of the C interface that draws.
#include <memory>

#include "firewall.hpp"
#include "render/renderer.hpp"
#include "render/window.hpp"

using namespace mjenv::core;
using namespace mjenv::core::firewall;

namespace mjenv::core {

struct HeldRenderer {
  Renderer renderer;
  std::shared_ptr<Link> link;

  HeldRenderer(const HeldEnv& env, const mjenv_render_settings& settings)
      : renderer(env.env.shared_model(), settings), link(env.link) {}
};

struct HeldWindow {
  Window window;
  std::shared_ptr<Link> link;

  HeldWindow(const HeldEnv& env, const mjenv_render_settings& settings)
      : window(env.env.shared_model(), settings), link(env.link) {}
};

}  // namespace mjenv::core

struct mjenv_window : Slot<HeldWindow> {
  static constexpr const char* kName = "window";
  static constexpr const char* kThing = "window";
  static constexpr bool kReadersSeeChanges = false;
};

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
template <typename Painter>
void look_at(Link& link, std::int64_t row, Painter& painter) {
  const std::lock_guard lock(link.mutex);
  if (!link.env || !link.env->object) fail(MJENV_E_STATE, "the environment that is to be drawn was destroyed");
  const Entered env(link.env);
  (*env).env.show(row, [&](mjData_* data) { painter.look_at(data); });
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
    look_at(*r.link, row, r.renderer);
    r.renderer.draw(rgb, depth);
  });
}

mjenv_status mjenv_window_create(mjenv_env* env, const mjenv_render_settings* settings, mjenv_window** window) {
  return guard([&] {
    const Reading e(env);
    need(window, "window");
    *window = handles<mjenv_window>.add(std::make_unique<HeldWindow>(*e, taken(*e, settings)));
  });
}

void mjenv_window_destroy(mjenv_window* window) {
  guard([&] { handles<mjenv_window>.destroy(window); });
}

std::int32_t mjenv_window_is_open(const mjenv_window* window) {
  return answer<std::int32_t>(0, [&] { return (*Reading(window)).window.is_open(); });
}

mjenv_status mjenv_window_draw(mjenv_window* window, std::int64_t row) {
  return guard([&] {
    const Entered held(window);
    Window& w = (*held).window;
    w.check_here();
    for (w.begin(); w.wants_picture();) {
      look_at(*(*held).link, row, w);
      w.draw();
    }
  });
}
