#include "env/holder.hpp"

#include <algorithm>

namespace mjenv::core {

Holder::Holder(std::int32_t i, const Task& task, Rows& rows)
    : index(i),
      task_(task),
      rows_(rows),
      work_(task.model),
      view_(work_, task.frame_skip, task.needs, static_cast<std::size_t>(task.carry_count)),
      before_(work_.layout().size),
      arrays_(work_.arrays()) {
  if (task.needs.current) work_.keep_current();
}

void Holder::hold(std::int64_t row) {
  view_.show_parameters(rows_.parameters(row));
  if (holds(row)) return;
  release();  // in case MuJoCo fails
  run(row, Entry::first);
  for (const Entry entry : {Entry::set_state, Entry::set_constants})
    if (rows_.has(row, entry)) run(row, entry);
  run_last(row);
}

void Holder::run_last(std::int64_t row) {
  release();
  if (rows_.is_written(row)) run(row, Entry::now);
  load_carried(row);
  // The row has the warnings of the whole step, but the work space has those of its last timestep alone.
  work_.set_warnings(static_cast<std::uint8_t>(rows_.head(row).warnings | work_.new_state_warnings()));
  rows_.worker(row) = index;
  resident_ = row;
}

void Holder::run(std::int64_t row, Entry entry) {
  // What lags behind needs the values and the state with which the entry before was computed.
  if (entry != Entry::first) work_.complete();
  use(row, entry);
  if (entry == Entry::now) return work_.load_written(rows_.state(row));
  if (entry == Entry::set_constants) {
    work_.load_rest(rows_.state(row, entry));
    return constants().compute(rows_.arrays(), rows_.values(row, entry), work_.data());
  }
  if (entry == Entry::first) {
    const Origin origin = rows_.head(row).origin;
    if (origin == Origin::cleared) return work_.clear();
    if (origin == Origin::step) {
      work_.load(rows_.state(row, entry));
      return work_.repeat_step();
    }
    work_.begin();
    use(row, entry);  // again, because begin may have cleared the inputs
  }
  work_.load(rows_.state(row, entry));
  work_.forward();
}

void Holder::hold(std::int64_t row, unsigned parts) {
  if (work_.has_lost(parts)) release();
  hold(row);
}

const Array* Holder::array(std::int64_t row, const std::string& name) {
  const Array* found = find(arrays_, name);
  return found ? &array(row, static_cast<std::size_t>(found - arrays_.data()), part_of(name)) : nullptr;
}

const Array& Holder::array(std::int64_t row, std::size_t place, unsigned part) {
  hold(row, part);
  work_.complete(part);
  return arrays_[place];
}

void Holder::show(std::int64_t row, const std::function<void(const mjModel_&, mjData_*)>& draw) {
  hold(row, Lag::frames);
  release();  // in case draw fails
  work_.complete();
  draw(work_.model(), work_.data());
  resident_ = row;
}

void Holder::clear() {
  release();
  work_.clear();
  for (std::int64_t row = 0; row < rows_.count(); ++row) work_.save(rows_.state(row));
}

void Holder::clear(std::int64_t row) {
  release();
  rows_.clear_inputs(row);
  use(row);
  work_.clear();
  rows_.begin(row, Origin::cleared);
  work_.save(rows_.state(row));
  Rows::Head& head = rows_.head(row);
  head.steps = 0;
  head.ready = true;
  head.ended = false;
  head.written = Written::by_caller;  // so that the next step begins with the numbers that the task's carry gives
  head.warnings = 0;
  run_last(row);
}

// Whether the callback carry may read what mj_forward leaves of the last step: forces, arrays that the task names, and
// what the row's flags turn off.
bool Holder::carries_from_last_step() const {
  const Needs& needs = task_.needs;
  return task_.calls->has_carry() &&
         ((needs.parts & Lag::forces) || !needs.arrays.empty() || needs.current || !rows_.arrays().empty());
}

bool Holder::can_forward_elsewhere() const {
  return !carries_from_last_step() && !work_.keeps_current() && !(task_.calls->has_carry() && task_.needs.contacts);
}

void Holder::set_state(std::int64_t row, const double* qpos, const double* qvel) {
  const bool has_stepped = rows_.head(row).origin == Origin::step;
  if (has_stepped && carries_from_last_step()) hold(row);
  const bool has_step = has_stepped && holds(row);
  // Whether the work space is as mj_resetData leaves it, and the state.
  const bool is_clear = holds(row) && rows_.head(row).origin == Origin::cleared && rows_.last(row) == Entry::first;
  if (has_stepped) rows_.make_room(Entry::set_state);
  release();
  if (has_step) {
    work_.complete(Lag::forces);  // before mj_forward overwrites the arrays from which they are computed
  } else if (!is_clear) {
    use(row);
    work_.begin();  // clears what another row has left in the work space
  }
  begin_set_state(row, qpos, qvel);
  work_.forward();
  end_set_state(row);
  if (has_stepped && !has_step) release();  // what the last step leaves is missing; hold() computes it
}

void Holder::begin_set_state(std::int64_t row, const double* qpos, const double* qvel) {
  const StateLayout& layout = work_.layout();
  double* start = before_.data();
  std::copy_n(rows_.state(row), layout.size, start);
  std::copy_n(qpos, layout.nq, layout.qpos(start));
  std::copy_n(qvel, layout.nv, layout.qvel(start));
  release();
  use(row);
  load_carried(row);
  view_.show_parameters(rows_.parameters(row));
  work_.load(start);
}

void Holder::end_set_state(std::int64_t row) {
  Rows::Head& head = rows_.head(row);
  task_.calls->carry(view_);  // before anything is stored, because it may fail
  if (head.origin == Origin::step) {
    rows_.append(row, Entry::set_state);
    store(row, Entry::set_state);
  } else {
    store(row, Origin::forward);
  }
  head.ready = true;
  head.ended = false;
}

std::vector<std::string> Holder::set_constants(std::int64_t row) {
  hold(row, Lag::on_demand);
  work_.complete();
  release();  // in case MuJoCo fails
  rows_.make_room(Entry::set_constants);
  const OwnArrays& arrays = rows_.arrays();
  constants().compute(arrays, rows_.values(row), work_.data());
  std::vector<std::string> shared = constants().new_arrays(arrays);
  if (!shared.empty()) return shared;
  rows_.append(row, Entry::set_constants);
  std::copy_n(rows_.layout().rest(rows_.state(row)), rows_.layout().more, rows_.state(row, Entry::set_constants));
  rows_.keep(row);
  if (!arrays.empty()) constants().save(arrays, rows_.own_values(row));
  work_.save(rows_.state(row));
  rows_.head(row).written = Written::by_caller;
  return shared;
}

Constants& Holder::constants() {
  if (!constants_) constants_ = std::make_unique<Constants>(*task_.model);
  return *constants_;
}

void Holder::use(std::int64_t row, Entry entry) {
  if (!rows_.arrays().empty()) use(rows_.values(row, entry));
}

void Holder::use(const std::byte* block) {
  work_.use(rows_.arrays(), block);
  view_.use(rows_.arrays(), block);
}

std::byte* Holder::own_values(std::int64_t row) {
  const bool has_moved = rows_.shares_model_values(row);
  std::byte* block = rows_.own_values(row);
  if (has_moved) {
    work_.use_model(rows_.arrays(), block);
    view_.use(rows_.arrays(), block);
  }
  return block;
}

void Holder::save(std::int64_t row, Origin origin) {
  task_.calls->carry(view_);  // before anything is stored, because it may fail
  store(row, origin);
}

void Holder::store(std::int64_t row, Origin origin) {
  rows_.begin(row, origin);
  store(row, Entry::first);
}

void Holder::store(std::int64_t row, Entry entry) {
  std::copy_n(before_.data(), before_.size(), rows_.state(row, entry));
  work_.save(rows_.state(row));
  if (work_.keeps_current())
    std::copy(work_.raw_qpos().begin(), work_.raw_qpos().end(), work_.layout().qpos(rows_.state(row)));
  std::copy_n(view_.carried(), task_.carry_count, rows_.carried(row));
  rows_.head(row).warnings = work_.step_warnings();
  rows_.worker(row) = index;
  resident_ = work_.lag() & Lag::others ? kNone : row;  // hold() computes the rest
}

}  // namespace mjenv::core
