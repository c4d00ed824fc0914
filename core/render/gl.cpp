#include "render/gl.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>

#include "error.hpp"
#include "render/glfw.hpp"
#include "system/platform.hpp"

namespace mjenv::core::gl {
namespace {

constexpr unsigned kVendor = 0x1F00, kRenderer = 0x1F01, kVersion = 0x1F02;
constexpr unsigned kMaxViewportDims = 0x0D3A, kMaxRenderbufferSize = 0x84E8;

struct BackEnd {
  mjenv_gl number;
  const char* name;
};
// MJENV_GL_AUTO tries them in this order.
constexpr std::array<BackEnd, 4> back_ends{
    {{MJENV_GL_EGL, "egl"}, {MJENV_GL_GLFW, "glfw"}, {MJENV_GL_OSMESA, "osmesa"}, {MJENV_GL_WGL, "wgl"}}};

// MuJoCo looks up the functions of OpenGL once per process. EGL and GLFW have the same functions, but OSMesa has its
// own, so a process that has drawn with OSMesa cannot draw with EGL or GLFW, nor the other way round.
struct Binding {
  std::mutex mutex;
  std::atomic<std::int32_t> process{0};
  mjenv_gl back_end = MJENV_GL_AUTO;
};

Binding& binding() {
  static auto* const once = new Binding;  // never deleted: a thread may draw while the process exits
  return *once;
}

const BackEnd& known_back_end(std::int32_t number) {
  for (const auto& known : back_ends)
    if (known.number == number) return known;
  fail(MJENV_E_VALUE, "gl is " + std::to_string(number) + ", not an mjenv_gl");
}

const char* name_of(mjenv_gl back_end) { return known_back_end(back_end).name; }

mjenv_gl chosen(std::int32_t asked) {
  if (asked != MJENV_GL_AUTO) return known_back_end(asked).number;
  const std::string variable = platform::environment("MUJOCO_GL").value_or("");
  if (variable.empty()) return MJENV_GL_AUTO;
  for (const auto& known : back_ends)
    if (variable == known.name) return known.number;
  fail(MJENV_E_VALUE, "the environment variable MUJOCO_GL is " + quoted(variable) + ", not egl, glfw, osmesa or wgl");
}

// Fails if this system does not draw with the back end at all.
void check_system(mjenv_gl back_end) {
  if (platform::draws_with(name_of(back_end))) return;
  std::string others;
  for (const auto& known : back_ends)
    if (platform::draws_with(known.name)) others += (others.empty() ? "" : " or ") + std::string(known.name);
  fail(MJENV_E_RENDER, std::string("this system does not draw with ") + name_of(back_end) + ", but with " + others);
}

// Fails if MuJoCo would take the functions of another back end than this one. It takes EGL's if they are visible in the
// process, otherwise OSMesa's.
void check_binding(const Binding& bound, mjenv_gl back_end) {
  const bool osmesa = back_end == MJENV_GL_OSMESA;
  if (bound.back_end != MJENV_GL_AUTO) {
    if (osmesa != (bound.back_end == MJENV_GL_OSMESA))
      fail(MJENV_E_RENDER, std::string("this process draws with ") + name_of(bound.back_end) +
                               " already, which excludes " + name_of(back_end) + " until it ends");
    return;
  }
  const bool shows_egl = platform::visible_symbol("eglGetProcAddress");
  const bool shows_osmesa = platform::visible_symbol("OSMesaGetProcAddress");
  if (osmesa ? shows_egl : (!shows_egl && shows_osmesa))
    fail(MJENV_E_RENDER, std::string("this process has loaded ") + (osmesa ? "EGL" : "OSMesa") + ", which excludes " +
                             name_of(back_end));
}

// Opens a context of this back end, and records that MuJoCo will take its functions from there.
template <typename Open>
auto bind(Binding& bound, mjenv_gl back_end, const Open& open_context) {
  if (bound.back_end != MJENV_GL_AUTO) check_binding(bound, back_end);
  auto context = open_context();
  check_binding(bound, back_end);
  context->show();  // only after it was opened successfully, because afterwards other back ends cannot be used
  bound.back_end = back_end;
  return context;
}

std::unique_ptr<Context> open_one(Binding& bound, mjenv_gl back_end) {
  check_system(back_end);
  return bind(bound, back_end, [&]() -> std::unique_ptr<Context> {
    if (back_end == MJENV_GL_EGL) return open_egl();
    if (back_end == MJENV_GL_OSMESA) return open_osmesa();
    if (back_end == MJENV_GL_WGL) return open_wgl();
    return std::make_unique<GlfwContext>(1, 1, "mjenv", false);  // small: pictures are drawn to a framebuffer
  });
}

std::unique_ptr<Context> open_chosen(Binding& bound, mjenv_gl choice) {
  if (choice != MJENV_GL_AUTO) return open_one(bound, choice);
  std::string reasons;
  for (const auto& candidate : back_ends) {
    if (!platform::draws_with(candidate.name)) continue;
    try {
      return open_one(bound, candidate.number);
    } catch (const Error& error) {
      reasons += std::string("; ") + error.what();
    }
  }
  fail(MJENV_E_RENDER, "no OpenGL" + reasons);
}

// Calls open_context(binding) under the lock. Fails in a forked child of a process that used OpenGL.
template <typename Open>
auto with_binding(const Open& open_context) {
  if (*platform::no_pictures) fail(MJENV_E_RENDER, platform::no_pictures);
  Binding& bound = binding();
  const std::int32_t before = bound.process;
  // Checked before the lock is taken, because in a forked child the lock may stay locked for ever.
  if (before != 0 && before != platform::process_id())
    fail(MJENV_E_RENDER,
         "OpenGL was used before this process was forked: start processes with spawn instead, or draw in one process "
         "only");
  const std::lock_guard lock(bound.mutex);
  bound.process = platform::process_id();
  try {
    return open_context(bound);
  } catch (...) {
    if (bound.back_end == MJENV_GL_AUTO) bound.process = 0;
    throw;
  }
}

}  // namespace

std::unique_ptr<Context> open(std::int32_t back_end) {
  return with_binding([&](Binding& bound) { return open_chosen(bound, chosen(back_end)); });
}

std::unique_ptr<GlfwContext> open_window(int width, int height, const char* title) {
  return with_binding([&](Binding& bound) {
    if (!platform::draws_with("glfw"))
      fail(MJENV_E_RENDER, "this library shows no windows on this system: draw pictures with a renderer");
    return bind(bound, MJENV_GL_GLFW, [&] { return std::make_unique<GlfwContext>(width, height, title, true); });
  });
}

bool here() { return binding().process == platform::process_id(); }

void check_here(const char* what) {
  if (!here()) fail(MJENV_E_RENDER, std::string(what) + " was made before this process was forked");
}

Traits traits_of(const Context& current) {
  const unsigned char* (*get_string)(unsigned) = Symbol{current.function("glGetString")};
  void (*get_integers)(unsigned, int*) = Symbol{current.function("glGetIntegerv")};
  if (!get_string || !get_integers || !get_string(kVersion))
    fail(MJENV_E_RENDER, std::string(current.name()) + ": no OpenGL context is current");
  Traits traits;
  traits.text = current.name();
  for (const unsigned part : {kVendor, kRenderer, kVersion}) {
    const unsigned char* text = get_string(part);
    traits.text += std::string(", ") + (text ? reinterpret_cast<const char*>(text) : "");
  }
  std::array<int, 2> viewport{};
  int buffer = 0;
  get_integers(kMaxViewportDims, viewport.data());
  get_integers(kMaxRenderbufferSize, &buffer);
  traits.width = std::min(viewport[0], buffer);
  traits.height = std::min(viewport[1], buffer);
  return traits;
}

Library::Library(const char* file, const char* packages) : file_(file) {
  std::string reason;
  handle_ = platform::open_library(file, reason);
  if (handle_) return;
  if (*packages) reason += std::string(" (Debian: apt-get install ") + packages + ")";
  fail(MJENV_E_RENDER, reason);
}

void Library::show() const { platform::show_library(file_); }
void* Library::look_up(const char* name) const { return platform::symbol_of(handle_, name); }

Symbol Library::find(const char* name) const {
  if (void* found = look_up(name)) return {found};
  fail(MJENV_E_RENDER, std::string(file_) + " has no " + name);
}

}  // namespace mjenv::core::gl
