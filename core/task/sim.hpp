// What a robot's definition sees of the simulation: views of one row's state and of what MuJoCo computed from it.
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "mjenv/mjenv.h"
#include "numpy/math.hpp"

namespace mjenv::core {

class Work;

// The caller's action for one row, in the caller's dtype.
struct Action {
  const void* values = nullptr;
  mjenv_dtype dtype = MJENV_DTYPE_FLOAT64;
  Eigen::Index count = 0;

  double operator[](Eigen::Index i) const { return dtype == MJENV_DTYPE_FLOAT32 ? narrow()[i] : wide()[i]; }
  Action part(Eigen::Index first, Eigen::Index length) const {
    return {dtype == MJENV_DTYPE_FLOAT32 ? static_cast<const void*>(narrow() + first) : wide() + first, dtype, length};
  }
  const float* narrow() const { return static_cast<const float*>(values); }
  const double* wide() const { return static_cast<const double*>(values); }
};

namespace np {

// numpy.square(action).sum(), computed in the action's own dtype.
inline Scalar sum_square(const Action& a) {
  if (a.dtype == MJENV_DTYPE_FLOAT32)
    return Scalar(sum(a.count, [x = a.narrow()](Eigen::Index i) { return x[i] * x[i]; }));
  return Scalar(sum(a.count, [x = a.wide()](Eigen::Index i) { return x[i] * x[i]; }));
}

}  // namespace np

class Sim {
 public:
  using Vec = Eigen::Map<const Eigen::VectorXd>;
  using Vec2 = Eigen::Map<const Eigen::Vector2d>;
  using Vec3 = Eigen::Map<const Eigen::Vector3d>;

  double timestep = 0;  // s, of one mj_step
  double dt = 0;        // s, of one environment step
  Action action;

  double time() const { return *view_.time; }
  Vec qpos(int from = 0) const { return {view_.qpos + from, view_.nq - from}; }
  Vec qvel() const { return {view_.qvel, view_.nv}; }
  Vec init_qpos() const { return {view_.qpos0, view_.nq}; }
  Vec ctrl() const { return {view_.ctrl, view_.nu}; }
  Vec3 xpos(int body) const { return Vec3(view_.xpos + 3 * body); }
  Vec2 body_xy(int body) const { return Vec2(view_.xpos + 3 * body); }
  Vec3 site_xpos(int site) const { return Vec3(view_.site_xpos + 3 * site); }
  Vec qfrc_actuator(int from = 0) const { return {view_.qfrc_actuator + from, view_.nv - from}; }
  Vec qfrc_constraint(int count) const { return {view_.qfrc_constraint, count}; }
  Vec ten_length() const { return {view_.ten_length, view_.ntendon}; }
  Vec ten_velocity() const { return {view_.ten_velocity, view_.ntendon}; }

  // One row for each body from `first` on, row-major.
  Vec cinert(int first = 0) const { return bodies(view_.cinert, 10, first); }
  Vec cvel(int first = 0) const { return bodies(view_.cvel, 6, first); }
  Vec cfrc_ext(int first = 0) const;

  Eigen::Vector2d mass_center_xy() const;
  // True if every number of qpos and qvel is finite.
  bool finite() const;

 private:
  friend class Work;
  struct View {  // pointers into mjModel and mjData, whose arrays never move
    int nq = 0, nv = 0, nu = 0, nbody = 0, ntendon = 0;
    const double *time = nullptr, *qpos = nullptr, *qvel = nullptr, *ctrl = nullptr, *qpos0 = nullptr;
    const double *xpos = nullptr, *xipos = nullptr, *site_xpos = nullptr, *body_mass = nullptr;
    const double *cinert = nullptr, *cvel = nullptr, *cfrc_ext = nullptr;
    const double *qfrc_actuator = nullptr, *qfrc_constraint = nullptr;
    const double *ten_length = nullptr, *ten_velocity = nullptr;
  };
  View view_;
  Work* work_ = nullptr;

  Vec bodies(const double* array, int width, int first) const {
    return {array + static_cast<std::ptrdiff_t>(width) * first,
            static_cast<Eigen::Index>(width) * (view_.nbody - first)};
  }
};

}  // namespace mjenv::core
