/* task.hpp - Defines a robot and its task as one C++17 function, as the built-in robots are defined. Wraps task.h, and
 * needs Eigen. docs/tasks/index.md begins with an example and explains how to build it.
 *
 * Definition
 *   MJENV_TASK("Cartpole-v0", r) { ... } defines a task; r is a mjenv::Robot &. The body runs once when the task is
 *   registered, without a model, to list the options: r's methods then return defaults and indices of 0. It runs again
 *   for each environment, on the thread that creates it. Then the lambdas of observe, reset_info, carry and step are
 *   called once with the model's initial state, to find out the fields and their lengths (trial calls).
 * Lambdas
 *   Each call is for one row. Several threads may run lambdas and definitions at the same time. So lambdas must capture
 *   by value, and change nothing but their non-const parameters. If a lambda throws, the call's row fails with
 *   MJENV_E_TASK.
 * Use
 *   A shared object of files with definitions is a plug-in (CMake: mjenv_add_tasks). A program registers the
 *   definitions that it contains with mjenv::register_tasks(). */
#ifndef MJENV_TASK_HPP
#define MJENV_TASK_HPP

#include <mjenv/task.h>
#include <mjenv/numpy.hpp>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace mjenv {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

/* ---- The parameters of the lambdas ---- */

/* A row's action: its numbers as doubles, and the dtype that the caller passed. It is 0 in trial calls. In other calls
 * it is NaN, except in step, before_step and before_substep. */
struct Action {
  const double *values = nullptr;
  mjenv_dtype dtype = MJENV_DTYPE_FLOAT64;
  Eigen::Index count = 0;

  double operator[](Eigen::Index i) const { return values[i]; }
  Eigen::Index size() const { return count; }
  Eigen::Map<const Eigen::VectorXd> vector() const { return {values, count}; }
};

namespace np {

/* numpy.square(action).sum(), computed in the action's dtype as NumPy does. */
inline Scalar sum_square(const Action &a) {
  if (a.dtype == MJENV_DTYPE_FLOAT32)
    return Scalar(sum(a.count, [x = a.values](Eigen::Index i) {
      const auto v = static_cast<float>(x[i]);
      return v * v;
    }));
  return Scalar(sum(a.count, [x = a.values](Eigen::Index i) { return x[i] * x[i]; }));
}

}  // namespace np

/* A sensor's first element in sensordata, and how many it has. */
struct Sensor {
  int first = 0, count = 0;
};
/* A joint's index, and its first element in qpos and qvel. */
struct Joint {
  int index = 0, qpos = 0, qvel = 0;
};
/* Numbers that the row carries for the task (Robot::carry): their first index in mjenv_sim.carried, and their count. */
struct Carry {
  Eigen::Index first = 0, count = 0;
};
/* A live parameter (Robot::live): its index in mjenv_sim.parameters. Lambdas read the row's number: s[parameter]. */
struct Live {
  Eigen::Index index = 0;
};
/* A live parameter of several numbers. */
struct LiveVector {
  Eigen::Index first = 0, count = 0;
};
/* An array of mjData or mjModel (Robot::array): its index in mjenv_sim.arrays, and how many elements it has. */
template <typename T>
struct Shared {
  std::int32_t index = 0;
  Eigen::Index count = 0;
};

/* One row's simulation: mjenv_sim as Eigen vectors. The methods have MuJoCo's names and return views, which are valid
 * until the lambda returns. `from` and `first` skip the elements or bodies before that index. */
class Sim {
 public:
  using Vec = Eigen::Map<const Eigen::VectorXd>;
  using Vec2 = Eigen::Map<const Eigen::Vector2d>;
  using Vec3 = Eigen::Map<const Eigen::Vector3d>;
  using Vec4 = Eigen::Map<const Eigen::Vector4d>;
  using Mat3 = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>;

  /* builder: not null in a trial call, in which the library learns which arrays the task needs. */
  explicit Sim(const mjenv_sim *c, mjenv_builder *builder = nullptr)
      : timestep(c->timestep),
        dt(c->dt),
        action{c->action, c->action_dtype, c->action_count},
        c_(c),
        builder_(builder) {}

  const double timestep; /* s, of one mj_step */
  const double dt;       /* s, of one step of the environment */
  const Action action;

  const mjenv_sim &c() const { return *c_; }
  double time() const { return *c_->time; }

  Vec qpos(int from = 0) const { return {c_->qpos + from, c_->nq - from}; }
  Vec qvel(int from = 0) const { return {c_->qvel + from, c_->nv - from}; }
  double qpos(const Joint &joint) const { return c_->qpos[joint.qpos]; }
  double qvel(const Joint &joint) const { return c_->qvel[joint.qvel]; }
  Vec init_qpos() const { return {c_->qpos0, c_->nq}; }
  Vec act() const { return {c_->act, c_->na}; }
  Vec ctrl() const { return {c_->ctrl, c_->nu}; }
  Vec qacc() const { return {c_->qacc, c_->nv}; }

  Vec3 xpos(int body) const { return Vec3(c_->xpos + 3 * body); }
  Vec2 body_xy(int body) const { return Vec2(c_->xpos + 3 * body); }
  Vec4 xquat(int body) const { return Vec4(c_->xquat + 4 * body); } /* w, x, y, z */
  Mat3 xmat(int body) const { return Mat3(c_->xmat + 9 * body); }
  Vec3 xipos(int body) const { return Vec3(c_->xipos + 3 * body); }
  Vec3 site_xpos(int site) const { return Vec3(c_->site_xpos + 3 * site); }
  Mat3 site_xmat(int site) const { return Mat3(c_->site_xmat + 9 * site); }
  Vec3 geom_xpos(int geom) const { return Vec3(on_demand("geom_xpos", &mjenv_sim::geom_xpos) + 3 * geom); }
  Mat3 geom_xmat(int geom) const { return Mat3(on_demand("geom_xmat", &mjenv_sim::geom_xmat) + 9 * geom); }
  Vec3 subtree_com(int body) const { return Vec3(c_->subtree_com + 3 * body); }

  /* One row per body, in row-major order. */
  Vec cinert(int first = 0) const { return bodies(c_->cinert, 10, first); }
  Vec cvel(int first = 0) const { return bodies(c_->cvel, 6, first); }
  Vec cfrc_ext(int first = 0) const { return bodies(on_demand("cfrc_ext", &mjenv_sim::cfrc_ext), 6, first); }

  Vec sensordata() const { return {c_->sensordata, c_->nsensordata}; }
  Vec sensor(const Sensor &sensor) const { return {c_->sensordata + sensor.first, sensor.count}; }
  Vec actuator_force() const { return {c_->actuator_force, c_->nu}; }
  Vec qfrc_actuator(int from = 0) const { return {c_->qfrc_actuator + from, c_->nv - from}; }
  Vec qfrc_passive() const { return {c_->qfrc_passive, c_->nv}; }
  Vec qfrc_bias() const { return {c_->qfrc_bias, c_->nv}; }
  Vec qfrc_constraint() const { return {c_->qfrc_constraint, c_->nv}; }
  Vec qfrc_constraint(int count) const { return {c_->qfrc_constraint, count}; }
  Vec ten_length() const { return {c_->ten_length, c_->ntendon}; }
  Vec ten_velocity() const { return {c_->ten_velocity, c_->ntendon}; }

  /* The row's contacts. */
  struct Contacts {
    const mjenv_contact *first, *last;
    const mjenv_contact *begin() const { return first; }
    const mjenv_contact *end() const { return last; }
    std::size_t size() const { return static_cast<std::size_t>(last - first); }
  };
  Contacts contacts() const {
    const mjenv_contact *first = on_demand("contacts", &mjenv_sim::contacts);
    return {first, first + c_->contact_count};
  }
  /* For each of these geoms, whether it touches the other geom: whether they have a contact whose distance is at most
   * 0. */
  template <std::size_t N>
  std::array<bool, N> touching(const std::array<int, N> &geoms, int other) const {
    std::array<bool, N> found{};
    for (const mjenv_contact &contact : contacts()) {
      if (contact.distance > 0 || (contact.geom1 != other && contact.geom2 != other)) continue;
      const int geom = contact.geom1 == other ? contact.geom2 : contact.geom1;
      for (std::size_t i = 0; i < N; ++i) found[i] |= geoms[i] == geom;
    }
    return found;
  }

