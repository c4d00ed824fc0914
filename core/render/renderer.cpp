#include "render/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "error.hpp"
#include "render/drawing.hpp"
#include "system/memory.hpp"

namespace mjenv::core {
namespace {

// The index of the chosen camera; MJENV_CAMERA_FREE is the free camera.
int camera_of(const Model& model, const mjenv_render_settings& settings) {
  if (settings.camera_name) {
    if (settings.camera != MJENV_CAMERA_FREE)
      fail(MJENV_E_VALUE, "camera and camera_name are both set: to use camera_name, leave camera at MJENV_CAMERA_FREE");
    return model.index("camera", settings.camera_name);
  }
  check_range("camera", settings.camera, MJENV_CAMERA_FREE, model.count("camera") - 1);
  return settings.camera;
}

// numpy.median
double median(std::vector<double> values) {
  const std::size_t n = values.size();
  if (n == 0 || std::any_of(values.begin(), values.end(), [](double x) { return std::isnan(x); }))
    return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return n % 2 == 1 ? values[n / 2] : (values[n / 2 - 1] + values[n / 2]) / 2;
}

template <typename T>
void copy_top_first(const std::vector<T>& from, T* to, std::size_t rows) {
  const std::size_t length = from.size() / rows;
  for (std::size_t row = 0; row < rows; ++row)
    std::copy_n(from.data() + (rows - 1 - row) * length, length, to + row * length);
}

}  // namespace

mjenv_render_settings render_defaults(const Model& model, const mjenv_task_camera& camera) {
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  settings.samples = std::clamp(model.get()->vis.quality.offsamples, 0, kMaxSamples);
  std::copy(std::begin(camera.lookat), std::end(camera.lookat), settings.lookat);
  settings.distance = camera.distance;
  settings.elevation = camera.elevation;
  write_default_options(settings);
  return settings;
}

Renderer::Renderer(std::shared_ptr<const Model> model, const mjenv_render_settings& settings)
    : model_(std::move(model)),
      width_(settings.width),
      height_(settings.height),
      lookat_{settings.lookat[0], settings.lookat[1], settings.lookat[2]},
      distance_(settings.distance),
      drawing_(std::make_unique<Drawing>(*model_, settings)) {
  mjvCamera& camera = drawing_->camera;
  camera.fixedcamid = camera_of(*model_, settings);
  camera.type = camera.fixedcamid < 0 ? mjCAMERA_FREE : mjCAMERA_FIXED;
  context_ = gl::open(settings.gl);
  const gl::Current current(*context_);
  traits_ = gl::traits_of(*context_);
  check_size();
  drawing_->make_context(mjFB_OFFSCREEN);
}

Renderer::~Renderer() { drawing_->free_in(*context_); }

void Renderer::check_size() const {
  if (width_ > traits_.width || height_ > traits_.height)
    fail(MJENV_E_VALUE, "a picture of " + std::to_string(width_) + " x " + std::to_string(height_) +
                            " is more than the " + std::to_string(traits_.width) + " x " +
                            std::to_string(traits_.height) + " that this OpenGL draws (" + traits_.text + ")");
  const double bytes_per_pixel = 8.0 * (2 + drawing_->model.vis.quality.offsamples) + 7;
  const double needed = static_cast<double>(pixels()) * bytes_per_pixel + drawing_->budget.bytes();
  if (needed > free_memory())
    fail(MJENV_E_MEMORY, "a picture of " + std::to_string(width_) + " x " + std::to_string(height_) + " needs " +
                             number(std::ceil(needed / 1e9)) + " GB, more than is free");
}

// Places the free camera once, for the state of the first picture, as Gymnasium does.
void Renderer::place_camera(const mjModel_& model, const mjData_& data) {
  if (camera_placed_) return;
  mjvCamera& camera = drawing_->camera;
  camera.distance = or_default(distance_, model.stat.extent);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> positions;
    for (int geom = 0; geom < model.ngeom; ++geom) positions.push_back(data.geom_xpos[3 * geom + axis]);
    camera.lookat[axis] = or_default(lookat_[static_cast<std::size_t>(axis)], median(positions));
  }
  camera_placed_ = true;
}

void Renderer::look_at(const mjModel_& model, mjData_* data) {
  drawing_->prepare(model, *context_, mjFB_OFFSCREEN);
  place_camera(model, *data);
  drawing_->update(model, data);
}

// MuJoCo draws each geom of the scene in one colour, which encodes the geom's number in the scene (segid + 1). The
// background is black.
void Renderer::draw_segmentation(std::int32_t* objects) {
  mjvScene& scene = drawing_->scene;
  segmentation_.resize(3 * pixels());
  scene.flags[mjRND_SEGMENT] = scene.flags[mjRND_IDCOLOR] = 1;
  const auto restore = [&] { scene.flags[mjRND_SEGMENT] = scene.flags[mjRND_IDCOLOR] = 0; };
  try {
    draw(segmentation_.data(), nullptr);
  } catch (...) {
    restore();
    throw;
  }
  restore();
  object_of_.assign(static_cast<std::size_t>(scene.ngeom) + 1, {-1, -1});
  for (int i = 0; i < scene.ngeom; ++i) {
    const mjvGeom& geom = scene.geoms[i];
    const auto number = static_cast<std::size_t>(geom.segid) + 1;
    if (geom.segid >= 0 && number < object_of_.size()) object_of_[number] = {geom.objid, geom.objtype};
  }
  for (std::size_t i = 0; i < pixels(); ++i) {
    const std::uint8_t* colour = segmentation_.data() + 3 * i;
    const std::size_t number = colour[0] + (std::size_t{colour[1]} << 8) + (std::size_t{colour[2]} << 16);
    const auto& [index, type] = object_of_[number < object_of_.size() ? number : 0];
    objects[2 * i] = index;
    objects[2 * i + 1] = type;
  }
}

void Renderer::draw(std::uint8_t* rgb, float* depth) {
  Drawing& d = *drawing_;
  const mjrRect viewport{0, 0, width_, height_};
  if (rgb) rgb_.resize(3 * pixels());
  if (depth) depth_.resize(pixels());
  {
    const gl::Current current(*context_);
    with_render_errors([&] {
      mjr_render(viewport, &d.scene, &d.context);
      mjr_readPixels(rgb ? rgb_.data() : nullptr, depth ? depth_.data() : nullptr, viewport, &d.context);
    });
  }
  if (rgb) copy_top_first(rgb_, rgb, static_cast<std::size_t>(height_));
  if (depth) copy_top_first(depth_, depth, static_cast<std::size_t>(height_));
}

}  // namespace mjenv::core
