#include "engine/lanes/frame/stepper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <exception>
#include <optional>
#include <type_traits>
#include <utility>

#include "engine/lanes/frame/memory.hpp"
#include "engine/lanes/mujoco2/arrays.hpp"
#include "engine/lanes/mujoco2/constraint_maker.hpp"
#include "engine/lanes/mujoco2/lanes.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/lanes/mujoco2/sensing.hpp"
#include "engine/lanes/mujoco2/solver.hpp"
#include "engine/lanes/mujoco2/unlisted.hpp"
#include "engine/mujoco.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {
namespace {

// An array of Lanes, and the array of mjData from and to which it is copied.
struct LaneArray {
  double* Lanes::*numbers;
  mjtNum* mjData::*data;
  int count;
};

// Numbers or flags of mjModel whose values may differ from row to row. `of` finds them in a model.
template <typename Element>
struct OwnArray {
  double* Lanes::*numbers;
  const Element* (*of)(const mjModel& model);
  int count;
  bool are_shared = false;  // the lanes hold the values that all rows share
};
using OwnNumbers = OwnArray<mjtNum>;
using OwnFlags = OwnArray<mjtByte>;

// Makes a view of a row's model that lists only the pairs of geoms that are near each other.
class RowModel {
 public:
  // pairs: the model's list of pairs; null if MuJoCo searches for pairs.
  explicit RowModel(const Pairs* pairs) {
    if (pairs) near_ = *pairs;
  }
  RowModel(const RowModel&) = delete;
  RowModel& operator=(const RowModel&) = delete;

  // Sets the row's model. is_own: its numbers may have changed since the last call.
  void follow(const mjModel& model, bool is_own) {
    if (all_ == &model && !is_own) return;
    all_ = &model;
    view_ = model;
    if (near_) set_pairs(view_, *near_);
  }

  // Returns a view with only those pairs that Code::reject has not excluded for the row. The contacts are the same,
  // because MuJoCo would exclude the other pairs, too. may_touch: Lanes::may_touch.
  const mjModel& with_near_pairs(int row, const unsigned char* may_touch) {
    view_.npair = 0;
    for (int i = 0; i < all_->npair; ++i)
      if (may_touch[i] >> row & 1) append(i);
    return view_;
  }

 private:
  const mjModel* all_ = nullptr;
  std::optional<Pairs> near_;
  mjModel view_{};

  void append(int from) {
    const auto to = static_cast<std::size_t>(view_.npair++);
    near_->dim[to] = all_->pair_dim[from];
    near_->geom1[to] = all_->pair_geom1[from];
    near_->geom2[to] = all_->pair_geom2[from];
    near_->margin[to] = all_->pair_margin[from];
    near_->gap[to] = all_->pair_gap[from];
    std::copy_n(all_->pair_solref + mjNREF * from, mjNREF, &near_->solref[mjNREF * to]);
    std::copy_n(all_->pair_solimp + mjNIMP * from, mjNIMP, &near_->solimp[mjNIMP * to]);
    std::copy_n(all_->pair_friction + 5 * from, 5, &near_->friction[5 * to]);
  }
};

std::size_t index_of(Party party) { return static_cast<std::size_t>(__builtin_ctz(party)); }

// The arrays of Lanes for a model, as arrays.hpp lists them.
class LaneArrays {
 public:
  explicit LaneArrays(const mjModel& model);

  std::size_t bytes(int width) const { return Memory<Lanes>::bytes(width, counts_); }

