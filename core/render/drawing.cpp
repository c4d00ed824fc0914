#include "render/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace mjenv::core {
namespace {

constexpr int kMaxPixelsPerSide = 1 << 16, kMaxGeoms = 1 << 20;
static_assert(MJENV_VISUAL_SKIN < sizeof(mjenv_render_settings::visual));
static_assert(visual_flag(MJENV_VISUAL_SKIN) == mjVIS_SKIN);
static_assert(label_kind(MJENV_LABEL_SELPNT) == mjLABEL_SELPNT);
static_assert(label_kind(MJENV_LABEL_CONTACTFORCE) == mjLABEL_CONTACTFORCE);
static_assert(int{MJENV_FRAME_WORLD} == int{mjFRAME_WORLD});

// A copy of the model with the settings applied to its visual options.
mjModel set(const mjModel& shared, const mjenv_render_settings& settings) {
  check_range("width", settings.width, 1, kMaxPixelsPerSide);
  check_range("height", settings.height, 1, kMaxPixelsPerSide);
  check_range("max_geom", settings.max_geom, 0, kMaxGeoms);
  check_range("samples", settings.samples, 0, kMaxSamples);
  check_range("label", settings.label, MJENV_LABEL_NONE, MJENV_LABEL_CONTACTFORCE);
  check_range("frame", settings.frame, MJENV_FRAME_NONE, MJENV_FRAME_WORLD);
  mjModel model = shared;
  model.vis.global.offwidth = settings.width;
  model.vis.global.offheight = settings.height;
  model.vis.quality.offsamples = settings.samples;
  if (!settings.shadows) model.vis.quality.shadowsize = 0;
  return model;
}

// Each setting that says which groups are drawn, and the array of the same name in mjvOption.
struct Groups {
  std::uint8_t (mjenv_render_settings::*setting)[mjNGROUP];
  mjtByte (mjvOption::*option)[mjNGROUP];
};
constexpr Groups kGroups[] = {{&mjenv_render_settings::geomgroup, &mjvOption::geomgroup},
                              {&mjenv_render_settings::sitegroup, &mjvOption::sitegroup},
                              {&mjenv_render_settings::jointgroup, &mjvOption::jointgroup},
                              {&mjenv_render_settings::tendongroup, &mjvOption::tendongroup},
                              {&mjenv_render_settings::actuatorgroup, &mjvOption::actuatorgroup},
                              {&mjenv_render_settings::skingroup, &mjvOption::skingroup}};

// Each setting that turns a flag of mjvScene on or off.
struct Flag {
  std::int32_t mjenv_render_settings::*setting;
  mjtRndFlag flag;
};
constexpr Flag kFlags[] = {{&mjenv_render_settings::shadows, mjRND_SHADOW},
                           {&mjenv_render_settings::wireframe, mjRND_WIREFRAME},
                           {&mjenv_render_settings::reflections, mjRND_REFLECTION},
                           {&mjenv_render_settings::additive, mjRND_ADDITIVE},
                           {&mjenv_render_settings::skybox, mjRND_SKYBOX},
                           {&mjenv_render_settings::fog, mjRND_FOG},
                           {&mjenv_render_settings::haze, mjRND_HAZE},
                           {&mjenv_render_settings::cull_face, mjRND_CULL_FACE}};

mjvOption options_of(const mjenv_render_settings& settings) {
  mjvOption options;
  mjv_defaultOption(&options);
  for (int i = 0; i <= MJENV_VISUAL_SKIN; ++i) options.flags[visual_flag(i)] = settings.visual[i] != 0;
  for (const auto& [setting, option] : kGroups)
    for (int i = 0; i < mjNGROUP; ++i) (options.*option)[i] = (settings.*setting)[i] != 0;
  options.label = label_kind(settings.label);
  options.frame = settings.frame;
  return options;
}

}  // namespace

void write_default_options(mjenv_render_settings& settings) {
  mjvOption options;
  mjv_defaultOption(&options);
  for (int i = 0; i <= MJENV_VISUAL_SKIN; ++i) settings.visual[i] = options.flags[visual_flag(i)];
  for (const auto& [setting, option] : kGroups)
    std::copy(std::begin(options.*option), std::end(options.*option), std::begin(settings.*setting));
}

double or_default(double value, double fallback) { return std::isnan(value) ? fallback : value; }