  /* These return the numbers of a Robot::carry, and the elements of a Robot::array. */
  Vec operator[](const Carry &carry) const { return {c_->carried + carry.first, carry.count}; }
  template <typename T>
  Eigen::Map<const Eigen::Matrix<T, Eigen::Dynamic, 1>> operator[](const Shared<T> &array) const {
    return {static_cast<const T *>(c_->arrays[array.index]), array.count};
  }
  /* The row's value of a Robot::live. */
  double operator[](const Live &live) const { return c_->parameters[live.index]; }
  Vec operator[](const LiveVector &live) const { return {c_->parameters + live.first, live.count}; }

  /* The x and y of the whole model's centre of mass, m. */
  Eigen::Vector2d mass_center_xy() const {
    Eigen::Vector2d moment(0, 0);
    for (int body = 0; body < c_->nbody; ++body) moment += c_->body_mass[body] * Vec2(c_->xipos + 3 * body);
    return moment / np::sum(Vec(c_->body_mass, c_->nbody));
  }
  /* True if every number of qpos and qvel is finite. */
  bool finite() const {
    const auto all_finite = [](const Vec &v) {
      return std::all_of(v.data(), v.data() + v.size(), [](double x) { return std::isfinite(x); });
    };
    return all_finite(qpos()) && all_finite(qvel());
  }

 private:
  const mjenv_sim *c_;
  mjenv_builder *builder_;

  Vec bodies(const double *array, int width, int first) const {
    return {array + static_cast<std::ptrdiff_t>(width) * first, static_cast<Eigen::Index>(width) * (c_->nbody - first)};
  }
  /* In a trial call, asks the library for the array, because the task uses it. */
  template <typename T>
  const T *on_demand(const char *name, const T *mjenv_sim::*array) const {
    if (builder_) mjenv_build_need(builder_, name);
    if (!(c_->*array)) refuse(name);
    return c_->*array;
  }
  [[noreturn]] static void refuse(const char *array) {
    throw std::logic_error(std::string(array) + " is computed on demand, and no trial call used it: call needs(\"" +
                           array + "\") in the definition");
  }
};

/* The row's random stream, with methods of numpy.random.Generator. normal() is standard_normal(), choice(p) is
 * choice(len(p), p=p), and sample(count, size) is choice(count, size, replace=False). */
class Rng {
 public:
  explicit Rng(mjenv_random *stream) : c_(stream) {}

  double random() { return mjenv_random_real(c_); }
  double uniform(double low, double high) { return mjenv_random_uniform(c_, low, high); }
  double normal() { return mjenv_random_normal(c_); }
  double normal(double mean, double deviation) { return mean + deviation * normal(); }
  std::int64_t integers(std::int64_t low, std::int64_t high) { return mjenv_random_integers(c_, low, high); }
  std::int64_t choice(std::int64_t count) { return mjenv_random_choice(c_, count, nullptr); }
  std::int64_t choice(const std::vector<double> &p) {
    return mjenv_random_choice(c_, static_cast<std::int64_t>(p.size()), p.data());
  }
  std::vector<std::int64_t> sample(std::int64_t count, std::int64_t size) {
    std::vector<std::int64_t> chosen(static_cast<std::size_t>(std::max<std::int64_t>(size, 0)));
    mjenv_random_sample(c_, count, size, chosen.data());
    return chosen;
  }
  std::vector<std::int64_t> permutation(std::int64_t count) {
    std::vector<std::int64_t> order(static_cast<std::size_t>(std::max<std::int64_t>(count, 0)));
    mjenv_random_permutation(c_, count, order.data());
    return order;
  }

 private:
  mjenv_random *c_;
};

/* The row's stream of numpy.random.RandomState, for a reset that takes it instead of Rng. */
class RandomState {
 public:
  explicit RandomState(mjenv_random *stream) : c_(stream) {}

  double rand() { return mjenv_random_state_rand(c_); }
  double uniform(double low, double high) { return mjenv_random_state_uniform(c_, low, high); }
  double randn() { return mjenv_random_state_randn(c_); }
  std::int64_t randint(std::int64_t low, std::int64_t high) { return mjenv_random_state_randint(c_, low, high); }
  std::int64_t choice(std::int64_t count) { return mjenv_random_state_choice(c_, count, nullptr); }
  /* choice(len(p), p=p) */
  std::int64_t choice(const std::vector<double> &p) {
    return mjenv_random_state_choice(c_, static_cast<std::int64_t>(p.size()), p.data());
  }
  std::vector<std::int64_t> permutation(std::int64_t count) {
    std::vector<std::int64_t> order(static_cast<std::size_t>(std::max<std::int64_t>(count, 0)));
    mjenv_random_state_permutation(c_, count, order.data());
    return order;
  }
  /* shuffle(values): of a std::vector, an Eigen vector or another sequence with size() and []. */
  template <typename Values>
  void shuffle(Values &&values) {
    using Index = decltype(values.size());
    std::vector<std::decay_t<decltype(values[0])>> old;
    for (Index i = 0; i < values.size(); ++i) old.push_back(values[i]);
    const std::vector<std::int64_t> order = permutation(static_cast<std::int64_t>(old.size()));
    for (Index i = 0; i < values.size(); ++i)
      values[i] = old[static_cast<std::size_t>(order[static_cast<std::size_t>(i)])];
  }
  /* No number was drawn since it was seeded. */
  bool is_new() const { return mjenv_random_state_is_new(c_) != 0; }

 private:
  mjenv_random *c_;
};

/* An array of which each row has its own copy (Robot::own): its index, and how many elements it has. */
struct Own {
  std::int32_t index = 0;
  Eigen::Index count = 0;
};

/* The initial state of an episode. Before reset changes it, qpos is the model's qpos0, and qvel, act and carried numbers
 * are 0, except those of Robot::keep, which have the values of the last episode. */
struct Start {
  explicit Start(mjenv_start *c) : qpos(c->qpos, c->nq), qvel(c->qvel, c->nv), act(c->act, c->na), c_(c) {}

  Eigen::Map<Eigen::VectorXd> qpos, qvel, act;

  Eigen::Map<Eigen::VectorXd> operator[](const Carry &carry) { return {c_->carried + carry.first, carry.count}; }
  /* A Robot::array of mjModel. Arrays of mjData are not valid here. */
  template <typename T>
  Eigen::Map<const Eigen::Matrix<T, Eigen::Dynamic, 1>> operator[](const Shared<T> &array) const {
    return {static_cast<const T *>(c_->arrays[array.index]), array.count};
  }

  double operator[](const Live &live) const { return c_->parameters[live.index]; }
  Eigen::Map<const Eigen::VectorXd> operator[](const LiveVector &live) const {
    return {c_->parameters + live.first, live.count};
  }

  /* For tasks with Robot::current. sim() is up to date after forward, advance and restart, and at the beginning; qpos,
   * qvel and act are its state. */
  Sim sim() const {
    check_current();
    return Sim(c_->sim);
  }
  /* A Robot::own, which reset writes. The next reset finds what this one has written. */
  Eigen::Map<Eigen::VectorXd> operator[](const Own &own) {
    if (!c_->own || !c_->own[own.index]) throw std::logic_error("reset can write own arrays of mjModel only");
    return {c_->own[own.index], own.count};
  }
  /* mj_forward with actuation disabled. */
  void forward() { check(mjenv_start_forward(c_)); }
  /* Simulates count timesteps. The first one continues from what was computed last (mjenv_start_advance). */
  void advance(std::int64_t count) { check(mjenv_start_advance(c_, count)); }
  /* Begins again: mj_resetData, then forward. */
  void restart() { check(mjenv_start_restart(c_)); }
  std::int64_t contact_count() const { return mjenv_start_contact_count(c_); }
  void set_time(double time) {
    check_current();
    *c_->time = time;
  }

 private:
  mjenv_start *c_;

  void check_current() const {
    if (!c_->sim) throw std::logic_error("reset can use the simulation only if the definition calls current()");
  }
  static void check(std::int32_t failed) {
    if (failed != 0) throw std::runtime_error("MuJoCo failed"); /* the library knows why */
  }
};

