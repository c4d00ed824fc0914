// Estimates the memory and time that drawing a model takes, before OpenGL is called: drivers end the process when
// memory runs out, and a picture of an untrusted model must not take hours.
#pragma once

#include <vector>

#include "engine/mujoco.hpp"

namespace mjenv::core {

class Budget {
 public:
  // Fails with MJENV_E_RENDER if an untrusted model has too many vertices, and with MJENV_E_MEMORY if memory is short.
  Budget(const mjModel& model, bool trusted);

  // The memory that OpenGL needs for the model, without the picture itself.
  double bytes() const { return bytes_; }
  // Fails with MJENV_E_RENDER if drawing the scene of an untrusted model would take too long.
  void check(const mjvScene& scene) const;

 private:
  bool trusted_;
  double shadow_;  // how many pixels a light's shadow map has
  double bytes_;
  double round_, quads_;                                  // how many vertices a sphere has, and a side of a box
  std::vector<double> planes_, meshes_, fields_, skins_;  // how many vertices each of these has

  double of_model() const;
  double of(const mjvGeom& geom) const;
};

}  // namespace mjenv::core
