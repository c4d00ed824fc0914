// A task in one environment: its fields, and its callbacks (mjenv/task.h) for one row at a time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/model.hpp"
#include "mjenv/task.h"
#include "numpy/math.hpp"
#include "task/field.hpp"
#include "task/parameters.hpp"
#include "task/random.hpp"
#include "task/sim_view.hpp"

namespace mjenv::core {

// The fields of each role.
using Fields = std::array<std::vector<Field>, MJENV_ROLE_GROUPS + 1>;

// The sum of the counts of a role's fields.
std::int64_t total(const std::vector<Field>& fields);

// The arrays that a task's reset writes.
struct Start {
  double *qpos, *qvel, *act, *carried, *const *own;
};

// The simulation in which the reset of a task with Needs::current runs.
struct ResetSimulation {
  Work& work;
  SimView& view;
  double* time;
  // Gives the simulation what the reset has written to own arrays. Throws if MuJoCo could not compute with it.
  const std::function<void()>& take_own;
};

// The members of mjenv_control that the caller of before_step and before_substep provides.
struct Control {
  std::int64_t substep;
  double *ctrl, *const *own;
  Work* work = nullptr;  // in which before_step can change the velocities and call mj_forward; null: it cannot
};

// The mjenv_control that the library passes.
struct WorkingControl : mjenv_control {
  Work* work = nullptr;
};

// The mjenv_start that the library passes to a reset.
struct SimulatingStart : mjenv_start {
  ResetSimulation* simulation = nullptr;
};

// Numbers that a row carries, which always lie in [low, high].
struct CarryBounds {
  std::int64_t first, count;
  double low, high;
};

// Carried numbers that a reset does not clear (mjenv_build_keep).
struct KeptNumbers {
  std::int64_t first, count;
};

class Builder;

// Calls a task's callbacks. Their `self` is what build made, which the destructor destroys, or `user` if there is no
// build. A physics_only task has no callbacks except build, destroy and reset: its observations and rewards are 0, and
// its infos NaN. If it has no reset, episodes begin in the model's initial state.
class Calls {
 public:
  // Calls build. checks: whether to refuse NaN in observations and rewards, and NaN and infinity in initial states and
  // in ctrl.
  Calls(std::string id, const mjenv_task& callbacks, bool checks, Builder& builder);
  ~Calls();
  Calls(const Calls&) = delete;
  Calls& operator=(const Calls&) = delete;

  // Call this once after build, with the fields that build has completed and the bounds of the carried numbers.
  void set_counts(const Fields& fields, std::int64_t carry_count, std::vector<CarryBounds> bounds);

  // Says which of these carried numbers is out of its bounds; "" if none is. The pointer may be misaligned.
  std::string out_of_bounds(const void* numbers) const;

  // As build has left them.
  const mjenv_task& callbacks() const { return callbacks_; }
  bool has_carry() const { return callbacks_.carry != nullptr; }
  bool has_reset_info() const { return callbacks_.reset_info || reset_info_count_ > 0; }

  // Draws the initial state of an episode. simulation: null, unless the task's reset can simulate (Needs::current). If
  // it is null, only the sizes and the model's arrays of `sim` are valid.
  void reset(const mjenv_sim& sim, const Start& start, Random& random, ResetSimulation* simulation = nullptr) const;
  // Returns the numbers of the reset info, which are stored in the view.
  const double* reset_info(SimView& view) const;
  // Writes what the next step needs to know of the present state to SimView::carried.
  void carry(SimView& view) const;
  void observe(SimView& view, double* to) const;
  bool has_before_step() const { return callbacks_.before_step != nullptr; }
  bool has_before_substep() const { return callbacks_.before_substep != nullptr; }
  bool has_control() const { return has_before_step() || has_before_substep(); }
  // Turns the action into ctrl.
  void before_step(SimView& view, const Action& action, const Control& control, Random& random) const;
  // Changes ctrl and forces before an mj_step.
  void before_substep(SimView& view, const Action& action, const Control& control, Random& random) const;
  // Calls step after the simulation has advanced with this action.
  mjenv_outcome step(SimView& view, const Action& action, Random& random, double* const* own) const;
  // The reward of one pair of goals of `size` numbers.
  double compute_reward(const double* achieved, const double* desired, std::int64_t size) const;

 private:
  std::string id_;
  mjenv_task callbacks_;
  bool checks_, built_ = false;
  void* self_;
  std::int64_t observation_count_ = 0, info_count_ = 0, reset_info_count_ = 0;
  std::int32_t carry_count_ = 0;
  std::vector<CarryBounds> bounds_;  // of what rows carry

  void destroy(void* self) const;
  void check_carried(const char* callback, const double* numbers) const;
  [[noreturn]] void refuse(const char* callback, const std::string& why) const;
  [[noreturn]] void fail_with(const char* callback, std::int32_t result) const;
  using ControlCallback = std::int32_t(const void*, const mjenv_sim*, mjenv_control*);
  void call_control(const char* name, ControlCallback* callback, SimView& view, const Action& action,
                    const Control& control, Random& random) const;
  template <typename Body>
  void call(const char* name, const Body& body, const Random* random = nullptr) const;
};

struct Task {
  std::shared_ptr<const Model> model;
  int frame_skip = 1;
  mjenv_task_camera camera{};
  std::int32_t revision = 0;     // part of an image's identity
  bool caller_thread = false;    // the callbacks run only on the thread that calls the library
  bool physics_only = false;     // the caller computes observations, rewards and infos (Env::begin)
  std::optional<np::Norm> norm;  // the rounding of norms, if the task computes any
  Fields fields;
  Needs needs;
  ActionBounds action;  // the action space
  std::int64_t carry_count = 0;
  std::vector<KeptNumbers> kept;
  std::int64_t goal_count = 0;  // how many numbers a goal has, if the task has compute_reward
  Parameters parameters;
  std::shared_ptr<const Calls> calls;

  // How many numbers an action has, and the name of one of them.
  std::int64_t action_count() const { return static_cast<std::int64_t>(action.low.size()); }
  bool has_own_actions() const { return !needs.action.low.empty(); }
  std::string action_label(std::int64_t i) const {
    return has_own_actions() ? "action[" + std::to_string(i) + "]" : model->actuator_label(static_cast<int>(i));
  }
};

}  // namespace mjenv::core
