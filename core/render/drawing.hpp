// MuJoCo's structures for drawing one model, which renderers and windows share.
#pragma once

#include <cstddef>
#include <vector>

#include "engine/model.hpp"
#include "engine/mujoco.hpp"
#include "error.hpp"
#include "mjenv/mjenv.h"
#include "render/budget.hpp"
#include "render/gl.hpp"

namespace mjenv::core {

// The most samples per pixel that can be set, more than any OpenGL offers. If OpenGL has fewer, MuJoCo uses those.
constexpr int kMaxSamples = 64;

struct Drawing {
  mjModel model;               // shares its arrays with the Model, or with a row's view of it
  float* geom_rgba = nullptr;  // unless null, replaces the model's colours
  Budget budget;
  mjvCamera camera{};
  mjvOption options{};
  mjvPerturb perturbation{};
  mjvScene scene{};
  mjrContext context{};

  // Throws if a setting that MuJoCo does not check is invalid, or if drawing the model exceeds the budget.
  Drawing(const Model& shared, const mjenv_render_settings& settings);
  ~Drawing();
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  // Creates MuJoCo's context in the current OpenGL context, and replaces an earlier one. free_in frees it.
  void make_context(int framebuffer);
  // Call this before update: adapts MuJoCo's context to the row, in the OpenGL context `owner`.
  void prepare(const mjModel& row, gl::Context& owner, int framebuffer);
  // Makes the OpenGL context current and frees MuJoCo's context in it. Does nothing in a forked child, or if the OpenGL
  // context is lost, because everything in it is lost as well.
  void free_in(gl::Context& owner) noexcept;

  // Shows a row.
  void update(const mjModel& row, mjData* data);

 private:
  // An array of the model of which MuJoCo's context has a copy.
  struct Upload {
    std::size_t bytes;
    const void* shared;            // the model's own values if the context has these; null if it has others
    std::vector<std::byte> other;  // what it has instead
    bool has(const void* values) const;
    void set(const void* values);
    void clear() { shared = nullptr, other.clear(); }
  };
  bool trusted_, shown_ = false;
  Upload heights_, sizes_, pixels_;  // of the height fields and the textures

  // The public constructor delegates to this one, so that the destructor runs if the public one throws.
  Drawing(const mjModel& shown, bool trusted);
  void use(const mjModel& row);
  // Whether the row needs a new context, because its planes or extent differ from those in the context. Only the first
  // row that is drawn can need one: Gymnasium makes the context at the first picture, and never again.
  bool needs_context(const mjModel& row) const;
  void make_context(const mjModel& row, int framebuffer);
  // Copies the row's own height fields or textures to the context.
  void upload_fields(const mjModel& row);
  void upload_textures(const mjModel& row);
};

// Sets those settings that are stored in mjvOption to MuJoCo's defaults.
void write_default_options(mjenv_render_settings& settings);
// The value, unless it is NaN.
double or_default(double value, double fallback);

// Runs the body and reports MuJoCo's errors as MJENV_E_RENDER, because they come from drawing, not from physics.
template <typename F>
void with_render_errors(const F& body) {
  try {
    body();
  } catch (const Error& error) {
    if (error.status() != MJENV_E_PHYSICS) throw;
    fail(MJENV_E_RENDER, error.what());
  }
}

}  // namespace mjenv::core