 protected:
  const mjModel& m_;
  std::array<std::vector<LaneArray>, kParties> written_, read_;  // for each Party, what it writes and reads in mjData
  std::vector<OwnNumbers> own_, frames_;  // frames_: those that the lanes hold only if rows have their own
  std::vector<OwnFlags> flags_;
  Counts<Lanes> counts_;
  int longest_ = 1;  // the greatest count of an array that is copied from or to mjData
};

LaneArrays::LaneArrays(const mjModel& m) : m_(m) {
  const auto add = [&](double* Lanes::*array, int count) {
    counts_.emplace_back(array, static_cast<std::size_t>(count));
  };
  const auto add_of_data = [&](const LaneArray& array, unsigned writers, unsigned readers) {
    add(array.numbers, array.count);
    longest_ = std::max(longest_, array.count);
    for (std::size_t party = 0; party < kParties; ++party) {
      if (writers >> party & 1) written_[party].push_back(array);
      if (readers >> party & 1) read_[party].push_back(array);
    }
  };
#define MJENV_ARRAY(name, count) add(&Lanes::name, count);
  MJENV_LANES_RESULTS(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  own_.push_back({&Lanes::name, [](const mjModel& of) -> const mjtNum* { return of.name; }, count});
  MJENV_LANES_OWN(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  own_.push_back({&Lanes::name, [](const mjModel& of) { return first(of.opt.name); }, count});
  MJENV_LANES_OWN_OPTIONS(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  frames_.push_back({&Lanes::name, [](const mjModel& of) -> const mjtNum* { return of.name; }, count});
  MJENV_LANES_OWN_FRAMES(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, limit) \
  flags_.push_back({&Lanes::name, [](const mjModel& of) -> const mjtByte* { return of.name; }, count});
  MJENV_LANES_OWN_FLAGS(MJENV_ARRAY)
#undef MJENV_ARRAY
#define MJENV_ARRAY(name, count, writers, readers) add_of_data({&Lanes::name, &mjData::name, count}, writers, readers);
  MJENV_LANES_DATA(MJENV_ARRAY)
#undef MJENV_ARRAY
  for (const auto* list : {&own_, &frames_})
    for (const OwnNumbers& own : *list) add(own.numbers, own.count);
  for (const OwnFlags& own : flags_) add(own.numbers, own.count);
}

class LaneStepper final : public Stepper, private LaneArrays {
 public:
  LaneStepper(const Model& model, const Code& code);
  std::uint32_t step(Work* const* works, int count, std::int64_t frames, double* const* before,
                     const BeforeSubstep* before_substep) override;

 private:
  const Code& code_;
  ModelTables tables_;
  const SingleStages single_;
  const bool has_adhesion_;
  Lanes lanes_{};
  Memory<Lanes> memory_, pair_memory_;
  std::vector<std::unique_ptr<RowModel>> models_;
  const bool searches_;                     // MuJoCo searches for pairs of geoms: the model has no list
  std::unique_ptr<Solver> solver_;          // null if MuJoCo solves the constraints row by row
  std::unique_ptr<ConstraintMaker> maker_;  // null if MuJoCo makes the constraints row by row
  bool makes_ = false;                      // whether maker_ can make the constraints of this step's rows
  const SensorNeeds sensors_;
  const bool has_rangefinders_, sees_from_cameras_;
  bool reads_forces_ = false;  // whether somebody reads what mj_rnePostConstraint computes after this step
  bool is_whole_ = true;       // whether this step must leave all of mjData as MuJoCo does
  std::vector<unsigned char> may_touch_, pair_rows_;
  std::vector<double> spare_;  // where scatter writes the numbers of lanes without a row
  std::vector<int> row_ends_;  // for scatter_derivatives: in each row of a matrix, where the next element belongs
  std::array<const mjModel*, kMaxWidth> row_models_{};
  std::array<const float*, kMaxWidth> heights_{};  // the rows' hfield_data
  std::array<mjData*, kMaxWidth> data_{};
  std::array<Work*, kMaxWidth> works_{};
  int count_ = 0;
  std::uint32_t all_ = 0;  // the lanes that have a row, as bits

  void set_world();
  bool has_shared_ = false;  // no row has numbers of mjModel of its own
  template <typename Own>
  bool are_shared(const Own& own) const;
  template <typename Own>
  void gather_own(Own& own);
  void gather_own();
  template <typename Element>
  bool has_own(Element* mjModel::*array) const;
  void gather_pairs();
  void gather_types();
  void gather_heights();
  void leave_unlike();
  bool is_unlike(const mjModel& m) const;
  bool has_other_types(const mjModel& m) const;
  void gather_forces(Work* const* works);
  void gather(Party writer);
  void scatter(Party reader, unsigned rows = ~0U);
  std::uint32_t live() const { return all_ & ~lanes_.left_to_mujoco; }
  template <typename Body>
  void for_live_rows(const Body& body);
  void leave_bad(const double* numbers, int count) { lanes_.left_to_mujoco |= code_.bad(numbers, count); }

  // Who reads the results of one evaluation of the dynamics.
  struct Readers {
    bool after_step;  // whoever reads mjData after the step
    bool sensors;
  };
  void forward(Readers readers);
  bool constrain_in_lanes();
  void keep_warmstart();
  // A stage of the dynamics before constraints. is_single: whether MuJoCo's functions compute it row by row; null if
  // lanes always compute it. is_shown: whether callbacks see its results in a new state.
  struct SmoothStage {
    void (*Code::*in_lanes)(Lanes&);
    bool is_shown;
    bool SingleStages::*is_single = nullptr;
    void (LaneStepper::*row_by_row)() = nullptr;
  };
  static const std::array<SmoothStage, 13> kSmoothStages;
  struct Call {
    void (*in_lanes)(Lanes&);
    void (LaneStepper::*row_by_row)();  // if in_lanes is null
  };
  std::vector<Call> smooth_stages_, shown_stages_;
  void choose_stages();
  void compute(const std::vector<Call>& calls);
  void actuate_row_by_row();
  void gather_sparse_tendons();
  void compute_passive_row_by_row();
  void collide();
  void search();
  void make_constraints();
  void solve_constraints(bool is_held);
  void sense_in_lanes();
  void sense_row_by_row(bool holds_constraints);
  void show();
  bool shows_current() const;
  void show_current(Work* const* works);
  void integrate(bool is_last);
  void scatter_moments();
  void scatter_derivatives();
};

// Sets the world's frame once. mj_kinematics would set the same in each step.
void LaneStepper::set_world() {
  std::fill_n(lanes_.xquat, code_.width, 1.0);
  for (double* matrix : {lanes_.xmat, lanes_.ximat})
    for (const int i : {0, 4, 8}) std::fill_n(matrix + i * code_.width, code_.width, 1.0);
}

LaneStepper::LaneStepper(const Model& model, const Code& code)
    : LaneArrays(*model.stepped()),
      code_(code),
      tables_(model),
      single_(m_),
      has_adhesion_(has_adhesion(m_)),
      memory_(lanes_, code.width, counts_),
      pair_memory_(lanes_, code.width,
                   {{&Lanes::pair_limit, tables_.pairs.size()},
                    {&Lanes::pair_margin, tables_.pairs.size()},
                    {&Lanes::pair_includemargin, tables_.pairs.size()},
                    {&Lanes::pair_reach, tables_.pairs.size()}}),
      searches_(!model.pairs()),
      solver_(Solver::make(code, m_)),
      maker_(solver_ ? ConstraintMaker::make(code, m_, tables_) : nullptr),
      sensors_(sensor_needs(m_)),
      has_rangefinders_(has_rangefinders(m_)),
      sees_from_cameras_(sees_from_cameras(m_)),
      may_touch_(tables_.pairs.size()),
      pair_rows_(tables_.pairs.size()),
      spare_(static_cast<std::size_t>(longest_)),
      row_ends_(static_cast<std::size_t>(m_.nv)) {
  set_world();
  choose_stages();
  for (int row = 0; row < code.width; ++row) models_.push_back(std::make_unique<RowModel>(model.pairs()));
  lanes_.model = &m_;
  lanes_.tendon_dof_adr = tables_.tendon_dof_adr.data();
  lanes_.tendon_dofs = tables_.tendon_dofs.data();
  lanes_.columns = tables_.columns.data();
  lanes_.segments = tables_.segments.data();
  lanes_.segment_adr = tables_.segment_adr.data();
  lanes_.ancestor_adr = tables_.ancestor_adr.data();
  lanes_.ancestors = tables_.ancestors.data();
  lanes_.moved_adr = tables_.moved_adr.data();
  lanes_.moved_bodies = tables_.moved_bodies.data();
  lanes_.actuators = tables_.actuators.data();
  lanes_.has_moments = tables_.has_moments;
  lanes_.has_ellipsoids = tables_.has_ellipsoids.data();
  lanes_.needs_fluids = !single_.passive || m_.opt.integrator == mjINT_IMPLICIT;
  lanes_.has_single_actuation = single_.actuation;
  lanes_.is_still_tendon = tables_.is_still_tendon.data();
  lanes_.pairs = tables_.pairs.data();
  lanes_.pair_count = static_cast<int>(tables_.pairs.size());
  lanes_.box_pairs = tables_.box_pairs.data();
  lanes_.boxes = tables_.boxes.data();
  lanes_.may_touch = may_touch_.data();
}

// Returns whether the rows have the shared model's values. Either all rows have a copy of an array or none has, so the
// first row's pointers tell for all.
template <typename Own>
bool LaneStepper::are_shared(const Own& own) const {
  return own.of(*row_models_[0]) == own.of(m_);
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
  lanes_.has_own_sizes =
      has_own(&mjModel::geom_size) || has_own(&mjModel::geom_margin) || has_own(&mjModel::hfield_size);
  for (OwnNumbers& own : own_) gather_own(own);
  for (OwnFlags& own : flags_) gather_own(own);
  lanes_.has_own_frames =
      !std::all_of(frames_.begin(), frames_.end(), [&](const OwnNumbers& own) { return are_shared(own); });
  for (std::size_t i = 0; i < frames_.size() && lanes_.has_own_frames; ++i) gather_own(frames_[i]);
  lanes_.has_negative_zeros =
      lanes_.has_own_frames ? has_negative_zero(lanes_.jnt_axis, 3 * m_.njnt * code_.width) ||
                                  has_negative_zero(lanes_.jnt_pos, 3 * m_.njnt * code_.width)
                            : has_negative_zero(m_.jnt_axis, 3 * m_.njnt) || has_negative_zero(m_.jnt_pos, 3 * m_.njnt);
  gather_pairs();
  gather_types();
  gather_heights();
  code_.adopt(lanes_);
  leave_unlike();
}

// Whether the rows have their own values of this array.
template <typename Element>
bool LaneStepper::has_own(Element* mjModel::*array) const {
  return row_models_[0]->*array != m_.*array;
}

void LaneStepper::gather_pairs() {
  lanes_.has_own_pairs =
      has_own(&mjModel::geom_margin) || has_own(&mjModel::geom_gap) || has_own(&mjModel::geom_rbound);
  for (std::size_t i = 0; i < tables_.pairs.size() && lanes_.has_own_pairs; ++i)
    for (int lane = 0; lane < code_.width; ++lane) {
      const GeomPair& pair = tables_.pairs[i];
      const PairNumbers numbers = pair_numbers(*row_models_[lane < count_ ? lane : 0], pair.geom1, pair.geom2);
      const std::size_t at = i * static_cast<std::size_t>(code_.width) + static_cast<std::size_t>(lane);
      lanes_.pair_limit[at] = numbers.limit;
      lanes_.pair_margin[at] = numbers.margin;
      lanes_.pair_includemargin[at] = numbers.includemargin;
      lanes_.pair_reach[at] = numbers.reach;
    }
}

// Finds out which of the listed pairs can touch in each row.
void LaneStepper::gather_types() {
  const bool are_other = has_own(&mjModel::geom_contype) || has_own(&mjModel::geom_conaffinity);
  lanes_.pair_rows = are_other ? pair_rows_.data() : nullptr;
  for (std::size_t i = 0; i < pair_rows_.size() && are_other; ++i) {
    unsigned rows = 0;
    for (int row = 0; row < count_; ++row)
      if (are_types_compatible(*row_models_[row], tables_.pairs[i].geom1, tables_.pairs[i].geom2)) rows |= 1U << row;
    pair_rows_[i] = static_cast<unsigned char>(rows);
  }
}

void LaneStepper::gather_heights() {
  lanes_.heights = has_own(&mjModel::hfield_data) ? heights_.data() : nullptr;
  for (int lane = 0; lane < code_.width; ++lane) heights_[lane] = row_models_[lane < count_ ? lane : 0]->hfield_data;
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

// Whether the tables of the shared model are not valid for a row's model, because
// - the fluid model of ellipsoids applies to other geoms than in the shared model,
// - other geoms than in the shared model have a bounding sphere,
// - a margin is negative, with which MuJoCo's search can find other pairs, or
// - contype and conaffinity let geoms touch that are not in the list of pairs.
bool LaneStepper::is_unlike(const mjModel& m) const {
  const auto differs = [&](const auto& kind) {
    for (int geom = 0; geom < m.ngeom; ++geom)
      if (kind(m, geom) != kind(m_, geom)) return true;
    return false;
  };
  if (lanes_.needs_fluids && m.geom_fluid != m_.geom_fluid &&
      differs([](const mjModel& of, int geom) { return of.geom_fluid[mjNFLUID * geom] > 0; }))
    return true;
  if (!tables_.knows_pairs) return false;
  if (m.geom_rbound != m_.geom_rbound && differs([](const mjModel& of, int geom) { return of.geom_rbound[geom] > 0; }))
    return true;
  if (m.geom_margin != m_.geom_margin &&
      std::any_of(m.geom_margin, m.geom_margin + m.ngeom, [](mjtNum margin) { return margin < 0; }))
    return true;
  if (!has_other_types(m)) return false;
  return !tables_.kept_apart ||
         std::any_of(tables_.kept_apart->begin(), tables_.kept_apart->end(),
                     [&](const auto& pair) { return are_types_compatible(m, pair.first, pair.second); });
}

bool LaneStepper::has_other_types(const mjModel& m) const {
  return m.geom_contype != m_.geom_contype || m.geom_conaffinity != m_.geom_conaffinity;
}

// Copies to lanes what this Party has written to the rows' mjData. Lanes without a row get a copy of the first row.
void LaneStepper::gather(Party writer) {
  std::array<const double*, kMaxWidth> from{};
  for (const LaneArray& array : written_[index_of(writer)]) {
    for (int lane = 0; lane < code_.width; ++lane) from[lane] = data_[lane < count_ ? lane : 0]->*array.data;
    code_.gather(lanes_.*array.numbers, from.data(), array.count);
  }
}

// Copies to the rows' mjData what this Party reads there.
void LaneStepper::scatter(Party reader, unsigned rows) {
  std::array<double*, kMaxWidth> to{};
  for (const LaneArray& array : read_[index_of(reader)]) {
    for (int lane = 0; lane < code_.width; ++lane)
      to[lane] = lane < count_ && rows >> lane & 1 ? data_[lane]->*array.data : spare_.data();
    code_.scatter(to.data(), lanes_.*array.numbers, array.count);
  }
}

// Copies qfrc_applied and xfrc_applied to lanes, unless they are 0 in all rows, as in most environments.
void LaneStepper::gather_forces(Work* const* works) {
  lanes_.has_forces = std::any_of(works, works + count_, [](const Work* work) { return work->has_forces(); });
  if (!lanes_.has_forces) return;
  gather(kForces);
  leave_bad(lanes_.qfrc_applied, m_.nv);
  leave_bad(lanes_.xfrc_applied, 6 * m_.nbody);
}

// Calls body(row, its model, its mjData) for the rows that are not left to MuJoCo. If MuJoCo fails in a row, this
// leaves the row, too: it is then stepped alone, fails again, and the error is reported.
template <typename Body>
void LaneStepper::for_live_rows(const Body& body) {
  const std::uint32_t rows = live();
  for (int row = 0; row < count_; ++row) {
    if (!(rows >> row & 1)) continue;
    try {
      body(row, *row_models_[row], *data_[row]);
    } catch (const std::exception&) {
      lanes_.left_to_mujoco |= 1u << row;
    }
  }
}

std::uint32_t LaneStepper::step(Work* const* works, int count, std::int64_t frames, double* const* before,
                                const BeforeSubstep* before_substep) {
  count_ = count;
  all_ = (1u << count) - 1;
  for (int row = 0; row < count; ++row) {
    row_models_[row] = &works[row]->unmixed();
    works_[row] = works[row];
    data_[row] = works[row]->data();
  }
  // With RK4, sensors read what mj_rnePostConstraint computes in the first stage, and complete_forces computes the same
  // arrays after the last. Lanes do not compute both, so if both are read, the step leaves all of mjData as MuJoCo
  // does.
  reads_forces_ = works[0]->reads_forces();
  is_whole_ =
      works[0]->reads_all() || (reads_forces_ && sensors_ != SensorNeeds::nothing && m_.opt.integrator == mjINT_RK4);
  gather_own();
  makes_ = maker_ && !has_adhesion_ && maker_->follow(row_models_, count) &&
           std::all_of(row_models_.begin(), row_models_.begin() + count,
                       [&](const mjModel* m) { return solver_->has_noslip_of(*m); });
  lanes_.left_to_mujoco = lanes_.unlike;
  if (live() == 0) return 0;
  gather(kState);
  gather_forces(works);
  leave_bad(lanes_.act, m_.na);
  leave_bad(lanes_.ctrl, m_.nu);
  leave_bad(lanes_.mocap_pos, 3 * m_.nmocap);
  leave_bad(lanes_.mocap_quat, 4 * m_.nmocap);
  for (std::int64_t frame = 1; frame <= frames; ++frame) {
    const bool is_last = frame == frames;
    leave_bad(lanes_.qpos, m_.nq);
    leave_bad(lanes_.qvel, m_.nv);
    if (before_substep || is_last) scatter(kState);
    if (before_substep) {
      for_live_rows([&](int row, const mjModel& /*m*/, mjData& /*d*/) { (*before_substep)(row, frame - 1); });
      gather(kCallback);
      gather_forces(works);
      leave_bad(lanes_.ctrl, m_.nu);
    }
    for (int row = 0; row < count && is_last; ++row) works[row]->save(before[row]);
    forward({is_last && m_.opt.integrator != mjINT_RK4, is_last && sensors_ != SensorNeeds::nothing});
    integrate(is_last);
    if (live() == 0) return 0;
    for (int row = 0; row < count && frame == 1; ++row) works[row]->drop_repeated_warnings();
    for (int row = 0; row < count; ++row) data_[row]->time += row_models_[row]->opt.timestep;
  }
  leave_bad(lanes_.qpos, m_.nq);
  leave_bad(lanes_.qvel, m_.nv);
  const bool computes_forces = reads_forces_ && !is_whole_;
  if (computes_forces) {
    code_.rnePostConstraint(lanes_, maker_->found(), solver_->constraints());
    scatter(kBetweenBodies);
  }
  scatter(kState);
  if (is_whole_ && !single_.actuation) scatter_moments();
  const bool is_current = works[0]->keeps_current(), is_shown = is_current && shows_current();
  if (is_shown) show_current(works);
  // Work::note_step may call mj_step1, which may fail.
  for_live_rows([&](int row, const mjModel& /*m*/, mjData& /*d*/) {
    works[row]->note_step(is_whole_, is_shown, computes_forces);
  });
  return live();
}

// Whether lanes can compute what callbacks see of the new state. If not, Work::note_step calls mj_step1 row by row.
bool LaneStepper::shows_current() const {
  return !is_whole_ && !single_.actuation && (sensors_ == SensorNeeds::nothing || !reads_constraints_before_forces(m_));
}

// Computes the stages of mj_step1 for the new state, except those whose results nobody reads: the inertia matrix,
// contacts, constraints and energies.
void LaneStepper::show_current(Work* const* works) {
  for (int row = 0; row < count_; ++row) works[row]->keep_raw_qpos();
  compute(shown_stages_);
  scatter(kState);
  scatter(kShown);
  if (sensors_ == SensorNeeds::nothing) return;
  scatter(kSensing);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { sense_state(m, d); });
}

// Chooses once how the stages of this model are computed.
void LaneStepper::choose_stages() {
  for (const SmoothStage& stage : kSmoothStages) {
    const bool is_single = stage.is_single && single_.*stage.is_single;
    const Call call{!is_single && stage.in_lanes ? code_.*stage.in_lanes : nullptr,
                    is_single ? stage.row_by_row : nullptr};
    if (!call.in_lanes && !call.row_by_row) continue;
    smooth_stages_.push_back(call);
    if (stage.is_shown) shown_stages_.push_back(call);
  }
}

void LaneStepper::compute(const std::vector<Call>& calls) {
  for (const Call& call : calls)
    if (call.in_lanes)
      call.in_lanes(lanes_);
    else
      (this->*call.row_by_row)();
}

// mj_forward. The order differs from MuJoCo's where that does not change the results: constraints come after all other
// stages except sensors and energies, unless the model has adhesion.
void LaneStepper::forward(Readers readers) {
  compute(smooth_stages_);
  leave_bad(lanes_.qacc_smooth, m_.nv);
  if (live() == 0) return;
  const bool reads_constraints = readers.sensors && sensors_ == SensorNeeds::constraints;
  const bool is_made = makes_ && !(is_whole_ && (readers.after_step || reads_constraints)) && constrain_in_lanes();
  if (readers.after_step && reads_forces_ && !is_made) is_whole_ = true;
  const bool is_held = (readers.after_step && is_whole_) || reads_constraints;
  if (!is_made) {
    scatter(kConstraints);
    if (!has_adhesion_) {
      collide();
      make_constraints();
    }
    solve_constraints(is_held);
  }
  leave_bad(lanes_.qacc, m_.nv);  // as mj_checkAcc
  if (readers.sensors && !is_whole_ && (is_made || !reads_constraints))
    sense_in_lanes();
  else if (readers.sensors)
    sense_row_by_row(is_held);
  if (readers.after_step) show();
}

// In this order. A single call computes tendons and actuators row by row.
const std::array<LaneStepper::SmoothStage, 13> LaneStepper::kSmoothStages{
    {{&Code::kinematics, true},
     {&Code::comPos, true},
     {&Code::tendon, true, &SingleStages::actuation},
     {&Code::crb, false},
     {&Code::factorM, false},
     {&Code::transmission, true, &SingleStages::actuation},
     {&Code::fwdVelocity, true, &SingleStages::actuation},
     {&Code::comVel, true},
     {nullptr, false, &SingleStages::actuation, &LaneStepper::actuate_row_by_row},
     {&Code::passive, true, &SingleStages::passive, &LaneStepper::compute_passive_row_by_row},
     {&Code::rne, true},
     {&Code::fwdActuation, false, &SingleStages::actuation},
     {&Code::fwdAcceleration, false}}};

// MuJoCo's functions compute tendons and actuators row by row. The moments of adhesion depend on contacts and
// constraints, so these come first.
void LaneStepper::actuate_row_by_row() {
  scatter(kActuation);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_tendon(&m, &d); });
  if (has_adhesion_) {
    collide();
    make_constraints();
  }
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) {
    mj_transmission(&m, &d);
    if (mj_isSparse(&m))
      mju_mulMatVecSparse(d.ten_velocity, d.ten_J, d.qvel, m_.ntendon, d.ten_J_rownnz, d.ten_J_rowadr, d.ten_J_colind,
                          nullptr);
    else
      mju_mulMatVec(d.ten_velocity, d.ten_J, d.qvel, m_.ntendon, m_.nv);
    mju_mulMatVec(d.actuator_velocity, d.actuator_moment, d.qvel, m_.nu, m_.nv);
    mj_fwdActuation(&m, &d);
  });
  gather(kActuation);
  if (!mj_isSparse(&m_))
    gather(kTendons);
  else if (m_.opt.integrator == mjINT_IMPLICIT)
    gather_sparse_tendons();
}

