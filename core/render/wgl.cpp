#include <array>
#include <cstdint>
#include <exception>
#include <future>
#include <string>
#include <thread>
#include <utility>

#include "error.hpp"
#include "render/gl.hpp"
#include "system/platform.hpp"

namespace mjenv::core::gl {
namespace {

// Declares the parts of Windows' headers that are used here, so that builds on other systems can compile this file,
// too. 64-bit Windows has only one calling convention, so the functions need no attribute for it.
using Handle = void*;

struct WindowClass {  // WNDCLASSEXW
  std::uint32_t size, style;
  void* procedure;
  std::array<std::int32_t, 2> extra;
  Handle instance, icon, cursor, background;
  const char16_t *menu, *name;
  Handle small_icon;
};
static_assert(sizeof(WindowClass) == 80 || sizeof(void*) != 8);

struct Message {  // MSG
  Handle window;
  std::uint32_t number;
  std::array<std::uint64_t, 2> parameters;
  std::uint32_t time;
  std::array<std::int32_t, 2> position;
};
static_assert(sizeof(Message) == 48 || sizeof(void*) != 8);

struct PixelFormat {  // PIXELFORMATDESCRIPTOR
  std::uint16_t size, version;
  std::uint32_t flags;
  std::uint8_t kind, colour;
  std::array<std::uint8_t, 6> colours;
  std::uint8_t alpha, alpha_shift;
  std::array<std::uint8_t, 5> accumulated;
  std::uint8_t depth, stencil;
  std::array<std::uint8_t, 3> others;
  std::array<std::uint32_t, 3> masks;
};
static_assert(sizeof(PixelFormat) == 40);

constexpr std::uint32_t kOwnDevice = 0x20, kPopup = 0x80000000, kClose = 0x10, kQuit = 0x12;
constexpr std::uint32_t kDoubleBuffer = 1, kDrawToWindow = 4, kSupportOpengl = 0x20;

struct Wgl {
  Library kernel{"kernel32.dll", ""}, user{"user32.dll", ""}, gdi{"gdi32.dll", ""}, opengl{"opengl32.dll", ""};
  std::uint32_t (*get_last_error)() = kernel.find("GetLastError");
  void (*set_last_error)(std::uint32_t) = kernel.find("SetLastError");
  Handle (*get_module)(const char16_t*) = kernel.find("GetModuleHandleW");
  std::uint16_t (*register_class)(const WindowClass*) = user.find("RegisterClassExW");
  Handle (*create_window)(std::uint32_t, const char16_t*, const char16_t*, std::uint32_t, int, int, int, int, Handle,
                          Handle, Handle, void*) = user.find("CreateWindowExW");
  int (*destroy_window)(Handle) = user.find("DestroyWindow");
  void* default_procedure = user.find("DefWindowProcW");
  Handle (*get_device)(Handle) = user.find("GetDC");
  int (*get_message)(Message*, Handle, std::uint32_t, std::uint32_t) = user.find("GetMessageW");
  std::int64_t (*dispatch_message)(const Message*) = user.find("DispatchMessageW");
  int (*post_thread_message)(std::uint32_t, std::uint32_t, std::uint64_t,
                             std::int64_t) = user.find("PostThreadMessageW");
  int (*choose_pixel_format)(Handle, const PixelFormat*) = gdi.find("ChoosePixelFormat");
  int (*set_pixel_format)(Handle, int, const PixelFormat*) = gdi.find("SetPixelFormat");
  Handle (*create_context)(Handle) = opengl.find("wglCreateContext");
  int (*delete_context)(Handle) = opengl.find("wglDeleteContext");
  int (*make_current)(Handle, Handle) = opengl.find("wglMakeCurrent");
  Handle (*get_current_context)() = opengl.find("wglGetCurrentContext");
  Handle (*get_current_device)() = opengl.find("wglGetCurrentDC");
  void* (*get_proc_address)(const char*) = opengl.find("wglGetProcAddress");

  // Throws with the reason of Windows' last error. Call this directly after the function that failed.
  [[noreturn]] void refuse(const std::string& what) const {
    fail(MJENV_E_RENDER, "wgl: " + what + " (Windows' error " + std::to_string(get_last_error()) + ")");
  }
};

// A window that is never shown. Windows destroys a window when the thread that created it ends, but an OpenGL context
// may be used by other threads after that. So each hidden window has a thread of its own.
class HiddenWindow {
 public:
  explicit HiddenWindow(const Wgl& wgl) : wgl_(wgl) {
    std::promise<Handle> device;
    std::future<Handle> made = device.get_future();
    try {
      thread_ = std::thread([this, to = std::move(device)]() mutable { live(to); });
    } catch (const std::exception&) {
      fail(MJENV_E_MEMORY, "wgl: the system does not give this process a thread for the window");
    }
    try {
      device_ = made.get();
    } catch (...) {
      thread_.join();
      throw;
    }
  }

