// The methods and types with which core/robots/ defines the robots. A definition is a function that takes a Robot&.
// It runs without a model to declare the options, and again with the caller's options and model to build the task.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "engine/model.hpp"
#include "engine/sim.hpp"
#include "numpy/math.hpp"
#include "numpy/random.hpp"
#include "task/options.hpp"

namespace mjenv::core {

using Rng = np::Generator;

struct Field {
  std::string name, doc;
  mjenv_type type = MJENV_TYPE_FLOAT64;
  std::vector<std::int64_t> shape;
  std::int64_t offset = 0, count = 1;
};

// The documentation of a term of an observation or an info, with its unit. "" for an unknown name.
const char* meaning(const std::string& name);

// These tell Info that Gymnasium returns a value in another type than np.float64.
struct PythonFloat {
  double value;
};
struct Typed {
  double value;
  mjenv_type type;
};

// Receives the info of one row: info(name, value) for each field. Every step must write the same fields in the same
// order; so must every reset_info.
class Info {
 public:
  // For a trial call: appends to `found` the fields that the call writes.
  explicit Info(std::vector<Field>& found) : found_(&found) {}
  // For other calls: writes the values to element `row` of `rows` in the array `base`, if it is not null.
  Info(const std::vector<Field>& fields, double* base, std::int64_t rows, std::int64_t row)
      : field_(fields.data()), end_(field_ + fields.size()), base_(base), rows_(rows), row_(row) {}

  void operator()(const char* name, double value) { scalar(name, value, MJENV_TYPE_FLOAT64); }
  void operator()(const char* name, np::Scalar value) { scalar(name, value, MJENV_TYPE_ACTION); }
  void operator()(const char* name, PythonFloat value) { scalar(name, value.value, MJENV_TYPE_NATIVE_FLOAT); }
  void operator()(const char* name, Typed value) { scalar(name, value.value, value.type); }
  template <typename Derived>
  void operator()(const char* name, const Eigen::DenseBase<Derived>& values) {
    if (found_) return add_field(name, MJENV_TYPE_FLOAT64, {values.size()});
    if (double* to = next(name, values.size()))
      for (Eigen::Index i = 0; i < values.size(); ++i) to[i] = values.derived().coeff(i);
  }
  // Writes all fields at once. values: their numbers, one field after the other.
  void write_all(const double* values) {
    for (; field_ != end_; ++field_)
      if (base_)
        std::copy_n(values + field_->offset, field_->count, base_ + field_->offset * rows_ + row_ * field_->count);
  }
  // Throws if a field has not been written.
  void check_complete() const {
    if (field_ != end_) refuse(nullptr, 0);
  }

 private:
  std::vector<Field>* found_ = nullptr;
  const Field *field_ = nullptr, *end_ = nullptr;
  double* base_ = nullptr;
  std::int64_t rows_ = 1, row_ = 0;

  void scalar(const char* name, double value, mjenv_type type) {
    if (found_) return add_field(name, type, {});
    if (double* to = next(name, 1)) *to = value;
  }
  // Where to write the next field, or null. Checks the field, because a wrong one would be written outside of this row.
  double* next(const char* name, std::int64_t count) {
    if (field_ == end_ || field_->name != name || field_->count != count) refuse(name, count);
    const Field& field = *field_++;
    return base_ ? base_ + field.offset * rows_ + row_ * field.count : nullptr;
  }
  [[noreturn]] void refuse(const char* name, std::int64_t count) const;
  void add_field(const char* name, mjenv_type type, std::vector<std::int64_t> shape);
};

// The result of a step.
struct Outcome {
  double reward;
  bool terminated;
};

// The initial state of an episode. It holds the model's initial state, which the task's reset function changes.
struct Start {
  Eigen::Map<Eigen::VectorXd> qpos, qvel, act, carried;
  const Sim& sim;  // only its sizes and the model's arrays are valid: it does not show this initial state
};

// The vector that carry returned for the state before the step.
using Carried = Eigen::Map<const Eigen::VectorXd>;

// What a task may change of its row in a step.
struct Row {
  Eigen::Map<Eigen::VectorXd> carried;
  Rng& rng;
};

// The value of an option, and whether the caller set it to an integer. In Python, the product of such an option and a
// bool is an integer: an np.int64 if the bool is NumPy's (numpy_typed), an int if it is Python's (python_typed).
struct Real {
  double value;
  bool integer;
  operator double() const { return value; }
};
inline Typed numpy_typed(double product, Real factor) {
  return {product, factor.integer ? MJENV_TYPE_INT64 : MJENV_TYPE_FLOAT64};
}
inline Typed python_typed(double product, Real factor) {
  return {product, factor.integer ? MJENV_TYPE_NATIVE_INT : MJENV_TYPE_NATIVE_FLOAT};
}

// One term of the observation. write returns the term's length, and writes the term if its second argument is not null.
struct Term {
  const char* name;
  std::function<Eigen::Index(const Sim&, double*)> write;
};

// Gymnasium's default_camera_config. NaN means MuJoCo's default.
struct Camera {
  double trackbodyid = kUnset, distance = kUnset;
  std::array<double, 3> lookat{kUnset, kUnset, kUnset};
  double elevation = kUnset;

  static constexpr double kUnset = std::numeric_limits<double>::quiet_NaN();
};

// The fields of a registered task, which describes them. Those of built-in tasks are found by trial calls (Schema).
struct Described {
  std::vector<Field> observation, info, reset_info, reward, structure;
};

// A task, as its definition has built it.
struct Task {
  std::shared_ptr<const Model> model;
  const char* model_xml = nullptr;  // the text of its default model; null if that is a file
  int frame_skip = 1;
  std::int64_t time_limit = 0;
  double reward_threshold = std::numeric_limits<double>::quiet_NaN();
  Camera camera;
  mjenv_type reward_type = MJENV_TYPE_FLOAT64;
  std::optional<np::Norm> norm;  // the rounding of norms, if the task computes any

