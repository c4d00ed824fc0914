// MuJoCo's structures for drawing one model, which renderers and windows share.
#pragma once

#include "engine/model.hpp"
#include "engine/mujoco.hpp"
#include "error.hpp"
#include "mjenv/mjenv.h"
#include "render/budget.hpp"
#include "render/gl.hpp"

namespace mjenv::core {

// More than any OpenGL offers. MuJoCo uses as many samples as OpenGL has.
constexpr int kMaxSamples = 64;

struct Drawing {
  mjModel model;               // shares its arrays with the Model, or with a row's view of it
  float* geom_rgba = nullptr;  // replaces the model's colours unless it is null
  Budget budget;
  mjvCamera camera{};
  mjvOption options{};
  mjvPerturb perturbation{};
  mjvScene scene{};
  mjrContext context{};

  // Checks the settings that MuJoCo does not check, and that drawing the model is within the budget.
  Drawing(const Model& shared, const mjenv_render_settings& settings);
  ~Drawing();
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  // Creates MuJoCo's context in the current OpenGL context, in place of an earlier one. free_in frees it there.
  void make_context(int framebuffer);
  // Whether the first row that is drawn needs a new context, because its height fields, planes or extent, which the
  // context contains, differ. Gymnasium makes the context at the first picture, and never again.
  bool needs_context(const mjModel& row) const;
  // Creates that context.
  void make_context(const mjModel& row, int framebuffer);
  // Makes the OpenGL context current and frees MuJoCo's context in it. Does nothing in a forked child, or if the OpenGL
  // context is lost, because everything in it is lost as well.
  void free_in(gl::Context& owner) noexcept;

  // Shows a row.
  void update(const mjModel& row, mjData* data);

 private:
  bool trusted_, shown_ = false;

  // Delegated to, so that the destructor runs if the public constructor throws.
  Drawing(const mjModel& shown, bool trusted) : model(shown), budget(model, trusted), trusted_(trusted) {}
  void use(const mjModel& row);
};

// Sets what mjvOption has: MuJoCo's defaults.
void write_default_options(mjenv_render_settings& settings);
// The value, unless it is NaN.
double or_default(double value, double fallback);

// Runs the body and reports MuJoCo's errors as MJENV_E_RENDER, because they come from drawing, not from physics.
template <typename F>
void drawing(const F& body) {
  try {
    body();
  } catch (const Error& error) {
    if (error.status() != MJENV_E_PHYSICS) throw;
    fail(MJENV_E_RENDER, error.what());
  }
}

}  // namespace mjenv::core
