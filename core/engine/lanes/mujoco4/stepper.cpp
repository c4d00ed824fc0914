#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "engine/lanes/frame/lane_stepper.hpp"
#include "engine/lanes/mujoco4/collider.hpp"
#include "engine/lanes/mujoco4/sensing.hpp"
#include "engine/lanes/mujoco4/solver.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

bool has_negative_zero(const double* numbers, int count) {
  return std::any_of(numbers, numbers + count, [](double x) { return x == 0 && std::signbit(x); });
}

const Stage& stage_of(Party party) {
  return *std::find_if(stages().begin(), stages().end(), [&](const Stage& stage) { return stage.party == party; });
}

class MujocoStepper final : public LaneStepper {
 public:
  MujocoStepper(const Model& model, const Code& code)
      : LaneStepper(model, code),
        is_by_rows_(!stage_of(kIntegration).obstacle(model).empty()),
        is_RungeKutta_(m_.opt.integrator == mjINT_RK4),
        is_implicit_(m_.opt.integrator == mjINT_IMPLICIT || m_.opt.integrator == mjINT_IMPLICITFAST),
        solver_(Solver::make(code, m_)),
        contacts_(stage_of(kContacts)),
        collider_(contacts_.obstacle(model).empty() ? std::make_unique<Collider>(model, code) : nullptr),
        needs_(sensor_needs(m_)),
        senses_in_lanes_(other_sensors(m_).empty()),
        sees_from_cameras_(sees_from_cameras(m_)),
        shows_current_(needs_ != SensorNeeds::early_constraints &&
                       std::all_of(stages().begin(), stages().end(), [&](const Stage& stage) {
                         return !(stage.party & (kMiddle | kActuation | kPassive)) || !stage.is_there(model) ||
                                stage.obstacle(model).empty();
                       })) {
    if (collider_) collider_->list_pairs(lanes_);
  }

 private:
  const bool is_by_rows_, is_RungeKutta_, is_implicit_;  // how a step is integrated
  const std::unique_ptr<Solver> solver_;                 // null: the stages' table has its twin
  const Stage& contacts_;
  const std::unique_ptr<Collider> collider_;  // null: the stages' table has its twin
  const SensorNeeds needs_;
  const bool senses_in_lanes_, sees_from_cameras_;
  const bool shows_current_;  // whether lanes compute what callbacks see of a new state
  bool is_whole_ = false;     // all of mjData is read after this step
  bool collides_ = false;     // lanes can find the contacts of this step's rows
  bool makes_ = false;        // lanes can make and solve the constraints of this step's rows

  void adopt() override;
  bool is_unlike(const mjModel& m) const override;
  void begin() override;
  void forward_alone(bool is_shown) override;
  void advance(bool is_last) override;
  Left finish() override;
  // Whether sensors of this step are computed row by row.
  bool reads_rows() const { return is_whole_ || !senses_in_lanes_; }
  bool forward(bool is_last);
  void evaluate(bool is_read, bool is_shown);
  bool constrain();
  void collide();
  void solve(bool is_read);
  void show();
  void sense(bool are_all);
  void sense_in_lanes(bool are_all);
  void show_current();
  void integrate(bool is_last);
  void integrate_by_rows(bool is_shown);
};

void MujocoStepper::adopt() {
  const int count = 3 * static_cast<int>(m_.njnt);
  lanes_.has_negative_zeros = lanes_.has_own_frames
                                  ? has_negative_zero(lanes_.jnt_axis, count * code_.width) ||
                                        has_negative_zero(lanes_.jnt_pos, count * code_.width)
                                  : has_negative_zero(m_.jnt_axis, count) || has_negative_zero(m_.jnt_pos, count);
  code_.adopt(lanes_);
}

// Whether lanes, which read flags of the shared model, compute something else than MuJoCo does for a row's model.
bool MujocoStepper::is_unlike(const mjModel& m) const {
  const auto differs = [&](const auto* own, const auto* shared, mjtSize count) {
    return own != shared && !std::equal(own, own + count, shared);
  };
  return differs(m.body_sameframe, m_.body_sameframe, m.nbody) ||
         differs(m.geom_sameframe, m_.geom_sameframe, m.ngeom) ||
         // Geoms that can touch in no other row have no frames in lanes.
         differs(m.geom_contype, m_.geom_contype, m.ngeom) ||
         differs(m.geom_conaffinity, m_.geom_conaffinity, m.ngeom) ||
         differs(m.site_sameframe, m_.site_sameframe, m.nsite) || differs(m.dof_simplenum, m_.dof_simplenum, m.nv) ||
         differs(m.dof_dampingpoly, m_.dof_dampingpoly, m.nv * mjNPOLY) ||
         differs(m.tendon_armature, m_.tendon_armature, m.ntendon) ||
         differs(m.tendon_stiffnesspoly, m_.tendon_stiffnesspoly, m.ntendon * mjNPOLY) ||
         (is_implicit_ && differs(m.tendon_damping, m_.tendon_damping, m.ntendon)) ||
         differs(m.tendon_dampingpoly, m_.tendon_dampingpoly, m.ntendon * mjNPOLY) ||
         differs(m.jnt_stiffnesspoly, m_.jnt_stiffnesspoly, m.njnt * mjNPOLY) ||
         differs(m.geom_fluid, m_.geom_fluid, m.ngeom * mjNFLUID) || m.body_gravcomp != m_.body_gravcomp ||
         m.geom_adhesion != m_.geom_adhesion || m.opt.disableflags != m_.opt.disableflags ||
         m.opt.enableflags != m_.opt.enableflags || m.opt.disableactuator != m_.opt.disableactuator ||
         m.opt.integrator != m_.opt.integrator || m.opt.cone != m_.opt.cone || m.opt.solver != m_.opt.solver ||
         m.opt.noslip_iterations != m_.opt.noslip_iterations;
}

