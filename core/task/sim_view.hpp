// The mjenv_sim through which a task's callbacks see a work space, and the buffers that it points to.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "mjenv/task.h"

namespace mjenv::core {

// The bounds of the action space that a task has defined (mjenv_build_action).
struct ActionBounds {
  std::vector<double> low, high;
};

// What a task asked for in build, beyond what every step computes anyway.
struct Needs {
  bool contacts = false;
  unsigned parts = 0;               // those of Lag::on_demand (Work::complete)
  std::vector<std::string> arrays;  // the names of the arrays in mjenv_sim::arrays
  bool current = false;             // whether the task called mjenv_build_current (Work::keep_current)
  std::vector<std::string> own;     // the names of the rows' own arrays that the task writes (mjenv_build_own)
  ActionBounds action;              // empty: actions are ctrl
  bool random_state = false;        // rows have a stream of NumPy's RandomState
  std::size_t info = 0;             // the number of elements of info or reset info, whichever is longer
};

// Whether this is an array of mjData that tasks can write (mjenv_build_own).
inline bool is_applied_force(const std::string& array) { return array == "qfrc_applied" || array == "xfrc_applied"; }

class SimView {
 public:
  SimView(Work& work, int frame_skip, const Needs& needs = {}, std::size_t carry_count = 0);
  SimView(const SimView&) = delete;
  SimView& operator=(const SimView&) = delete;

  const mjenv_sim& sim() const { return sim_; }
  // The numbers that the row carries for the task from one step to the next.
  double* carried() { return carried_.data(); }
  std::size_t carry_count() const { return carried_.size(); }
  void carry(std::size_t count) { carried_.assign(count, 0), expose(); }
  // Where callbacks write an info.
  double* info() { return info_.data(); }
  // Where a task's step changes the velocities.
  std::vector<double>& velocities() { return velocities_; }
  // Whether the last step has changed them.
  bool is_kicked() const {
    return std::memcmp(velocities_.data(), sim_.qvel, velocities_.size() * sizeof(double)) != 0;
  }
  // Sets the action that callbacks see. Otherwise they see NaN.
  void show(const Action& action);
  void hide_action();
  // Sets the live parameters that callbacks see. This keeps the pointer, so the numbers must not move.
  void show_parameters(const double* numbers) { sim_.parameters = numbers; }

  // Adds to what `complete` computes: "contacts", or an array that is computed on demand.
  void need(const std::string& what);
  // Appends an array of mjData or mjModel to mjenv_sim::arrays.
  const Array& share(const std::string& name);
  const Needs& needs() const { return needs_; }
  void need_current() { needs_.current = true; }
  int need_own(const std::string& array);
  void need_action(ActionBounds bounds);
  void need_random_state() { needs_.random_state = true; }

  // Makes callbacks see the row's own arrays. Call this after Work::use, with the same arguments.
  void use(const OwnArrays& arrays, const std::byte* block);
  // Computes what the task needs but steps do not compute.
  void complete() {
    work_.complete(needs_.parts);
    if (needs_.contacts && listed_ != work_.computation()) list_contacts();
  }

 private:
  Work& work_;
  const int frame_skip_;
  Needs needs_;
  std::vector<double> carried_, action_, info_, velocities_;
  std::vector<mjenv_contact> contacts_;
  std::uint64_t listed_ = 0;        // the Work::computation for which contacts_ was filled
  std::vector<Array> data_arrays_;  // filled when a task first shares an array
  std::vector<const void*> shared_, shared_originals_;
  // Its pointers lead into mjModel, mjData, the vectors above and the row's own values, which move when rows get a
  // further own array (Rows::add_arrays).
  mjenv_sim sim_{};

  void expose();
  void list_contacts();
};

}  // namespace mjenv::core
