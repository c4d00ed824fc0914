// Draws pictures of rows that equal those of Gymnasium: MuJoCo draws the row's mjData from the camera that Gymnasium
// would choose.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/model.hpp"
#include "mjenv/task.h"
#include "render/gl.hpp"

namespace mjenv::core {

struct Drawing;

// The settings with which Gymnasium would draw this model and task.
mjenv_render_settings render_defaults(const Model& model, const mjenv_task_camera& camera);

class Renderer {
 public:
  Renderer(std::shared_ptr<const Model> model, const mjenv_render_settings& settings);
  ~Renderer();

  const std::string& gl() const { return traits_.text; }
  std::size_t pixels() const { return static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_); }

  // Sets the scene that `draw` draws. Does not change data.
  void look_at(const mjModel_& model, mjData_* data);
  // Writes the picture to rgb[height][width][3] and depth[height][width]. Either may be null.
  void draw(std::uint8_t* rgb, float* depth);
  // Writes the index and the type of the object that each pixel shows to objects[height][width][2].
  void draw_segmentation(std::int32_t* objects);

 private:
  std::shared_ptr<const Model> model_;
  const int width_, height_;
  std::array<double, 3> lookat_;
  double distance_;
  bool camera_placed_ = false;
  std::unique_ptr<gl::Context> context_;
  gl::Traits traits_;
  std::unique_ptr<Drawing> drawing_;
  std::vector<std::uint8_t> rgb_;  // in OpenGL's order: the bottom row first
  std::vector<float> depth_;
  std::vector<std::uint8_t> segmentation_;
  std::vector<std::pair<std::int32_t, std::int32_t>> object_of_;  // index and type, by the colour's number

  void check_size() const;
  void place_camera(const mjModel_& model, const mjData_& data);
};

}  // namespace mjenv::core
