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

  int (*init)();
  int (*get_error)(const char**);
  void (*window_hint)(int, int);
  GLFWwindow* (*create_window)(int, int, const char*, GLFWmonitor*, GLFWwindow*);
  void (*destroy_window)(GLFWwindow*);
  void (*make_context_current)(GLFWwindow*);
  GLFWwindow* (*get_current_context)();
  void* (*get_proc_address)(const char*);
  void (*swap_interval)(int);
  void (*swap_buffers)(GLFWwindow*);
  void (*poll_events)();
  int (*window_should_close)(GLFWwindow*);
  void (*set_window_should_close)(GLFWwindow*, int);
  void (*hide_window)(GLFWwindow*);
  void (*get_framebuffer_size)(GLFWwindow*, int*, int*);
  void (*get_window_size)(GLFWwindow*, int*, int*);
  void (*set_window_user_pointer)(GLFWwindow*, void*);
  void* (*get_window_user_pointer)(GLFWwindow*);
  int (*get_key)(GLFWwindow*, int);
  int (*get_mouse_button)(GLFWwindow*, int);
  void (*get_cursor_pos)(GLFWwindow*, double*, double*);
  OnKey (*set_key_callback)(GLFWwindow*, OnKey);
  OnButton (*set_mouse_button_callback)(GLFWwindow*, OnButton);
  OnMove (*set_cursor_pos_callback)(GLFWwindow*, OnMove);
  OnMove (*set_scroll_callback)(GLFWwindow*, OnMove);

  // Loads and initialises GLFW. Fails if there is no display.
  static const Glfw& get();
  // Fails with GLFW's reason for its last error.
  [[noreturn]] void refuse(const std::string& what) const;

 private:
  Glfw();
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

// Opens a visible window. GLFW is used even if renderers use another back end.
std::unique_ptr<GlfwContext> open_window(int width, int height, const char* title);

}  // namespace mjenv::core::gl