// Gathers the sparse Jacobians of tendons. Assigns the elements and does not add them, because a tendon has at most one
// element for each dof: models in which a fixed tendon names a joint twice are refused (untrusted/mjcf.cpp).
void LaneStepper::gather_sparse_tendons() {
  std::fill_n(lanes_.ten_J, m_.ntendon * m_.nv * code_.width, 0.0);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    for (int i = 0; i < m.ntendon; ++i)
      for (int n = 0; n < d.ten_J_rownnz[i]; ++n) {
        const int at = d.ten_J_rowadr[i] + n, dof = d.ten_J_colind[at];
        lanes_.ten_J[(i * m.nv + dof) * code_.width + row] = d.ten_J[at];
      }
  });
}

// MuJoCo's functions compute the passive forces row by row. mjData holds what they read, because actuate_row_by_row
// comes first.
void LaneStepper::compute_passive_row_by_row() {
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_passive(&m, &d); });
  gather(kPassive);
}

void LaneStepper::sense_in_lanes() {
  static const Contacts kNoContacts{};
  static const Constraints kNoConstraints{};
  if (sees_from_cameras_) {
    scatter(kCameras);
    for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_camlight(&m, &d); });
    gather(kCameras);
  }
  if (sensors_ == SensorNeeds::constraints)
    code_.sensors(lanes_, maker_->found(), solver_->constraints());
  else
    code_.sensors(lanes_, kNoContacts, kNoConstraints);
  scatter(kSensed);
  if (has_rangefinders_) scatter(kRays);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { sense_singly(m, d); });
}

