#include "render/window.hpp"

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "render/png.hpp"

namespace mjenv::core {
namespace {

// GLFW's numbers of actions, mouse buttons and keys.
constexpr int kRelease = 0, kPress = 1, kLeft = 0, kRight = 1;
constexpr int kSpace = 32, kEscape = 256, kTab = 258, kRightArrow = 262, kLeftShift = 340, kRightShift = 344;

Window& owner_of(GLFWwindow* window) { return *static_cast<Window*>(gl::Glfw::get().get_window_user_pointer(window)); }
double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

// Refuses windows that are too large, because for them the X library would end the process.
const mjenv_render_settings& sized_for_a_window(const mjenv_render_settings& settings) {
  check_range("width", settings.width, 1, 1 << 14);
  check_range("height", settings.height, 1, 1 << 14);
  return settings;
}

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

}  // namespace

Window::Window(std::shared_ptr<const Model> model, const mjenv_render_settings& settings)
    : model_(std::move(model)),
      drawing_(*model_, sized_for_a_window(settings)),
      context_(gl::open_window(settings.width, settings.height, "mjenv")),
      glfw_(context_->glfw) {
  drawing_.camera.distance = or_default(settings.distance, drawing_.camera.distance);
  for (int axis = 0; axis < 3; ++axis) drawing_.camera.lookat[axis] = or_default(settings.lookat[axis], 0);

  GLFWwindow* window = context_->window();
  int units = 0;
  glfw_.get_framebuffer_size(window, &width_, &height_);
  glfw_.get_window_size(window, &units, nullptr);
  pixels_per_unit_ = units > 0 ? static_cast<double>(width_) / units : 1;
  glfw_.set_window_user_pointer(window, this);
  glfw_.set_key_callback(window, [](GLFWwindow* w, int key, int, int action, int) {
    if (action == kRelease) owner_of(w).press(key);
  });
  glfw_.set_mouse_button_callback(window, [](GLFWwindow* w, int, int, int) {
    double x = 0, y = 0;
    gl::Glfw::get().get_cursor_pos(w, &x, &y);
    owner_of(w).place_mouse(x, y);
  });
  glfw_.set_cursor_pos_callback(window, [](GLFWwindow* w, double x, double y) { owner_of(w).move_mouse(x, y); });
  glfw_.set_scroll_callback(window, [](GLFWwindow* w, double, double y) { owner_of(w).zoom(-0.05 * y); });
  const gl::Current current(*context_);
  drawing_.make_context(mjFB_WINDOW);
  glfw_.swap_interval(1);
}

Window::~Window() { drawing_.free_in(*context_); }

void Window::begin() {
  waits_ = paused_;
  pictures_due_ += drawing_.model.opt.timestep / (seconds_per_picture_ * run_speed_);
  if (every_frame_) pictures_due_ = 1;
  if (waits_) pictures_due_ = 0;
}

void Window::look_at(const mjModel& model, mjData* data) {
  iterations_ = *solver_iterations(*data);
  time_ = data->time;
  if (transparent_) {
    geom_rgba_.assign(model.geom_rgba, model.geom_rgba + 4 * model.ngeom);
    for (std::size_t i = 3; i < geom_rgba_.size(); i += 4) geom_rgba_[i] /= 5;
  }
  drawing_.prepare(model, *context_, mjFB_WINDOW);
  drawing_.geom_rgba = transparent_ ? geom_rgba_.data() : nullptr;
  drawing_.update(model, data);
}

void Window::draw() {
  const double start = seconds();
  {
    const gl::Current current(*context_);
    glfw_.get_framebuffer_size(context_->window(), &width_, &height_);
    with_render_errors([&] {
      mjr_render({0, 0, width_, height_}, &drawing_.scene, &drawing_.context);
      if (menu_) draw_overlay();
    });
    if (to_save_) save_picture();
    glfw_.swap_buffers(context_->window());
    poll();
  }
  seconds_per_picture_ = 0.9 * seconds_per_picture_ + 0.1 * (seconds() - start);
  if (waits_) {
    waits_ = paused_ && !advance_;
    advance_ = false;
  } else {
    pictures_due_ -= 1;
  }
}

void Window::poll() {
  glfw_.poll_events();
  if (!glfw_.window_should_close(context_->window())) return;
  glfw_.hide_window(context_->window());
  open_ = false;
}

void Window::draw_overlay() {
  std::string names, values;
  const auto line = [&](const std::string& name, const std::string& value) {
    names += name + "\n";
    values += value + "\n";
  };
  const auto show = [&](int corner) {
    mjr_overlay(mjFONTSCALE_150, corner, {0, 0, width_, height_}, names.c_str(), values.c_str(), &drawing_.context);
    names.clear();
    values.clear();
  };
  const auto on_off = [](bool on) { return on ? "On" : "Off"; };

  if (!every_frame_) line(formatted("Run speed = %.3f x real time", run_speed_), "[S]lower, [F]aster");
  line("Ren[d]er every frame", on_off(every_frame_));
  line(formatted("Switch camera (#cams = %d)", drawing_.model.ncam + 1),
       formatted("[Tab] (camera ID = %d)", drawing_.camera.fixedcamid));
  line("[C]ontact forces", on_off(contacts_));
  line("T[r]ansparent", on_off(transparent_));
  line(paused_ ? "Start" : "Stop", "[Space]");
  if (paused_) line("Advance simulation by one step", "[right arrow]");
  line("Referenc[e] frames", on_off(drawing_.options.frame == mjFRAME_BODY));
  line("[H]ide Menu", "");
  line("Cap[t]ure frame", saved_.empty() ? "" : "Saved as " + saved_);
  line("Toggle geomgroup visibility", "0-4");
  show(mjGRID_TOPLEFT);
  line("FPS", formatted("%d", static_cast<int>(1 / seconds_per_picture_)));
  line("Solver iterations", formatted("%d", iterations_ + 1));
  line("Step", formatted("%ld", std::lround(time_ / drawing_.model.opt.timestep)));
  line("timestep", formatted("%.5f", drawing_.model.opt.timestep));
  show(mjGRID_BOTTOMLEFT);
}

void Window::press(int key) {
  mjvOption& options = drawing_.options;
  switch (key) {
    case kTab: return next_camera();
    case kSpace: paused_ = !paused_; return;
    case kRightArrow: paused_ = advance_ = true; return;
    case kEscape: return glfw_.set_window_should_close(context_->window(), 1);
    case 'S': run_speed_ /= 2; return;
    case 'F': run_speed_ *= 2; return;
    case 'D': every_frame_ = !every_frame_; return;
    case 'H': menu_ = !menu_; return;
    case 'T': to_save_ = true; return;
    case 'C':
      contacts_ = !contacts_;
      options.flags[mjVIS_CONTACTPOINT] = options.flags[mjVIS_CONTACTFORCE] = contacts_;
      return;
    case 'E': options.frame = options.frame == mjFRAME_BODY ? mjFRAME_NONE : mjFRAME_BODY; return;
    case 'R': transparent_ = !transparent_; return;
    default:
      if (key >= '0' && key <= '4') options.geomgroup[key - '0'] ^= 1;
  }
}

void Window::next_camera() {
  mjvCamera& camera = drawing_.camera;
  camera.type = mjCAMERA_FIXED;
  if (++camera.fixedcamid < drawing_.model.ncam) return;
  camera.fixedcamid = -1;
  camera.type = mjCAMERA_FREE;
}

void Window::save_picture() {
  to_save_ = false;
  const std::size_t length = 3 * static_cast<std::size_t>(width_), height = static_cast<std::size_t>(height_);
  std::vector<std::uint8_t> bottom_first(length * height), rgb;
  mjr_readPixels(bottom_first.data(), nullptr, {0, 0, width_, height_}, &drawing_.context);
  for (auto line = bottom_first.end(); line != bottom_first.begin(); line -= static_cast<std::ptrdiff_t>(length))
    rgb.insert(rgb.end(), line - static_cast<std::ptrdiff_t>(length), line);
  saved_ = save_png(rgb.data(), width_, height_);
}

void Window::place_mouse(double x, double y) {
  mouse_x_ = static_cast<int>(pixels_per_unit_ * x);
  mouse_y_ = static_cast<int>(pixels_per_unit_ * y);
}

void Window::move_mouse(double x, double y) {
  GLFWwindow* window = context_->window();
  const bool left = glfw_.get_mouse_button(window, kLeft) == kPress;
  const bool right = glfw_.get_mouse_button(window, kRight) == kPress;
  if (!left && !right) return;
  const bool shift = glfw_.get_key(window, kLeftShift) == kPress || glfw_.get_key(window, kRightShift) == kPress;
  const int action = right ? (shift ? mjMOUSE_MOVE_H : mjMOUSE_MOVE_V) : (shift ? mjMOUSE_ROTATE_H : mjMOUSE_ROTATE_V);
  const int last_x = mouse_x_, last_y = mouse_y_;
  place_mouse(x, y);
  int width = 0, height = 0;
  glfw_.get_framebuffer_size(window, &width, &height);
  if (width > 0 && height > 0)
    move_camera(drawing_.model, action, static_cast<double>(mouse_x_ - last_x) / width,
                static_cast<double>(mouse_y_ - last_y) / height, drawing_.scene, drawing_.camera);
}

void Window::zoom(double amount) {
  move_camera(drawing_.model, mjMOUSE_ZOOM, 0, amount, drawing_.scene, drawing_.camera);
}

}  // namespace mjenv::core
