// What is used of GLFW, so that building does not need its headers.
#pragma once

#include <string>

#include "render/gl.hpp"

// NOLINTBEGIN(bugprone-reserved-identifier): GLFW's names
struct GLFWwindow;
struct GLFWmonitor;
// NOLINTEND(bugprone-reserved-identifier)

namespace mjenv::gl {

struct Glfw {
  int (*init)();
  int (*get_error)(const char**);
  void (*window_hint)(int, int);
  GLFWwindow* (*create_window)(int, int, const char*, GLFWmonitor*, GLFWwindow*);
  void (*destroy_window)(GLFWwindow*);
  void (*make_context_current)(GLFWwindow*);
  GLFWwindow* (*get_current_context)();
  void* (*get_proc_address)(const char*);

  // Loaded and initialised; fails where there is no display.
  static const Glfw& get();
  // A window whose context nobody has current.
  GLFWwindow* open_window(int width, int height, const char* title, bool visible) const;
  // GLFW's reason for what has just failed.
  [[noreturn]] void refuse(const std::string& what) const;
  void enter(GLFWwindow* window) const;

 private:
  Glfw();
};

}  // namespace mjenv::gl
