// Estimates what drawing a model takes, before OpenGL is called: drivers end the process when memory runs out, and a
// picture of an untrusted model must not take hours.
#pragma once

#include <mujoco/mujoco.h>

#include <vector>

namespace mjenv::core {

class Budget {
 public:
  // Fails with MJENV_E_RENDER for more vertices than a stranger's model may have, with MJENV_E_MEMORY for more bytes
  // than are free.
  Budget(const mjModel& model, bool trusted);

  // Of OpenGL, apart from the picture itself.
  double bytes() const { return bytes_; }
  // Fails with MJENV_E_RENDER when a picture would take too long.
  void check(const mjvScene& scene) const;

 private:
  bool trusted_;
  double shadow_, bytes_;  // pixels of a light's shadow map
  double round_, quads_;   // vertices of a sphere, and of a side of a box
  std::vector<double> planes_, meshes_, fields_, skins_;

  double of_model() const;
  double of(const mjvGeom& geom) const;
};

}  // namespace mjenv::core
