// What a renderer and a window have in common: MuJoCo's structures for drawing one model.
#pragma once

#include <mujoco/mujoco.h>

#include <string>

#include "engine/model.hpp"
#include "error.hpp"
#include "mjenv/mjenv.h"

namespace mjenv {

struct Drawing {
  mjModel model;  // shares the model's arrays
  mjvCamera camera{};
  mjvOption options{};
  mjvPerturb perturbation{};
  mjvScene scene{};
  mjrContext context{};

  // Checks the settings that MuJoCo does not.
  Drawing(const Model& shared, const mjenv_render_settings& settings);
  ~Drawing() { mjv_freeScene(&scene); }
  Drawing(const Drawing&) = delete;
  Drawing& operator=(const Drawing&) = delete;

  // What has to be done, and undone, while an OpenGL context is current.
  void make_context(int framebuffer);
  void free_context() { mjr_freeContext(&context); }

  void update(mjData* data);
};

void check_range(const char* name, std::int64_t value, std::int64_t low, std::int64_t high);
// The value, unless it is NaN.
double or_default(double value, double otherwise);

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

}  // namespace mjenv
