// A compiled model. Only this folder handles what differs between MuJoCo's versions (mujoco.hpp names one exception).
// Besides it, only task/sim_view.cpp and render/ use MuJoCo's structs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/errors.hpp"
#include "engine/pairs.hpp"
#include "mjenv/mjenv.h"

// NOLINTBEGIN(bugprone-reserved-identifier): MuJoCo's names
struct mjModel_;
struct mjData_;
// NOLINTEND(bugprone-reserved-identifier)

namespace mjenv::core {

// An array of mjModel or mjData, with MuJoCo's name.
struct Array {
  std::string name;
  mjenv_dtype type;
  std::vector<std::int64_t> shape;
  const void* data;
  // In an array of structs: the bytes from one struct to the next. 0: the array is contiguous.
  std::size_t stride = 0;
  // Returns how many elements, or structs, are in use; empty: all are. `read` gives 0 for the others, because MuJoCo
  // leaves old values there.
  std::function<std::int64_t()> held = {};
  // Computes the elements of struct i, if MuJoCo stores them nowhere; otherwise empty.
  std::function<void(std::int64_t i, double* values)> compute = {};

  std::size_t count() const;
  std::size_t bytes() const;  // of all elements in their own type
  void read(double* values) const;
  void copy(std::byte* to) const;  // in their own type
  // Does the same where the elements behind the first `before` bytes are 0. Returns how many bytes are now in use.
  std::size_t copy(std::byte* to, std::size_t before) const;
};

// Calls body with a 0 of the C++ type that the dtype stands for.
template <typename Body>
auto with_type(mjenv_dtype type, const Body& body) {
  switch (type) {
    case MJENV_DTYPE_FLOAT32: return body(float{});
    case MJENV_DTYPE_INT32: return body(int{});
    case MJENV_DTYPE_INT64: return body(std::int64_t{});
    case MJENV_DTYPE_UINT8: return body(std::uint8_t{});
    default: return body(double{});
  }
}

struct DeleteData {
  void operator()(mjData_* data) const;
};

// The array with this name; null if there is none.
const Array* find(const std::vector<Array>& arrays, const std::string& name);

class Model {
 public:
  // Loads a built-in model ("ant.xml") or a file. As in Gymnasium, a text that starts with ".", "/" or "~" is a path.
  // An untrusted model can only read files in its folder, and its size is limited (engine/untrusted/limits.hpp).
  static std::shared_ptr<const Model> open(const std::string& xml_file, bool trusted = false);
  // Loads MJCF text. If a model with the same text, label and `trusted` is already in use, open and parse return that
  // one, unless the text refers to files.
  static std::shared_ptr<const Model> parse(const std::string& label, const std::string& xml, bool trusted = false);
  ~Model();

  const mjModel_* get() const { return model_.get(); }
  // A view of this model with which mj_step is faster, and gives the same bits.
  const mjModel_* stepped() const { return stepped_.get(); }
  // The same view, but without sensors if the model allows it. All mj_steps of a step but the last one use it, because
  // nobody reads what the sensors measure in them.
  const mjModel_* sensorless() const { return (sensorless_ ? sensorless_ : stepped_).get(); }
  // The list of geom pairs in that view; null if MuJoCo has to search for pairs.
  const Pairs* pairs() const { return pairs_ ? &*pairs_ : nullptr; }
  bool trusted() const { return origin_ != Origin::untrusted; }
  const std::string& label() const { return label_; }
  const std::vector<Array>& arrays() const { return arrays_; }

  int nq() const { return nq_; }
  int nv() const { return nv_; }
  int na() const { return na_; }
  int nu() const { return nu_; }
  int nbody() const { return nbody_; }
  // How many numbers a row's state has besides time, qpos, qvel, act, qacc_warmstart and ctrl.
  int more_state() const;
  // Whether MuJoCo can compute with these more_state() numbers.
  bool is_valid_more(const double* state) const;
  // How much memory an mjData of the model takes.
  std::size_t work_bytes() const;
  // The bounds of the actuators, rounded to float32 as in Gymnasium's action space.
  std::vector<double> action_low() const { return action_bound(0); }
  std::vector<double> action_high() const { return action_bound(1); }
  // False if the model says nothing of an actuator's ctrlrange; its bounds are then 0 and 0.
  bool has_control_range(int i) const;

  // The index of the object of this type ("body", "joint", ...) and name. If there is none, the error lists the names.
  int index(const std::string& type, const std::string& name) const;
  // The name of an object, "" if it has none.
  const char* name(const std::string& type, std::int64_t index) const;
  int count(const std::string& type) const;
  // The name of actuator i. If it has none, the name of the joint that it drives.
  std::string actuator_label(int i) const;

  // Where the free joint of a body begins in qvel; -1 if the body has none.
  int free_dof(int body) const;

  // A hash of the whole compiled model.
  std::uint64_t fingerprint() const;

 private:
  enum class Origin { built_in, trusted, untrusted };
  struct Source {
    std::string label, path, text;
    Origin origin;
  };
  struct Delete {
    void operator()(mjModel_* model) const;
  };
  using Compiled = std::unique_ptr<mjModel_, Delete>;
  std::string label_;
  Compiled model_;
  Origin origin_;
  std::optional<Pairs> pairs_;
  std::vector<unsigned char> sameframe_;
  std::unique_ptr<const mjModel_> stepped_, sensorless_;  // they share model_'s arrays
  std::vector<Array> arrays_;
  int nq_ = 0, nv_ = 0, na_ = 0, nu_ = 0, nbody_ = 0;

  static std::shared_ptr<const Model> open(const Source& source);
  Model(std::string label, Compiled model, Origin origin);
  std::vector<double> action_bound(int side) const;
};

// For example "2.2.2".
const char* mujoco_version();
// Whether sin, cos and so on are this library's own (MJENV_MATH=portable), not the C library's.
bool math_is_portable();
// For example "0.1.0 (MuJoCo 2.2.2)". The version of MuJoCo is that of the opened library, or, before it is opened, the
// one that this library was compiled for.
const char* library_version();

}  // namespace mjenv::core