/* What drives the simulation in a step (mjenv_control). ctrl has one number for each actuator. */
class Control {
 public:
  Control(mjenv_control *c, Eigen::Index nu, Eigen::Index nv)
      : ctrl(c->ctrl, nu), substep(c->substep), c_(c), nv_(nv) {}

  Eigen::Map<Eigen::VectorXd> ctrl;
  const int substep; /* which mj_step of the step comes next, from 0 on */
  /* The row's forces: a Robot::own of "qfrc_applied" or "xfrc_applied". They act until they are written again or the
   * row is reset. */
  Eigen::Map<Eigen::VectorXd> operator[](const Own &own) {
    if (!c_->own[own.index]) throw std::logic_error("only reset and step can write own arrays of mjModel");
    return {c_->own[own.index], own.count};
  }
  /* The velocities with which the step begins, and mj_forward (mjenv_control_forward): only in before_step, and not in
   * tasks that call current(). */
  Eigen::Map<Eigen::VectorXd> qvel() {
    if (!c_->qvel)
      throw std::logic_error("only before_step can write the velocities, and not if the definition calls current()");
    return {c_->qvel, nv_};
  }
  void forward() {
    if (mjenv_control_forward(c_) != 0) throw std::runtime_error("MuJoCo failed"); /* the library knows why */
  }

 private:
  mjenv_control *c_;
  Eigen::Index nv_;
};

/* What a step may change of its row: the numbers of a Robot::carry, its own arrays, its velocities, and its random
 * stream. */
class Row {
 public:
  Row(double *carried, mjenv_random *random, double *const *own = nullptr, double *qvel = nullptr, Eigen::Index nv = 0)
      : rng(random), carried_(carried), own_(own), qvel_(qvel), nv_(nv) {}

  Rng rng;
  Eigen::Map<Eigen::VectorXd> operator[](const Carry &carry) { return {carried_ + carry.first, carry.count}; }
  /* A Robot::own that the step writes. The new values take effect in the next step. */
  Eigen::Map<Eigen::VectorXd> operator[](const Own &own) {
    if (!own_ || !own_[own.index]) throw std::logic_error("only step can write own arrays with row[own]");
    return {own_[own.index], own.count};
  }
  /* The row's velocities, which the step can change: row.qvel()[0] += 0.5 is a kick (mjenv_outcome.qvel). */
  Eigen::Map<Eigen::VectorXd> qvel() {
    if (!qvel_) throw std::logic_error("only step can write the velocities with row.qvel()");
    return {qvel_, nv_};
  }

 private:
  double *carried_;
  double *const *own_;
  double *qvel_;
  Eigen::Index nv_;
};

/* The vector that the lambda of Robot::carry returned for the state before the step. */
using Carried = Eigen::Map<const Eigen::VectorXd>;

/* A goal, achieved or desired (Robot::compute_reward). */
using Goal = Eigen::Map<const Eigen::VectorXd>;

/* Counts how long each of some geoms, such as feet, has been in the air. time: a Robot::carry of N numbers (row[air]):
 * 0 for a geom that touches the ground, otherwise growing by dt in each step. Returns for each geom the
 * duration of the flight that ended in this step, s; 0 if none ended. */
template <std::size_t N>
std::array<double, N> air_time(Eigen::Map<Eigen::VectorXd> time, const std::array<bool, N> &touching, double dt) {
  std::array<double, N> flights{};
  for (std::size_t i = 0; i < N; ++i) {
    double &air = time[static_cast<Eigen::Index>(i)];
    if (touching[i]) flights[i] = air;
    air = touching[i] ? 0 : air + dt;
  }
  return flights;
}

/* A height field whose geom is fixed to the world and not turned (Robot::terrain). `view` is a Sim or a Start. The
 * surface consists of the triangles with which other geoms collide. Beyond the edge, the heights are those of the
 * edge. If rows have their own hfield_data, the heights are the row's; the place and the size are the model's. Heights
 * that a reset writes take effect after forward or advance. */
class Terrain {
 public:
  /* The surface's height at x and y, m; all in the world's frame. */
  template <typename View>
  double height(const View &view, double x, double y) const {
    const double column = cell(x - position_[0], size_[0], columns_), row = cell(y - position_[1], size_[1], rows_);
    const int c = std::max(std::min(static_cast<int>(column), columns_ - 2), 0);
    const int r = std::max(std::min(static_cast<int>(row), rows_ - 2), 0);
    const double u = column - c, v = row - r;
    const auto data = view[data_];
    const auto at = [&](int j, int i) {
      return static_cast<double>(data[first_ + std::min(r + j, rows_ - 1) * columns_ + std::min(c + i, columns_ - 1)]);
    };
    /* The diagonal of a cell goes from (r, c) to (r + 1, c + 1). */
    const double near = at(0, 0), far = at(1, 1), corner = u >= v ? at(0, 1) : at(1, 0);
    const double along = u >= v ? u * (corner - near) + v * (far - corner) : v * (corner - near) + u * (far - corner);
    return (near + along) * size_[2] + position_[2];
  }
  /* The surface's heights around a body: an Eigen expression with one number for each point, m in the world's frame.
   * points: (x, y) from the body's position, along axes that are turned by the body's yaw alone. Valid until the lambda
   * returns. */
  auto around(const Sim &sim, int body, const std::vector<std::array<double, 2>> &points) const {
    const auto mat = sim.xmat(body);
    const double ahead = mat(0, 0), left = mat(1, 0), norm = std::sqrt(ahead * ahead + left * left);
    const double cos = norm > 0 ? ahead / norm : 1, sin = norm > 0 ? left / norm : 0;
    return Eigen::VectorXd::NullaryExpr(static_cast<Eigen::Index>(points.size()),
                                        [=, at = sim.xpos(body), all = points.data()](Eigen::Index i) {
                                          const auto &[x, y] = all[i];
                                          return height(sim, at[0] + (cos * x - sin * y), at[1] + (sin * x + cos * y));
                                        });
  }

 private:
  friend class Robot;
  Shared<float> data_;
  int first_ = 0, rows_ = 1, columns_ = 1; /* the field's first number in hfield_data, and its sizes */
  std::array<double, 3> size_{1, 1, 1}, position_{};

  static double cell(double x, double radius, int count) {
    const double at = (x + radius) / (2 * radius) * (count - 1);
    return std::min(std::max(at, 0.0), static_cast<double>(count - 1));
  }
};

/* The result of a step. */
struct Outcome {
  double reward;
  bool terminated;
};

/* A value that Gymnasium returns as a Python float. A plain double is an np.float64. */
struct PythonFloat {
  double value;
};
/* A value and its type. */
struct Typed {
  double value;
  mjenv_dtype type;
};

namespace detail {

/* Describes a field: a scalar with ndim 0, a vector of count numbers with ndim 1. */
inline void describe(mjenv_builder *builder, mjenv_role role, const char *name, const char *doc, mjenv_dtype type,
                     std::int32_t ndim = 0, Eigen::Index count = 1, const char *group = nullptr) {
  mjenv_task_field field = MJENV_TASK_FIELD_INIT;
  field.role = role;
  field.name = name;
  field.doc = doc;
  field.dtype = type;
  field.ndim = ndim;
  field.shape[0] = count;
  field.group = group;
  mjenv_build_field(builder, &field);
}

}  // namespace detail

/* Receives the info: info(name, value, doc). In each call, a lambda must write the same names and lengths in the same
 * order. */
class Info {
 public:
  struct Entry {
    const char *name;
    std::string text;
    Eigen::Index count;
  };

  /* For a trial call, which describes the fields of a role; and for calls that write their values. */
  Info(std::vector<Entry> &learned, mjenv_builder *builder, mjenv_role role)
      : learned_(&learned), builder_(builder), role_(role) {}
  Info(const std::vector<Entry> &entries, double *to)
      : entry_(entries.data()), end_(entry_ + entries.size()), to_(to) {}

