// The part of the C interface that draws.
#include <atomic>
#include <memory>

#include "firewall.hpp"
#include "render/renderer.hpp"

using namespace mjenv;
using namespace mjenv::firewall;

struct mjenv_renderer {
  Renderer renderer;
  std::shared_ptr<Link> link;
  std::atomic_flag busy = ATOMIC_FLAG_INIT;

  mjenv_renderer(mjenv_env& env, const mjenv_render_settings& settings)
      : renderer(env.env.shared_model(), settings), link(env.link) {}
};

namespace {

mjenv_render_settings defaults_of(const mjenv_env& env) { return render_defaults(env.env.model(), env.env.camera()); }

// Settings from the caller, who may know less or more of them than this library.
mjenv_render_settings taken(const mjenv_env& env, const mjenv_render_settings* from) {
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
void look_at(mjenv_renderer& r, std::int64_t row) {
  const std::lock_guard lock(r.link->mutex);
  if (!r.link->env) fail(MJENV_E_STATE, "the environment that is to be drawn was destroyed");
  const Hold hold(r.link->env->busy, "environment");
  r.link->env->env.show(row, [&](mjData_* data) { r.renderer.look_at(data); });
}

}  // namespace

mjenv_status mjenv_render_defaults(const mjenv_env* env, mjenv_render_settings* settings) {
  return guard([&] { hand_out(settings, "settings", defaults_of(need(env, "env"))); });
}

mjenv_status mjenv_renderer_create(mjenv_env* env, const mjenv_render_settings* settings, mjenv_renderer** renderer) {
  return guard([&] {
    mjenv_env& e = need(env, "env");
    need(renderer, "renderer");
    const ErrorTrap trap;
    *renderer = new mjenv_renderer(e, taken(e, settings));
  });
}

void mjenv_renderer_destroy(mjenv_renderer* renderer) {
  guard([&] {
    const ErrorTrap trap;
    delete renderer;
  });
}

const char* mjenv_renderer_gl(const mjenv_renderer* renderer) {
  return renderer ? renderer->renderer.gl().c_str() : nullptr;
}

mjenv_status mjenv_render(mjenv_renderer* renderer, std::int64_t row, std::uint8_t* rgb, std::size_t rgb_count,
                          float* depth, std::size_t depth_count) {
  return guard([&] {
    mjenv_renderer& r = need(renderer, "renderer");
    if (!rgb && !depth) fail(MJENV_E_ARGUMENT, "rgb and depth are NULL");
    check_room("rgb", rgb, rgb_count, 3 * r.renderer.pixels());
    check_room("depth", depth, depth_count, r.renderer.pixels());
    const Hold hold(r.busy, "renderer");
    const ErrorTrap trap;
    look_at(r, row);
    r.renderer.draw(rgb, depth);
  });
}
