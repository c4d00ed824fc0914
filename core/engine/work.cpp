#include "engine/work.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <utility>

#include "engine/mujoco.hpp"

namespace mjenv::core {
namespace {

constexpr std::array<mjtWarning, 3> divergence{mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC};

}  // namespace

Work::Work(std::shared_ptr<const Model> model) : model_(std::move(model)), layout_(*model_) {
  const ErrorTrap trap(ErrorTrap::Memory::is_checked);
  data_.reset(mj_makeData(model_->get()));
  if (!data_) throw std::bad_alloc();
  deferred_ctrl_.resize(layout_.nu);
  deferred_qvel_.resize(layout_.nv);
}

std::vector<Array> Work::arrays() const {
  return data_arrays(*model_->get(), *data_, [this]() -> const mjModel& { return model(); });
}

void Work::use_model(const OwnArrays& arrays, const std::byte* block) {
  if (!view_) view_.emplace(*model_);
  view_->use(arrays, block);
}

void Work::use(const OwnArrays& arrays, const std::byte* block) {
  use_model(arrays, block);
  has_inputs_ = arrays.has_inputs();
  for (const OwnArray& array : arrays.list()) {
    if (array.place != OwnArray::Place::data_input) continue;
    void* input;
    std::memcpy(&input, reinterpret_cast<const std::byte*>(data_.get()) + array.member, sizeof input);
    std::memcpy(input, block + array.offset, array.bytes);
  }
}

void Work::apply(const Pushes& pushes) {
  for (const Force& force : pushes.forces)
    std::copy(force.values.begin(), force.values.end(), data_->xfrc_applied + 6 * std::ptrdiff_t{force.body});
  for (const Kick& kick : pushes.kicks)
    for (std::size_t i = 0; i < kick.values.size(); ++i)
      data_->qvel[static_cast<std::size_t>(kick.dof) + i] += kick.values[i];
}

double* Work::force(const std::string& array) {
  return array == "qfrc_applied" ? data_->qfrc_applied : data_->xfrc_applied;
}

bool Work::has_forces() const {
  const auto is_set = [](double x) { return x != 0; };
  const mjtNum *qfrc = data_->qfrc_applied, *xfrc = data_->xfrc_applied;
  return has_inputs_ && (std::any_of(qfrc, qfrc + layout_.nv, is_set) ||
                         std::any_of(xfrc, xfrc + std::ptrdiff_t{6} * model_->get()->nbody, is_set));
}

void Work::clear() {
  mj_resetData(&model(), data_.get());
  clear_warnings();
  lag_ = 0;
  ++computation_;
}

void Work::begin() {
  const mjModel* m = model_->get();
  mjData* d = data_.get();
  const bool is_cleared = layout_.more > 0 || keeps_current_;
  if (is_cleared) clear();
  std::copy_n(m->qpos0, layout_.nq, d->qpos);
  if (is_cleared) return;
  clear_stack(*d);
  d->time = 0;
  for (mjtNum* array : {d->qvel, d->qacc_warmstart}) std::fill_n(array, layout_.nv, 0.0);
  std::fill_n(d->act, layout_.na, 0.0);
  std::fill_n(d->ctrl, layout_.nu, 0.0);
  for (mjtNum* array : {d->cacc, d->cfrc_int, d->cfrc_ext}) std::fill_n(array, 6 * m->nbody, 0.0);
  clear_caches(*m, *d);
  std::fill_n(d->qHDiagInv, layout_.nv, 0.0);
  clear_warnings();
  lag_ &= ~Lag::forces;
}

void Work::load(const double* state, bool continues) {
  mjData* d = data_.get();
  continues_ = continues && can_continue();
  if (continues_) std::copy_n(d->qpos, layout_.nq, normalized_qpos_.begin());
  clear_stack(*d);  // an exception thrown out of MuJoCo leaves its stack in use
  clear_warnings();
  diverged_early_ = is_deferred_ = false;
  d->time = *state++;
  for (const auto& [array, count] : {std::pair{d->qpos, layout_.nq},
                                     {d->qvel, layout_.nv},
                                     {d->act, layout_.na},
                                     {d->qacc_warmstart, layout_.nv},
                                     {d->ctrl, layout_.nu}}) {
    std::copy_n(state, count, array);
    state += count;
  }
  load_rest(state);
}

void Work::load_written(const double* state) {
  double* qpos = data_->qpos;
  const bool is_shown =
      keeps_current_ && std::memcmp(raw_qpos_.data(), state + 1, raw_qpos_.size() * sizeof(double)) == 0;
  if (is_shown) std::copy_n(qpos, layout_.nq, normalized_qpos_.begin());
  load(state);
  if (is_shown) std::copy_n(normalized_qpos_.begin(), layout_.nq, qpos);
}

// Whether the next step can begin with mj_step2, from what mjData holds. Not with RK4, which does not use mj_step2.
// Not if the state has numbers of StateLayout::more, which mj_step1 may change: a step that does not continue calls
// mj_step1 again, so its results would differ from those of a step that continues.
bool Work::can_continue() {
  return keeps_current_ && layout_.more == 0 && stepped().opt.integrator != mjINT_RK4 && !diverged();
}

void Work::load_rest(const double* rest) {
  if (layout_.more > 0) load_more(*model_->get(), *data_, rest);
}

void Work::save(double* state) const {
  const mjData* d = data_.get();
  *state++ = d->time;
  state = std::copy_n(d->qpos, layout_.nq, state);
  state = std::copy_n(d->qvel, layout_.nv, state);
  state = std::copy_n(d->act, layout_.na, state);
  state = std::copy_n(d->qacc_warmstart, layout_.nv, state);
  state = std::copy_n(d->ctrl, layout_.nu, state);
  if (layout_.more > 0) save_more(*model_->get(), *d, state);
}

void Work::keep_current() {
  keeps_current_ = true;
  raw_qpos_.resize(layout_.nq);
  normalized_qpos_.resize(layout_.nq);
}

void Work::keep_raw_qpos() { std::copy_n(data_->qpos, layout_.nq, raw_qpos_.begin()); }

void Work::compute_current() {
  keep_raw_qpos();
  mjData* d = data_.get();
  std::uint8_t of_step = warnings();
  set_warnings(0);
  mj_step1(&stepped(), d);
  if (diverged()) keep_raw_qpos();  // the new state was bad: MuJoCo resets the simulation, unless that is disabled
  if (was_reset()) of_step = 0;     // mj_resetData has cleared these
  new_state_warnings_ = warnings();
  only_new_state_warnings_ = static_cast<std::uint8_t>(new_state_warnings_ & ~of_step);
  set_warnings(static_cast<std::uint8_t>(of_step | new_state_warnings_));
  // mj_step1 does not compute these arrays, so they hold numbers of older constraints, perhaps of other rows.
  for (mjtNum* array : {d->efc_b, d->efc_force}) std::fill_n(array, d->nefc, 0.0);
  std::fill_n(d->efc_state, d->nefc, 0);
}

void Work::simulate(std::int64_t count) {
  if (stepped().opt.integrator != mjINT_RK4) {
    mj_step2(&stepped(), data_.get());
    --count;
  }
  for (std::int64_t i = 0; i < count; ++i) mj_step(&stepped(), data_.get());
  note_step();
}

Work::State Work::state() { return {&data_->time, data_->qpos, data_->qvel, data_->act, data_->ctrl}; }

std::int64_t Work::contact_count() const { return data_->ncon; }

void Work::forward() {
  if (keeps_current_) {
    keep_raw_qpos();
    mjModel passive = stepped();
    passive.opt.disableflags |= mjDSBL_ACTUATION;
    mj_forward(&passive, data_.get());
  } else {
    mj_forward(&stepped(), data_.get());
  }
  lag_ = (lag_ & Lag::forces) | Lag::frames;
  lost_ &= Lag::forces;
  ++computation_;
}

void Work::forward_first() {
  is_deferred_ = may_defer_;
  if (!is_deferred_) return forward();
  std::copy_n(data_->ctrl, layout_.nu, deferred_ctrl_.begin());
  std::copy_n(data_->qvel, layout_.nv, deferred_qvel_.begin());
}

bool Work::is_outdated() const {
  return std::memcmp(deferred_qvel_.data(), data_->qvel, layout_.nv * sizeof(double)) != 0;
}

void Work::swap_ctrl() { std::swap_ranges(deferred_ctrl_.begin(), deferred_ctrl_.end(), data_->ctrl); }

void Work::act(const Action& action) {
  clear_warnings();
  for (std::int64_t i = 0; i < action.count; ++i) data_->ctrl[i] = action[i];
}

void Work::step(std::int64_t frames, double* before, const BeforeSubstep* before_substep) {
  const auto advance = [&](std::int64_t i, const mjModel& m) {
    if (i == 0 && continues_) {
      std::copy(normalized_qpos_.begin(), normalized_qpos_.end(), data_->qpos);
      mj_step2(&m, data_.get());
    } else {
      mj_step(&m, data_.get());
    }
    if (i == 0) drop_repeated_warnings();
  };
  for (std::int64_t i = 0; i < frames - 1; ++i) {
    if (before_substep) (*before_substep)(i);
    advance(i, sensorless());
  }
  diverged_early_ = diverged();
  if (before_substep) (*before_substep)(frames - 1);
  save(before);
  advance(frames - 1, stepped());
  note_step();
}

void Work::repeat_step() {
  mj_step(&stepped(), data_.get());
  if (keeps_current_) compute_forces();
  note_step(keeps_current_ ? Lag::frames : Lag::on_demand);
}

void Work::compute(unsigned parts) {
  if ((parts & Lag::forces) && !has_lost(Lag::forces)) compute_forces();
  if (!(parts & Lag::frames) || has_lost(Lag::frames)) return;
  const mjModel* m = &model();
  mjData* d = data_.get();
  for (int g = 0; g < m->ngeom; ++g) update_frame(*m, *d, g);
  mj_camlight(m, d);
  lag_ &= ~Lag::frames;
}

void Work::compute_forces() {
  mj_rnePostConstraint(&model(), data_.get());
  lag_ &= ~Lag::forces;
}

static_assert(mjNWARNING <= 8, "warnings() has a bit for each kind");

std::uint8_t Work::warnings() const {
  unsigned kinds = 0;
  for (unsigned kind = 0; kind < mjNWARNING; ++kind) kinds |= (data_->warning[kind].number > 0 ? 1u : 0u) << kind;
  return static_cast<std::uint8_t>(kinds);
}

void Work::set_warnings(std::uint8_t kinds) {
  for (unsigned kind = 0; kind < mjNWARNING; ++kind) data_->warning[kind].number = kinds >> kind & 1;
}

bool Work::are_warnings(std::uint8_t kinds) { return kinds >> mjNWARNING == 0; }

void Work::clear_warnings() {
  set_warnings(0);
  new_state_warnings_ = only_new_state_warnings_ = 0;
}

void Work::drop_repeated_warnings() {
  if (!keeps_current_ || stepped().opt.integrator == mjINT_RK4 || diverged()) return;
  for (const auto kind : {mjWARN_INERTIA, mjWARN_CONTACTFULL, mjWARN_CNSTRFULL}) data_->warning[kind].number = 0;
}

bool Work::diverged() const {
  return std::any_of(divergence.begin(), divergence.end(), [&](auto kind) { return data_->warning[kind].number > 0; });
}

int Work::constraint_count() const { return data_->nefc; }

bool Work::was_reset() const { return diverged() && resets_diverged(model()); }

}  // namespace mjenv::core