void LaneStepper::sense_row_by_row(bool holds_constraints) {
  for (const Party reader : {kShown, kState, kSensing}) scatter(reader);
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) { sense(m, d, holds_constraints); });
}

// Writes to mjData what callbacks can read, and everything else if somebody reads it (is_whole_).
void LaneStepper::show() {
  scatter(kShown);
  if (!is_whole_) return;
  scatter(kWhole);
  if (!single_.actuation) scatter(kTendons);
  const bool has_paths = !tables_.segments.empty(), has_energy = (m_.opt.enableflags & mjENBL_ENERGY) != 0;
  if (!has_paths && !has_energy) return;
  scatter(kState);
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) {
    if (has_paths) mj_tendon(&m, &d);  // for the tendons' paths, which lanes do not compute
    if (!has_energy) return;
    mj_energyPos(&m, &d);
    mj_energyVel(&m, &d);
  });
}

// Finds contacts, and makes and solves constraints in lanes, without writing them to mjData, where nobody reads them.
// Returns false if MuJoCo's functions must do this row by row.
bool LaneStepper::constrain_in_lanes() {
  code_.reject(lanes_);
  if (!maker_->find(lanes_, live(), *solver_, row_models_, data_)) return false;
  solver_->solve(lanes_, maker_->found(), row_models_, data_);
  keep_warmstart();
  solver_->remove_slip(lanes_, maker_->found());
  return true;
}