  void operator()(const char *name, double x, const char *doc = "") { scalar(name, x, MJENV_DTYPE_FLOAT64, doc); }
  void operator()(const char *name, np::Scalar x, const char *doc = "") { scalar(name, x, MJENV_DTYPE_ACTION, doc); }
  void operator()(const char *name, PythonFloat value, const char *doc = "") {
    scalar(name, value.value, MJENV_DTYPE_NATIVE_FLOAT, doc);
  }
  void operator()(const char *name, Typed value, const char *doc = "") { scalar(name, value.value, value.type, doc); }
  /* An int or a bool. */
  template <typename T, typename = std::enable_if_t<std::is_integral_v<T>>>
  void operator()(const char *name, T value, const char *doc = "") {
    scalar(name, static_cast<double>(value), MJENV_DTYPE_NATIVE_INT, doc);
  }
  template <typename Derived>
  void operator()(const char *name, const Eigen::DenseBase<Derived> &values, const char *doc = "") {
    if (learned_) return learn(name, MJENV_DTYPE_FLOAT64, 1, values.size(), doc);
    double *to = next(name, values.size());
    for (Eigen::Index i = 0; i < values.size(); ++i) to[i] = values.derived().coeff(i);
  }

  void check_complete() const {
    if (entry_ != end_) refuse(nullptr, 0);
  }

 private:
  std::vector<Entry> *learned_ = nullptr;
  mjenv_builder *builder_ = nullptr;
  mjenv_role role_ = MJENV_ROLE_INFO;
  const Entry *entry_ = nullptr, *end_ = nullptr;
  double *to_ = nullptr;

  void scalar(const char *name, double value, mjenv_dtype type, const char *doc) {
    if (learned_) return learn(name, type, 0, 1, doc);
    *next(name, 1) = value;
  }
  double *next(const char *name, Eigen::Index count) {
    if (entry_ == end_ || (entry_->name != name && entry_->text != name) || entry_->count != count) refuse(name, count);
    double *to = to_;
    to_ += entry_++->count;
    return to;
  }
  void learn(const char *name, mjenv_dtype type, std::int32_t ndim, Eigen::Index count, const char *doc) {
    for (const auto &entry : *learned_)
      if (entry.text == name) throw std::logic_error("the info has two fields \"" + entry.text + '"');
    detail::describe(builder_, role_, name, doc, type, ndim, count);
    learned_->push_back({name, name, count});
  }
  [[noreturn]] void refuse(const char *name, Eigen::Index count) const {
    const auto text = [](const std::string &field, Eigen::Index numbers) {
      return '"' + field + "\" (" + std::to_string(numbers) + " number(s))";
    };
    throw std::logic_error("the info must have the same fields in each call, but " +
                           (name ? text(name, count) + " was written" : std::string("it ended")) + " where " +
                           (entry_ == end_ ? "the end" : text(entry_->text, entry_->count)) + " was expected");
  }
};

/* The value of a real option, and whether the caller set it to an integer. If so, the option's product
 * with a bool is an integer, too: an np.int64 if the bool is NumPy's (numpy_typed), an int if it is Python's
 * (python_typed). */
struct Real {
  double value;
  bool integer;
  operator double() const { return value; }
};
inline Typed numpy_typed(double product, Real factor) {
  return {product, factor.integer ? MJENV_DTYPE_INT64 : MJENV_DTYPE_FLOAT64};
}
inline Typed python_typed(double product, Real factor) {
  return {product, factor.integer ? MJENV_DTYPE_NATIVE_INT : MJENV_DTYPE_NATIVE_FLOAT};
}

/* Gymnasium's default_camera_config. kUnset and MJENV_BODY_UNSET mean MuJoCo's default. */
struct Camera {
  std::int32_t trackbodyid = MJENV_BODY_UNSET;
  double distance = kUnset;
  std::array<double, 3> lookat{kUnset, kUnset, kUnset};
  double elevation = kUnset;

  static constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();
};

/* ---- The definition of a task ---- */

/* A definition throws this if the task cannot use the model; the text says why, such as "it has no leg". mjenv_create
 * then returns MJENV_E_MODEL. */
struct UnfitModel : std::runtime_error {
  using std::runtime_error::runtime_error;
};

namespace detail {

/* The lambdas of a definition in one environment, and the fields that their trial calls found. */
struct Functions {
  /* Returns how many numbers the term has. Writes them to `to` if it is not null and `room` is this number. */
  using Write = std::function<Eigen::Index(const Sim &, double *to, Eigen::Index room)>;
  struct Term {
    std::string name, doc, group;
    Write write;
    Eigen::Index count = 0;
  };

  std::vector<Term> terms;
  std::function<void(Start &, mjenv_random *)> reset;
  std::function<void(const Sim &, Info &)> reset_info;
  std::function<void(const Sim &, double *)> carry;
  std::function<Outcome(const Sim &, Row &, Info &)> step;
  std::function<void(const Sim &, Row &, Control &)> before_step, before_substep;
  std::function<double(const Goal &, const Goal &)> compute_reward;
  std::vector<Info::Entry> info, reset_infos;
};

/* What a definition says about its task even in the run without a model, which lists the options. */
struct Outline {
  struct Option {
    mjenv_kind kind;
    std::string name, doc, text, choices;
    std::vector<double> values;
    double low, high;
    bool live = false;
  };

  std::string model, model_text;
  bool fixed_model = false, fixed_frame_skip = false;
  int frame_skip = 1;
  std::int64_t time_limit = 0;
  double reward_threshold = Camera::kUnset;
  Camera camera;
  std::int32_t revision = 0;
  std::vector<Option> options;

  /* The function of Robot whose effect differs; null: none. */
  const char *difference(const Outline &other) const {
    const auto same = [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); };
    if (model != other.model) return "model";
    if (model_text != other.model_text) return "model_text";
    if (fixed_model != other.fixed_model) return "fixed_model";
    if (frame_skip != other.frame_skip) return "frame_skip";
    if (fixed_frame_skip != other.fixed_frame_skip) return "fixed_frame_skip";
    if (time_limit != other.time_limit) return "time_limit";
    if (!same(reward_threshold, other.reward_threshold)) return "reward_threshold";
    if (revision != other.revision) return "revision";
    const bool looks_at = std::equal(camera.lookat.begin(), camera.lookat.end(), other.camera.lookat.begin(), same);
    if (!looks_at || camera.trackbodyid != other.camera.trackbodyid || !same(camera.distance, other.camera.distance) ||
        !same(camera.elevation, other.camera.elevation))
      return "camera";
    return nullptr;
  }
};

template <typename Derived>
std::true_type is_dense(const Eigen::DenseBase<Derived> *);
std::false_type is_dense(const void *);

/* These stop the compiler with a plain message at a lambda with wrong parameters or a wrong result. */
template <typename F>
constexpr void check_observe() {
  static_assert(
      !std::is_invocable_v<const F &, const Sim &, Rng &> && !std::is_invocable_v<const F &, const Sim &, Row &>,
      "observe cannot draw or change the row, because it is also called when a program reads a row: draw in "
      "step, and carry the number");
  static_assert(std::is_invocable_v<const F &, const Sim &>,
                "the lambda of observe takes (const Sim &s), and is not mutable");
  if constexpr (std::is_invocable_v<const F &, const Sim &>) {
    using V = std::decay_t<std::invoke_result_t<const F &, const Sim &>>;
    static_assert(std::is_arithmetic_v<V> || decltype(is_dense(static_cast<V *>(nullptr)))::value,
                  "the lambda of observe returns a number or an Eigen vector");
  }
}
template <typename F>
constexpr void check_control() {
  static_assert(std::is_invocable_v<const F &, const Sim &, Control &> ||
                    std::is_invocable_v<const F &, const Sim &, Row &, Control &>,
                "the lambda of before_step and before_substep takes (const Sim &s, Control &control) or (const Sim &s, "
                "Row &row, Control &control), and is not mutable");
}
template <typename F>
constexpr void check_step() {
  static_assert(
      std::is_invocable_r_v<Outcome, const F &, const Sim &, Info &> ||
          std::is_invocable_r_v<Outcome, const F &, const Sim &, const Carried &, Info &> ||
          std::is_invocable_r_v<Outcome, const F &, const Sim &, Row &, Info &> ||
          std::is_invocable_r_v<Outcome, const F &, const Sim &, const Carried &, Row &, Info &>,
      "the lambda of step takes (const Sim &s, Info &info), (const Sim &s, const Carried &before, Info &info), "
      "(const Sim &s, Row &row, Info &info) or (const Sim &s, const Carried &before, Row &row, Info &info), "
      "returns an Outcome, and is not mutable");
}

}  // namespace detail

