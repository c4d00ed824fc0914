#include "env/task_step.hpp"

#include <algorithm>
#include <cstring>

namespace mjenv::core {

void TaskStep::load(std::int64_t row, const Action& action, const Work::Pushes* pushes) {
  scratch_.ensure(holder_);
  Rows& rows = holder_.rows();
  Work& work = holder_.work();
  if (rows.head(row).written == Written::by_caller && calls_.has_carry()) {
    holder_.hold(row);  // carried numbers may depend on what was written
    // The row gets these numbers only in commit. So if the row is loaded again (Team::advance), the callback carry
    // begins with the same numbers as the first time, not with its own result.
    calls_.carry(holder_.view());
  } else {
    holder_.load_carried(row);
  }
  const bool continues = holder_.holds(row) && rows.ends_with_step(row) && !pushes;
  holder_.release();
  holder_.view().show_parameters(rows.parameters(row));
  holder_.use(row);
  work.load(rows.state(row), continues);
  if (pushes) work.apply(*pushes);
  work.act(action);
  pushes_ = pushes;
  random_ = nullptr;
}

void TaskStep::begin(std::int64_t row, const Action& action, const Work::Pushes* pushes, Random& random) {
  load(row, calls_.has_before_step() ? Action{} : action, pushes);
  random_ = &random;
  action_ = action;
  Work& work = holder_.work();
  for (Scratch::TaskArray& own : scratch_.task_arrays) {
    if (!own.is_force) continue;
    std::copy_n(work.force(own.array->original.name), own.values.size(), own.values.data());
    work.defer_forward(false);  // it computes with the forces from before the callback
  }
  if (!calls_.has_before_step()) return;
  calls_.before_step(holder_.view(), action,
                     {0, work.state().ctrl, scratch_.of_control.data(), work.keeps_current() ? nullptr : &work},
                     random);
  apply_forces();
}

void TaskStep::before_substep(std::int64_t substep) {
  double* ctrl = holder_.work().state().ctrl;
  calls_.before_substep(holder_.view(), action_, {substep, ctrl, scratch_.of_control.data()}, *random_);
  apply_forces();
}

void TaskStep::apply_forces() {
  for (const Scratch::TaskArray& own : scratch_.task_arrays) {
    if (!own.is_force) continue;
    own.array->check(own.values.data());
    std::copy(own.values.begin(), own.values.end(), holder_.work().force(own.array->original.name));
  }
}

Random TaskStep::random(std::int64_t row) const {
  const Rows::Head& head = holder_.rows().head(row);
  return Random(head.seeded ? &head.rng : nullptr);
}

mjenv_outcome TaskStep::call(std::int64_t row, const Action& action, Random& random) {
  for (Scratch::TaskArray& own : scratch_.task_arrays) {
    if (!own.is_force)
      own.array->read(holder_.rows().values(row), own.values.data());
    else if (!random_)
      std::copy_n(holder_.work().force(own.array->original.name), own.values.size(), own.values.data());
    own.before = own.values;
  }
  const mjenv_outcome outcome = calls_.step(holder_.view(), action, random, scratch_.of_step.data());
  is_kicked_ = holder_.view().is_kicked();
  return outcome;
}

void TaskStep::commit(std::int64_t row, Random* random) {
  Rows& rows = holder_.rows();
  Work& work = holder_.work();
  std::vector<Scratch::TaskArray>& arrays = scratch_.task_arrays;
  const auto is_changed = [&](const Scratch::TaskArray& own) {
    return random && std::memcmp(own.values.data(), own.before.data(), own.values.size() * sizeof(double)) != 0;
  };
  const auto put = [&](std::vector<double> Scratch::TaskArray::*values) {
    for (const Scratch::TaskArray& own : arrays)
      if (is_changed(own)) own.array->write((own.*values).data(), holder_.own_values(row));
  };
  const bool is_written = std::any_of(arrays.begin(), arrays.end(), is_changed), is_kicked = random && is_kicked_;
  for (const Scratch::TaskArray& own : arrays)
    if (is_changed(own)) own.array->check(own.values.data());
  // The callback carry must see what the task has written. But the row is stored with the values from before, because
  // MuJoCo has computed the derived arrays with those.
  put(&Scratch::TaskArray::values);
  if (is_kicked) std::copy_n(holder_.view().velocities().data(), work.layout().nv, work.state().qvel);
  try {
    calls_.carry(holder_.view());
  } catch (...) {
    put(&Scratch::TaskArray::before);
    throw;
  }
  put(&Scratch::TaskArray::before);
  holder_.store(row, Origin::step);
  store_inputs(row);
  if (is_written) rows.keep(row);
  put(&Scratch::TaskArray::values);
  for (const Scratch::TaskArray& own : arrays)
    if (own.is_force && is_changed(own))
      std::copy(own.values.begin(), own.values.end(), work.force(own.array->original.name));
  if (is_written || is_kicked) rows.head(row).written = Written::by_task;
  if (!random || !random->drew()) return;
  rows.head(row).rng = random->rng();
  rows.head(row).seeded = true;
}

void TaskStep::store_inputs(std::int64_t row) {
  Rows& rows = holder_.rows();
  if (pushes_)
    for (const Work::Force& force : pushes_->forces)
      save_input(row, force.offset, force.values.data(), sizeof force.values);
  if (random_)
    for (const Scratch::TaskArray& own : scratch_.task_arrays)
      if (own.is_force) save_input(row, own.array->offset, own.before.data(), own.array->bytes);
  // If MuJoCo reset the simulation during this step, MuJoCo has cleared the inputs. The row keeps the inputs with which
  // the last mj_step began, to be able to repeat it. If MuJoCo reset the simulation in an earlier mj_step and no
  // before_substep has set forces since, the last one began with cleared inputs, and there is nothing to keep.
  const Work& work = holder_.work();
  if (!rows.arrays().has_inputs() || !work.was_reset()) return;
  if (!work.diverged_early() || (random_ && has_before_substep())) rows.keep(row);
  rows.clear_inputs(row);
}

void TaskStep::save_input(std::int64_t row, std::size_t offset, const double* values, std::size_t bytes) {
  if (std::memcmp(holder_.rows().values(row) + offset, values, bytes) == 0) return;  // needs no memory
  std::memcpy(holder_.own_values(row) + offset, values, bytes);
}

}  // namespace mjenv::core
