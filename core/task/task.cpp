#include "task/task.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

#include "error.hpp"
#include "system/floats.hpp"
#include "task/api.hpp"
#include "task/builder.hpp"

namespace mjenv::core {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Makes the action visible to a callback while this object lives.
struct ShownAction {
  SimView& view;
  ShownAction(SimView& to, const Action& action) : view(to) { view.show(action); }
  ~ShownAction() { view.hide_action(); }
  ShownAction(const ShownAction&) = delete;
  ShownAction& operator=(const ShownAction&) = delete;
};

// The buffer for an info. Numbers that the callback does not write stay NaN.
double* nan_info(SimView& view, std::int64_t count) {
  double* values = view.info();
  std::fill_n(values, count, kNaN);
  return values;
}

}  // namespace

std::int64_t total(const std::vector<Field>& fields) {
  return fields.empty() ? 0 : fields.back().offset + fields.back().count;
}

Calls::Calls(std::string id, const mjenv_task& callbacks, bool checks, Builder& builder)
    : id_(std::move(id)), callbacks_(callbacks), checks_(checks), self_(callbacks.user) {
  if (!callbacks_.build) return;
  builder.task = &callbacks_;
  void* self = nullptr;
  bool is_unfit = false;
  try {
    call("build", [&] {
      const std::int32_t result = callbacks_.build(&builder, callbacks_.user, &self);
      built_ = result == 0;  // if build failed, it has freed what it allocated
      builder.check();
      is_unfit = result == MJENV_E_MODEL;
      return is_unfit ? 0 : result;
    });
    if (is_unfit) fail(MJENV_E_MODEL, id_ + " cannot use model " + quoted(builder.label()) + ": " + task_message());
  } catch (...) {
    destroy(self);
    throw;
  }
  self_ = self;
}

Calls::~Calls() { destroy(self_); }

void Calls::destroy(void* self) const {
  if (!built_ || !callbacks_.destroy) return;
  const KeptFloats floats;
  callbacks_.destroy(self);
}

void Calls::set_counts(const Fields& fields, std::int64_t carry_count, std::vector<CarryBounds> bounds) {
  observation_count_ = total(fields[MJENV_ROLE_OBSERVATION]);
  info_count_ = total(fields[MJENV_ROLE_INFO]);
  reset_info_count_ = total(fields[MJENV_ROLE_RESET_INFO]);
  carry_count_ = static_cast<std::int32_t>(carry_count);
  bounds_ = std::move(bounds);
}

std::string Calls::out_of_bounds(const void* numbers) const {
  for (const CarryBounds& bounds : bounds_)
    for (std::int64_t i = bounds.first; i < bounds.first + bounds.count; ++i) {
      double value = 0;
      std::memcpy(&value, static_cast<const std::byte*>(numbers) + i * sizeof value, sizeof value);
      const bool is_within = bounds.low <= value && value <= bounds.high;  // false if it is NaN
      if (!is_within)
        return element_is("carried", static_cast<std::size_t>(i), value) + ", not " + number(bounds.low) + " to " +
               number(bounds.high);
    }
  return {};
}

// Fails if the callback wrote a number outside of its bounds, because an image with that number could not be restored.
void Calls::check_carried(const char* callback, const double* numbers) const {
  if (bounds_.empty()) return;  // as most tasks; the text below takes time even if it is empty
  if (const std::string found = out_of_bounds(numbers); !found.empty()) refuse(callback, found);
}

void Calls::reset(const mjenv_sim& sim, const Start& start, Random& random, ResetSimulation* simulation) const {
  if (!callbacks_.reset) return;
  SimulatingStart to{{sizeof(mjenv_start), 0, &task_api(), &random, sim.qpos0, start.qpos, start.qvel, start.act,
                      start.carried, sim.arrays, sim.nq, sim.nv, sim.na, carry_count_, sim.parameters,
                      simulation ? &sim : nullptr, simulation ? simulation->time : nullptr, start.own},
                     simulation};
  call(
      "reset", [&] { return callbacks_.reset(self_, &to); }, &random);
  check_carried("reset", start.carried);
  if (!checks_) return;
  const auto check_finite = [&](const char* name, const double* values, int count) {
    for (int i = 0; i < count; ++i)
      if (!std::isfinite(values[i])) refuse("reset", element_is(name, static_cast<std::size_t>(i), values[i]));
  };
  check_finite("qpos", start.qpos, sim.nq);
  check_finite("qvel", start.qvel, sim.nv);
  check_finite("act", start.act, sim.na);
}

const double* Calls::reset_info(SimView& view) const {
  view.complete();
  double* values = nan_info(view, reset_info_count_);
  if (!callbacks_.reset_info) return values;
  call("reset_info", [&] { return callbacks_.reset_info(self_, &view.sim(), values); });
  return values;
}