/* What a definition calls to describe its task. */
class Robot {
 public:
  /* builder: null in the run that lists the options. */
  Robot(const char *id, detail::Outline &outline, detail::Functions &functions, mjenv_builder *builder)
      : version(version_of(id)), v5(version == 5), outline_(outline), functions_(functions), builder_(builder) {}
  Robot(const Robot &) = delete;
  Robot &operator=(const Robot &) = delete;

  const int version; /* the number at the end of the id */
  const bool v5;     /* version == 5 */

  /* ---- Model and limits ---- */
  /* The default of the option xml_file: a built-in model ("hopper.xml"), or a path that begins with ".", "/" or "~";
   * "." is the folder of the shared object or program that contains the definition. */
  Robot &model(const char *name) { return outline_.model = name, *this; }
  /* The text of an MJCF model, instead of model(). */
  Robot &model_text(const char *mjcf) { return outline_.model_text = mjcf, *this; }
  /* The task has no options xml_file, xml_string and trust_xml. */
  Robot &fixed_model() { return outline_.fixed_model = true, *this; }
  /* How many mj_steps make a step: the default of the option frame_skip. */
  Robot &frame_skip(int count) { return outline_.frame_skip = count, *this; }
  /* The task has no option frame_skip. */
  Robot &fixed_frame_skip() { return outline_.fixed_frame_skip = true, *this; }
  /* The number of steps after which an episode is truncated; 0, the default: never. */
  Robot &time_limit(std::int64_t steps) { return outline_.time_limit = steps, *this; }
  /* The return from which the task counts as solved. */
  Robot &reward_threshold(double value) { return outline_.reward_threshold = value, *this; }
  Robot &camera(Camera value) { return outline_.camera = value, *this; }
  /* Increase it when the task changes, so that snapshots of the old task are refused. */
  Robot &revision(std::int32_t number) { return outline_.revision = number, *this; }
  /* The reward's type in Python; default: np.float64. */
  Robot &reward_type(mjenv_dtype type) {
    if (builder_) detail::describe(builder_, MJENV_ROLE_REWARD, "reward", "", type);
    return *this;
  }
  /* Refuses models whose qpos or qvel is shorter. */
  Robot &needs(int nq, int nv) { return require(this->nq() >= nq && this->nv() >= nv, "at least ", nq, nv); }
  /* Refuses models whose qpos or qvel has another length. */
  Robot &needs_exactly(int nq, int nv) { return require(this->nq() == nq && this->nv() == nv, "", nq, nv); }
  /* Makes an array available that is computed on demand (mjenv_build_need). Only necessary if no trial call uses the
   * array. */
  Robot &needs(const char *array) {
    if (builder_) mjenv_build_need(builder_, array);
    return *this;
  }

  /* The model's sizes; 0 in the run that lists the options. */
  int nq() const { return builder_ ? builder_->sim->nq : 0; }
  int nv() const { return builder_ ? builder_->sim->nv : 0; }
  int nu() const { return builder_ ? builder_->sim->nu : 0; }
  int nbody() const { return builder_ ? builder_->sim->nbody : 0; }

  /* Makes lambdas see what belongs to the new state, and lets reset simulate (mjenv_build_current). */
  Robot &current() {
    if (builder_) mjenv_build_current(builder_);
    return *this;
  }
  /* The action space: low[i] and high[i] bound number i of an action, which before_step turns into ctrl. */
  Robot &action(const std::vector<double> &low, const std::vector<double> &high) {
    if (low.size() != high.size()) throw std::invalid_argument("the bounds of the action have different lengths");
    if (builder_) mjenv_build_action(builder_, static_cast<std::int64_t>(low.size()), low.data(), high.data());
    return *this;
  }
  Robot &action(int count, double low, double high) {
    const auto size = static_cast<std::size_t>(count);
    return action(std::vector<double>(size, low), std::vector<double>(size, high));
  }
  /* Gives each row its own copy of an array of real numbers (mjenv_build_own). Of an array of mjModel, reset
   * writes it with start[own], and step with row[own]. before_step and before_substep write "qfrc_applied" and
   * "xfrc_applied" with control[own], and step with row[own]. */
  Own own(const char *name) {
    if (!builder_) return {};
    mjenv_field field = MJENV_FIELD_INIT;
    const std::int32_t at = mjenv_build_array(builder_, name, &field);
    const std::int32_t index = mjenv_build_own(builder_, name);
    if (!builder_->failed) own_.push_back(numbers(builder_->sim->arrays[at], field));
    return {index, static_cast<Eigen::Index>(field.count)};
  }

  /* ---- Options: each call declares an option with its default and documentation, and returns its value ---- */
  /* low and high are closed bounds. */
  Real real(const char *name, double value, const char *doc, double low = -kInfinity, double high = kInfinity) {
    if (!builder_) return declare({MJENV_KIND_REALS, name, doc, "", "", {value}, low, high}), Real{value, false};
    return {mjenv_build_real(builder_, name), mjenv_build_is_integer(builder_, name) != 0};
  }
  std::array<double, 2> range(const char *name, std::array<double, 2> value, const char *doc) {
    const std::vector<double> found = reals(name, {value[0], value[1]}, doc);
    return {found[0], found[1]};
  }
  std::vector<double> reals(const char *name, std::vector<double> value, const char *doc) {
    if (!builder_) return declare({MJENV_KIND_REALS, name, doc, "", "", value, -kInfinity, kInfinity}), value;
    mjenv_build_reals(builder_, name, value.data(), static_cast<std::int64_t>(value.size()));
    return value;
  }
  /* A live parameter: each row has its own number, at first the option's, which the program changes while the task runs
   * (mjenv_write: "parameters.NAME"). Lambdas read it with s[live], reset with start[live]. */
  Live live(const char *name, double value, const char *doc, double low = -kInfinity, double high = kInfinity) {
    return {live(name, std::vector<double>{value}, doc, low, high).first};
  }
  LiveVector live(const char *name, const std::vector<double> &value, const char *doc, double low = -kInfinity,
                  double high = kInfinity) {
    if (!builder_) declare({MJENV_KIND_REALS, name, doc, "", "", value, low, high, true});
    return {builder_ ? static_cast<Eigen::Index>(mjenv_build_parameter(builder_, name)) : 0,
            static_cast<Eigen::Index>(value.size())};
  }
  bool flag(const char *name, bool value, const char *doc) {
    if (!builder_) return declare({MJENV_KIND_FLAG, name, doc, "", "", {value ? 1.0 : 0.0}, 0, 1}), value;
    return mjenv_build_integer(builder_, name) != 0;
  }
  std::int64_t integer(const char *name, std::int64_t value, std::int64_t low, std::int64_t high, const char *doc) {
    const auto real = [](std::int64_t number) { return static_cast<double>(number); };
    if (!builder_) return declare({MJENV_KIND_INTEGER, name, doc, "", "", {real(value)}, real(low), real(high)}), value;
    return mjenv_build_integer(builder_, name);
  }
  /* choices: the valid texts, separated by blanks; "": any text is valid. */
  std::string text(const char *name, const char *value, const char *doc, const char *choices = "") {
    if (!builder_) return declare({MJENV_KIND_STRING, name, doc, value, choices, {0}, 0, 0}), value;
    return mjenv_build_text(builder_, name);
  }
  /* The option reset_noise_scale. */
  double noise(double value) {
    return real("reset_noise_scale", value, "spread of the random initial state", 0,
                std::numeric_limits<double>::max() / 2);
  }
  /* An option that names a body or gives its index. Returns the index. */
  int body_option(const char *name, int value, const char *doc) {
    constexpr double most = std::numeric_limits<int>::max();
    if (!builder_)
      return declare({MJENV_KIND_STRING_OR_INT, name, doc, "", "", {static_cast<double>(value)}, 0, most}), 0;
    return mjenv_build_option_index(builder_, name, "body");
  }
  /* The Euclidean norm, rounded as the option "norm" says. */
  np::Norm norm() { return np::Norm(builder_ && mjenv_build_norm_is_fused(builder_)); }

