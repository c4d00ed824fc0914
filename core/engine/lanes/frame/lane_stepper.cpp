#include "engine/lanes/frame/lane_stepper.hpp"

#include <algorithm>
#include <type_traits>

namespace mjenv::core::lanes {
namespace {

std::size_t index_of(Party party) { return static_cast<std::size_t>(__builtin_ctz(party)); }

// Whether MuJoCo's functions compute the whole stage row by row, where the table says so.
bool is_by_rows(const Stage& stage, const Model& model) { return stage.compute && !stage.obstacle(model).empty(); }

// The stages that only this model's features keep out of lanes. What other stages write row by row, lanes may change again.
unsigned parties_by_rows(const Model& model) {
  unsigned parties = 0;
  for (const Stage& stage : stages())
    if (is_by_rows(stage, model) && !stage.functions.empty()) parties |= stage.party;
  return parties;
}

}  // namespace

LaneStepper::LaneStepper(const Model& model, const Code& code)
    : LaneArrays(*model.stepped(), parties_by_rows(model)),
      code_(code),
      memory_(lanes_, code.width, counts_),
      spare_(static_cast<std::size_t>(longest_)) {
  lanes_.model = &m_;
  // The world's frame. mj_kinematics would set the same in each step.
  std::fill_n(lanes_.xquat, code_.width, 1.0);
  for (double* matrix : {lanes_.xmat, lanes_.ximat})
    for (const int i : {0, 4, 8}) std::fill_n(matrix + i * code_.width, code_.width, 1.0);
  for (const Stage& stage : stages()) {
    if (is_by_rows(stage, model)) {
      all_calls_.push_back({nullptr, &stage});
      continue;
    }
    for (const Function& function : stage.functions) {
      if (!function.compute) continue;
      all_calls_.push_back({code.*function.compute, nullptr});
      if (function.is_shown) shown_calls_.push_back(all_calls_.back());
    }
  }
}

void LaneStepper::compute(bool shown_only) {
  for (const Call& call : shown_only ? shown_calls_ : all_calls_) {
    if (call.in_lanes) {
      call.in_lanes(lanes_);
      continue;
    }
    scatter(call.row_by_row->party);
    for_live_rows([&](int row, const mjModel& m, mjData& d) { call.row_by_row->compute(*works_[row], m, d); });
    gather(call.row_by_row->party);
  }
}

// Gathers the rows' values, unless they are the shared ones and the lanes hold those already.
template <typename Own>
void LaneStepper::gather_own(Own& own) {
  const bool shares = are_shared(own);
  if (own.are_shared && shares) return;
  std::array<decltype(own.of(m_)), kMaxWidth> from{};
  for (int lane = 0; lane < code_.width; ++lane) from[lane] = own.of(*row_models_[lane < count_ ? lane : 0]);
  if constexpr (std::is_same_v<decltype(own.of(m_)), const mjtNum*>) {
    code_.gather(lanes_.*own.numbers, from.data(), own.count);
  } else {
    for (int i = 0; i < own.count; ++i)
      for (int lane = 0; lane < code_.width; ++lane) (lanes_.*own.numbers)[i * code_.width + lane] = from[lane][i];
  }
  own.are_shared = shares;
}

// Gathers the rows' numbers of mjModel. Those that all rows share stay in the lanes from step to step.
void LaneStepper::gather_own() {
  const bool had_shared = has_shared_;
  has_shared_ = row_models_[0] == &m_;
  if (has_shared_ && had_shared) return;
  for (OwnNumbers& own : own_) gather_own(own);
  for (OwnFlags& own : flags_) gather_own(own);
  lanes_.has_own_frames =
      !std::all_of(frames_.begin(), frames_.end(), [&](const OwnNumbers& own) { return are_shared(own); });
  for (std::size_t i = 0; i < frames_.size() && lanes_.has_own_frames; ++i) gather_own(frames_[i]);
  adopt();
  leave_unlike();
}

// Leaves two kinds of rows to MuJoCo: those with an own number that is too large or not finite, in any array that lanes
// hold (of the shared model, obstacle() checks fewer arrays); and those for which the shared model's tables are not
// valid.
void LaneStepper::leave_unlike() {
  const auto leave = [&](const auto& list) {
    for (const auto& own : list)
      if (!own.are_shared) lanes_.unlike |= code_.bad(lanes_.*own.numbers, own.count);
  };
  leave(own_);
  if (lanes_.has_own_frames) leave(frames_);
  for (int row = 0; row < count_; ++row)
    if (is_unlike(*row_models_[row])) lanes_.unlike |= 1U << row;
}

void LaneStepper::gather(Party writer) {
  std::array<const double*, kMaxWidth> from{};
  for (const LaneArray& array : written_[index_of(writer)]) {
    for (int lane = 0; lane < code_.width; ++lane) from[lane] = data_[lane < count_ ? lane : 0]->*array.data;
    code_.gather(lanes_.*array.numbers, from.data(), array.count);
  }
}

void LaneStepper::scatter(Party reader, unsigned rows) {
  std::array<mjData*, kMaxWidth> taking{};
  for (int row = 0; row < count_; ++row)
    if (rows >> row & 1) taking[row] = data_[row];
  std::array<double*, kMaxWidth> to{};
  for (const LaneArray& array : read_[index_of(reader)]) {
    for (int lane = 0; lane < code_.width; ++lane) to[lane] = taking[lane] ? taking[lane]->*array.data : spare_.data();
    code_.scatter(to.data(), lanes_.*array.numbers, array.count);
  }
}

// Copies qfrc_applied and xfrc_applied to lanes, unless they are 0 in all rows, as in most environments.
void LaneStepper::gather_forces() {
  lanes_.has_forces =
      std::any_of(works_.begin(), works_.begin() + count_, [](const Work* work) { return work->has_forces(); });
  if (!lanes_.has_forces) return;
  gather(kForces);
  leave_bad(lanes_.qfrc_applied, m_.nv);
  leave_bad(lanes_.xfrc_applied, 6 * m_.nbody);
}

// Calls mj_forward with the ctrl from before the callback before_step.
void LaneStepper::forward_where_deferred() {
  std::uint32_t deferred = 0, outdated = 0;
  for (int row = 0; row < count_; ++row) {
    if (!works_[row]->is_deferred()) continue;
    deferred |= 1u << row;
    if (works_[row]->is_outdated()) outdated |= 1u << row;
  }
  if (deferred == 0) return;
  lanes_.left_to_mujoco |= deferred == all_ ? outdated : deferred;
  if (live() == 0 || deferred != all_) return;
  const auto swap = [&] {
    for (int row = 0; row < count_; ++row) works_[row]->swap_ctrl();
    gather(kCallback);
    leave_bad(lanes_.ctrl, m_.nu);
  };
  swap();
  forward_alone(false);
  swap();
}

bool LaneStepper::load(Work* const* works, int count, unsigned readers) {
  count_ = count;
  all_ = (1u << count) - 1;
  for (int row = 0; row < count; ++row) {
    row_models_[row] = &works[row]->unmixed();
    works_[row] = works[row];
    data_[row] = works[row]->data();
  }
  readers_ = readers;
  gather_own();
  begin();
  lanes_.left_to_mujoco = lanes_.unlike;
  if (live() == 0) return false;
  gather(kState);
  gather_forces();
  leave_bad(lanes_.act, m_.na);
  leave_bad(lanes_.ctrl, m_.nu);
  leave_bad(lanes_.mocap_pos, 3 * m_.nmocap);
  leave_bad(lanes_.mocap_quat, 4 * m_.nmocap);
  leave_bad(lanes_.qpos, m_.nq);
  leave_bad(lanes_.qvel, m_.nv);
  return true;
}

std::uint32_t LaneStepper::forward(Work* const* works, int count) {
  if (!load(works, count, kShown)) return 0;
  forward_alone(true);
  if (live() == 0) return 0;
  scatter(kState);
  scatter(kShown);
  for_live_rows(
      [&](int row, const mjModel& /*m*/, mjData& /*d*/) { works[row]->note_step(Lag::on_demand | Lag::others); });
  return live();
}

std::uint32_t LaneStepper::step(Work* const* works, int count, std::int64_t frames, double* const* before,
                                const BeforeSubstep* before_substep) {
  const unsigned expected = works[0]->expected();
  const unsigned read =
      kShown | (expected & Lag::others ? kWhole : 0U) | (expected & Lag::forces ? kBetweenBodies : 0U);
  if (!load(works, count, read)) return 0;
  forward_where_deferred();
  if (live() == 0) return 0;
  for (std::int64_t frame = 1; frame <= frames; ++frame) {
    const bool is_last = frame == frames;
    if (before_substep || is_last) scatter(kState);
    if (before_substep) {
      for_live_rows([&](int row, const mjModel& /*m*/, mjData& /*d*/) { (*before_substep)(row, frame - 1); });
      gather(kCallback);
      gather_forces();
      leave_bad(lanes_.ctrl, m_.nu);
    }
    for (int row = 0; row < count && is_last; ++row) works[row]->save(before[row]);
    advance(is_last);
    leave_bad(lanes_.qpos, m_.nq);
    leave_bad(lanes_.qvel, m_.nv);
    if (live() == 0) return 0;
    for (int row = 0; row < count && frame == 1; ++row) works[row]->drop_repeated_warnings();
    for (int row = 0; row < count; ++row) data_[row]->time += row_models_[row]->opt.timestep;
  }
  scatter(kState);
  const Left left = finish();
  // Work::note_step may call mj_step1, which may fail.
  for_live_rows([&](int row, const mjModel& /*m*/, mjData& /*d*/) { works[row]->note_step(left.lag, left.is_shown); });
  return live();
}

std::vector<int> widths() {
  std::vector<int> found;
  if (!absence().empty()) return found;
  for (const Code* code : codes()) found.push_back(code->width);
  return found;
}

int best_width(const Model& model, std::int64_t rows, int most) {
  int best = 0;
  for (const int width : widths())
    if (width <= most && width <= rows) best = width;
  return obstacle(model).empty() ? best : 0;
}

std::size_t stepper_bytes(const Model& model, int width) {
  const mjModel& m = *model.stepped();
  return LaneArrays(m).bytes(width) + more_bytes(m, width);
}

const Code* code_of(int width) {
  for (const Code* code : codes())
    if (code->width == width) return code;
  return nullptr;
}

}  // namespace mjenv::core::lanes
