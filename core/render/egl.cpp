#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "error.hpp"
#include "render/gl.hpp"
#include "system/platform.hpp"

namespace mjenv::core::gl {
namespace {

// The parts of EGL's headers that are used here, so that the build does not need those headers.
using Display = void*;
using Config = void*;
using Surface = void*;
using Handle = void*;
using Device = void*;
using Int = std::int32_t;
constexpr Int kAlphaSize = 0x3021, kBlueSize = 0x3022, kGreenSize = 0x3023, kRedSize = 0x3024, kDepthSize = 0x3025,
              kStencilSize = 0x3026, kSurfaceType = 0x3033, kNone = 0x3038, kColorBufferType = 0x303F,
              kRenderableType = 0x3040, kRgbBuffer = 0x308E, kPbufferBit = 1, kOpenglBit = 8, kDraw = 0x3059,
              kRead = 0x305A;
constexpr unsigned kOpenglApi = 0x30A2, kPlatformDevice = 0x313F, kPlatformSurfaceless = 0x31DD;

constexpr const char* kPackages = "libegl1 libgl1-mesa-dri";

struct Egl {
  Library library{"libEGL.so.1", kPackages};
  unsigned (*initialize)(Display, Int*, Int*) = library.find("eglInitialize");
  unsigned (*bind_api)(unsigned) = library.find("eglBindAPI");
  unsigned (*query_api)() = library.find("eglQueryAPI");
  unsigned (*choose_config)(Display, const Int*, Config*, Int, Int*) = library.find("eglChooseConfig");
  Handle (*create_context)(Display, Config, Handle, const Int*) = library.find("eglCreateContext");
  unsigned (*destroy_context)(Display, Handle) = library.find("eglDestroyContext");
  unsigned (*make_current)(Display, Surface, Surface, Handle) = library.find("eglMakeCurrent");
  Handle (*get_current_context)() = library.find("eglGetCurrentContext");
  Display (*get_current_display)() = library.find("eglGetCurrentDisplay");
  Surface (*get_current_surface)(Int) = library.find("eglGetCurrentSurface");
  Int (*get_error)() = library.find("eglGetError");
  void* (*get_proc_address)(const char*) = library.find("eglGetProcAddress");
  // Extensions, which may be missing.
  unsigned (*query_devices)(Int, Device*, Int*) = Symbol{get_proc_address("eglQueryDevicesEXT")};
  Display (*get_platform_display)(unsigned, void*, const Int*) = Symbol{get_proc_address("eglGetPlatformDisplayEXT")};

  [[noreturn]] void refuse(const std::string& what) const {
    std::array<char, 16> code{};
    std::snprintf(code.data(), code.size(), "0x%x", static_cast<unsigned>(get_error()));
    fail(MJENV_E_RENDER, "egl: " + what + " (" + code.data() + ")");
  }

  Display ready(unsigned platform, void* device) const {
    const Display display = get_platform_display(platform, device, nullptr);
    return display && initialize(display, nullptr, nullptr) ? display : nullptr;
  }

  // Opens the display of the first device that works, or of the device that MUJOCO_EGL_DEVICE_ID selects, as MuJoCo's
  // Python package does. If there is none, opens Mesa's display without a device.
  Display open_display() const {
    if (!get_platform_display) fail(MJENV_E_RENDER, "egl: this EGL cannot draw without a window");
    std::array<Device, 64> devices{};
    Int count = 0;
    if (!query_devices || !query_devices(static_cast<Int>(devices.size()), devices.data(), &count)) count = 0;
    Int first = 0, last = count;
    if (const auto chosen = platform::environment("MUJOCO_EGL_DEVICE_ID")) {
      char* end = nullptr;
      const long index = std::strtol(chosen->c_str(), &end, 10);
      if (end == chosen->c_str() || *end || index < 0 || index >= count)
        fail(MJENV_E_VALUE,
             "the environment variable MUJOCO_EGL_DEVICE_ID is " + quoted(*chosen) +
                 (count == 0 ? ", but EGL lists no devices" : ", outside 0.." + std::to_string(count - 1)));
      first = static_cast<Int>(index);
      last = first + 1;
    }
    for (Int i = first; i < last; ++i)
      if (const Display display = ready(kPlatformDevice, devices[static_cast<std::size_t>(i)])) return display;
    if (const Display display = ready(kPlatformSurfaceless, nullptr)) return display;
    fail(MJENV_E_RENDER, std::string("egl: no driver that draws (Debian: apt-get install ") + kPackages + ")");
  }
};

class EglContext : public Context {
 public:
  explicit EglContext(const Egl& egl) : egl_(egl), display_(egl.open_display()) {
    constexpr std::array<Int, 23> wanted{
        kRedSize,        8,          kGreenSize,   8, kBlueSize,        8,          kAlphaSize,   8,
        kDepthSize,      24,         kStencilSize, 8, kColorBufferType, kRgbBuffer, kSurfaceType, kPbufferBit,
        kRenderableType, kOpenglBit, kNone};
    Config config = nullptr;
    Int count = 0;
    if (!egl_.choose_config(display_, wanted.data(), &config, 1, &count) || count < 1)
      egl_.refuse("no configuration with 8 bits a colour and 24 of depth");
    const unsigned api = egl_.query_api();
    egl_.bind_api(kOpenglApi);
    context_ = egl_.create_context(display_, config, nullptr, nullptr);
    egl_.bind_api(api);
    if (!context_) egl_.refuse("no context could be made");
  }

  ~EglContext() override {
    if (here()) egl_.destroy_context(display_, context_);
  }

  void enter() override {
    api_ = egl_.query_api();
    egl_.bind_api(kOpenglApi);
    previous_ = egl_.get_current_context();
    previous_display_ = egl_.get_current_display();
    draw_ = egl_.get_current_surface(kDraw);
    read_ = egl_.get_current_surface(kRead);
    if (egl_.make_current(display_, nullptr, nullptr, context_)) return;
    egl_.bind_api(api_);
    egl_.refuse("the context is lost, or in use on another thread");
  }

  void leave() noexcept override {
    if (previous_)
      egl_.make_current(previous_display_, draw_, read_, previous_);
    else
      egl_.make_current(display_, nullptr, nullptr, nullptr);
    egl_.bind_api(api_);
  }

  void* function(const char* name) const override { return egl_.get_proc_address(name); }
  void show() const override { egl_.library.show(); }
  const char* name() const override { return "egl"; }

 private:
  const Egl& egl_;
  Display display_;
  Handle context_ = nullptr;
  unsigned api_ = 0;
  Handle previous_ = nullptr;  // the thread's context before enter
  Display previous_display_ = nullptr;
  Surface draw_ = nullptr, read_ = nullptr;
};

}  // namespace

std::unique_ptr<Context> open_egl() {
  static const Egl* const egl = new Egl;
  return std::make_unique<EglContext>(*egl);
}

}  // namespace mjenv::core::gl