  /* ---- Objects of the model. A model that does not have them is refused. ---- */
  /* type: as in mjenv_object_index. */
  int index(const char *type, const char *name) { return builder_ ? mjenv_build_index(builder_, type, name) : 0; }
  int body(const char *name) { return index("body", name); }
  int geom(const char *name) { return index("geom", name); }
  int site(const char *name) { return index("site", name); }
  int site(int at) {
    if (builder_ && at >= builder_->sim->nsite) throw UnfitModel("it has no site " + std::to_string(at));
    return at;
  }
  int actuator(const char *name) { return index("actuator", name); }
  int tendon(const char *name) { return index("tendon", name); }
  Joint joint(const char *name) {
    const int at = index("joint", name);
    return {at, element("jnt_qposadr", at), element("jnt_dofadr", at)};
  }
  Sensor sensor(const char *name) {
    const int at = index("sensor", name);
    return {element("sensor_adr", at), element("sensor_dim", at)};
  }
  /* The height field of this geom, whose heights lambdas read. The geom must be fixed to the world and not turned. */
  Terrain terrain(const char *geom) {
    Terrain found;
    found.data_ = array<float>("hfield_data");
    if (!builder_) return found;
    const int at = this->geom(geom), field = element("geom_dataid", at);
    constexpr int kHeightField = 1; /* mjGEOM_HFIELD */
    if (element("geom_type", at) != kHeightField || element("geom_bodyid", at) != 0 ||
        element<double>("geom_quat", 4 * at) != 1)
      throw UnfitModel(std::string("its geom \"") + geom +
                       "\" is no height field that is fixed to the world and not turned");
    found.first_ = element("hfield_adr", field);
    found.rows_ = element("hfield_nrow", field);
    found.columns_ = element("hfield_ncol", field);
    for (int i = 0; i < 3; ++i) {
      found.size_[static_cast<std::size_t>(i)] = element<double>("hfield_size", 4 * field + i);
      found.position_[static_cast<std::size_t>(i)] = element<double>("geom_pos", 3 * at + i);
    }
    return found;
  }
  /* An array of mjData or mjModel, by its MuJoCo name, which lambdas read with s[array]. T is the type of its elements:
   * double, float, std::int32_t or std::uint8_t. */
  template <typename T = double>
  Shared<T> array(const char *name) {
    if (!builder_) return {};
    mjenv_field field = MJENV_FIELD_INIT;
    const std::int32_t at = mjenv_build_array(builder_, name, &field);
    const mjenv_dtype wanted = std::is_same_v<T, double>         ? MJENV_DTYPE_FLOAT64
                               : std::is_same_v<T, float>        ? MJENV_DTYPE_FLOAT32
                               : std::is_same_v<T, std::int32_t> ? MJENV_DTYPE_INT32
                                                                 : MJENV_DTYPE_UINT8;
    if (field.struct_size && field.name && field.dtype != wanted)
      throw std::invalid_argument("array \"" + std::string(name) + "\" has another element type");
    return {at, static_cast<Eigen::Index>(field.count)};
  }

  /* ---- The task ---- */
  /* Begins a group of terms, such as "policy" or "critic": the terms that follow belong to it, until the next group.
   * With groups, the observation is a Gymnasium Dict (the option "observation"). "" ends the group. */
  void group(const char *name) { group_ = name; }
  /* Adds a term to the observation: term(sim) returns an Eigen vector expression or a number. */
  template <typename F>
  void observe(const char *name, const F &term, const char *doc = "") {
    detail::check_observe<F>();
    functions_.terms.push_back({name, doc, group_, [term](const Sim &s, double *to, Eigen::Index room) -> Eigen::Index {
                                  const auto values = term(s);
                                  using V = std::decay_t<decltype(values)>;
                                  if constexpr (std::is_arithmetic_v<V>) {
                                    if (to && room == 1) *to = static_cast<double>(values);
                                    return 1;
                                  } else {
                                    if (to && values.size() == room)
                                      for (Eigen::Index i = 0; i < room; ++i) to[i] = values.coeff(i);
                                    return values.size();
                                  }
                                }});
  }
  /* Adds a term if it is wanted; otherwise observation_structure lists it with 0 numbers. */
  template <typename F>
  void observe_if(bool wanted, const char *name, const F &term, const char *doc = "") {
    if (wanted)
      observe(name, term, doc);
    else
      observe_nothing(name);
  }
  /* Lists a term with 0 numbers in observation_structure. */
  void observe_nothing(const char *name) {
    functions_.terms.push_back({name, "", group_, [](const Sim &, double *, Eigen::Index) { return Eigen::Index{0}; }});
  }
  /* Adds Gymnasium's observation_structure: how many elements of qpos the observation leaves out (-1: not listed), then
   * the length of each term. */
  void structure(int skipped_qpos = -1) {
    structured_ = true;
    skipped_qpos_ = skipped_qpos;
  }

  /* Makes the row carry count numbers from step to step. They are 0 at the start of an episode. reset changes them with
   * start[carry], step with row[carry], and lambdas read them with s[carry]. low and high are closed bounds, between
   * which 0 must be. A lambda that writes a number outside of them fails, and an image with such a number is refused.
   * Numbers that are used as indices or sizes need bounds. */
  Carry carry(int count, double low = -kInfinity, double high = kInfinity) {
    const Carry added{carry_count_, count};
    carry_count_ += count;
    if (low != -kInfinity || high != kInfinity) carry_bounds_.push_back({added, low, high});
    return added;
  }

  /* As carry, but resets do not set the numbers to 0, and find them in start[carry]: a terrain's level, for instance.
   * They are 0 until the row's first reset. */
  Carry keep(int count, double low = -kInfinity, double high = kInfinity) {
    kept_.push_back(carry(count, low, high));
    return kept_.back();
  }

  /* Sets the lambda that draws the initial state of an episode, from the row's Rng or from its RandomState. */
  template <typename F>
  void reset(const F &draw) {
    static_assert(
        std::is_invocable_v<const F &, Start &, Rng &> || std::is_invocable_v<const F &, Start &, RandomState &>,
        "the lambda of reset takes (Start &start, Rng &rng) or (Start &start, RandomState &random), and is not "
        "mutable; it sees the simulation as start.sim(), if the definition calls current()");
    if constexpr (std::is_invocable_v<F, Start &, Rng &>) {
      functions_.reset = [draw](Start &start, mjenv_random *stream) {
        Rng rng(stream);
        draw(start, rng);
      };
    } else {
      if (builder_) mjenv_build_random_state(builder_);
      functions_.reset = [draw](Start &start, mjenv_random *stream) {
        RandomState random(stream);
        draw(start, random);
      };
    }
  }
  /* before_step sets the lambda that turns the action into ctrl before the first mj_step of a step; before_substep sets
   * one that is called before each mj_step. Their parameters are (sim, control) or (sim, row, control). In sim they may
   * read the action, the state and the arrays of mjModel, but not what MuJoCo computes from the state
   * (mjenv_task.before_step). */
  template <typename F>
  void before_step(const F &map) {
    detail::check_control<F>();
    functions_.before_step = control_of(map);
  }
  template <typename F>
  void before_substep(const F &map) {
    detail::check_control<F>();
    functions_.before_substep = control_of(map);
  }
  /* Sets the lambda that computes the reward of a pair of goals (achieved, desired), for hindsight experience replay.
   * The observation needs the groups or terms achieved_goal and desired_goal. step may call the same lambda. */
  template <typename F>
  void compute_reward(const F &reward) {
    static_assert(
        std::is_invocable_r_v<double, const F &, const Goal &, const Goal &>,
        "the lambda of compute_reward takes (const Goal &achieved, const Goal &desired), returns a number, and "
        "is not mutable");
    functions_.compute_reward = reward;
  }
  /* Sets the lambda that writes the info of a reset. */
  template <typename F>
  void reset_info(const F &info) {
    static_assert(std::is_invocable_v<const F &, const Sim &, Info &>,
                  "the lambda of reset_info takes (const Sim &s, Info &info), and is not mutable");
    functions_.reset_info = info;
  }
  /* Sets the lambda before(sim), which returns what the next step needs to know of the present state: a vector of fixed
   * length. It is called when mjenv_task's carry is called. */
  template <typename F, typename = std::enable_if_t<!std::is_arithmetic_v<F>>>
  void carry(const F &before) {
    static_assert(
        std::is_invocable_v<const F &, const Sim &>,
        "the lambda of carry takes (const Sim &s), and is not mutable; it cannot draw, because it is also called "
        "when a program changes a row");
    using V = std::decay_t<decltype(before(std::declval<const Sim &>()).eval())>;
    static_assert(V::SizeAtCompileTime > 0, "a carried vector has a fixed length");
    if (functions_.step) throw std::logic_error("step takes the vector that carry returns: call carry before step");
    carried_ = carry(static_cast<int>(V::SizeAtCompileTime));
    functions_.carry = [before, at = carried_.first](const Sim &s, double *to) { Eigen::Map<V>{to + at} = before(s); };
  }
  /* Sets the lambda that computes the reward, the info and whether the episode has terminated, after frame_skip
   * mj_steps. Its parameters are (sim, info), (sim, carried, info), (sim, row, info) or (sim, carried, row, info);
   * carried is the vector of carry, which is empty without carry. */
  template <typename F>
  void step(const F &outcome) {
    detail::check_step<F>();
    if constexpr (std::is_invocable_v<F, const Sim &, Info &>)
      functions_.step = [outcome](const Sim &s, Row &, Info &info) -> Outcome { return outcome(s, info); };
    else if constexpr (std::is_invocable_v<F, const Sim &, Row &, Info &>)
      functions_.step = outcome;
    else {
      functions_.step = [outcome, at = carried_](const Sim &s, Row &row, Info &info) -> Outcome {
        const Carried carried(row[at].data(), at.count);
        if constexpr (std::is_invocable_v<F, const Sim &, const Carried &, Info &>)
          return outcome(s, carried, info);
        else
          return outcome(s, carried, row, info);
      };
    }
  }

