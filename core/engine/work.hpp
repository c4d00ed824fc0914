// The work space in which one row at a time is simulated: an mjData, into and out of which the states of rows are
// copied.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/action.hpp"
#include "engine/model.hpp"
#include "engine/model_view.hpp"
#include "mjenv/task.h"

namespace mjenv::core {

// The state from which MuJoCo continues a simulation exactly: time, qpos, qvel, act, qacc_warmstart, ctrl, and what
// else the version of MuJoCo has (Model::more_state), in this order.
class StateLayout {
 public:
  explicit StateLayout(const Model& model)
      : nq(model.nq()),
        nv(model.nv()),
        na(model.na()),
        nu(model.nu()),
        more(model.more_state()),
        size(1 + nq + nv + na + nv + nu + more) {}

  std::size_t nq, nv, na, nu, more, size;

  // Where the array with MuJoCo's name lies in a state; nothing if no part of the state has this name.
  struct Part {
    std::size_t offset, count;
  };
  std::optional<Part> part(const std::string& array) const;

  double* qpos(double* state) const { return state + 1; }
  double* qvel(double* state) const { return state + 1 + nq; }
  double* act(double* state) const { return state + 1 + nq + nv; }
  double* warmstart(double* state) const { return state + 1 + nq + nv + na; }
  double* rest(double* state) const { return state + size - more; }
};

// What a task needs of a work space besides what MuJoCo computes in every step.
struct Needs {
  const mjenv_task_api* api = nullptr;                    // the library's functions for callbacks
  bool contacts = false, forces = false, frames = false;  // see Work::complete_forces and Work::complete_frames
  std::vector<std::string> arrays;                        // the names of the arrays in mjenv_sim::arrays
  std::size_t info = 0;                                   // how many numbers the longer of info and reset info has
};

class Work {
 public:
  Work(std::shared_ptr<const Model> model, int frame_skip, const Needs& needs = {}, std::size_t carry_count = 0);

  // What callbacks see of the simulation.
  const mjenv_sim& sim() const { return sim_; }
  const StateLayout& layout() const { return layout_; }
  mjData_* data() { return data_.get(); }
  // Numbers that the task keeps from one step of the row to the next.
  double* carried() { return carried_.data(); }
  std::size_t carry_count() const { return carried_.size(); }
  void carry(std::size_t count) { carried_.assign(count, 0), expose(); }
  // Where callbacks see the action, and where they write an info.
  double* action_buffer() { return action_.data(); }
  double* info_buffer() { return info_.data(); }

  // A force and torque on a body, as xfrc_applied has them.
  struct Force {
    std::int32_t body;
    std::size_t offset;  // of the body's part of xfrc_applied in a row's block of own values
    std::array<double, 6> values;
  };
  void apply(const Force& force);

  // Adds to what complete_needs computes: "contacts", or an array that is computed on demand.
  void need(const std::string& what);
  // Says that this array of mjData is read after each step.
  void expect(const std::string& array);
  // Whether arrays are read after each step that after_every_step does not name.
  bool reads_all() const { return reads_all_ || needs_.contacts || needs_.forces; }
  // Whether the last step has left all of mjData as MuJoCo does. If not, only what after_every_step names may be read.
  bool is_whole() const { return is_whole_; }
  // Appends an array of mjData or mjModel to mjenv_sim::arrays.
  const Array& share(const std::string& name);
  const Needs& needs() const { return needs_; }

  // The arrays of mjData, with MuJoCo's names.
  std::vector<Array> arrays() const;

  // What MuJoCo computes with: the model, in which arrays are a row's own after `use`.
  const mjModel_& model() const { return view_ ? view_->whole() : *model_->get(); }
  // The view of it that mj_step computes with.
  const mjModel_& stepped() const { return view_ ? view_->stepped() : *model_->stepped(); }
  // Computes with a row's own arrays, and copies its inputs into mjData. The block must outlive its use.
  void use(const OwnArrays& arrays, std::byte* block);

  // Calls mj_resetData, which also clears the derived arrays.
  void clear();
  // Starts an episode. Resets less than clear, which is faster and has the same effect on what follows.
  void begin();
  void load(const double* state);
  // Loads only what lies in StateLayout::rest.
  void load_rest(const double* rest);
  void save(double* state) const;

  // Calls mj_forward, as Gymnasium's set_state does.
  void forward();
  // A step is `frames` calls of mj_step with an action: act, then step, which writes the state before the last call to
  // `before`. Where lanes::Stepper advances mjData instead, it calls note_step.
  void act(const Action& action);
  void step(std::int64_t frames, double* before);
  void note_step(bool is_whole = true) {
    forces_lag_ = frames_lag_ = contacts_lag_ = true;
    is_whole_ = is_whole;
  }
  // Repeats the last call of mj_step, after that state was loaded.
  void repeat_step();
  // Computes what is only computed on demand: the forces cacc, cfrc_int and cfrc_ext, with MuJoCo's own function, and
  // the frames of geoms, cameras and lights.
  void complete();
  void complete_forces();
  void complete_frames();
  // Computes those of them that the task needs, and the contacts if it needs them.
  void complete_needs() {
    if (needs_.forces) complete_forces();
    if (needs_.frames) complete_frames();
    if (needs_.contacts && contacts_lag_) list_contacts();
  }
  static bool on_demand(const std::string& array);
  // Whether the array of mjData can be read after every step: those of mjenv_sim, the state, and the frames that
  // complete_frames computes.
  static bool after_every_step(const std::string& array);

  int constraint_count() const;
  // Whether MuJoCo found bad numbers in qpos, qvel or qacc during the last step or forward.
  bool diverged() const;
  // Whether it then reset the simulation, as it does unless the model disables that.
  bool was_reset() const;
  // Whether it did so before the last mj_step of a step.
  bool diverged_early() const { return diverged_early_; }

 private:
  struct Delete {
    void operator()(mjData_* data) const;
  };
  std::shared_ptr<const Model> model_;
  std::optional<ModelView> view_;  // only if rows have arrays of their own
  int frame_skip_;
  StateLayout layout_;
  std::unique_ptr<mjData_, Delete> data_;
  bool forces_lag_ = false;    // cacc, cfrc_int and cfrc_ext are older than the last mj_step
  bool frames_lag_ = false;    // the frames are older than the last mj_step or mj_forward
  bool contacts_lag_ = false;  // contacts_ is older than the contacts of mjData
  bool diverged_early_ = false;
  bool is_whole_ = true, reads_all_ = false;
  Needs needs_;
  std::vector<double> carried_, action_, info_;
  std::vector<mjenv_contact> contacts_;
  std::vector<Array> data_arrays_;  // filled when a task first shares an array
  std::vector<const void*> shared_, shared_originals_;
  // Points into mjModel and mjData. `use` points it to a row's own arrays, which move when an array is added.
  mjenv_sim sim_{};

  void clear_warnings();
  void expose();
  void list_contacts();
};

}  // namespace mjenv::core
