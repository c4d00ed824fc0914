// What a task's callbacks see of a work space: mjenv_sim, and the buffers that belong to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/work.hpp"
#include "mjenv/task.h"

namespace mjenv::core {

// The bounds of an action space of a task's own.
struct ActionBounds {
  std::vector<double> low, high;
};

// What a task needs besides what MuJoCo computes in every step.
struct Needs {
  bool contacts = false, forces = false, frames = false;
  std::vector<std::string> arrays;  // the names of the arrays in mjenv_sim::arrays
  bool current = false;             // Work::keep_current
  std::vector<std::string> own;     // the arrays that the task writes
  ActionBounds action;              // empty: actions are ctrl
  bool random_state = false;        // rows have a stream of NumPy's RandomState
  std::size_t info = 0;             // how many numbers the longer of info and reset info has
};

class SimView {
 public:
  SimView(Work& work, int frame_skip, const Needs& needs = {}, std::size_t carry_count = 0);
  SimView(const SimView&) = delete;
  SimView& operator=(const SimView&) = delete;

  const mjenv_sim& sim() const { return sim_; }
  // Numbers that the task keeps from one step of the row to the next.
  double* carried() { return carried_.data(); }
  std::size_t carry_count() const { return carried_.size(); }
  void carry(std::size_t count) { carried_.assign(count, 0), expose(); }
  // Where callbacks write an info.
  double* info() { return info_.data(); }
  // The action that callbacks see: NaN unless it is shown.
  void show(const Action& action);
  void hide_action();
  // Shows a row's live parameters. The numbers must stay where they are.
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

  // Call this after Work::use, with the same arguments: shows the row's own arrays.
  void use(const OwnArrays& arrays, const std::byte* block);
  // Computes what the task needs but steps do not compute.
  void complete() {
    if (needs_.forces) work_.complete_forces();
    if (needs_.frames) work_.complete_frames();
    if (needs_.contacts && listed_ != work_.computation()) list_contacts();
  }

 private:
  Work& work_;
  const int frame_skip_;
  Needs needs_;
  std::vector<double> carried_, action_, info_;
  std::vector<mjenv_contact> contacts_;
  std::uint64_t listed_ = 0;        // Work::computation of contacts_
  std::vector<Array> data_arrays_;  // filled when a task first shares an array
  std::vector<const void*> shared_, shared_originals_;
  // Points into mjModel and mjData, and to a row's own arrays, which move when an array is added.
  mjenv_sim sim_{};

  void expose();
  void list_contacts();
};

}  // namespace mjenv::core