  /* Makes the trial calls, which describe the fields and their lengths. */
  void learn() {
    if (builder_->failed) throw std::logic_error("build has failed"); /* the library knows why */
    if (!functions_.reset || !functions_.step) throw std::logic_error("a definition must call reset and step");
    mjenv_build_carry(builder_, carry_count_);
    for (const auto &[numbers, low, high] : carry_bounds_)
      mjenv_build_carry_bounds(builder_, numbers.first, numbers.count, low, high);
    for (const Carry &kept : kept_) mjenv_build_keep(builder_, kept.first, kept.count);
    const Sim sim(builder_->sim, builder_);
    if (structured_ && skipped_qpos_ >= 0) describe(MJENV_ROLE_STRUCTURE, "skipped_qpos", "", skipped_qpos_);
    for (auto &term : functions_.terms) {
      for (const auto *other = functions_.terms.data(); other != &term; ++other)
        if (other->name == term.name) throw std::logic_error("the observation has two terms \"" + term.name + '"');
      term.count = term.write(sim, nullptr, 0);
      if (term.count > 0)
        detail::describe(builder_, MJENV_ROLE_OBSERVATION, term.name.c_str(), term.doc.c_str(), MJENV_DTYPE_FLOAT64, 1,
                         term.count, term.group.c_str());
      if (structured_) describe(MJENV_ROLE_STRUCTURE, term.name.c_str(), term.doc, term.count);
    }
    if (functions_.reset_info) {
      Info info(functions_.reset_infos, builder_, MJENV_ROLE_RESET_INFO);
      functions_.reset_info(sim, info);
    }
    std::vector<double> carried(static_cast<std::size_t>(carry_count_));
    if (functions_.carry) functions_.carry(sim, carried.data());
    Info info(functions_.info, builder_, MJENV_ROLE_INFO);
    std::vector<double *> own;
    for (std::vector<double> &values : own_) own.push_back(values.data());
    std::vector<double> qvel(builder_->sim->qvel, builder_->sim->qvel + nv());
    Row row(carried.data(), builder_->random, own.data(), qvel.data(), nv());
    functions_.step(sim, row, info);
  }

 private:
  detail::Outline &outline_;
  detail::Functions &functions_;
  mjenv_builder *builder_;
  std::string group_; /* of the next terms */
  bool structured_ = false;
  int skipped_qpos_ = -1;
  Eigen::Index carry_count_ = 0;
  Carry carried_;
  std::vector<Carry> kept_;
  std::vector<std::vector<double>> own_; /* the model's values of the own arrays, for the trial call of step */
  struct CarryBounds {
    Carry numbers;
    double low, high;
  };
  std::vector<CarryBounds> carry_bounds_;

  template <typename F>
  static std::function<void(const Sim &, Row &, Control &)> control_of(const F &map) {
    if constexpr (std::is_invocable_v<F, const Sim &, Control &>)
      return [map](const Sim &s, Row &, Control &control) { map(s, control); };
    else
      return map;
  }
  static std::vector<double> numbers(const void *array, const mjenv_field &field) {
    if (field.dtype == MJENV_DTYPE_FLOAT32)
      return {static_cast<const float *>(array), static_cast<const float *>(array) + field.count};
    return {static_cast<const double *>(array), static_cast<const double *>(array) + field.count};
  }
  static int version_of(const char *id) {
    const std::string text = id;
    const std::size_t dash = text.rfind("-v");
    return dash == std::string::npos ? 0 : std::atoi(text.c_str() + dash + 2);
  }
  void declare(detail::Outline::Option option) {
    for (const auto &other : outline_.options)
      if (other.name == option.name) return;
    outline_.options.push_back(std::move(option));
  }
  static std::string sizes(int nq, int nv) {
    return std::to_string(nq) + " positions and " + std::to_string(nv) + " velocities";
  }
  Robot &require(bool fits, const char *how, int nq, int nv) {
    if (builder_ && !fits)
      throw UnfitModel("it has " + sizes(this->nq(), this->nv()) + ", not " + (how + sizes(nq, nv)));
    return *this;
  }
  /* Describes a vector. */
  void describe(mjenv_role role, const char *name, const std::string &doc, Eigen::Index count) {
    detail::describe(builder_, role, name, doc.c_str(), MJENV_DTYPE_FLOAT64, 1, count);
  }
  template <typename T = std::int32_t>
  T element(const char *name, int at) {
    const auto numbers = array<T>(name);
    return builder_ && at < numbers.count ? static_cast<const T *>(builder_->sim->arrays[numbers.index])[at] : T{0};
  }
};

/* ---- How a definition becomes a mjenv_task ---- */

namespace detail {

/* Calls body. If it throws, the callback fails with the exception's text. */
template <typename Body>
std::int32_t guarded(const mjenv_task_api *api, const Body &body) noexcept {
  try {
    body();
    return 0;
  } catch (const UnfitModel &error) {
    return mjenv_task_fail(api, error.what()), MJENV_E_MODEL;
  } catch (const std::bad_alloc &) {
    return MJENV_E_MEMORY;
  } catch (const std::exception &error) {
    return mjenv_task_fail(api, error.what());
  } catch (...) {
    return mjenv_task_fail(api, "it threw an exception that is not a std::exception");
  }
}

/* A definition and its id. It has no destructor, because the library keeps a pointer to it (mjenv_task.user). */
struct Definition {
  const char *id;
  void (*define)(Robot &);
  Definition *next;

  static std::int32_t build(mjenv_builder *builder, void *user, void **self) {
    return guarded(builder->api, [&] {
      const auto &definition = *static_cast<const Definition *>(user);
      auto functions = std::make_unique<Functions>();
      Functions ignored;
      Outline outline, listed;
      Robot robot(definition.id, outline, *functions, builder), listing(definition.id, listed, ignored, nullptr);
      definition.define(robot);
      robot.learn();
      definition.define(listing);
      if (const char *what = outline.difference(listed))
        throw std::logic_error(std::string("the definition calls ") + what +
                               " only under an option or for some models, but it must be the same in all environments");
      set_callbacks(*builder->task, *functions);
      *self = functions.release();
    });
  }
  static void destroy(void *self) { delete static_cast<Functions *>(self); }