  std::vector<Term> terms;
  bool has_structure = false;
  int skipped_qpos = -1;  // see Robot::structure
  std::function<void(Start&, Rng&)> reset;
  std::function<void(const Sim&, Info&)> reset_info;
  Eigen::Index carry_count = 0;
  std::function<void(const Sim&, double*)> carry;
  std::function<Outcome(const Sim&, Row&, Info&)> step;

  // Only registered tasks set these.
  std::optional<Described> described;
  Needs needs;
  bool draws_in_steps = false;  // a step may draw from the row's stream
  bool caller_thread = false;   // its functions run only on the thread that calls the library
  std::int32_t revision = 0;    // part of an image's identity
};

constexpr std::int64_t kMaxFrameSkip = 1'000'000;

// Declares the option xml_file.
const Option& declare_model(Options& options, const char* xml_file);
// Declares max_episode_steps and norm, and if takes_xml also xml_string and trust_xml.
void declare_common(Options& options, bool takes_xml, std::int64_t time_limit);

class Robot {
 public:
  // Build::options only declares the options. Build::task also opens the model and looks up names in it.
  enum class Build { options, task };
  Robot(int version, Options& options, Build build) : v5(version != 4), options_(options), build_(build) {}

  const bool v5;  // also true for Model-v0

  // ---- The model ----
  // The model. In v5 the option xml_file replaces it.
  Robot& model(const char* name);
  // A model that the option xml_file replaces in v4 as well.
  Robot& xml_file(const char* name);
  // How many mj_steps make a step. In v5 this is an option.
  Robot& frame_skip(int count);
  Robot& time_limit(std::int64_t steps) { return task_.time_limit = steps, *this; }
  Robot& reward_threshold(double value) { return task_.reward_threshold = value, *this; }
  Robot& camera(Camera value) { return task_.camera = value, *this; }
  Robot& reward_type(mjenv_type type) { return task_.reward_type = type, *this; }
  // Refuses models with fewer positions or velocities, because the task's formulas index them.
  Robot& needs(int nq, int nv);
  // Refuses models with other sizes, because Gymnasium declares an observation of fixed size.
  Robot& needs_exactly(int nq, int nv);

  // ---- Options. Each call but norm() declares an option with its default and doc, and returns its value. ----
  Real real(const char* name, double value, const char* doc);
  std::array<double, 2> range(const char* name, std::array<double, 2> value, const char* doc);
  bool flag(const char* name, bool value, const char* doc);
  // The option reset_noise_scale.
  double noise(double value);
  // An option that names a body or gives its index. Returns the index.
  int body_option(const char* name, int value, const char* doc);
  // The Euclidean norm with the rounding that the option "norm" chooses.
  np::Norm norm();

  // ---- Objects of the model ----
  int body(const char* name) const;
  int site(int index) const;

  // ---- The task ----
  // Adds a term to the observation: term(sim) returns an Eigen vector expression.
  template <typename F>
  void observe(const char* name, const F& term) {
    task_.terms.push_back({name, [term](const Sim& s, double* to) {
                             const auto values = term(s);
                             if (to)
                               for (Eigen::Index i = 0; i < values.size(); ++i) to[i] = values.coeff(i);
                             return values.size();
                           }});
  }
  // Adds a term if it is wanted; otherwise observation_structure lists it with length 0.
  template <typename F>
  void observe_if(bool wanted, const char* name, const F& term) {
    if (wanted)
      observe(name, term);
    else
      observe_nothing(name);
  }
  void observe_nothing(const char* name);
  // Adds observation_structure in v5: how many positions the observation leaves out (-1: not listed), then the length
  // of each term.
  void structure(int skipped_qpos = -1);

  // Sets the function that draws the initial state of an episode. It draws in Gymnasium's order.
  void reset(std::function<void(Start&, Rng&)> draw) { task_.reset = std::move(draw); }
  void reset_info(std::function<void(const Sim&, Info&)> info) { task_.reset_info = std::move(info); }
  // Sets the function before(sim), which returns a vector of fixed length: what the next step needs to know of the
  // present state. It is called after each reset, step, set_state and simulate. The row stores the vector.
  template <typename F>
  void carry(const F& before) {
    using V = std::decay_t<decltype(before(std::declval<const Sim&>()).eval())>;
    static_assert(V::SizeAtCompileTime > 0, "a carried vector has a fixed length");
    task_.carry_count = V::SizeAtCompileTime;
    task_.carry = [before](const Sim& s, double* to) { Eigen::Map<V>{to} = before(s); };
  }
  // Sets the function outcome(sim, carried, info), which computes the reward, the info and whether the episode has
  // terminated, after the simulation has advanced by frame_skip mj_steps.
  template <typename F>
  void step(const F& outcome) {
    task_.step = [outcome](const Sim& s, Row& row, Info& info) -> Outcome {
      return outcome(s, Carried(row.carried.data(), row.carried.size()), info);
    };
  }

  // Declares the options that core::declare_common names. Called after the definition, so they follow the robot's own.
  void declare_common() { core::declare_common(options_, takes_xml_, task_.time_limit); }
  Task take() { return std::move(task_); }

 private:
  Options& options_;
  Build build_;
  bool takes_xml_ = false;
  Task task_;

  Robot& open(const std::string& xml_file);
  bool trusts_xml() const { return options_.get("trust_xml").integer != 0; }
};

}  // namespace mjenv::core