void MujocoStepper::begin() {
  is_whole_ = (readers_ & (kWhole | kBetweenBodies)) || (is_by_rows_ && is_RungeKutta_);
  collides_ = collider_ && (!collider_->has_pairs() || std::none_of(works_.begin(), works_.begin() + count_,
                                                                    [](const Work* work) { return work->searches(); }));
  makes_ = collides_ && solver_ && collider_->follow(row_models_, data_, count_) &&
           std::all_of(row_models_.begin(), row_models_.begin() + count_,
                       [&](const mjModel* m) { return solver_->follows(*m); });
}

void MujocoStepper::forward_alone(bool is_shown) {
  if (is_shown) forward(true);  // otherwise only mj_step writes what is read: qacc_warmstart
}

void MujocoStepper::advance(bool is_last) {
  const bool is_shown = forward(is_last);
  if (live() == 0) return;
  if (is_by_rows_ || (is_implicit_ && is_last && is_whole_))
    integrate_by_rows(is_shown);
  else
    integrate(is_last);
}

// mj_forward. Returns whether `show` has been called.
bool MujocoStepper::forward(bool is_last) {
  if (lanes_.has_forces) lanes_.left_to_mujoco = ~0U;
  // Sensors of positions and velocities are computed again for the new state, if that is shown.
  const bool is_late = needs_ == SensorNeeds::motion && works_[0]->keeps_current();
  const bool senses = is_last && needs_ != SensorNeeds::nothing && !is_late;
  const bool is_read = (is_last && is_whole_) || (senses && needs_ >= SensorNeeds::constraints);
  const bool is_shown = is_read && reads_rows();
  evaluate(is_read, is_shown);
  if (senses && live() != 0) sense(needs_ != SensorNeeds::motion);
  return is_shown;
}

// mj_forward without sensors. The order differs from MuJoCo's where that does not change the results. is_read: whether
// somebody reads constraints afterwards. is_shown: whether somebody reads all of mjData.
void MujocoStepper::evaluate(bool is_read, bool is_shown) {
  if (live() == 0) return;
  compute();
  leave_bad(lanes_.qacc_smooth, m_.nv);
  if (live() == 0) return;
  if (is_read || !makes_ || !constrain()) {
    if (collider_) collide();
    if (solver_) solve(is_read);
  }
  if (is_shown) show();
  leave_bad(lanes_.qacc, m_.nv);  // as mj_checkAcc
}

// Lanes make and solve the constraints. Returns false if they cannot.
bool MujocoStepper::constrain() {
  if (!collider_->find(lanes_, live()) || !solver_->can_solve(collider_->found(), data_)) return false;
  solver_->solve(lanes_, collider_->found(), row_models_, data_);
  if (is_by_rows_) scatter(kSolved);
  return true;
}

// MuJoCo makes the constraints. Lanes find the contacts, if they can.
void MujocoStepper::collide() {
  const bool finds = collides_ && collider_->find_contacts(lanes_, live()) && collider_->has_room(data_);
  scatter(finds && m_.neq == 0 ? kMaking : kMiddle);
  if (m_.neq > 0) scatter(kContacts);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    if (!finds) return contacts_.compute(*works_[row], m, d);
    collider_->write(row, works_[row]->stepped(), d);
    mj_makeConstraint(&works_[row]->stepped(), &d);
  });
}

// Lanes solve the constraints that MuJoCo has made, if they can. MuJoCo solves the others.
void MujocoStepper::solve(bool is_read) {
  std::uint32_t solvable = 0, others = 0;
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    const bool is_solvable = Solver::prepare(m, d);
    if (d.nefc > 0) (is_solvable ? solvable : others) |= 1U << row;
    if (is_read) std::fill_n(d.solver_niter, mjNISLAND, 0);
  });
  solver_->solve(lanes_, solvable, row_models_, data_, is_read);
  if (is_by_rows_ || others != 0) scatter(kSolved, ~others);
  if (others == 0) return;
  scatter(kConstraints, others);
  const Stage& stage = stage_of(kConstraints);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    if (others >> row & 1) stage.compute(*works_[row], m, d);
  });
  gather(kConstraints);
}