void Calls::carry(SimView& view) const {
  if (!callbacks_.carry) return;
  view.complete();
  call("carry", [&] { return callbacks_.carry(self_, &view.sim(), view.carried()); });
  check_carried("carry", view.carried());
}

void Calls::observe(SimView& view, double* to) const {
  if (!callbacks_.observe) return static_cast<void>(std::fill_n(to, observation_count_, 0.0));
  view.complete();
  call("observe", [&] { return callbacks_.observe(self_, &view.sim(), to); });
  if (!checks_) return;
  double sum = 0;
  for (std::int64_t i = 0; i < observation_count_; ++i) sum += 0 * to[i];  // becomes NaN if a number is not finite
  if (sum == 0) return;
  for (std::int64_t i = 0; i < observation_count_; ++i)  // infinity is allowed
    if (std::isnan(to[i])) refuse("observe", "observation[" + std::to_string(i) + "] is NaN");
}

void Calls::before_step(SimView& view, const Action& action, const Control& control, Random& random) const {
  call_control("before_step", callbacks_.before_step, view, action, control, random);
}

void Calls::before_substep(SimView& view, const Action& action, const Control& control, Random& random) const {
  call_control("before_substep", callbacks_.before_substep, view, action, control, random);
}

void Calls::call_control(const char* name, ControlCallback* callback, SimView& view, const Action& action,
                         const Control& control, Random& random) const {
  WorkingControl to{{sizeof(mjenv_control), static_cast<std::int32_t>(control.substep), control.ctrl, view.carried(),
                     &random, control.own, control.work ? control.work->state().qvel : nullptr},
                    control.work};
  const ShownAction shown(view, action);
  call(
      name, [&] { return callback(self_, &view.sim(), &to); }, &random);
  check_carried(name, view.carried());
  if (!checks_) return;
  for (std::int32_t i = 0; i < view.sim().nu; ++i)
    if (!std::isfinite(control.ctrl[i])) refuse(name, element_is("ctrl", static_cast<std::size_t>(i), control.ctrl[i]));
  for (std::int32_t i = 0; to.qvel && i < view.sim().nv; ++i)
    if (!std::isfinite(to.qvel[i])) refuse(name, element_is("qvel", static_cast<std::size_t>(i), to.qvel[i]));
}

mjenv_outcome Calls::step(SimView& view, const Action& action, Random& random, double* const* own) const {
  view.complete();
  std::vector<double>& qvel = view.velocities();
  std::copy_n(view.sim().qvel, qvel.size(), qvel.data());
  mjenv_outcome to{sizeof to, 0, 0, nan_info(view, info_count_), view.carried(), &random, own, qvel.data()};
  if (!callbacks_.step) return to;
  const ShownAction shown(view, action);
  call(
      "step", [&] { return callbacks_.step(self_, &view.sim(), &to); }, &random);
  check_carried("step", view.carried());
  if (checks_ && std::isnan(to.reward)) refuse("step", "the reward is NaN");
  if (!view.is_kicked()) return to;
  for (std::size_t i = 0; i < qvel.size(); ++i)
    if (!std::isfinite(qvel[i]) && std::isfinite(view.sim().qvel[i])) refuse("step", element_is("qvel", i, qvel[i]));
  return to;
}

double Calls::compute_reward(const double* achieved, const double* desired, std::int64_t size) const {
  double reward = 0;
  call("compute_reward",
       [&] { return callbacks_.compute_reward(self_, &task_api(), achieved, desired, size, &reward); });
  if (checks_ && std::isnan(reward)) refuse("compute_reward", "the reward is NaN");
  return reward;
}

void Calls::refuse(const char* callback, const std::string& why) const {
  fail(MJENV_E_TASK, id_ + ": " + callback + ": " + why);
}

// Throws the error of a callback that returned `result`, or in which a draw or a simulation failed (refuse_draw).
void Calls::fail_with(const char* callback, std::int32_t result) const {
  if (result == MJENV_E_MEMORY) throw std::bad_alloc();
  const std::string why = task_message();
  refuse(callback, why.empty() ? "it returned " + std::to_string(result) + " without a message" : why);
}

template <typename Body>
void Calls::call(const char* name, const Body& body, const Random* random) const {
  clear_task_message();
  std::int32_t result = 0;
  try {
    const KeptFloats floats;
    result = body();
  } catch (const Error& error) {  // from Builder::check
    fail(error.status(), id_ + ": " + name + ": " + error.what());
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    refuse(name, std::string("it threw an exception: ") + error.what());
  } catch (...) {
    refuse(name, "it threw an exception");
  }
  if (random && random->failure == MJENV_E_MEMORY) throw std::bad_alloc();
  if (result != 0 || (random && random->failure != MJENV_OK)) fail_with(name, result);
}

}  // namespace mjenv::core
