#include "render/glfw.hpp"

#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core::gl {

const Glfw& Glfw::get() {
  static const Glfw* const glfw = new Glfw;
  if (!glfw->init()) glfw->refuse("there is no display");
  return *glfw;
}

void Glfw::refuse(const std::string& what) const {
  const char* reason = nullptr;
  get_error(&reason);
  fail(MJENV_E_RENDER, "glfw: " + what + (reason ? std::string(": ") + reason : ""));
}

GlfwContext::GlfwContext(int width, int height, const char* title, bool visible) {
  constexpr int kVisible = 0x00020004;
  glfw.window_hint(kVisible, visible);
  window_ = glfw.create_window(width, height, title, nullptr, nullptr);
  if (!window_) glfw.refuse("no window with OpenGL could be made");
}

GlfwContext::~GlfwContext() {
  if (here()) glfw.destroy_window(window_);
}

void GlfwContext::show() const {
  // Makes the OpenGL library that GLFW has loaded visible to MuJoCo. Otherwise MuJoCo could take the functions of an
  // OSMesa that was tried before.
  for (const char* file : {"libGLX.so.0", "libGL.so.1", "libEGL.so.1"})
    if (platform::show_library(file)) return;
}

void GlfwContext::enter() {
  previous_ = glfw.get_current_context();
  glfw.get_error(nullptr);
  glfw.make_context_current(window_);
  if (glfw.get_current_context() != window_) glfw.refuse("the window's context cannot be made current");
}

}  // namespace mjenv::core::gl
