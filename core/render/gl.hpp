// OpenGL contexts. OpenGL's libraries are loaded when they are first needed; this library does not link to them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "mjenv/mjenv.h"

namespace mjenv::core::gl {

// An OpenGL context, which any thread may use, but only one thread at a time.
class Context {
 public:
  virtual ~Context() = default;
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Makes the context current on the calling thread. leave makes the previous context of the thread current again.
  virtual void enter() = 0;
  virtual void leave() noexcept = 0;
  // Returns the OpenGL function with this name.
  virtual void* function(const char* name) const = 0;
  // Makes the functions of its OpenGL library visible to MuJoCo, as long as the process lives.
  virtual void show() const = 0;
  // "egl", "glfw", "osmesa" or "wgl"
  virtual const char* name() const = 0;
};

// Makes a context current while it lives.
class Current {
 public:
  explicit Current(Context& context) : context_(context) { context_.enter(); }
  ~Current() { context_.leave(); }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  Context& context_;
};

// Opens a context. back_end: an mjenv_gl.
std::unique_ptr<Context> open(std::int32_t back_end);

// Whether this process has opened contexts. False in a forked child, which cannot use the contexts of its parent.
bool here();
// Fails unless here(). what: "the renderer", for the message.
void check_here(const char* what);

// The names of the OpenGL implementation, and the largest picture that it draws.
struct Traits {
  std::string text;
  int width = 0, height = 0;
};
Traits traits_of(const Context& current);

// The back ends. They fail with the reason and MJENV_E_RENDER. EGL fails with MJENV_E_VALUE if MUJOCO_EGL_DEVICE_ID is
// invalid, and WGL with MJENV_E_MEMORY if the system gives it no thread.
std::unique_ptr<Context> open_egl();
std::unique_ptr<Context> open_osmesa();
std::unique_ptr<Context> open_wgl();

// Converts the address of a symbol to a pointer to a function of any type.
struct Symbol {
  void* address;
  template <typename F>
  operator F*() const {
    return reinterpret_cast<F*>(address);
  }
};

// A shared library. It is never unloaded, because drivers would crash. Its errors name the Debian packages to install.
class Library {
 public:
  Library(const char* file, const char* packages);
  Symbol find(const char* name) const;
  // Null if the library has no such function.
  void* look_up(const char* name) const;
  // Makes the library's symbols visible to the whole process, as if the process were linked to it.
  void show() const;

 private:
  const char* file_;
  void* handle_;
};

}  // namespace mjenv::core::gl
