#include "env/worker.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "error.hpp"

namespace mjenv::core {

Worker::Worker(std::int32_t i, const Task& task)
    : index(i),
      task_(task),
      work_(task.model),
      view_(work_, task.frame_skip, task.needs, static_cast<std::size_t>(task.carry_count)),
      before_(work_.layout().size),
      arrays_(work_.arrays()) {}

void Worker::prepare(const Schema& schema) {
  observation_.resize(static_cast<std::size_t>(schema.observation_count()));
  for (const std::size_t i : schema.exported()) {
    exported_.push_back(&arrays_[i]);
    work_.expect(arrays_[i].name);
  }
}

void Worker::save(Rows& rows, std::int64_t row, Origin origin) {
  task_.calls->carry(view_);  // first, because it may fail
  if (origin == Origin::set) {
    rows.keep_step(row);
    rows.drop_all_but_step(row);
  } else {
    rows.drop_kept(row);
  }
  std::copy_n(before_.data(), before_.size(), rows.computed_state(row));
  work_.save(rows.state(row));
  std::copy_n(view_.carried(), task_.carry_count, rows.carried(row));
  Rows::Head& head = rows.head(row);
  head.origin = origin;
  if (origin == Origin::step && forces_ && !forces_->empty()) {
    for (const Work::Force& force : *forces_)
      std::memcpy(rows.values(row) + force.offset, force.values.data(), sizeof force.values);
    rows.note_forces(row);
  }
  // If MuJoCo reset the simulation during this step, it cleared the inputs. If the last mj_step did so, its inputs are
  // kept, to compute it again. If an earlier mj_step did, the last one began without inputs.
  if (origin == Origin::step && rows.arrays().has_inputs() && work_.was_reset()) {
    if (!work_.diverged_early()) rows.keep(row);
    rows.clear_inputs(row);
  }
  rows.worker(row) = index;
  head.written = head.has_constants = false;
  if (work_.is_whole())
    resident_ = row;
  else
    release();  // hold() computes the rest
}

void Worker::use(Rows& rows, std::int64_t row, Version version) {
  if (!rows.arrays().empty()) use(rows.arrays(), rows.values(row, version));
}

void Worker::use(const OwnArrays& arrays, std::byte* block) {
  work_.use(arrays, block);
  view_.use(arrays, block);
}

void Worker::hold(Rows& rows, std::int64_t row) {
  if (holds(rows, row)) return;
  release();  // in case MuJoCo fails
  compute(rows, row);
  if (rows.head(row).written) {
    work_.complete();  // before the written values and state are loaded, because it needs the older ones
    if (rows.head(row).has_constants) repeat_constants(rows, row);
    use(rows, row);
    work_.load(rows.state(row));
  }
  load_carried(rows, row);
  rows.worker(row) = index;
  resident_ = row;
}

void Worker::compute(Rows& rows, std::int64_t row) {
  switch (rows.head(row).origin) {
    case Origin::cleared: use(rows, row); return work_.clear();
    case Origin::forward:
      use(rows, row, Version::computed);
      work_.begin();
      use(rows, row, Version::computed);  // the inputs again, which begin may have cleared
      work_.load(rows.computed_state(row));
      return work_.forward();
    case Origin::step:
      use(rows, row, Version::computed);
      work_.load(rows.computed_state(row));
      return work_.repeat_step();
    case Origin::set:
      use(rows, row, Version::stepped);
      work_.load(rows.stepped_state(row));
      work_.repeat_step();
      work_.complete_forces();
      use(rows, row, Version::computed);
      work_.load(rows.computed_state(row));
      return work_.forward();
  }
}

// Calls mj_setConst as set_constants did: with the own values and the poses of mocap bodies that the row had then,
// because both may have been written since.
void Worker::repeat_constants(Rows& rows, std::int64_t row) {
  const std::byte* values = rows.values(row, Version::constants);
  if (!rows.arrays().empty()) {
    inputs_.resize(rows.block_bytes());
    if (values)
      std::copy_n(values, inputs_.size(), inputs_.data());
    else
      rows.arrays().fill(0, inputs_.data());
    use(rows.arrays(), inputs_.data());
  }
  work_.load_rest(rows.constants_rest(row));
  compute_constants(rows, values);
}

void Worker::compute_constants(const Rows& rows, const std::byte* values) {
  prepare_constants();
  constants_->compute(rows.arrays(), values, work_.data());
}

std::vector<std::string> Worker::set_constants(Rows& rows, std::int64_t row) {
  hold(rows, row);
  work_.complete();
  release();  // in case MuJoCo fails
  rows.prepare_keep_constants();
  compute_constants(rows, rows.arrays().empty() ? nullptr : rows.values(row));
  std::vector<std::string> names = constants_->new_arrays(rows.arrays());
  if (!names.empty()) return names;
  rows.keep(row);
  rows.keep_constants(row);
  if (!rows.arrays().empty()) constants_->save(rows.arrays(), rows.values(row));
  work_.save(rows.state(row));
  rows.head(row).written = rows.head(row).has_constants = true;
  return names;
}

void Worker::clear(Rows& rows) {
  release();
  work_.clear();
  for (std::int64_t row = 0; row < rows.count(); ++row) work_.save(rows.state(row));
}

void Worker::begin(Rows& rows, std::int64_t row, const Rng& rng, const Randomization& randomization) {
  const StateLayout& layout = work_.layout();
  double* start = before_.data();
  release();
  drawn_.clear();
  const OwnArrays& arrays = rows.arrays();
  if (arrays.has_inputs()) {  // cleared in a copy, because the task may fail
    inputs_.assign(rows.values(row), rows.values(row) + rows.block_bytes());
    arrays.clear_inputs(inputs_.data());
    use(arrays, inputs_.data());
  } else {
    use(rows, row);
  }
  work_.begin();
  work_.save(start);
  std::fill_n(view_.carried(), task_.carry_count, 0.0);
  Random random(&rng);
  task_.calls->reset(view_.sim(), {layout.qpos(start), layout.qvel(start), layout.act(start), view_.carried()}, random);
  // Saved before mj_forward, because that may fail: then the next reset must draw another initial state.
  rows.head(row).rng = random.drew() ? random.rng() : rng;
  rows.head(row).seeded = true;
  if (!randomization.empty()) draw(rows, row, randomization);
  work_.load(start);
  work_.forward();
  save(rows, row, Origin::forward);
  if (!arrays.has_inputs()) return;
  rows.clear_inputs(row);
  use(rows, row);
}

// Of the row, only the stream changes.
void Worker::draw(Rows& rows, std::int64_t row, const Randomization& randomization) {
  const OwnArrays& arrays = rows.arrays();
  drawn_.assign(rows.values(row), rows.values(row) + rows.block_bytes());
  arrays.clear_inputs(drawn_.data());
  randomization.draw(rows.head(row).rng, drawn_.data());
  if (!randomization.computes_constants()) return;
  constants_->compute(arrays, drawn_.data());
  const std::vector<std::string> more = constants_->new_arrays(arrays);
  if (!more.empty()) fail(MJENV_E_MODEL, "mj_setConst changes " + listed(more) + ", which all rows share");
  constants_->save(arrays, drawn_.data());
}

void Worker::adopt(Rows& rows, std::int64_t row) noexcept {
  if (drawn_.empty()) return;
  rows.keep(row);
  std::copy(drawn_.begin(), drawn_.end(), rows.values(row));
  drawn_.clear();
  rows.head(row).written = true;
  forget(row);
}

void Worker::prepare(const OwnArrays& arrays) {
  release();
  drawn_.reserve(arrays.block_bytes());
  inputs_.resize(arrays.block_bytes());
  arrays.fill(0, inputs_.data());
  use(arrays, inputs_.data());
}

void Worker::prepare_constants() {
  if (!constants_) constants_ = std::make_unique<Constants>(*task_.model);
}

void Worker::prepare_constants_of_draws() {
  prepare_constants();
  constants_->make_data();
}

void Worker::load(Rows& rows, std::int64_t row, const Action& action, const Forces* forces) {
  if (rows.head(row).written && task_.carry_count > 0) {  // what the task carries may depend on what was written
    hold(rows, row);
    // Only commit gives the row these numbers. So if the row is loaded again (Team::advance), carry starts from the row's
    // old numbers once more, not from its own result.
    task_.calls->carry(view_);
  } else {
    load_carried(rows, row);
  }
  release();
  use(rows, row);
  if (forces)
    for (const Work::Force& force : *forces) work_.apply(force);
  work_.load(rows.state(row));
  work_.act(action);
  forces_ = forces;
}

void Worker::commit(Rows& rows, std::int64_t row) { save(rows, row, Origin::step); }

void Worker::commit(Rows& rows, std::int64_t row, Random& random) {
  commit(rows, row);
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
  const Origin last = rows.head(row).origin;
  const bool has_stepped = last == Origin::step || last == Origin::set;
  if (has_stepped && task_.carry_count > 0) hold(rows, row);  // the task may read the last step's forces in carry
  const bool has_forces = has_stepped && holds(rows, row);
  if (has_stepped) rows.prepare_keep_step();
  double* start = before_.data();
  std::copy_n(rows.state(row), layout.size, start);
  std::copy_n(qpos, layout.nq, layout.qpos(start));
  std::copy_n(qvel, layout.nv, layout.qvel(start));
  release();
  if (has_forces) {
    work_.complete_forces();  // before mj_forward replaces the arrays of the last step, from which they are computed
  } else {
    use(rows, row);
    work_.begin();  // clears what another row has left in the work space
  }
  use(rows, row);
  load_carried(rows, row);
  work_.load(start);
  work_.forward();
  save(rows, row, has_stepped ? Origin::set : Origin::forward);
  if (has_stepped && !has_forces) release();  // the work space lacks the last step's forces; hold() computes them
}

const double* Worker::observation() {
  task_.calls->observe(view_, observation_.data());
  return observation_.data();
}

void Worker::write_observation(const double* observation, void* to, const Place& place) const {
  if (!to) return;
  const auto count = static_cast<std::int64_t>(observation_.size()), start = place.index * count;
  if (place.out.obs_dtype == MJENV_DTYPE_FLOAT32)
    std::transform(observation, observation + count, static_cast<float*>(to) + start,
                   [](double x) { return static_cast<float>(x); });
  else
    std::copy_n(observation, count, static_cast<double*>(to) + start);
}

void Worker::fail_row(std::int64_t row, mjenv_status status, const char* what) noexcept {
  release();
  try {
    failures.add(status, in_row(row, what));
  } catch (const std::exception&) {  // no memory for the text
    failures.add(MJENV_E_MEMORY, "");
  }
}

void Worker::write_observation(void* to, const Place& place) {
  if (!to) return;
  const auto count = static_cast<std::int64_t>(observation_.size()), start = place.index * count;
  const bool narrow = place.out.obs_dtype == MJENV_DTYPE_FLOAT32;
  double* wide = narrow ? observation_.data() : static_cast<double*>(to) + start;
  task_.calls->observe(view_, wide);
  if (narrow)
    std::transform(wide, wide + count, static_cast<float*>(to) + start, [](double x) { return static_cast<float>(x); });
}

void Worker::write_arrays(const Schema& schema, const Place& place) {
  if (!place.out.arrays) return;
  if (schema.exports_on_demand()) work_.complete();
  const std::vector<Field>& fields = schema.fields(MJENV_ROLE_ARRAYS);
  for (std::size_t i = 0; i < fields.size(); ++i) exported_[i]->read(place.out.arrays + place.start(fields[i]));
}

const Array* Worker::array(Rows& rows, std::int64_t row, const std::string& name) {
  const auto found = std::find_if(arrays_.begin(), arrays_.end(), [&](const Array& a) { return a.name == name; });
  if (found == arrays_.end()) return nullptr;
  hold(rows, row);
  work_.complete();
  return &*found;
}

void Worker::show(Rows& rows, std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw) {
  hold(rows, row);
  release();  // in case draw fails
  work_.complete();
  draw(work_.model(), work_.data());
  resident_ = row;
}

}  // namespace mjenv::core
