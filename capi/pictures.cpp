// The part of the C interface that draws.
#include <memory>

#include "firewall.hpp"
#include "held.hpp"
#include "render/gl.hpp"
#include "structs.hpp"

using namespace mjenv::core;
using namespace mjenv::core::firewall;

namespace {

mjenv_render_settings defaults_of(const HeldEnv& env) { return render_defaults(env.env.model(), env.env.camera()); }

mjenv_render_settings settings_of(const HeldEnv& env, const mjenv_render_settings* given) {
  return given ? read_struct(given, "settings", defaults_of(env)) : defaults_of(env);
}

void check_room(const char* name, const void* to, std::int64_t count, std::size_t needed) {
  if (size_of(count, name) < needed && to)
    fail(MJENV_E_SIZE, std::string(name) + " has room for " + std::to_string(count) + ", but " +
                           std::to_string(needed) + " are needed");
}

// Shows a row to a renderer or a window. Waits while another renderer or window reads a row. Throws BUSY (Entered)
// while a thread steps the rows.
template <typename Painter>
void look_at(Link& link, std::int64_t row, Painter& painter) {
  const std::lock_guard lock(link.lock);
  if (!link.env || !link.env->object) fail(MJENV_E_ARGUMENT, "the environment that is to be drawn was destroyed");
  const Entered env(link.env);
  Env& rows = (*env).env;
  rows.with_mirrors(
      [&] { rows.show(row, [&](const mjModel_& model, mjData_* data) { painter.look_at(model, data); }); });
}

}  // namespace

mjenv_status mjenv_render_defaults(const mjenv_env* env, mjenv_render_settings* settings) {
  return read(env, [&](const HeldEnv& held) { write_struct(settings, "settings", defaults_of(held)); });
}

mjenv_status mjenv_renderer_create(mjenv_env* env, const mjenv_render_settings* settings, mjenv_renderer** renderer) {
  return read(env, [&](const HeldEnv& held) {
    need(renderer, "renderer");
    *renderer = handles<mjenv_renderer>.add(std::make_unique<Painting<Renderer>>(held, settings_of(held, settings)));
  });
}

void mjenv_renderer_destroy(mjenv_renderer* renderer) { destroy(renderer); }

const char* mjenv_renderer_gl(const mjenv_renderer* renderer) {
  return answer<const char*>(nullptr, [&] { return (*Reading(renderer)).painter.gl().c_str(); });
}

mjenv_status mjenv_render(mjenv_renderer* renderer, std::int64_t row, std::uint8_t* rgb, std::int64_t rgb_count,
                          float* depth, std::int64_t depth_count) {
  return change(renderer, [&](Painting<Renderer>& held) {
    Renderer& r = held.painter;
    gl::check_here("the renderer");
    if (!rgb && !depth) fail(MJENV_E_ARGUMENT, "rgb and depth are NULL");
    check_room("rgb", rgb, rgb_count, 3 * r.pixels());
    check_room("depth", depth, depth_count, r.pixels());
    look_at(*held.link, row, r);
    r.draw(rgb, depth);
  });
}

mjenv_status mjenv_render_segmentation(mjenv_renderer* renderer, std::int64_t row, std::int32_t* objects,
                                       std::int64_t count) {
  return change(renderer, [&](Painting<Renderer>& held) {
    Renderer& r = held.painter;
    gl::check_here("the renderer");
    need(objects, "objects");
    check_room("objects", objects, count, 2 * r.pixels());
    look_at(*held.link, row, r);
    r.draw_segmentation(objects);
  });
}

mjenv_status mjenv_window_create(mjenv_env* env, const mjenv_render_settings* settings, mjenv_window** window) {
  return read(env, [&](const HeldEnv& held) {
    need(window, "window");
    *window = handles<mjenv_window>.add(std::make_unique<Painting<Window>>(held, settings_of(held, settings)));
  });
}

void mjenv_window_destroy(mjenv_window* window) { destroy(window); }

std::int32_t mjenv_window_is_open(const mjenv_window* window) {
  return answer<std::int32_t>(0, [&] { return (*Reading(window)).painter.is_open(); });
}

mjenv_status mjenv_window_draw(mjenv_window* window, std::int64_t row) {
  return change(window, [&](Painting<Window>& held) {
    Window& w = held.painter;
    gl::check_here("the window");
    for (w.begin(); w.wants_picture();) {
      look_at(*held.link, row, w);
      w.draw();
    }
  });
}