// Calls mj_collision row by row, with the pairs of geoms that are near each other.
void LaneStepper::collide() {
  const bool lists_all = std::all_of(row_models_.begin(), row_models_.begin() + count_,
                                     [&](const mjModel* m) { return !searches_ && m->npair == m_.npair; });
  if (!lists_all) return search();
  code_.reject(lanes_);
  std::uint32_t near = 0;
  for (const unsigned char rows : may_touch_) near |= rows;
  if ((near & live()) != 0) scatter(kCollision);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    d.ncon = 0;
    if (!(near >> row & 1)) return;
    models_[row]->follow(works_[row]->stepped(), &m != &m_);
    mj_collision(&models_[row]->with_near_pairs(row, may_touch_.data()), &d);
  });
}

// Calls mjenv_collision row by row, which looks for pairs itself. If the model has a list of pairs, lanes do not
// compute the frames of geoms that only such a search reads, so this does.
void LaneStepper::search() {
  scatter(searches_ ? kCollision : kSearch);
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) {
    for (int geom = 0; geom < m.ngeom && !searches_; ++geom) update_frame(m, d, geom);
    mjenv_collision(&m, &d);
  });
}

// MuJoCo makes the constraints of the contacts in mjData row by row.
void LaneStepper::make_constraints() {
  int contacts = 0;
  for_live_rows([&](int /*row*/, const mjModel& /*m*/, mjData& d) { contacts += d.ncon; });
  if (contacts > 0 || m_.neq > 0) scatter(kBodyConstraints);
  if (!single_.actuation) scatter(kTendons);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_makeConstraint(&m, &d); });
}

