// A work space: an mjData that simulates one row at a time. The row's state is copied into it and back.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/action.hpp"
#include "engine/data_arrays.hpp"
#include "engine/model.hpp"
#include "engine/model_view.hpp"
#include "engine/state_layout.hpp"

namespace mjenv::core {

// Owns the mjData. Its derived arrays belong to the last step, repeat_step, forward, clear or simulate, except those of
// the parts that `lag` names.
class Work {
 public:
  explicit Work(std::shared_ptr<const Model> model);

  const StateLayout& layout() const { return layout_; }
  mjData_* data() { return data_.get(); }
  // The arrays of mjData, with MuJoCo's names.
  std::vector<Array> arrays() const;

  // A force and torque on a body, as xfrc_applied has them.
  struct Force {
    std::int32_t body;
    std::size_t offset;  // of the body's xfrc_applied in a row's block of own values
    std::array<double, 6> values;
  };
  // A change of the six numbers in qvel of a free joint.
  struct Kick {
    std::int32_t dof;
    std::array<double, 6> values;
  };
  // What pushes do in a step.
  struct Pushes {
    std::vector<Force> forces;  // they replace those in xfrc_applied
    std::vector<Kick> kicks;

    void clear() { forces.clear(), kicks.clear(); }
  };
  // Call this after the row's state has been loaded.
  void apply(const Pushes& pushes);
  // qfrc_applied or xfrc_applied of mjData.
  double* force(const std::string& array);
  // Whether a number in qfrc_applied or xfrc_applied is not 0.
  bool has_forces() const;

  // Announces that these parts of mjData (Lag) will be read after each step.
  void expect(unsigned parts) { expected_ |= parts; }
  unsigned expected() const { return expected_; }
  // The parts that lag behind. A step leaves Lag::frames, and in lanes, unless expected, Lag::forces and Lag::others.
  unsigned lag() const { return lag_; }
  // Computes those of these parts that lag and follow from the rest of mjData: Lag::frames, and usually Lag::forces.
  void complete(unsigned parts = Lag::on_demand) {
    if (parts & lag_) compute(parts & lag_);
  }
  // Completes what is expected, because what mjData follows from will be overwritten. The other parts that lag are lost.
  void lose() {
    complete(expected_ & Lag::on_demand);
    lost_ = lag_;
  }
  // Whether some of these parts lag and `complete` cannot mend it. After keep_current(), only repeat_step and steps that
  // expect forces compute them, because the mj_step1 for the new state overwrites what they follow from.
  bool has_lost(unsigned parts) const {
    const unsigned lost = lost_ | (keeps_current_ || (lag_ & Lag::others) ? Lag::forces : 0U);
    return (lag_ & lost & parts) != 0;
  }

  const Model& compiled() const { return *model_; }
  // The model that MuJoCo computes with. After `use`, some of its arrays are a row's own.
  const mjModel_& model() const { return view_ ? view_->whole() : *model_->get(); }
  // The view of this model that mj_step computes with.
  const mjModel_& stepped() { return view_ ? view_->stepped() : *model_->stepped(); }
  // The view for all mj_steps of a step but the last one (Model::sensorless).
  const mjModel_& sensorless() { return view_ ? view_->sensorless() : *model_->sensorless(); }
  // The view of `stepped`, for code that does not read the parameters of its list of pairs (ModelView::unmixed).
  const mjModel_& unmixed() const { return view_ ? view_->unmixed() : *model_->stepped(); }
  // Whether the row's arrays may change which pairs of geoms touch (ModelView::searches).
  bool searches() const { return view_ && view_->searches(); }
  // Makes MuJoCo compute with a row's own arrays, and copies the row's inputs into mjData. The block must live until
  // the next call.
  void use(const OwnArrays& arrays, const std::byte* block);
  // Does the same without the inputs: those in mjData stay.
  void use_model(const OwnArrays& arrays, const std::byte* block);

  // Calls mj_resetData, which also clears the derived arrays.
  void clear();
  // Starts an episode, at the qpos0 of the compiled model, as Gymnasium's init_qpos. Resets less than `clear` does, so it
  // is faster; the results of what follows are the same.
  void begin();
  // continues: after keep_current(), whether mjData holds what the last step has computed for this state. If so, the
  // next step need not compute it again.
  void load(const double* state, bool continues = false);
  // Loads a state that was written after mjData was computed. If qpos was not, readers still see it normalised
  // (raw_qpos).
  void load_written(const double* state);
  // Loads only what lies in StateLayout::rest.
  void load_rest(const double* rest);
  void save(double* state) const;

