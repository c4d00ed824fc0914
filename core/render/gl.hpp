// OpenGL contexts without a display, loaded when they are asked for: the library links to none.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "mjenv/mjenv.h"

namespace mjenv::core::gl {

// A context to draw in. It may be used from any thread, by one at a time.
class Context {
 public:
  virtual ~Context() = default;
  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Makes it current on the calling thread; leave gives the thread back what was current there before.
  virtual void enter() = 0;
  virtual void leave() noexcept = 0;
  // The OpenGL function of that name.
  virtual void* function(const char* name) const = 0;
  // Puts its functions where MuJoCo looks for them, for good.
  virtual void show() const = 0;
  // "egl", "osmesa" or "glfw"
  virtual const char* name() const = 0;
};

class Current {
 public:
  explicit Current(Context& context) : context_(context) { context_.enter(); }
  ~Current() { context_.leave(); }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;

 private:
  Context& context_;
};

// A context of that back end, an mjenv_gl.
std::unique_ptr<Context> open(std::int32_t back_end);

// OpenGL was first used in this process; a forked child cannot go on with it.
bool here();

// What the context's implementation calls itself, and the widest and highest picture it draws.
struct Traits {
  std::string text;
  int width = 0, height = 0;
};
Traits traits_of(const Context& current);

// The back ends; they fail with MJENV_E_RENDER and the reason.
std::unique_ptr<Context> open_egl();
std::unique_ptr<Context> open_osmesa();

// A shared library, for good: drivers do not survive being unloaded. Fails with the Debian packages to install.
class Library {
 public:
  Library(const char* file, const char* packages);
  template <typename F>
  void find(F& function, const char* name) const {
    function = reinterpret_cast<F>(symbol(name));
  }
  // To the whole process, as if it had been linked to it.
  void show() const;

 private:
  const char* file_;
  void* handle_;

  void* symbol(const char* name) const;
};

}  // namespace mjenv::core::gl
