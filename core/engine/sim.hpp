// What a task sees of the simulation: views of one row's state and of the arrays that MuJoCo computed from it.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "mjenv/task.h"
#include "numpy/math.hpp"

namespace mjenv::core {

class Work;

// The action of one row, in the caller's array and dtype.
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

// What a task needs of a work space besides what MuJoCo computes in every step.
struct Needs {
  const mjenv_task_api* api = nullptr;                    // the library's functions for the callbacks of mjenv/task.h
  bool contacts = false, forces = false, frames = false;  // see Work::complete_forces and Work::complete_frames
  std::vector<std::string> arrays;                        // the names of the arrays in mjenv_sim::arrays
  std::size_t info = 0;                                   // how many numbers the longer of info and reset info has
};

// The methods have MuJoCo's names. `from` and `first` skip the elements or bodies before that index.
class Sim {
 public:
  using Vec = Eigen::Map<const Eigen::VectorXd>;
  using Vec2 = Eigen::Map<const Eigen::Vector2d>;
  using Vec3 = Eigen::Map<const Eigen::Vector3d>;

  double timestep = 0;  // s, of one mj_step
  double dt = 0;        // s, of one environment step
  Action action;

  double time() const { return *c_.time; }
  Vec qpos(int from = 0) const { return {c_.qpos + from, c_.nq - from}; }
  Vec qvel() const { return {c_.qvel, c_.nv}; }
  Vec init_qpos() const { return {c_.qpos0, c_.nq}; }
  Vec ctrl() const { return {c_.ctrl, c_.nu}; }
  Vec3 xpos(int body) const { return Vec3(c_.xpos + 3 * body); }
  Vec2 body_xy(int body) const { return Vec2(c_.xpos + 3 * body); }
  Vec3 site_xpos(int site) const { return Vec3(c_.site_xpos + 3 * site); }
  Vec qfrc_actuator(int from = 0) const { return {c_.qfrc_actuator + from, c_.nv - from}; }
  Vec qfrc_constraint(int count) const { return {c_.qfrc_constraint, count}; }
  Vec ten_length() const { return {c_.ten_length, c_.ntendon}; }
  Vec ten_velocity() const { return {c_.ten_velocity, c_.ntendon}; }

  // One row per body, in row-major order.
  Vec cinert(int first = 0) const { return bodies(c_.cinert, 10, first); }
  Vec cvel(int first = 0) const { return bodies(c_.cvel, 6, first); }
  Vec cfrc_ext(int first = 0) const;

  Eigen::Vector2d mass_center_xy() const;
  // True if every number of qpos and qvel is finite.
  bool finite() const;

  // The same data for the callbacks of mjenv/task.h.
  const mjenv_sim& c() const { return c_; }
  // Computes the Needs of the task.
  void complete() const;
  // Buffers of the work space for a callback: for the action it reads, and for the info it writes.
  double* action_buffer() const;
  double* info_buffer() const;

 private:
  friend class Work;
  mjenv_sim c_{};  // points into mjModel and mjData, whose arrays never move
  const double* cfrc_ext_ = nullptr;
  Work* work_ = nullptr;

  Vec bodies(const double* array, int width, int first) const {
    return {array + static_cast<std::ptrdiff_t>(width) * first, static_cast<Eigen::Index>(width) * (c_.nbody - first)};
  }
};

}  // namespace mjenv::core