// Writes to mjData what no stage has read, the energies, the paths of tendons, and the moments of actuators, which are
// sparse matrices.
void MujocoStepper::show() {
  for (const Party reader : {kMiddle, kSolved, kActuation}) scatter(reader);
  for_live_rows([&](int row, const mjModel& /*m*/, mjData& d) {
    const mjModel& m = works_[row]->stepped();
    mj_camlight(&m, &d);
    mj_tendon(&m, &d);
    mj_transmission(&m, &d);
    d.energy[0] = d.energy[1] = 0;
    if (!(m.opt.enableflags & mjENBL_ENERGY)) return;
    mj_energyPos(&m, &d);
    mj_energyVel(&m, &d);
  });
}

// Computes the sensors of positions and velocities, or all. If all are computed row by row, `show` has been called.
void MujocoStepper::sense(bool are_all) {
  if (!reads_rows()) return sense_in_lanes(are_all);
  for (const Party reader : {kMiddle, kShown})
    if (!are_all) scatter(reader);
  for_live_rows([&](int row, const mjModel& /*m*/, mjData& d) {
    const mjModel& m = works_[row]->stepped();
    if (!are_all) mj_camlight(&m, &d);
    d.flg_subtreevel = d.flg_rnepost = false;
    mj_sensorPos(&m, &d);
    mj_sensorVel(&m, &d);
    if (are_all) mj_sensorAcc(&m, &d);
  });
}

void MujocoStepper::sense_in_lanes(bool are_all) {
  if (sees_from_cameras_) {
    scatter(kMiddle);
    for_live_rows([&](int row, const mjModel& /*m*/, mjData& d) { mj_camlight(&works_[row]->stepped(), &d); });
    gather(kCameras);
  }
  code_.sensors(lanes_, false);
  if (are_all) code_.sensors(lanes_, true);
  const int width = code_.width;
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    for (int i = 0; i < m.nsensor; ++i) {
      if (!is_single(m.sensor_type[i]) || (!are_all && m.sensor_needstage[i] == mjSTAGE_ACC)) continue;
      std::array<mjtNum, 3> pos{};
      std::array<mjtNum, 9> mat{};
      const int site = std::max(0, m.sensor_objid[i]);  // a clock has none
      for (int k = 0; k < 3 && m.nsite > 0; ++k) pos[k] = lanes_.site_xpos[(3 * site + k) * width + row];
      for (int k = 0; k < 9 && m.nsite > 0; ++k) mat[k] = lanes_.site_xmat[(9 * site + k) * width + row];
      lanes_.sensordata[m.sensor_adr[i] * width + row] = sense_singly(m, d, i, pos.data(), mat.data());
    }
  });
  scatter(kSensed);
}

// Computes the stages of mj_step1 for the new state, except those whose results nobody reads.
void MujocoStepper::show_current() {
  for (int row = 0; row < count_; ++row) works_[row]->keep_raw_qpos();
  compute(true);
  if (needs_ != SensorNeeds::nothing) sense(false);
}

void MujocoStepper::integrate(bool is_last) {
  if (!is_RungeKutta_) return is_implicit_ ? code_.implicitfast(lanes_) : code_.Euler(lanes_);
  for (int stage = 1; stage < 4; ++stage) {
    code_.RungeKutta(lanes_, stage);
    leave_bad(lanes_.qpos, m_.nq);
    leave_bad(lanes_.qvel, m_.nv);
    evaluate(is_last && is_whole_ && stage == 3, is_last && is_whole_ && stage == 3);
    if (live() == 0) return;
  }
  code_.RungeKutta(lanes_, 4);
}

// `step` advances the time. is_shown: `show` has been called. Otherwise what it writes for mj_implicit is written here.
void MujocoStepper::integrate_by_rows(bool is_shown) {
  const bool shows = is_implicit_ && !is_shown;
  for (const Party reader : {kMiddle, kSolved, kActuation})
    if (shows) scatter(reader);
  for_live_rows([&](int row, const mjModel& /*m*/, mjData& d) {
    const mjModel& m = works_[row]->stepped();
    if (shows) mj_transmission(&m, &d);
    const mjtNum time = d.time;
    if (is_RungeKutta_)
      mj_RungeKutta(&m, &d, 4);
    else if (is_implicit_)
      mj_implicit(&m, &d);
    else
      mj_Euler(&m, &d);
    d.time = time;
  });
  gather(kIntegration);
}

MujocoStepper::Left MujocoStepper::finish() {
  if (is_whole_ && !is_RungeKutta_ && !is_implicit_ && !is_by_rows_ && lanes_.damped != 0)
    scatter(kFactor, lanes_.damped);
  const bool is_shown = works_[0]->keeps_current() && shows_current_ && !is_whole_;
  if (is_shown) show_current();
  if (!(is_by_rows_ && is_RungeKutta_)) scatter(kShown);
  return {is_whole_ ? Lag::on_demand : Lag::on_demand | Lag::others, is_shown};
}

}  // namespace

std::size_t more_bytes(const mjModel& m, int width) { return Solver::bytes(width, m); }

std::unique_ptr<Stepper> make_stepper(const Model& model, const Code& code) {
  return std::make_unique<MujocoStepper>(model, code);
}

}  // namespace mjenv::core::lanes
