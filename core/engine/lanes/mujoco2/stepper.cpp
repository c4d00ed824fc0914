#include "engine/lanes/frame/lane_stepper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "engine/lanes/mujoco2/constraint_maker.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/lanes/mujoco2/sensing.hpp"
#include "engine/lanes/mujoco2/solver.hpp"
#include "engine/lanes/mujoco2/unlisted.hpp"
#include "engine/mujoco.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {
namespace {

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

class MujocoStepper final : public LaneStepper {
 public:
  MujocoStepper(const Model& model, const Code& code);

 private:
  ModelTables tables_;
  Memory<Lanes> pair_memory_;
  std::vector<std::unique_ptr<RowModel>> models_;
  const bool searches_;                     // MuJoCo searches for pairs of geoms: the model has no list
  std::unique_ptr<Solver> solver_;          // null if MuJoCo solves the constraints row by row
  std::unique_ptr<ConstraintMaker> maker_;  // null if MuJoCo makes the constraints row by row
  bool makes_ = false;                      // whether maker_ can make the constraints of this step's rows
  const SensorNeeds sensors_;
  const bool has_rangefinders_, sees_from_cameras_;
  std::vector<unsigned char> may_touch_, pair_rows_;
  std::vector<int> row_ends_;  // for scatter_derivatives: in each row of a matrix, where the next element belongs
  std::array<const float*, kMaxWidth> heights_{};  // the rows' hfield_data

  void adopt() override;
  bool is_unlike(const mjModel& m) const override;
  void begin() override;
  void forward_alone(bool is_shown) override { forward(is_shown ? sensors() : 0U); }
  void advance(bool is_last) override;
  Left finish() override;

