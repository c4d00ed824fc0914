// A window that shows rows as Gymnasium's render mode "human" does, with the same keys and mouse actions.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "render/drawing.hpp"
#include "render/glfw.hpp"

namespace mjenv::core {

class Window {
 public:
  Window(std::shared_ptr<const Model> model, const mjenv_render_settings& settings);
  ~Window();

  bool is_open() const { return open_; }
  // Call this once per reset or step. Then draw as long as wants_picture() is true: once, as often as the chosen speed
  // requires, or while the user pauses.
  void begin();
  bool wants_picture() const { return open_ && (waits_ || pictures_due_ > 0); }
  // Sets the scene that `draw` draws. Does not change data.
  void look_at(const mjModel& model, mjData* data);
  // Draws the picture and handles the user's input.
  void draw();

 private:
  std::shared_ptr<const Model> model_;
  std::vector<float> geom_rgba_;  // the model's colours, made transparent
  Drawing drawing_;
  std::unique_ptr<gl::GlfwContext> context_;
  const gl::Glfw& glfw_;
  int width_ = 0, height_ = 0;  // pixels of the last picture
  int iterations_ = 0;
  double time_ = 0;  // simulated seconds

  std::atomic<bool> open_{true};  // other threads read it
  bool paused_ = false, advance_ = false, waits_ = false, to_save_ = false;
  bool every_frame_ = true, contacts_ = false, transparent_ = false, menu_ = true;
  double pictures_due_ = 0, seconds_per_picture_ = 1 / 60.0, run_speed_ = 1;
  double pixels_per_unit_ = 1;  // pixels per unit of the mouse's coordinates
  int mouse_x_ = 0, mouse_y_ = 0;
  std::string saved_;  // the path of the last screenshot

  void draw_overlay();
  void press(int key);
  void next_camera();
  void poll();
  void save_picture();
  void move_mouse(double x, double y);
  void place_mouse(double x, double y);
  void zoom(double amount);
};

}  // namespace mjenv::core