  static const Functions &of(const void *self) { return *static_cast<const Functions *>(self); }
  static std::int32_t reset(const void *self, mjenv_start *c) {
    return guarded(c->api, [&] {
      Start start(c);
      of(self).reset(start, c->random);
    });
  }
  static std::int32_t reset_info(const void *self, const mjenv_sim *c, double *to) {
    return guarded(c->api, [&] {
      if (!of(self).reset_info) return;
      Info info(of(self).reset_infos, to);
      of(self).reset_info(Sim(c), info);
      info.check_complete();
    });
  }
  static std::int32_t carry(const void *self, const mjenv_sim *c, double *to) {
    return guarded(c->api, [&] {
      if (of(self).carry) of(self).carry(Sim(c), to);
    });
  }
  static std::int32_t observe(const void *self, const mjenv_sim *c, double *to) {
    return guarded(c->api, [&] {
      const Sim sim(c);
      for (const auto &term : of(self).terms) {
        const Eigen::Index count = term.write(sim, to, term.count);
        if (count != term.count)
          throw std::length_error("term \"" + term.name + "\" has " + std::to_string(count) + " number(s), but " +
                                  std::to_string(term.count) + " in the trial call");
        to += count;
      }
    });
  }
  template <std::function<void(const Sim &, Row &, Control &)> Functions::*kMap>
  static std::int32_t control(const void *self, const mjenv_sim *c, mjenv_control *to) {
    return guarded(c->api, [&] {
      Row row(to->carried, to->random);
      Control control(to, c->nu, c->nv);
      (of(self).*kMap)(Sim(c), row, control);
    });
  }
  static std::int32_t compute_reward(const void *self, const mjenv_task_api *api, const double *achieved,
                                     const double *desired, std::int64_t size, double *reward) {
    return guarded(api, [&] { *reward = of(self).compute_reward(Goal(achieved, size), Goal(desired, size)); });
  }
  static std::int32_t step(const void *self, const mjenv_sim *c, mjenv_outcome *outcome) {
    return guarded(c->api, [&] {
      const Functions &functions = of(self);
      Info info(functions.info, outcome->info);
      Row row(outcome->carried, outcome->random, outcome->own, outcome->qvel, c->nv);
      const Outcome result = functions.step(Sim(c), row, info);
      info.check_complete();
      outcome->reward = result.reward;
      outcome->terminated = result.terminated;
    });
  }
  /* Gives the task the callbacks for what the definition has set. */
  static void set_callbacks(mjenv_task &task, const Functions &functions) {
    task.reset = reset;
    task.reset_info = functions.reset_info ? reset_info : nullptr;
    task.carry = functions.carry ? carry : nullptr;
    task.observe = observe;
    task.step = step;
    task.before_step = functions.before_step ? control<&Functions::before_step> : nullptr;
    task.before_substep = functions.before_substep ? control<&Functions::before_substep> : nullptr;
    task.compute_reward = functions.compute_reward ? compute_reward : nullptr;
  }
};

/* A definition as a mjenv_task, and the memory that the mjenv_task points to. */
class Description {
 public:
  explicit Description(const Definition &definition) {
    Functions functions;
    Robot robot(definition.id, outline_, functions, nullptr);
    definition.define(robot);
    for (const auto &from : outline_.options) {
      mjenv_task_option to = MJENV_TASK_OPTION_INIT;
      to.kind = from.kind;
      to.name = from.name.c_str();
      to.doc = from.doc.c_str();
      to.value = from.values.empty() ? 0 : from.values[0];
      to.values = from.values.data();
      to.count = from.kind == MJENV_KIND_REALS ? static_cast<std::int64_t>(from.values.size()) : 0;
      to.low = from.low;
      to.high = from.high;
      to.text = from.kind == MJENV_KIND_STRING ? from.text.c_str() : nullptr;
      to.live = from.live;
      to.choices = from.choices.empty() ? nullptr : from.choices.c_str();
      options_.push_back(to);
    }
    const auto &[body, distance, lookat, elevation] = outline_.camera;
    camera_ = {sizeof camera_, body, distance, {lookat[0], lookat[1], lookat[2]}, elevation};
    task_.revision = outline_.revision;
    task_.id = definition.id;
    task_.model = outline_.model.empty() && !outline_.model_text.empty() ? nullptr : outline_.model.c_str();
    task_.model_text = outline_.model_text.empty() ? nullptr : outline_.model_text.c_str();
    task_.frame_skip = outline_.frame_skip;
    task_.has_reward_threshold = !std::isnan(outline_.reward_threshold);
    task_.reward_threshold = outline_.reward_threshold;
    task_.time_limit = outline_.time_limit;
    task_.camera = &camera_;
    task_.options = options_.data();
    task_.option_count = static_cast<std::int64_t>(options_.size());
    task_.user = const_cast<Definition *>(&definition); /* build only reads it */
    task_.build = Definition::build;
    task_.destroy = Definition::destroy;
    Definition::set_callbacks(task_, functions);
    task_.fixed_model = outline_.fixed_model;
    task_.fixed_frame_skip = outline_.fixed_frame_skip;
  }
  Description(const Description &) = delete;
  Description &operator=(const Description &) = delete;

  const mjenv_task &task() const { return task_; }

 private:
  Outline outline_;
  std::vector<mjenv_task_option> options_;
  mjenv_task_camera camera_{};
  mjenv_task task_ = MJENV_TASK_INIT;
};

/* The definitions of this program or shared object. The symbols are hidden, so that each shared object has its own. */
MJENV_HIDDEN inline Definition *definitions = nullptr;

/* Adds a definition to the list when the program or shared object is loaded. */
struct Registrar {
  MJENV_HIDDEN explicit Registrar(Definition &definition) {
    Definition **end = &definitions;
    while (*end) end = &(*end)->next;
    *end = &definition;
  }
};

/* The tasks of this shared object, as a plug-in hands them to the library. */
struct Plugin {
  std::vector<std::unique_ptr<Description>> described;
  std::vector<const mjenv_task *> tasks;
  mjenv_plugin plugin{};

  Plugin() {
    for (auto *at = definitions; at; at = at->next) {
      described.push_back(std::make_unique<Description>(*at));
      tasks.push_back(&described.back()->task());
    }
    plugin = {sizeof plugin, MJENV_ABI_VERSION, tasks.data(), static_cast<std::int64_t>(tasks.size())};
  }
};

/* The Plugin that the first finished call of plugin_of_tasks has made, until the shared object is unloaded. */
struct Made {
  std::atomic<const Plugin *> plugin{nullptr};
  constexpr Made() = default;
  Made(const Made &) = delete;
  Made &operator=(const Made &) = delete;
  ~Made() { delete plugin.load(); }
};
MJENV_HIDDEN inline Made made;

/* Several threads may call this at the same time: each makes a Plugin, and the first one that is finished is kept.
 * There is no lock, because a child that is forked meanwhile could find it held by a thread that the child does not
 * have. */
MJENV_HIDDEN inline const mjenv_plugin *plugin_of_tasks(const mjenv_task_api *api) {
  const Plugin *found = made.plugin.load();
  if (found) return &found->plugin;
  const std::int32_t failed = guarded(api, [&] {
    auto own = std::make_unique<const Plugin>();
    if (made.plugin.compare_exchange_strong(found, own.get())) found = own.release();
  });
  return failed != 0 ? nullptr : &found->plugin;
}

}  // namespace detail

/* For code that turns a definition into a mjenv_task, as the library does: Description(definition).task(). */
using detail::Definition;
using detail::Description;

/* Registers the tasks that this program defines with MJENV_TASK. The program links with libmjenv. Throws
 * std::runtime_error if the library refuses a task. */
MJENV_HIDDEN inline void register_tasks() {
  for (detail::Definition *at = detail::definitions; at; at = at->next)
    if (mjenv_register_task(&detail::Description(*at).task()) != MJENV_OK) throw std::runtime_error(mjenv_last_error());
}

}  // namespace mjenv

/* Begins the definition of a task: MJENV_TASK("Cartpole-v0", r) { r.model(...); ... } */
#define MJENV_TASK(id, robot) MJENV_TASK_NUMBERED(id, robot, __COUNTER__)
#define MJENV_TASK_NUMBERED(id, robot, number) MJENV_TASK_NAMED(id, robot, mjenv_task_, number)
#define MJENV_TASK_NAMED(id, robot, name, number)                                              \
  static void name##number(::mjenv::Robot &robot);                                             \
  static ::mjenv::detail::Definition name##definition_##number = {id, name##number, nullptr};  \
  static const ::mjenv::detail::Registrar name##registrar_##number(name##definition_##number); \
  static void name##number(::mjenv::Robot &robot)

/* Makes a shared object with definitions a plug-in. Not compiled into a program that defines MJENV_NO_PLUGIN. */
#ifndef MJENV_NO_PLUGIN
extern "C" MJENV_EXPORT inline const mjenv_plugin *mjenv_tasks(const mjenv_task_api *api) {
  return mjenv::detail::plugin_of_tasks(api);
}
#endif
#endif
