#include "env/worker.hpp"

#include <algorithm>
#include <cstring>

namespace mjenv::core {

Worker::Worker(std::int32_t i, const Task& task)
    : index(i),
      task_(task),
      work_(task.model),
      view_(work_, task.frame_skip, task.needs, static_cast<std::size_t>(task.carry_count)),
      before_(work_.layout().size),
      writer_(task, work_, view_),
      constants_(*task.model),
      arrays_(work_.arrays()) {
  if (task.needs.current) work_.keep_current();
}

void Worker::save(Rows& rows, std::int64_t row, Origin origin) {
  task_.calls->carry(view_);  // before anything is stored, because it may fail
  store(rows, row, origin);
}

void Worker::store(Rows& rows, std::int64_t row, Origin origin) {
  rows.begin(row, origin);
  store(rows, row, Entry::first);
  if (origin == Origin::step) store_inputs(rows, row);
}

void Worker::store(Rows& rows, std::int64_t row, Entry entry) {
  std::copy_n(before_.data(), before_.size(), rows.state(row, entry));
  work_.save(rows.state(row));
  if (work_.keeps_current())
    std::copy(work_.raw_qpos().begin(), work_.raw_qpos().end(), work_.layout().qpos(rows.state(row)));
  std::copy_n(view_.carried(), task_.carry_count, rows.carried(row));
  rows.head(row).warnings = work_.step_warnings();
  rows.worker(row) = index;
  if (work_.is_whole())
    resident_ = row;
  else
    release();  // hold() computes the rest
}

void Worker::store_inputs(Rows& rows, std::int64_t row) {
  if (pushes_)
    for (const Work::Force& force : pushes_->forces)
      save_input(rows, row, force.offset, force.values.data(), sizeof force.values);
  if (random_)
    for (const OwnValues& own : own_values_)
      if (own.is_force) save_input(rows, row, own.array->offset, own.before.data(), own.array->bytes);
  // If MuJoCo reset the simulation during this step, MuJoCo has cleared the inputs. The row keeps the inputs with which
  // the last mj_step began, to be able to repeat it. If MuJoCo reset the simulation in an earlier mj_step and no
  // before_substep has set forces since, the last one began with cleared inputs, and there is nothing to keep.
  if (!rows.arrays().has_inputs() || !work_.was_reset()) return;
  if (!work_.diverged_early() || (random_ && has_before_substep())) rows.keep(row);
  rows.clear_inputs(row);
}

void Worker::use(Rows& rows, std::int64_t row, Entry entry) {
  if (!rows.arrays().empty()) use(rows.arrays(), rows.values(row, entry));
}

void Worker::use(const OwnArrays& arrays, const std::byte* block) {
  work_.use(arrays, block);
  view_.use(arrays, block);
}

std::byte* Worker::own_values(Rows& rows, std::int64_t row) {
  const bool has_moved = rows.shares_model_values(row);
  std::byte* block = rows.own_values(row);
  if (has_moved) {
    work_.use_model(rows.arrays(), block);
    view_.use(rows.arrays(), block);
  }
  return block;
}

void Worker::save_input(Rows& rows, std::int64_t row, std::size_t offset, const double* values, std::size_t bytes) {
  if (std::memcmp(rows.values(row) + offset, values, bytes) == 0) return;  // needs no memory
  std::memcpy(own_values(rows, row) + offset, values, bytes);
}

void Worker::hold(Rows& rows, std::int64_t row) {
  view_.show_parameters(rows.parameters(row));
  if (holds(rows, row)) return;
  release();  // in case MuJoCo fails
  run(rows, row, Entry::first);
  for (const Entry entry : {Entry::set_state, Entry::set_constants})
    if (rows.has(row, entry)) run(rows, row, entry);
  if (rows.is_written(row)) run(rows, row, Entry::now);
  load_carried(rows, row);
  // The row has the warnings of the whole step, but the work space has those of its last timestep alone.
  work_.set_warnings(static_cast<std::uint8_t>(rows.head(row).warnings | work_.new_state_warnings()));
  rows.worker(row) = index;
  resident_ = row;
}

void Worker::run(Rows& rows, std::int64_t row, Entry entry) {
  // What lags behind needs the values and the state with which the entry before was computed.
  if (entry != Entry::first) work_.complete();
  if (entry == Entry::set_constants) return constants_.repeat(work_, rows, row);
  use(rows, row, entry);
  if (entry == Entry::now) return work_.load_written(rows.state(row));
  if (entry == Entry::first) {
    const Origin origin = rows.head(row).origin;
    if (origin == Origin::cleared) return work_.clear();
    if (origin == Origin::step) {
      work_.load(rows.state(row, entry));
      return work_.repeat_step();
    }
    work_.begin();
    use(rows, row, entry);  // again, because begin may have cleared the inputs
  }
  work_.load(rows.state(row, entry));
  work_.forward();
}

void Worker::hold_forces(Rows& rows, std::int64_t row) {
  if (work_.has_lost_forces()) release();
  hold(rows, row);
}

std::vector<std::string> Worker::set_constants(Rows& rows, std::int64_t row) {
  hold_forces(rows, row);
  work_.complete();
  release();  // in case MuJoCo fails
  return constants_.set(work_, rows, row);
}

void Worker::clear(Rows& rows) {
  release();
  work_.clear();
  for (std::int64_t row = 0; row < rows.count(); ++row) work_.save(rows.state(row));
}

void Worker::clear(Rows& rows, std::int64_t row) {
  release();
  rows.clear_inputs(row);
  use(rows, row);
  work_.clear();
  rows.begin(row, Origin::cleared);
  work_.save(rows.state(row));
  Rows::Head& head = rows.head(row);
  head.steps = 0;
  head.ready = true;
  head.ended = false;
  head.written = Written::by_caller;  // so that the next step begins with the numbers that the task's carry gives
  head.warnings = 0;
}

void Worker::show_kept(Rows& rows, std::int64_t row) {
  std::fill_n(view_.carried(), task_.carry_count, 0.0);
  for (const KeptNumbers& kept : task_.kept)
    std::copy_n(rows.carried(row) + kept.first, kept.count, view_.carried() + kept.first);
  view_.show_parameters(rows.parameters(row));
}

void Worker::begin_simulating(Rows& rows, std::int64_t row, const Rng& rng, const Randomization& randomization,
                              const Initial& initial) {
  release();
  draws_.clear();
  const OwnArrays& arrays = rows.arrays();
  // The reset writes to a copy, because it may fail.
  inputs_.assign(rows.values(row), rows.values(row) + rows.block_bytes());
  if (arrays.has_inputs()) arrays.clear_inputs(inputs_.data());
  if (!arrays.empty()) use(arrays, inputs_.data());
  for (OwnValues& own : own_values_)
    if (own.is_converted) own.array->read(inputs_.data(), own.values.data());
  work_.clear();
  // Computes what the task's reset sees. If the caller gives the state instead, mj_forward is called once, because its
  // solver begins with the result of the call before.
  if (!initial.qpos || task_.calls->callbacks().reset) {
    work_.forward();
    view_.complete();
  }
  show_kept(rows, row);

  const Work::State state = work_.state();
  ResetSimulation simulation{work_, view_, state.time, written_.data(), take_own_};
  Random random(&rng);
  np::RandomState stream;
  if (rows.has_random_state()) {
    stream = rows.random_state(row);
    if (!stream.is_seeded()) {
      const std::uint64_t seed = Rng::from_entropy().next();
      stream = np::RandomState::from_seed(&seed, 1);
    }
    random.state = &stream;
  }
  task_.calls->reset(view_.sim(), {state.qpos, state.qvel, state.act, view_.carried()}, random, &simulation);
  initial.copy_to(state.qpos, state.qvel, work_.layout());
  take_own();
  for (const std::string& name : task_.needs.own) arrays.find(name)->check(inputs_.data());
  work_.save(before_.data());
  work_.forward();
  // The randomisation draws after the task, as in `begin`.
  Rows::Head& head = rows.head(row);
  const Rng old = head.rng;
  head.rng = random.drew() ? random.rng() : rng;
  try {
    if (!randomization.empty()) draws_.draw(rows, row, inputs_.data(), randomization, constants_);
    save(rows, row, Origin::forward);
  } catch (...) {
    head.rng = old;
    throw;
  }
  head.seeded = true;
  if (rows.has_random_state()) rows.set_random_state(row, stream);
  if (arrays.empty()) return;
  rows.set_values(row, inputs_.data());
  use(rows, row);
}

void Worker::take_own() {
  for (const OwnValues& own : own_values_) {
    if (!own.is_converted) continue;
    own.array->check(own.values.data());
    own.array->write(own.values.data(), inputs_.data());
  }
}

void Worker::begin(Rows& rows, std::int64_t row, const Rng& rng, const Randomization& randomization,
                   const Initial& initial) {
  if (!is_prepared_) prepare(rows.arrays());
  if (work_.keeps_current()) return begin_simulating(rows, row, rng, randomization, initial);
  const StateLayout& layout = work_.layout();
  double* start = before_.data();
  release();
  draws_.clear();
  const OwnArrays& arrays = rows.arrays();
  if (arrays.has_inputs()) {  // clears the inputs in a copy, because the task may fail
    inputs_.assign(rows.values(row), rows.values(row) + rows.block_bytes());
    arrays.clear_inputs(inputs_.data());
    use(arrays, inputs_.data());
  } else {
    use(rows, row);
  }
  work_.begin();
  work_.save(start);
  show_kept(rows, row);
  Random random(&rng);
  task_.calls->reset(view_.sim(), {layout.qpos(start), layout.qvel(start), layout.act(start), view_.carried()}, random);
  initial.copy_to(layout.qpos(start), layout.qvel(start), layout);
  // The stream is saved before mj_forward: if that fails, the next reset must draw another initial state.
  rows.head(row).rng = random.drew() ? random.rng() : rng;
  rows.head(row).seeded = true;
  if (!randomization.empty()) draws_.draw(rows, row, rows.values(row), randomization, constants_);
  work_.load(start);
  work_.forward();
  save(rows, row, Origin::forward);
  if (!arrays.has_inputs()) return;
  rows.clear_inputs(row);
  use(rows, row);
}

void Worker::adopt(Rows& rows, std::int64_t row) noexcept {
  if (draws_.adopt(rows, row)) forget(row);
}

void Worker::prepare(const OwnArrays& arrays) {
  release();
  is_prepared_ = false;
  draws_.reserve(arrays.block_bytes());
  inputs_.resize(arrays.block_bytes());
  // In new vectors, so that those of the last call stay if memory runs out.
  std::vector<OwnValues> own;
  std::vector<double*> controlled(task_.needs.own.size()), forces = controlled, written = controlled;
  own.reserve(controlled.size());
  for (std::size_t i = 0; i < controlled.size(); ++i) {
    const OwnArray* array = arrays.find(task_.needs.own[i]);
    if (!array) continue;  // not yet added to the rows' arrays
    const bool is_force = array->place == OwnArray::Place::data_input;
    const bool is_converted = array->original.type != MJENV_DTYPE_FLOAT64;
    own.push_back({array, is_force, is_converted, std::vector<double>(array->original.count()), {}});
    own.back().before = own.back().values;
    controlled[i] = own.back().values.data();
    if (is_force)
      forces[i] = controlled[i];
    else
      written[i] = is_converted ? controlled[i] : reinterpret_cast<double*>(inputs_.data() + array->offset);
  }
  own_values_ = std::move(own);
  controlled_ = std::move(controlled);
  forces_of_task_ = std::move(forces);
  written_ = std::move(written);
  arrays.fill(0, inputs_.data());
  use(arrays, inputs_.data());
  is_prepared_ = true;
}

void Worker::load(Rows& rows, std::int64_t row, const Action& action, const Work::Pushes* pushes) {
  if (!is_prepared_) prepare(rows.arrays());
  if (rows.head(row).written == Written::by_caller &&
      task_.calls->has_carry()) {  // carried numbers may depend on what was written
    hold(rows, row);
    // The row gets these numbers only in commit. So if the row is loaded again (Team::advance), the callback carry
    // begins with the same numbers as the first time, not with its own result.
    task_.calls->carry(view_);
  } else {
    load_carried(rows, row);
  }
  const bool continues = holds(rows, row) && rows.ends_with_step(row) && !pushes;
  release();
  view_.show_parameters(rows.parameters(row));
  use(rows, row);
  work_.load(rows.state(row), continues);
  if (pushes) work_.apply(*pushes);
  work_.act(action);
  pushes_ = pushes;
  random_ = nullptr;
}

void Worker::begin_step(Rows& rows, std::int64_t row, const Action& action, const Work::Pushes* pushes,
                        Random& random) {
  const bool has_before_step = task_.calls->has_before_step();
  load(rows, row, has_before_step ? Action{} : action, pushes);
  random_ = &random;
  action_ = action;
  for (OwnValues& own : own_values_)
    if (own.is_force) std::copy_n(work_.force(own.array->original.name), own.values.size(), own.values.data());
  if (!has_before_step) return;
  task_.calls->before_step(view_, action, {0, work_.state().ctrl, forces_of_task_.data()}, random);
  apply_own_forces();
}

void Worker::before_substep(std::int64_t substep) {
  task_.calls->before_substep(view_, action_, {substep, work_.state().ctrl, forces_of_task_.data()}, *random_);
  apply_own_forces();
}

void Worker::apply_own_forces() {
  for (const OwnValues& own : own_values_) {
    if (!own.is_force) continue;
    own.array->check(own.values.data());
    std::copy(own.values.begin(), own.values.end(), work_.force(own.array->original.name));
  }
}

mjenv_outcome Worker::step(Rows& rows, std::int64_t row, const Action& action, Random& random) {
  for (OwnValues& own : own_values_) {
    if (!own.is_force)
      own.array->read(rows.values(row), own.values.data());
    else if (!random_)
      std::copy_n(work_.force(own.array->original.name), own.values.size(), own.values.data());
    own.before = own.values;
  }
  const mjenv_outcome outcome = task_.calls->step(view_, action, random, controlled_.data());
  is_kicked_ = view_.is_kicked();
  return outcome;
}

void Worker::commit(Rows& rows, std::int64_t row) { save(rows, row, Origin::step); }

void Worker::commit_step(Rows& rows, std::int64_t row) {
  const auto is_changed = [](const OwnValues& own) {
    return std::memcmp(own.values.data(), own.before.data(), own.values.size() * sizeof(double)) != 0;
  };
  const auto put = [&](std::vector<double> OwnValues::*values) {
    for (const OwnValues& own : own_values_)
      if (is_changed(own)) own.array->write((own.*values).data(), own_values(rows, row));
  };
  const bool is_written = std::any_of(own_values_.begin(), own_values_.end(), is_changed);
  if (!is_written && !is_kicked_) return save(rows, row, Origin::step);
  for (const OwnValues& own : own_values_)
    if (is_changed(own)) own.array->check(own.values.data());
  // The callback carry must see what the task has written. But the row is stored with the values from before, because
  // MuJoCo has computed the derived arrays with those.
  put(&OwnValues::values);
  std::copy(view_.velocities().begin(), view_.velocities().end(), work_.state().qvel);
  try {
    task_.calls->carry(view_);
  } catch (...) {
    put(&OwnValues::before);
    throw;
  }
  put(&OwnValues::before);
  store(rows, row, Origin::step);
  if (is_written) rows.keep(row);
  put(&OwnValues::values);
  for (const OwnValues& own : own_values_)
    if (own.is_force) std::copy(own.values.begin(), own.values.end(), work_.force(own.array->original.name));
  rows.head(row).written = Written::by_task;
}

void Worker::commit(Rows& rows, std::int64_t row, Random& random) {
  commit_step(rows, row);
  if (!random.drew()) return;
  rows.head(row).rng = random.rng();
  rows.head(row).seeded = true;
}

Random Worker::random(const Rows& rows, std::int64_t row) {
  const Rows::Head& head = rows.head(row);
  return Random(head.seeded ? &head.rng : nullptr);
}

void Worker::set_state(Rows& rows, std::int64_t row, const double* qpos, const double* qvel) {
  const StateLayout& layout = work_.layout();
  const bool has_stepped = rows.head(row).origin == Origin::step;
  if (has_stepped && task_.calls->has_carry()) hold(rows, row);  // the callback carry may read the last step's forces
  const bool has_forces = has_stepped && holds(rows, row) && !work_.has_lost_forces();
  if (has_stepped) rows.make_room(Entry::set_state);
  double* start = before_.data();
  std::copy_n(rows.state(row), layout.size, start);
  std::copy_n(qpos, layout.nq, layout.qpos(start));
  std::copy_n(qvel, layout.nv, layout.qvel(start));
  release();
  if (has_forces) {
    work_.complete_forces();  // before mj_forward overwrites the arrays from which they are computed
  } else {
    use(rows, row);
    work_.begin();  // clears what another row has left in the work space
  }
  use(rows, row);
  load_carried(rows, row);
  view_.show_parameters(rows.parameters(row));
  work_.load(start);
  work_.forward();
  if (!has_stepped) return save(rows, row, Origin::forward);
  task_.calls->carry(view_);
  rows.append(row, Entry::set_state);
  store(rows, row, Entry::set_state);
  if (!has_forces) release();  // the last step's forces are missing; hold() computes them
}

void Worker::fail_row(std::int64_t row, mjenv_status status, const char* what) noexcept {
  release();
  try {
    failures.add(status, in_row(row, what));
  } catch (const std::exception&) {  // no memory for the text
    failures.add(MJENV_E_MEMORY, "");
  }
}

const Array* Worker::array(Rows& rows, std::int64_t row, const std::string& name) {
  const Array* found = find(arrays_, name);
  if (!found) return nullptr;
  if (is_force(name)) {
    hold_forces(rows, row);
    work_.complete_forces();
  } else {
    hold(rows, row);
    if (is_frame(name)) work_.complete_frames();
  }
  return found;
}

void Worker::show(Rows& rows, std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw) {
  hold(rows, row);
  release();  // in case draw fails
  work_.complete();
  draw(work_.model(), work_.data());
  resident_ = row;
}

}  // namespace mjenv::core