  void gather_pairs();
  void gather_types();
  void gather_heights();
  bool has_other_types(const mjModel& m) const;
  void forward(unsigned readers);
  unsigned sensors() const { return sensors_ == SensorNeeds::nothing ? 0U : kSensed; }
  bool constrain_in_lanes();
  void keep_warmstart();
  void collide();
  void search();
  void make_constraints();
  void solve_constraints(bool is_held);
  void sense_in_lanes();
  void sense_row_by_row(bool holds_constraints);
  void show(unsigned readers);
  bool shows_current() const;
  void show_current();
  void integrate(bool is_last);
  void gather_sparse_tendons();
  void scatter_moments();
  void scatter_derivatives();
};

MujocoStepper::MujocoStepper(const Model& model, const Code& code)
    : LaneStepper(model, code),
      tables_(model),
      pair_memory_(lanes_, code.width,
                   {{&Lanes::pair_limit, tables_.pairs.size()},
                    {&Lanes::pair_margin, tables_.pairs.size()},
                    {&Lanes::pair_includemargin, tables_.pairs.size()},
                    {&Lanes::pair_reach, tables_.pairs.size()}}),
      searches_(!model.pairs()),
      solver_(Solver::make(code, m_)),
      maker_(solver_ && !has_adhesion(m_) ? ConstraintMaker::make(code, m_, tables_) : nullptr),
      sensors_(sensor_needs(m_)),
      has_rangefinders_(has_rangefinders(m_)),
      sees_from_cameras_(sees_from_cameras(m_)),
      may_touch_(tables_.pairs.size()),
      pair_rows_(tables_.pairs.size()),
      row_ends_(static_cast<std::size_t>(m_.nv)) {
  for (int row = 0; row < code.width; ++row) models_.push_back(std::make_unique<RowModel>(model.pairs()));
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
  lanes_.needs_fluids = passive_obstacle(m_).empty() || m_.opt.integrator == mjINT_IMPLICIT;
  lanes_.has_single_actuation = !actuation_obstacle(m_).empty();
  lanes_.is_still_tendon = tables_.is_still_tendon.data();
  lanes_.pairs = tables_.pairs.data();
  lanes_.pair_count = static_cast<int>(tables_.pairs.size());
  lanes_.box_pairs = tables_.box_pairs.data();
  lanes_.boxes = tables_.boxes.data();
  lanes_.may_touch = may_touch_.data();
}

void MujocoStepper::adopt() {
  lanes_.has_own_sizes =
      has_own(&mjModel::geom_size) || has_own(&mjModel::geom_margin) || has_own(&mjModel::hfield_size);
  lanes_.has_negative_zeros =
      lanes_.has_own_frames ? has_negative_zero(lanes_.jnt_axis, 3 * m_.njnt * code_.width) ||
                                  has_negative_zero(lanes_.jnt_pos, 3 * m_.njnt * code_.width)
                            : has_negative_zero(m_.jnt_axis, 3 * m_.njnt) || has_negative_zero(m_.jnt_pos, 3 * m_.njnt);
  gather_pairs();
  gather_types();
  gather_heights();
  code_.adopt(lanes_);
}

void MujocoStepper::gather_pairs() {
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
void MujocoStepper::gather_types() {
  const bool are_other = has_own(&mjModel::geom_contype) || has_own(&mjModel::geom_conaffinity);
  lanes_.pair_rows = are_other ? pair_rows_.data() : nullptr;
  for (std::size_t i = 0; i < pair_rows_.size() && are_other; ++i) {
    unsigned rows = 0;
    for (int row = 0; row < count_; ++row)
      if (are_types_compatible(*row_models_[row], tables_.pairs[i].geom1, tables_.pairs[i].geom2)) rows |= 1U << row;
    pair_rows_[i] = static_cast<unsigned char>(rows);
  }
}

void MujocoStepper::gather_heights() {
  lanes_.heights = has_own(&mjModel::hfield_data) ? heights_.data() : nullptr;
  for (int lane = 0; lane < code_.width; ++lane) heights_[lane] = row_models_[lane < count_ ? lane : 0]->hfield_data;
}

// Whether the tables of the shared model are not valid for a row's model, because
// - the fluid model of ellipsoids applies to other geoms than in the shared model,
// - other geoms than in the shared model have a bounding sphere,
// - MuJoCo computes in another way (opt),
// - a margin is negative, with which MuJoCo's search can find other pairs, or
// - contype and conaffinity let geoms touch that are not in the list of pairs.
bool MujocoStepper::is_unlike(const mjModel& m) const {
  const auto differs = [&](const auto& kind) {
    for (int geom = 0; geom < m.ngeom; ++geom)
      if (kind(m, geom) != kind(m_, geom)) return true;
    return false;
  };
  if (m.opt.integrator != m_.opt.integrator || m.opt.cone != m_.opt.cone || m.opt.solver != m_.opt.solver ||
      m.opt.disableflags != m_.opt.disableflags || m.opt.enableflags != m_.opt.enableflags)
    return true;
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

bool MujocoStepper::has_other_types(const mjModel& m) const {
  return m.geom_contype != m_.geom_contype || m.geom_conaffinity != m_.geom_conaffinity;
}

// With RK4, sensors read what mj_rnePostConstraint computes in the first stage, and Work::complete computes the same
// arrays after the last. Lanes do not compute both, so if both are read, the step leaves all of mjData as MuJoCo does.
void MujocoStepper::begin() {
  if ((readers_ & kBetweenBodies) && sensors_ != SensorNeeds::nothing && m_.opt.integrator == mjINT_RK4)
    readers_ |= kWhole;
  makes_ = maker_ && maker_->follow(row_models_, data_, count_) &&
           std::all_of(row_models_.begin(), row_models_.begin() + count_,
                       [&](const mjModel* m) { return solver_->has_noslip_of(*m); });
}

void MujocoStepper::advance(bool is_last) {
  forward(!is_last ? 0U : m_.opt.integrator == mjINT_RK4 ? sensors() : sensors() | readers_);
  integrate(is_last);
}

MujocoStepper::Left MujocoStepper::finish() {
  const bool is_whole = (readers_ & kWhole) != 0, has_forces = (readers_ & kBetweenBodies) && !is_whole;
  if (has_forces) {
    code_.rnePostConstraint(lanes_, maker_->found(), solver_->constraints());
    scatter(kBetweenBodies);
  }
  if (is_whole && !lanes_.has_single_actuation) scatter_moments();
  const bool is_shown = works_[0]->keeps_current() && shows_current();
  if (is_shown) show_current();
  return {Lag::frames | (has_forces ? 0U : Lag::forces) | (is_whole ? 0U : Lag::others), is_shown};
}

// Whether lanes can compute what callbacks see of the new state. If not, Work::note_step calls mj_step1 row by row.
bool MujocoStepper::shows_current() const {
  return !(readers_ & kWhole) && !lanes_.has_single_actuation &&
         (sensors_ == SensorNeeds::nothing || !reads_constraints_before_forces(m_));
}

// Computes the stages of mj_step1 for the new state, except those whose results nobody reads: the inertia matrix,
// contacts, constraints and energies.
void MujocoStepper::show_current() {
  for (int row = 0; row < count_; ++row) works_[row]->keep_raw_qpos();
  compute(true);
  scatter(kState);
  scatter(kShown);
  if (sensors_ == SensorNeeds::nothing) return;
  scatter(kSensing);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { sense_state(m, d); });
}

// mj_forward. The order differs from MuJoCo's where that does not change the results: constraints come after all other
// stages except sensors and energies. readers: who reads mjData after this evaluation.
void MujocoStepper::forward(unsigned readers) {
  compute();
  leave_bad(lanes_.qacc_smooth, m_.nv);
  if (live() == 0) return;
  const bool senses = (readers & kSensed) != 0, reads_constraints = senses && sensors_ == SensorNeeds::constraints;
  const bool is_made =
      makes_ && !(readers & kWhole) && !(reads_constraints && readers_ & kWhole) && constrain_in_lanes();
  if ((readers & kBetweenBodies) && !is_made) readers_ |= kWhole, readers |= kWhole;
  const bool is_held = (readers & kWhole) || reads_constraints;
  if (!is_made) {
    scatter(kConstraints);
    if (!has_adhesion(m_)) {
      collide();
      make_constraints();
    }
    solve_constraints(is_held);
  }
  leave_bad(lanes_.qacc, m_.nv);  // as mj_checkAcc
  if (senses && !(readers_ & kWhole) && (is_made || !reads_constraints))
    sense_in_lanes();
  else if (senses)
    sense_row_by_row(is_held);
  if (readers & kShown) show(readers);
}

// Gathers the sparse Jacobians of tendons. Assigns the elements and does not add them, because a tendon has at most one
// element for each dof: models in which a fixed tendon names a joint twice are refused (untrusted/mjcf.cpp).
void MujocoStepper::gather_sparse_tendons() {
  std::fill_n(lanes_.ten_J, m_.ntendon * m_.nv * code_.width, 0.0);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    for (int i = 0; i < m.ntendon; ++i)
      for (int n = 0; n < d.ten_J_rownnz[i]; ++n) {
        const int at = d.ten_J_rowadr[i] + n, dof = d.ten_J_colind[at];
        lanes_.ten_J[(i * m.nv + dof) * code_.width + row] = d.ten_J[at];
      }
  });
}

