#include "render/glfw.hpp"

#include "error.hpp"

namespace mjenv::gl {
namespace {

constexpr int kVisible = 0x00020004;

class GlfwContext : public Context {
 public:
  GlfwContext(int width, int height) : window_(glfw_.open_window(width, height, "mjenv", false)) {}
  ~GlfwContext() override {
    if (here()) glfw_.destroy_window(window_);
  }

  void enter() override {
    previous_ = glfw_.get_current_context();
    glfw_.enter(window_);
  }
  void leave() noexcept override { glfw_.make_context_current(previous_); }
  void* function(const char* name) const override { return glfw_.get_proc_address(name); }
  const char* name() const override { return "glfw"; }

 private:
  const Glfw& glfw_ = Glfw::get();
  GLFWwindow* window_;
  GLFWwindow* previous_ = nullptr;  // what the thread that entered had current
};

}  // namespace

Glfw::Glfw() {
  const Library library("libglfw.so.3", "libglfw3");
  library.find(init, "glfwInit");
  library.find(get_error, "glfwGetError");
  library.find(window_hint, "glfwWindowHint");
  library.find(create_window, "glfwCreateWindow");
  library.find(destroy_window, "glfwDestroyWindow");
  library.find(make_context_current, "glfwMakeContextCurrent");
  library.find(get_current_context, "glfwGetCurrentContext");
  library.find(get_proc_address, "glfwGetProcAddress");
}

const Glfw& Glfw::get() {
  static const Glfw* const glfw = new Glfw;
  if (!glfw->init()) glfw->refuse("there is no display");
  return *glfw;
}

GLFWwindow* Glfw::open_window(int width, int height, const char* title, bool visible) const {
  window_hint(kVisible, visible);
  GLFWwindow* window = create_window(width, height, title, nullptr, nullptr);
  if (!window) refuse("no window with OpenGL could be made");
  return window;
}

void Glfw::refuse(const std::string& what) const {
  const char* reason = nullptr;
  get_error(&reason);
  fail(MJENV_E_RENDER, "glfw: " + what + (reason ? std::string(": ") + reason : ""));
}

void Glfw::enter(GLFWwindow* window) const {
  get_error(nullptr);
  make_context_current(window);
  if (get_current_context() != window) refuse("the window's context cannot be made current");
}

std::unique_ptr<Context> open_glfw(int width, int height) { return std::make_unique<GlfwContext>(width, height); }

}  // namespace mjenv::gl