Drawing::Drawing(const mjModel& shown, bool trusted)
    : model(shown),
      budget(model, trusted),
      trusted_(trusted),
      heights_{static_cast<std::size_t>(model.nhfielddata) * sizeof(float), model.hfield_data, {}},
      sizes_{static_cast<std::size_t>(model.nhfield) * 4 * sizeof(mjtNum), model.hfield_size, {}},
      pixels_{static_cast<std::size_t>(model.ntexdata), pixels_of(model), {}} {}

Drawing::Drawing(const Model& shared, const mjenv_render_settings& settings)
    : Drawing(set(*shared.get(), settings), shared.trusted()) {
  mjv_defaultCamera(&camera);
  camera.azimuth = or_default(settings.azimuth, camera.azimuth);
  camera.elevation = or_default(settings.elevation, camera.elevation);
  options = options_of(settings);
  mjv_defaultPerturb(&perturbation);
  mjr_defaultContext(&context);
  mjv_defaultScene(&scene);
  // MuJoCo would sort through a null pointer if the scene had no room for any geom.
  with_render_errors([&] { mjv_makeScene(&model, &scene, std::max(settings.max_geom, 1)); });
  scene.maxgeom = settings.max_geom;
  for (const auto& [setting, flag] : kFlags) scene.flags[flag] = settings.*setting != 0;
}

Drawing::~Drawing() {
  mjv_freeScene(&scene);
  // mjr_freeContext was not called if the context was never completed or is lost. Then these arrays, which are in
  // ordinary memory, are still allocated. After mjr_freeContext they are null.
  for (unsigned* names : {context.skinvertVBO, context.skinnormalVBO, context.skintexcoordVBO, context.skinfaceVBO})
    mju_free(names);
}

void Drawing::make_context(int framebuffer) {
  with_render_errors([&] {
    mjr_makeContext(&model, &context, mjFONTSCALE_150);
    mjr_setBuffer(framebuffer, &context);
  });
}

bool Drawing::Upload::has(const void* values) const {
  const void* const here = other.empty() ? shared : other.data();
  return values == here || bytes == 0 || (here && std::memcmp(values, here, bytes) == 0);
}

void Drawing::Upload::set(const void* values) {
  const auto* first = static_cast<const std::byte*>(values);
  other.assign(first, first + bytes);
}

void Drawing::prepare(const mjModel& row, gl::Context& owner, int framebuffer) {
  const bool new_context = needs_context(row);
  const bool new_fields = !heights_.has(row.hfield_data) || !sizes_.has(row.hfield_size);
  const bool new_textures = !pixels_.has(pixels_of(row));
  if (!new_context && !new_fields && !new_textures) return;
  const gl::Current current(owner);
  if (new_context) make_context(row, framebuffer);
  if (new_fields) upload_fields(row);
  if (new_textures) upload_textures(row);
}

bool Drawing::needs_context(const mjModel& row) const {
  return !shown_ && (row.stat.extent != model.stat.extent || row.geom_size != model.geom_size ||
                     row.mat_texrepeat != model.mat_texrepeat);
}

void Drawing::make_context(const mjModel& row, int framebuffer) {
  const mjModel shared = model;
  try {
    use(row);
    budget = Budget(model, trusted_);
    make_context(framebuffer);
  } catch (...) {
    model = shared;  // so that the next picture tries again
    throw;
  }
}

void Drawing::upload_fields(const mjModel& row) {
  heights_.clear();  // in case MuJoCo fails
  use(row);
  with_render_errors([&] {
    for (int i = 0; i < static_cast<int>(model.nhfield); ++i) mjr_uploadHField(&model, &context, i);
  });
  heights_.set(row.hfield_data);
  sizes_.set(row.hfield_size);
}

void Drawing::upload_textures(const mjModel& row) {
  pixels_.clear();
  use(row);
  with_render_errors([&] {
    for (int i = 0; i < static_cast<int>(model.ntex); ++i) mjr_uploadTexture(&model, &context, i);
  });
  pixels_.set(pixels_of(row));
}

void Drawing::free_in(gl::Context& owner) noexcept {
  if (!gl::here()) return;
  try {
    const gl::Current current(owner);
    mjr_freeContext(&context);
  } catch (...) {  // the OpenGL context is lost, with everything in it
  }
}

void Drawing::use(const mjModel& row) {
  const mjVisual settings = model.vis;
  model = row;
  model.vis = settings;
}

void Drawing::update(const mjModel& row, mjData* data) {
  use(row);
  use_textures(row, context);
  shown_ = true;
  if (geom_rgba) model.geom_rgba = geom_rgba;
  with_render_errors([&] { mjv_updateScene(&model, data, &options, &perturbation, &camera, mjCAT_ALL, &scene); });
  budget.check(scene);
}

}  // namespace mjenv::core