  // Calls mj_forward, as Gymnasium's set_state does. After keep_current(), it computes without actuation, as
  // dm_control's resets do.
  void forward();
  // Calls mj_forward before the first mj_step of a step. If lanes will step the row (defer_forward), they call it
  // instead: a task sees nothing of it, and a step reads only the qacc_warmstart that it leaves.
  void forward_first();
  void defer_forward(bool may) { may_defer_ = may && layout_.nq == layout_.nv; }  // no quaternions to normalise
  bool is_deferred() const { return is_deferred_; }
  // Whether the velocities have changed since the deferred mj_forward.
  bool is_outdated() const;
  // Exchanges ctrl for that of the deferred mj_forward, and back.
  void swap_ctrl();

  // From now on, each step also computes the stages of mj_step1 for its new state (mjenv_build_current).
  void keep_current();
  bool keeps_current() const { return keeps_current_; }
  // The qpos with which the last mj_step1 or mj_forward began. MuJoCo 2.2.2 normalises the quaternions in qpos. A step
  // that began with the normalised ones would normalise them again, which can change their last bits.
  const std::vector<double>& raw_qpos() const { return raw_qpos_; }
  // For resets: simulates `count` timesteps. The first one continues from what was computed last.
  void simulate(std::int64_t count);
  // The state in mjData.
  struct State {
    double *time, *qpos, *qvel, *act, *ctrl;
  };
  State state();
  std::int64_t contact_count() const;

  // Called before each mj_step of a step, with its number. May write ctrl and forces.
  using BeforeSubstep = std::function<void(std::int64_t)>;
  // For a step, call act, then step, which calls mj_step `frames` times. `before` receives the state before the last of
  // these calls. before_substep may be null.
  void act(const Action& action);
  void step(std::int64_t frames, double* before, const BeforeSubstep* before_substep = nullptr);
  // lanes::Stepper advances mjData instead of `step`, and calls this at the end. lag: the parts that it left behind.
  // shows_current: it has called keep_raw_qpos and then computed the stages of mj_step1.
  void note_step(unsigned lag = Lag::on_demand, bool shows_current = false) {
    lag_ = lag;
    lost_ = 0;
    new_state_warnings_ = only_new_state_warnings_ = 0;
    if (keeps_current_ && !shows_current) {
      if ((expected_ & lag_ & Lag::forces) && !(lag_ & Lag::others)) compute_forces();
      compute_current();
    }
    ++computation_;
  }
  void keep_raw_qpos();
  // Repeats the last call of mj_step. First load the state that preceded that call.
  void repeat_step();
  // A number that changes whenever mjData's contacts may have changed.
  std::uint64_t computation() const { return computation_; }
  int constraint_count() const;
  // Whether MuJoCo found bad numbers in qpos, qvel or qacc during the last step or forward.
  bool diverged() const;
  // Whether MuJoCo reset the simulation because of that. It does unless the model disables it.
  bool was_reset() const;
  // The kinds of warnings (mjtWarning) that MuJoCo has given since the last call of load, begin, clear or act, as bits.
  std::uint8_t warnings() const;
  void set_warnings(std::uint8_t kinds);
  // The warnings of the step alone. After keep_current(), warnings() also has those of the mj_step1 for the new state.
  // Rows do not store the latter: lanes do not compute them, and they follow from the new state.
  std::uint8_t step_warnings() const { return static_cast<std::uint8_t>(warnings() & ~only_new_state_warnings_); }
  std::uint8_t new_state_warnings() const { return new_state_warnings_; }
  static bool are_warnings(std::uint8_t kinds);  // whether MuJoCo has all these kinds
  // Call this after the first mj_step of a step. After keep_current(), the last step or reset has already warned of
  // what mj_step1 finds in the state. This drops the second warning, because dm_control's simulations, which call
  // mj_step2 and then mj_step1, warn of it once.
  void drop_repeated_warnings();
  // Whether MuJoCo found bad numbers in an mj_step before the last one of the step.
  bool diverged_early() const { return diverged_early_; }

 private:
  std::shared_ptr<const Model> model_;
  std::optional<ModelView> view_;  // only if rows have arrays of their own
  StateLayout layout_;
  std::unique_ptr<mjData_, DeleteData> data_;
  unsigned lag_ = 0, expected_ = 0;
  unsigned lost_ = 0;  // parts that `lose` has left behind; those of lag_ still are
  bool diverged_early_ = false;
  bool has_inputs_ = false;  // rows have inputs of mjData of their own
  bool keeps_current_ = false;
  bool continues_ = false;                        // the next step begins with mj_step2
  bool may_defer_ = false, is_deferred_ = false;  // mj_forward before the first mj_step
  std::vector<double> deferred_ctrl_, deferred_qvel_;
  std::uint8_t new_state_warnings_ = 0;             // those of the mj_step1 for the new state
  std::uint8_t only_new_state_warnings_ = 0;        // of these, those that the step before has not given
  std::vector<double> raw_qpos_, normalized_qpos_;  // before and after the last mj_step1
  std::uint64_t computation_ = 0;

  void clear_warnings();
  void compute(unsigned parts);
  void compute_current();
  void compute_forces();
  bool can_continue();
};

}  // namespace mjenv::core
