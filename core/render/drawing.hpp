// What a renderer and a window have in common: MuJoCo's structures for drawing one model.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "engine/model.hpp"
#include "error.hpp"
#include "mjenv/mjenv.h"
#include "render/budget.hpp"
#include "render/gl.hpp"

namespace mjenv::core {

// More than any OpenGL has; MuJoCo takes as many as there are.
constexpr int kMaxSamples = 64;

struct Drawing {
  mjModel model;  // shares the model's arrays
  Budget budget;
  mjvCamera camera{};
  mjvOption options{};
  mjvPerturb perturbation{};
  mjvScene scene{};
  mjrContext context{};

  // Checks the settings that MuJoCo does not, and what the model takes.
  Drawing(const Model& shared, const mjenv_render_settings& settings);
  ~Drawing();
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  // While an OpenGL context is current, in which it then has to be freed.
  void make_context(int framebuffer);
  // Makes that context current itself; does nothing after a fork or when it is lost, with all that it held.
  void free_in(gl::Context& owner) noexcept;

  void update(mjData* data);

 private:
  // Delegated to, so that the destructor runs if the public constructor throws.
  Drawing(const mjModel& shown, bool trusted) : model(shown), budget(model, trusted) {}
};

void check_range(const char* name, std::int64_t value, std::int64_t low, std::int64_t high);
// The value, unless it is NaN.
double or_default(double value, double fallback);

// MuJoCo's errors while drawing are not the simulation's.
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