// Lanes solve the constraints that MuJoCo has made, if they can. is_held: mjData must hold the constraints and their
// forces afterwards.
void LaneStepper::solve_constraints(bool is_held) {
  std::uint32_t constrained = 0, solvable = 0;
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    if (d.nefc > 0) constrained |= 1u << row;
    if (solver_ && solver_->solves(m, d)) solvable |= 1u << row;
  });
  if ((solvable & (solvable - 1)) == 0) solvable = 0;  // for a single row, MuJoCo's solver is faster
  if ((constrained & ~solvable) != 0) scatter(kSolver);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    if (solvable >> row & 1) return;
    if (d.nefc > 0) {
      mj_projectConstraint(&m, &d);
      mj_referenceConstraint(&m, &d);
    }
    mj_fwdConstraint(&m, &d);
  });
  if (solvable != 0) solver_->solve(lanes_, solvable, row_models_, data_, is_held);
  if (constrained != 0) return gather(kSolver);
  const auto count = static_cast<std::size_t>(m_.nv) * static_cast<std::size_t>(code_.width);
  std::copy_n(lanes_.qacc_smooth, count, lanes_.qacc);
  std::fill_n(lanes_.qfrc_constraint, count, 0.0);
  keep_warmstart();
}

// The next solver begins with the acceleration that this one has found, as in mj_fwdConstraint.
void LaneStepper::keep_warmstart() { std::copy_n(lanes_.qacc, m_.nv * code_.width, lanes_.qacc_warmstart); }