void MujocoStepper::sense_in_lanes() {
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

void MujocoStepper::sense_row_by_row(bool holds_constraints) {
  for (const Party reader : {kShown, kState, kSensing}) scatter(reader);
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) { sense(m, d, holds_constraints); });
}

// Writes to mjData what callbacks can read, and everything else if somebody reads it.
void MujocoStepper::show(unsigned readers) {
  scatter(kShown);
  if (!(readers & kWhole)) return;
  scatter(kWhole);
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
bool MujocoStepper::constrain_in_lanes() {
  code_.reject(lanes_);
  if (!maker_->find(lanes_, live(), *solver_, row_models_, data_)) return false;
  solver_->solve(lanes_, maker_->found(), row_models_, data_);
  keep_warmstart();
  solver_->remove_slip(lanes_, maker_->found());
  return true;
}

// Calls mj_collision row by row, with the pairs of geoms that are near each other.
void MujocoStepper::collide() {
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
void MujocoStepper::search() {
  scatter(searches_ ? kCollision : kSearch);
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) {
    for (int geom = 0; geom < m.ngeom && !searches_; ++geom) update_frame(m, d, geom);
    mjenv_collision(&m, &d);
  });
}

// MuJoCo makes the constraints of the contacts in mjData row by row.
void MujocoStepper::make_constraints() {
  int contacts = 0;
  for_live_rows([&](int /*row*/, const mjModel& /*m*/, mjData& d) { contacts += d.ncon; });
  if (contacts > 0 || m_.neq > 0) scatter(kBodyConstraints);
  scatter(kTendons);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_makeConstraint(&m, &d); });
}

// Lanes solve the constraints that MuJoCo has made, if they can. is_held: mjData must hold the constraints and their
// forces afterwards.
void MujocoStepper::solve_constraints(bool is_held) {
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
void MujocoStepper::keep_warmstart() { std::copy_n(lanes_.qacc, m_.nv * code_.width, lanes_.qacc_warmstart); }

// Copies the moments of actuators to mjData. If all actuators act on slides and hinges, their moments are their gears,
// and the lanes have no array of them.
void MujocoStepper::scatter_moments() {
  if (tables_.has_moments) return scatter(kMoments);
  for (int row = 0; row < count_; ++row) {
    mjtNum* const moment = data_[row]->actuator_moment;
    std::fill_n(moment, m_.nu * m_.nv, 0.0);
    for (int i = 0; i < m_.nu; ++i)
      moment[i * m_.nv + tables_.actuators[i].dof] = row_models_[row]->actuator_gear[6 * std::ptrdiff_t{i}];
  }
}

// Copies qDeriv and qLU to mjData, whose sparse matrices have the columns of each row in ascending order.
void MujocoStepper::scatter_derivatives() {
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

void MujocoStepper::integrate(bool is_last) {
  const bool is_whole = is_last && (readers_ & kWhole);
  if (m_.opt.integrator == mjINT_IMPLICIT) {
    if (lanes_.has_single_actuation && mj_isSparse(&m_)) gather_sparse_tendons();
    code_.implicit(lanes_);
    code_.advanceActivations(lanes_, 0);
    if (is_whole) scatter_derivatives();
    return;
  }
  if (m_.opt.integrator == mjINT_EULER) {
    code_.Euler(lanes_);
    code_.advanceActivations(lanes_, 0);
    if (is_whole && lanes_.damped != 0) scatter(kFactor, lanes_.damped);
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
    forward(is_last && stage == 3 ? readers_ : 0);
    for (int row = 0; row < count_; ++row) data_[row]->pstack -= taken;
  }
  code_.RungeKutta(lanes_, 4);
  code_.advanceActivations(lanes_, 4);
}

}  // namespace

std::size_t more_bytes(const mjModel& m, int width) { return Solver::bytes(width, m); }

std::unique_ptr<Stepper> make_stepper(const Model& model, const Code& code) {
  return std::make_unique<MujocoStepper>(model, code);
}

}  // namespace mjenv::core::lanes
