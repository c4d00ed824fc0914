// The parts of GLFW's header that are used here, so that the build does not need that header.
#pragma once

#include <string>

#include "render/gl.hpp"

// NOLINTBEGIN(bugprone-reserved-identifier): GLFW's names
struct GLFWwindow;
struct GLFWmonitor;
// NOLINTEND(bugprone-reserved-identifier)

namespace mjenv::core::gl {

struct Glfw {
  using OnKey = void (*)(GLFWwindow*, int key, int scancode, int action, int modifiers);
  using OnButton = void (*)(GLFWwindow*, int button, int action, int modifiers);
  using OnMove = void (*)(GLFWwindow*, double x, double y);

  Library library{"libglfw.so.3", "libglfw3"};
  int (*init)() = library.find("glfwInit");
  int (*get_error)(const char**) = library.find("glfwGetError");
  void (*window_hint)(int, int) = library.find("glfwWindowHint");
  GLFWwindow* (*create_window)(int, int, const char*, GLFWmonitor*, GLFWwindow*) = library.find("glfwCreateWindow");
  void (*destroy_window)(GLFWwindow*) = library.find("glfwDestroyWindow");
  void (*make_context_current)(GLFWwindow*) = library.find("glfwMakeContextCurrent");
  GLFWwindow* (*get_current_context)() = library.find("glfwGetCurrentContext");
  void* (*get_proc_address)(const char*) = library.find("glfwGetProcAddress");
  void (*swap_interval)(int) = library.find("glfwSwapInterval");
  void (*swap_buffers)(GLFWwindow*) = library.find("glfwSwapBuffers");
  void (*poll_events)() = library.find("glfwPollEvents");
  int (*window_should_close)(GLFWwindow*) = library.find("glfwWindowShouldClose");
  void (*set_window_should_close)(GLFWwindow*, int) = library.find("glfwSetWindowShouldClose");
  void (*hide_window)(GLFWwindow*) = library.find("glfwHideWindow");
  void (*get_framebuffer_size)(GLFWwindow*, int*, int*) = library.find("glfwGetFramebufferSize");
  void (*get_window_size)(GLFWwindow*, int*, int*) = library.find("glfwGetWindowSize");
  void (*set_window_user_pointer)(GLFWwindow*, void*) = library.find("glfwSetWindowUserPointer");
  void* (*get_window_user_pointer)(GLFWwindow*) = library.find("glfwGetWindowUserPointer");
  int (*get_key)(GLFWwindow*, int) = library.find("glfwGetKey");
  int (*get_mouse_button)(GLFWwindow*, int) = library.find("glfwGetMouseButton");
  void (*get_cursor_pos)(GLFWwindow*, double*, double*) = library.find("glfwGetCursorPos");
  OnKey (*set_key_callback)(GLFWwindow*, OnKey) = library.find("glfwSetKeyCallback");
  OnButton (*set_mouse_button_callback)(GLFWwindow*, OnButton) = library.find("glfwSetMouseButtonCallback");
  OnMove (*set_cursor_pos_callback)(GLFWwindow*, OnMove) = library.find("glfwSetCursorPosCallback");
  OnMove (*set_scroll_callback)(GLFWwindow*, OnMove) = library.find("glfwSetScrollCallback");

  // Loads and initialises GLFW. Fails if there is no display.
  static const Glfw& get();
  // Fails with GLFW's reason for its last error.
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  Glfw() = default;
};

// The context of a window.
class GlfwContext : public Context {
 public:
  GlfwContext(int width, int height, const char* title, bool visible);
  ~GlfwContext() override;

  void enter() override;
  void leave() noexcept override { glfw.make_context_current(previous_); }
  void* function(const char* name) const override { return glfw.get_proc_address(name); }
  void show() const override;
  const char* name() const override { return "glfw"; }
  GLFWwindow* window() const { return window_; }

  const Glfw& glfw = Glfw::get();

 private:
  GLFWwindow* window_;
  GLFWwindow* previous_ = nullptr;  // the thread's context before enter
};

// Opens a visible window with GLFW. Renderers of the same process may use EGL, which has the same OpenGL functions, but
// not OSMesa, which has its own (Binding in gl.cpp).
std::unique_ptr<GlfwContext> open_window(int width, int height, const char* title);

}  // namespace mjenv::core::gl