// Copies the moments of actuators to mjData. If all actuators act on slides and hinges, their moments are their gears,
// and the lanes have no array of them.
void LaneStepper::scatter_moments() {
  if (tables_.has_moments) return scatter(kMoments);
  for (int row = 0; row < count_; ++row) {
    mjtNum* const moment = data_[row]->actuator_moment;
    std::fill_n(moment, m_.nu * m_.nv, 0.0);
    for (int i = 0; i < m_.nu; ++i)
      moment[i * m_.nv + tables_.actuators[i].dof] = row_models_[row]->actuator_gear[6 * std::ptrdiff_t{i}];
  }
}

// Copies qDeriv and qLU to mjData, whose sparse matrices have the columns of each row in ascending order.
void LaneStepper::scatter_derivatives() {
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    mj_makeMSparse(&m, &d, d.D_rownnz, d.D_rowadr, d.D_colind);
    const auto copy = [&](int to, const double* qDeriv, const double* qLU, int from) {
      d.qDeriv[to] = qDeriv[from * code_.width + row];
      d.qLU[to] = qLU[from * code_.width + row];
    };
    for (int i = 0; i < m.nv; ++i) {
      const int adr = tables_.ancestor_adr[i], depth = tables_.ancestor_adr[i + 1] - adr;
      row_ends_[i] = d.D_rowadr[i] + depth;
      for (int n = 0; n < depth; ++n) copy(row_ends_[i] - 1 - n, lanes_.qDeriv, lanes_.qLU, adr + n);
      for (int n = 1; n < depth; ++n)
        copy(row_ends_[tables_.ancestors[adr + n]]++, lanes_.qDeriv_above, lanes_.qLU_above, adr + n);
    }
  });
}