  ~HiddenWindow() {
    wgl_.post_thread_message(thread_id_, kQuit, 0, 0);
    thread_.join();
  }

  HiddenWindow(const HiddenWindow&) = delete;
  HiddenWindow& operator=(const HiddenWindow&) = delete;

  // The window's device context, to which OpenGL draws.
  Handle device() const { return device_; }

 private:
  const Wgl& wgl_;
  std::uint32_t thread_id_ = 0;
  Handle device_ = nullptr;
  std::thread thread_;

  void live(std::promise<Handle>& made) {
    Handle window = nullptr;
    try {
      thread_id_ = platform::thread_id();
      window = create();
      made.set_value(prepared(window));
    } catch (...) {
      if (window) wgl_.destroy_window(window);
      made.set_exception(std::current_exception());
      return;
    }
    // Handles the window's messages, because Windows would wait for a window that does not handle its own. Only the
    // owner of this object closes the window.
    Message message{};
    while (wgl_.get_message(&message, nullptr, 0, 0) > 0)
      if (message.number != kClose) wgl_.dispatch_message(&message);
    wgl_.destroy_window(window);
  }

  Handle create() const {
    WindowClass kind{};
    kind.size = sizeof kind;
    kind.style = kOwnDevice;  // one thread after the other can use such a device context
    kind.procedure = wgl_.default_procedure;
    kind.instance = wgl_.get_module(nullptr);
    kind.name = u"mjenv";
    wgl_.register_class(&kind);  // fails for all windows but the first, because the class then exists
    wgl_.set_last_error(0);
    Handle window = wgl_.create_window(0, kind.name, kind.name, kPopup, 0, 0, 1, 1, nullptr, nullptr, kind.instance,
                                       nullptr);  // one pixel, because pictures are drawn to a separate framebuffer
    if (!window) wgl_.refuse("no window could be made");
    return window;
  }

  Handle prepared(Handle window) const {
    Handle device = wgl_.get_device(window);
    PixelFormat wanted{};
    wanted.size = sizeof wanted;
    wanted.version = 1;
    wanted.flags = kDrawToWindow | kSupportOpengl | kDoubleBuffer;
    wanted.colour = 24;
    wanted.alpha = 8;
    wanted.depth = 24;
    wanted.stencil = 8;
    const int format = device ? wgl_.choose_pixel_format(device, &wanted) : 0;
    if (format == 0) wgl_.refuse("the display has no OpenGL");
    if (!wgl_.set_pixel_format(device, format, &wanted)) wgl_.refuse("the window cannot be drawn to with OpenGL");
    return device;
  }
};

class WglContext : public Context {
 public:
  explicit WglContext(const Wgl& wgl) : wgl_(wgl), window_(wgl), context_(wgl.create_context(window_.device())) {
    if (!context_) wgl_.refuse("no context could be made");
  }

  ~WglContext() override { wgl_.delete_context(context_); }

  void enter() override {
    previous_ = wgl_.get_current_context();
    previous_device_ = wgl_.get_current_device();
    if (!wgl_.make_current(window_.device(), context_)) wgl_.refuse("the context is lost, or in use on another thread");
  }

  void leave() noexcept override { wgl_.make_current(previous_ ? previous_device_ : nullptr, previous_); }

  // Windows finds the functions of OpenGL 1.1 in opengl32.dll, and all others in the driver.
  void* function(const char* name) const override {
    void* const found = wgl_.get_proc_address(name);
    return found ? found : wgl_.opengl.look_up(name);
  }
  void show() const override {}  // not needed: on Windows, MuJoCo always looks in this library
  const char* name() const override { return "wgl"; }

 private:
  const Wgl& wgl_;
  HiddenWindow window_;
  Handle context_;
  Handle previous_ = nullptr, previous_device_ = nullptr;  // the thread's context before enter
};

}  // namespace

std::unique_ptr<Context> open_wgl() {
  static const Wgl* const wgl = new Wgl;
  auto context = std::make_unique<WglContext>(*wgl);
  const Current current(*context);
  if (!context->function("glBindFramebuffer"))  // without a driver, Windows has only OpenGL 1.1
    fail(MJENV_E_RENDER, traits_of(*context).text + ": too old to draw pictures; install the graphics card's driver");
  return context;
}

}  // namespace mjenv::core::gl
