// The work space in which one row at a time is simulated: an mjData, and the copying of rows into and out of it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "engine/model.hpp"
#include "task/sim.hpp"

namespace mjenv::core {

// What MuJoCo needs to go on: time, qpos, qvel, act, qacc_warmstart, ctrl, one after the other.
class StateLayout {
 public:
  explicit StateLayout(const Model& model)
      : nq(model.nq()), nv(model.nv()), na(model.na()), nu(model.nu()), size(1 + nq + nv + na + nv + nu) {}

  std::size_t nq, nv, na, nu, size;

  double* qpos(double* state) const { return state + 1; }
  double* qvel(double* state) const { return state + 1 + nq; }
  double* act(double* state) const { return state + 1 + nq + nv; }
  double* warmstart(double* state) const { return state + 1 + nq + nv + na; }
};

class Work {
 public:
  Work(std::shared_ptr<const Model> model, int frame_skip, const Needs& needs = {}, std::size_t carry_count = 0);

  const Sim& sim() const { return sim_; }
  const StateLayout& layout() const { return layout_; }
  mjData_* data() { return data_.get(); }
  // What the task carries from one state of the row to the next.
  double* carried() { return carried_.data(); }
  std::size_t carry_count() const { return carried_.size(); }
  void carry(std::size_t count) { carried_.assign(count, 0), expose(); }
  double* action_buffer() { return action_.data(); }
  double* info_buffer() { return info_.data(); }

  // From now on complete_needs computes this: "contacts", or an array that is computed on demand.
  void need(const std::string& what);
  // From now on the array of mjData or mjModel is the last one in mjenv_sim::arrays.
  const Array& share(const std::string& name);
  const Needs& needs() const { return needs_; }

  // The arrays of mjData, under MuJoCo's names.
  std::vector<Array> arrays() const;

  // As mj_resetData leaves it, derived arrays included.
  void clear();
  // The start of an episode: clear, without its cost.
  void begin();
  void load(const double* state);
  void save(double* state) const;

  // mj_forward, as Gymnasium's set_state does.
  void forward();
  // mj_step `frames` times under an action; before receives the state before the last of them.
  void step(const Action& action, std::int64_t frames, double* before);
  // The last of them, from that state.
  void repeat_step();
  // Completes what is computed only on demand: cacc, cfrc_int and cfrc_ext, as MuJoCo itself does, and the frames of
  // geoms, cameras and lights.
  void complete();
  void complete_forces();
  void complete_frames();
  // What the task needs of that, and the contacts.
  void complete_needs();
  static bool on_demand(const std::string& array);

  // MuJoCo found qpos, qvel or qacc bad during the last step or forward, and restarted the simulation.
  bool diverged() const;

 private:
  struct Delete {
    void operator()(mjData_* data) const;
  };
  std::shared_ptr<const Model> model_;
  StateLayout layout_;
  std::unique_ptr<mjData_, Delete> data_;
  bool forces_lag_ = false;    // cfrc_ext and its like are older than the last mj_step
  bool frames_lag_ = false;    // geom_xpos and its like are older than the last mj_step or mj_forward
  bool contacts_lag_ = false;  // contacts_ are older than those of mjData
  Needs needs_;
  std::vector<double> carried_, action_, info_;
  std::vector<mjenv_contact> contacts_;
  std::vector<Array> data_arrays_;  // once a task shares one
  std::vector<const void*> shared_;
  Sim sim_;

  void clear_warnings();
  void expose();
  void list_contacts();
};

}  // namespace mjenv::core
