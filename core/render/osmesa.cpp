#include <array>

#include "error.hpp"
#include "render/gl.hpp"

namespace mjenv::core::gl {
namespace {

using Handle = void*;
constexpr unsigned kRgba = 0x1908, kFloat = 0x1406;
constexpr int kType = 0x23;

struct OsMesa {
  Library library{"libOSMesa.so.8", "libosmesa6"};
  Handle (*create)(unsigned, int, int, int, Handle) = library.find("OSMesaCreateContextExt");
  void (*destroy)(Handle) = library.find("OSMesaDestroyContext");
  unsigned char (*make_current)(Handle, void*, unsigned, int, int) = library.find("OSMesaMakeCurrent");
  Handle (*get_current)() = library.find("OSMesaGetCurrentContext");
  void (*get_integer)(int, int*) = library.find("OSMesaGetIntegerv");
  unsigned char (*get_color_buffer)(Handle, int*, int*, int*, void**) = library.find("OSMesaGetColorBuffer");
  void* (*get_proc_address)(const char*) = library.find("OSMesaGetProcAddress");
};

class OsMesaContext : public Context {
 public:
  explicit OsMesaContext(const OsMesa& osmesa) : osmesa_(osmesa), context_(osmesa.create(kRgba, 24, 8, 0, nullptr)) {
    if (!context_) fail(MJENV_E_RENDER, "osmesa: no context could be made");
  }

  ~OsMesaContext() override {
    if (here()) osmesa_.destroy(context_);
  }

  void enter() override {
    previous_ = osmesa_.get_current();
    if (previous_) {
      int format = 0;
      osmesa_.get_integer(kType, &previous_type_);
      osmesa_.get_color_buffer(previous_, &previous_width_, &previous_height_, &format, &previous_window_);
    }
    if (!osmesa_.make_current(context_, window_.data(), kFloat, 1, 1))
      fail(MJENV_E_RENDER, "osmesa: the context cannot be made current");
  }

  void leave() noexcept override {
    if (previous_)
      osmesa_.make_current(previous_, previous_window_, static_cast<unsigned>(previous_type_), previous_width_,
                           previous_height_);
    else
      osmesa_.make_current(nullptr, nullptr, kFloat, 0, 0);
  }

  void* function(const char* name) const override { return osmesa_.get_proc_address(name); }
  void show() const override { osmesa_.library.show(); }
  const char* name() const override { return "osmesa"; }

 private:
  const OsMesa& osmesa_;
  std::array<float, 4> window_{};  // one pixel, because pictures are drawn to a separate framebuffer
  Handle context_;
  Handle previous_ = nullptr;  // the thread's context before enter
  int previous_type_ = 0, previous_width_ = 0, previous_height_ = 0;
  void* previous_window_ = nullptr;
};

}  // namespace

std::unique_ptr<Context> open_osmesa() {
  static const OsMesa* const osmesa = new OsMesa;
  return std::make_unique<OsMesaContext>(*osmesa);
}

}  // namespace mjenv::core::gl