void LaneStepper::integrate(bool is_last) {
  if (m_.opt.integrator == mjINT_IMPLICIT) {
    code_.implicit(lanes_);
    code_.advanceActivations(lanes_, 0);
    if (is_last && is_whole_) scatter_derivatives();
    return;
  }
  if (m_.opt.integrator == mjINT_EULER) {
    code_.Euler(lanes_);
    code_.advanceActivations(lanes_, 0);
    if (is_last && is_whole_ && lanes_.damped != 0) scatter(kFactor, lanes_.damped);
    return;
  }
  for (int stage = 1; stage < 4; ++stage) {
    code_.RungeKutta(lanes_, stage);
    code_.advanceActivations(lanes_, stage);
    leave_bad(lanes_.qpos, m_.nq);
    leave_bad(lanes_.qvel, m_.nv);
    if (live() == 0) return;
    // mj_RungeKutta keeps four X, four F and dX on mjData's stack. This leaves less of it for constraints, so MuJoCo
    // may fail. To have the same effect, the same amount is marked as used here. The stack is large enough for these
    // arrays, or the environment's trial step (registered_task.cpp) would have failed.
    const int taken = 4 * (m_.nq + 2 * (m_.nv + m_.na)) + 2 * m_.nv + m_.na;
    for (int row = 0; row < count_; ++row) data_[row]->pstack += taken;
    forward({is_last && stage == 3, false});
    for (int row = 0; row < count_; ++row) data_[row]->pstack -= taken;
  }
  code_.RungeKutta(lanes_, 4);
  code_.advanceActivations(lanes_, 4);
}

}  // namespace

std::vector<int> widths() {
  std::vector<int> found;
  for (const Code* code : codes()) found.push_back(code->width);
  return found;
}

std::string absence() { return ""; }

int best_width(const Model& model, std::int64_t rows, int most) {
  int best = 0;
  for (const int width : widths())
    if (width <= most && width <= rows) best = width;
  return obstacle(model).empty() ? best : 0;
}

std::size_t stepper_bytes(const Model& model, int width) {
  const mjModel& m = *model.stepped();
  return LaneArrays(m).bytes(width) + Solver::bytes(width, m);
}

const Code* code_of(int width) {
  for (const Code* code : codes())
    if (code->width == width) return code;
  return nullptr;
}

std::unique_ptr<Stepper> make_stepper(const Model& model, const Code& code) {
  return std::make_unique<LaneStepper>(model, code);
}

}  // namespace mjenv::core::lanes
