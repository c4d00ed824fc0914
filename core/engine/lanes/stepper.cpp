#include "engine/lanes/stepper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <exception>
#include <optional>
#include <utility>

#include "engine/lanes/constraint_maker.hpp"
#include "engine/lanes/lanes.hpp"
#include "engine/lanes/memory.hpp"
#include "engine/lanes/model_tables.hpp"
#include "engine/lanes/sensing.hpp"
#include "engine/lanes/solver.hpp"
#include "engine/lanes/unlisted.hpp"
#include "engine/mujoco.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {
namespace {

// Eight lanes are only about a tenth faster than four, and each lane takes the memory of an mjData.
constexpr int kBestWidth = 4;

// An array of Lanes, and the array of mjData from and to which it is copied.
struct LaneArray {
  double* Lanes::*numbers;
  mjtNum* mjData::*data;
  int count;
};

// An array of mjModel whose values may differ from row to row.
struct OwnNumbers {
  double* Lanes::*numbers;
  int count;
  const mjtNum* (*of)(const mjModel& model);
  bool are_shared = false;  // the lanes hold the numbers that all rows share
};

// Makes a view of a row's model that lists only the pairs of geoms that are near each other.
class RowModel {
 public:
  // pairs: the model's list of pairs; null if MuJoCo searches for pairs.
  explicit RowModel(const Pairs* pairs) {
    if (pairs) near_ = *pairs;
  }
  RowModel(const RowModel&) = delete;
  RowModel& operator=(const RowModel&) = delete;

  // Sets the row's model. can_change: its numbers may have changed since the last call with the same model.
  void follow(const mjModel& model, bool can_change) {
    if (!can_change && all_ == &model) return;
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

// Lists the arrays of Lanes, and the array of mjData or mjModel to which each belongs.
class LaneArrays {
 public:
  explicit LaneArrays(const mjModel& model);

  std::size_t bytes(int width) const { return Memory<Lanes>::bytes(width, counts_); }

 protected:
  const mjModel& m_;
  std::vector<LaneArray> state_, control_, input_, forces_, shown_, others_, for_limits_, for_equality_, for_geoms_,
      for_contacts_, for_solver_, for_sensors_, from_solver_, warmstart_, of_euler_, poses_, motions_, lengths_,
      speeds_, actuation_, passive_, tendons_, moments_, sensed_, for_rays_, after_constraints_, for_cameras_, cameras_,
      for_implicit_, integrated_;
  std::vector<OwnNumbers> own_;
  std::vector<OwnNumbers> frames_;  // those that the lanes hold only if rows have their own
  Counts<Lanes> counts_;
  int longest_ = 1;  // the greatest count of an array that is copied from or to mjData
};

// The lists are in the order of mj_forward. shown_ lists what mjenv_sim shows to callbacks.
LaneArrays::LaneArrays(const mjModel& model) : m_(model) {
  using L = Lanes;
  using D = mjData;
  const int nq = m_.nq, nv = m_.nv, nu = m_.nu, nbody = m_.nbody, njnt = m_.njnt, nM = m_.nM;
  state_ = {{&L::qpos, &D::qpos, nq},
            {&L::qvel, &D::qvel, nv},
            {&L::mocap_quat, &D::mocap_quat, 4 * m_.nmocap},
            {&L::act, &D::act, m_.na}};
  forces_ = {{&L::qfrc_applied, &D::qfrc_applied, nv}, {&L::xfrc_applied, &D::xfrc_applied, 6 * nbody}};
  control_ = {{&L::ctrl, &D::ctrl, nu}};
  input_ = {{&L::qpos, &D::qpos, nq},
            {&L::qvel, &D::qvel, nv},
            {&L::act, &D::act, m_.na},
            {&L::ctrl, &D::ctrl, nu},
            {&L::mocap_pos, &D::mocap_pos, 3 * m_.nmocap},
            {&L::mocap_quat, &D::mocap_quat, 4 * m_.nmocap}};
  shown_ = {{&L::xpos, &D::xpos, 3 * nbody},
            {&L::xquat, &D::xquat, 4 * nbody},
            {&L::xmat, &D::xmat, 9 * nbody},
            {&L::xipos, &D::xipos, 3 * nbody},
            {&L::ximat, &D::ximat, 9 * nbody},
            {&L::xanchor, &D::xanchor, 3 * njnt},
            {&L::xaxis, &D::xaxis, 3 * njnt},
            {&L::site_xpos, &D::site_xpos, 3 * m_.nsite},
            {&L::site_xmat, &D::site_xmat, 9 * m_.nsite},
            {&L::subtree_com, &D::subtree_com, 3 * nbody},
            {&L::cinert, &D::cinert, 10 * nbody},
            {&L::ten_length, &D::ten_length, m_.ntendon},
            {&L::actuator_length, &D::actuator_length, nu},
            {&L::ten_velocity, &D::ten_velocity, m_.ntendon},
            {&L::actuator_velocity, &D::actuator_velocity, nu},
            {&L::cvel, &D::cvel, 6 * nbody},
            {&L::qfrc_bias, &D::qfrc_bias, nv},
            {&L::qfrc_passive, &D::qfrc_passive, nv},
            {&L::actuator_force, &D::actuator_force, nu},
            {&L::qfrc_actuator, &D::qfrc_actuator, nv}};
  others_ = {{&L::geom_xpos, &D::geom_xpos, 3 * m_.ngeom},
             {&L::geom_xmat, &D::geom_xmat, 9 * m_.ngeom},
             {&L::cdof, &D::cdof, 6 * nv},
             {&L::crb, &D::crb, 10 * nbody},
             {&L::qM, &D::qM, nM},
             {&L::qLD, &D::qLD, nM},
             {&L::qLDiagInv, &D::qLDiagInv, nv},
             {&L::qLDiagSqrtInv, &D::qLDiagSqrtInv, nv},
             {&L::cdof_dot, &D::cdof_dot, 6 * nv},
             {&L::act_dot, &D::act_dot, m_.na},
             {&L::qfrc_smooth, &D::qfrc_smooth, nv},
             {&L::qacc_smooth, &D::qacc_smooth, nv}};
  tendons_ = {{&L::ten_J, &D::ten_J, m_.ntendon * nv}};
  for_limits_ = {
      {&L::qpos, &D::qpos, nq}, {&L::ten_length, &D::ten_length, m_.ntendon}, {&L::qacc_smooth, &D::qacc_smooth, nv}};
  for_equality_ = {{&L::xpos, &D::xpos, 3 * nbody}, {&L::xquat, &D::xquat, 4 * nbody}, {&L::xmat, &D::xmat, 9 * nbody}};
  for_geoms_ = {{&L::geom_xpos, &D::geom_xpos, 3 * m_.ngeom}, {&L::geom_xmat, &D::geom_xmat, 9 * m_.ngeom}};
  for_contacts_ = {{&L::subtree_com, &D::subtree_com, 3 * nbody}, {&L::cdof, &D::cdof, 6 * nv}};
  for_solver_ = {{&L::qvel, &D::qvel, nv},
                 {&L::qM, &D::qM, nM},
                 {&L::qLD, &D::qLD, nM},
                 {&L::qLDiagInv, &D::qLDiagInv, nv},
                 {&L::qLDiagSqrtInv, &D::qLDiagSqrtInv, nv},
                 {&L::qfrc_smooth, &D::qfrc_smooth, nv}};
  for_sensors_ = {{&L::geom_xpos, &D::geom_xpos, 3 * m_.ngeom},
                  {&L::geom_xmat, &D::geom_xmat, 9 * m_.ngeom},
                  {&L::cdof, &D::cdof, 6 * nv},
                  {&L::cdof_dot, &D::cdof_dot, 6 * nv}};
  after_constraints_ = {{&L::cacc_ext, &D::cacc, 6 * nbody},
                        {&L::cfrc_int, &D::cfrc_int, 6 * nbody},
                        {&L::cfrc_ext, &D::cfrc_ext, 6 * nbody}};
  sensed_ = {{&L::sensordata, &D::sensordata, m_.nsensordata}};
  const int ncam = sees_from_cameras(m_) ? m_.ncam : 0;
  cameras_ = {{&L::cam_xpos, &D::cam_xpos, 3 * ncam}, {&L::cam_xmat, &D::cam_xmat, 9 * ncam}};
  for_cameras_ = {{&L::xpos, &D::xpos, 3 * nbody},
                  {&L::xquat, &D::xquat, 4 * nbody},
                  {&L::xmat, &D::xmat, 9 * nbody},
                  {&L::subtree_com, &D::subtree_com, 3 * nbody}};
  for_rays_ = {{&L::site_xpos, &D::site_xpos, 3 * m_.nsite},
               {&L::site_xmat, &D::site_xmat, 9 * m_.nsite},
               {&L::geom_xpos, &D::geom_xpos, 3 * m_.ngeom},
               {&L::geom_xmat, &D::geom_xmat, 9 * m_.ngeom}};
  poses_ = {{&L::qpos, &D::qpos, nq},
            {&L::xpos, &D::xpos, 3 * nbody},
            {&L::xquat, &D::xquat, 4 * nbody},
            {&L::xmat, &D::xmat, 9 * nbody},
            {&L::xipos, &D::xipos, 3 * nbody},
            {&L::ximat, &D::ximat, 9 * nbody},
            {&L::geom_xpos, &D::geom_xpos, 3 * m_.ngeom},
            {&L::geom_xmat, &D::geom_xmat, 9 * m_.ngeom},
            {&L::site_xpos, &D::site_xpos, 3 * m_.nsite},
            {&L::site_xmat, &D::site_xmat, 9 * m_.nsite},
            {&L::subtree_com, &D::subtree_com, 3 * nbody},
            {&L::cdof, &D::cdof, 6 * nv}};
  motions_ = {{&L::qvel, &D::qvel, nv}, {&L::act, &D::act, m_.na}, {&L::cvel, &D::cvel, 6 * nbody}};
  lengths_ = {{&L::ten_length, &D::ten_length, m_.ntendon}, {&L::actuator_length, &D::actuator_length, nu}};
  speeds_ = {{&L::ten_velocity, &D::ten_velocity, m_.ntendon}, {&L::actuator_velocity, &D::actuator_velocity, nu}};
  actuation_ = {{&L::actuator_force, &D::actuator_force, nu},
                {&L::qfrc_actuator, &D::qfrc_actuator, nv},
                {&L::act_dot, &D::act_dot, m_.na}};
  moments_ = {{&L::actuator_moment, &D::actuator_moment, has_moments(m_) ? nu * nv : 0}};
  passive_ = {{&L::qfrc_passive, &D::qfrc_passive, nv}};
  from_solver_ = {{&L::qacc, &D::qacc, nv}, {&L::qfrc_constraint, &D::qfrc_constraint, nv}};
  warmstart_ = {{&L::qacc, &D::qacc_warmstart, nv}};
  of_euler_ = {{&L::qH, &D::qH, nM}, {&L::qHDiagInv, &D::qHDiagInv, nv}};
  for_implicit_ = {{&L::cinert, &D::cinert, 10 * nbody},
                   {&L::cdof_dot, &D::cdof_dot, 6 * nv},
                   {&L::qM, &D::qM, nM},
                   {&L::qfrc_smooth, &D::qfrc_smooth, nv},
                   {&L::act_dot, &D::act_dot, m_.na}};
  integrated_ = {{&L::qpos, &D::qpos, nq}, {&L::qvel, &D::qvel, nv}, {&L::act, &D::act, m_.na}};

  const int sensing = m_.nsensor > 0 ? nbody : 0;
  // Arrays of Lanes that are not copied from or to mjData.
  const std::vector<std::pair<double * Lanes::*, int>> more{{&L::body_vel, 6 * sensing},
                                                            {&L::subtree_linvel, 3 * sensing},
                                                            {&L::subtree_angmom, 3 * sensing},
                                                            {&L::angle, njnt},
                                                            {&L::sine, njnt},
                                                            {&L::cosine, njnt},
                                                            {&L::cacc, 6 * nbody},
                                                            {&L::cfrc_body, 6 * nbody},
                                                            {&L::MhB, nM},
                                                            {&L::qacc_euler, nv},
                                                            {&L::X_qpos, nq},
                                                            {&L::X_qvel, 4 * nv},
                                                            {&L::F, 4 * nv},
                                                            {&L::dX, 2 * nv},
                                                            {&L::X_act, m_.na},
                                                            {&L::F_act, 4 * m_.na},
                                                            {&L::com_scale, nbody},
                                                            {&L::viscous_torque, nbody},
                                                            {&L::viscous_force, nbody},
                                                            {&L::torque_drag, 3 * nbody},
                                                            {&L::force_drag, 3 * nbody}};
  own_ = {
      {&L::body_mass, nbody, [](const mjModel& m) -> const mjtNum* { return m.body_mass; }},
      {&L::body_subtreemass, sensing, [](const mjModel& m) -> const mjtNum* { return m.body_subtreemass; }},
      {&L::sensor_cutoff, m_.nsensor, [](const mjModel& m) -> const mjtNum* { return m.sensor_cutoff; }},
      {&L::body_inertia, 3 * nbody, [](const mjModel& m) -> const mjtNum* { return m.body_inertia; }},
      {&L::body_ipos, 3 * nbody, [](const mjModel& m) -> const mjtNum* { return m.body_ipos; }},
      {&L::jnt_stiffness, njnt, [](const mjModel& m) -> const mjtNum* { return m.jnt_stiffness; }},
      {&L::dof_armature, nv, [](const mjModel& m) -> const mjtNum* { return m.dof_armature; }},
      {&L::dof_damping, nv, [](const mjModel& m) -> const mjtNum* { return m.dof_damping; }},
      {&L::dof_M0, nv, [](const mjModel& m) -> const mjtNum* { return m.dof_M0; }},
      {&L::tendon_lengthspring, m_.ntendon, [](const mjModel& m) -> const mjtNum* { return m.tendon_lengthspring; }},
      {&L::tendon_length0, m_.ntendon, [](const mjModel& m) -> const mjtNum* { return m.tendon_length0; }},
      {&L::tendon_range, 2 * m_.ntendon, [](const mjModel& m) -> const mjtNum* { return m.tendon_range; }},
      {&L::tendon_margin, m_.ntendon, [](const mjModel& m) -> const mjtNum* { return m.tendon_margin; }},
      {&L::eq_data, mjNEQDATA * m_.neq, [](const mjModel& m) -> const mjtNum* { return m.eq_data; }},
      {&L::actuator_gainprm, mjNGAIN * nu, [](const mjModel& m) -> const mjtNum* { return m.actuator_gainprm; }},
      {&L::actuator_biasprm, mjNBIAS * nu, [](const mjModel& m) -> const mjtNum* { return m.actuator_biasprm; }},
      {&L::actuator_acc0, nu, [](const mjModel& m) -> const mjtNum* { return m.actuator_acc0; }},
      {&L::jnt_range, 2 * njnt, [](const mjModel& m) -> const mjtNum* { return m.jnt_range; }},
      {&L::jnt_margin, njnt, [](const mjModel& m) -> const mjtNum* { return m.jnt_margin; }},
      {&L::cam_quat, 4 * ncam, [](const mjModel& m) -> const mjtNum* { return m.cam_quat; }},
      {&L::wrap_prm, m_.nwrap, [](const mjModel& m) -> const mjtNum* { return m.wrap_prm; }},
      {&L::geom_size, 3 * m_.ngeom, [](const mjModel& m) -> const mjtNum* { return m.geom_size; }},
      {&L::gravity, 3, [](const mjModel& m) -> const mjtNum* { return m.opt.gravity; }}};
  frames_ = {{&L::body_pos, 3 * nbody, [](const mjModel& m) -> const mjtNum* { return m.body_pos; }},
             {&L::body_quat, 4 * nbody, [](const mjModel& m) -> const mjtNum* { return m.body_quat; }},
             {&L::geom_pos, 3 * m_.ngeom, [](const mjModel& m) -> const mjtNum* { return m.geom_pos; }},
             {&L::geom_quat, 4 * m_.ngeom, [](const mjModel& m) -> const mjtNum* { return m.geom_quat; }},
             {&L::site_pos, 3 * m_.nsite, [](const mjModel& m) -> const mjtNum* { return m.site_pos; }},
             {&L::site_quat, 4 * m_.nsite, [](const mjModel& m) -> const mjtNum* { return m.site_quat; }}};
  const auto add = [&](double* Lanes::*array, int count) {
    counts_.emplace_back(array, static_cast<std::size_t>(count));
  };
  for (const auto& [array, count] : more) add(array, count);
  for (const auto* list : {&own_, &frames_})
    for (const OwnNumbers& own : *list) add(own.numbers, own.count);
  for (const auto* list : {&input_, &forces_, &shown_, &tendons_, &moments_, &sensed_, &cameras_, &after_constraints_,
                           &others_, &from_solver_, &of_euler_})
    for (const LaneArray& array : *list) {
      add(array.numbers, array.count);
      longest_ = std::max(longest_, array.count);
    }
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
  Lanes lanes_{};
  Memory<Lanes> memory_;
  std::vector<std::unique_ptr<RowModel>> models_;
  const bool searches_;                     // MuJoCo searches for pairs of geoms: the model has no list
  std::unique_ptr<Solver> solver_;          // null if MuJoCo solves the constraints row by row
  std::unique_ptr<ConstraintMaker> maker_;  // null if MuJoCo makes the constraints row by row
  bool makes_ = false;                      // whether maker_ can make the constraints of this step's rows
  const SensorNeeds sensors_;
  const bool senses_in_lanes_, has_rangefinders_, sees_from_cameras_;
  bool reads_forces_ = false;  // whether somebody reads what mj_rnePostConstraint computes after this step
  bool is_whole_ = true;       // whether this step must leave all of mjData as MuJoCo does
  std::vector<unsigned char> may_touch_;
  std::vector<double> spare_;  // where scatter writes the numbers of lanes without a row
  std::array<const mjModel*, kMaxWidth> row_models_{};
  std::array<const float*, kMaxWidth> heights_{};  // the rows' hfield_data
  std::array<mjData*, kMaxWidth> data_{};
  int count_ = 0;
  std::uint32_t all_ = 0;  // the lanes that have a row, as bits

  void set_world();
  bool has_shared_ = false;   // no row has numbers of mjModel of its own
  bool has_changed_ = false;  // a row's own numbers of mjModel differ from those of the last step
  bool gather_own(OwnNumbers& own, bool must_hold);
  void gather_own();
  void gather_forces(Work* const* works);
  void gather(const std::vector<LaneArray>& arrays);
  void scatter(const std::vector<LaneArray>& arrays);
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
  void actuate_row_by_row();
  void compute_passive_row_by_row();
  void collide();
  void search();
  void constrain(bool is_held);
  void sense_in_lanes();
  void sense_row_by_row(bool holds_constraints);
  void show();
  bool shows_current() const;
  void show_current(Work* const* works);
  void integrate(bool is_last);
  void integrate_singly();
  void scatter_moments();
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
      memory_(lanes_, code.width, counts_),
      searches_(!model.pairs()),
      solver_(Solver::make(code, m_)),
      maker_(solver_ ? ConstraintMaker::make(code, m_, tables_) : nullptr),
      sensors_(sensor_needs(m_)),
      senses_in_lanes_(senses_in_lanes(m_)),
      has_rangefinders_(has_rangefinders(m_)),
      sees_from_cameras_(sees_from_cameras(m_)),
      may_touch_(tables_.pairs.size()),
      spare_(static_cast<std::size_t>(longest_)) {
  const auto fill = [&](double* array, const std::vector<double>& numbers) {
    for (std::size_t i = 0; i < numbers.size(); ++i)
      std::fill_n(array + i * static_cast<std::size_t>(code.width), code.width, numbers[i]);
  };
  if (tables_.has_moments) fill(lanes_.actuator_moment, tables_.actuator_moment);
  set_world();
  for (int row = 0; row < code.width; ++row) models_.push_back(std::make_unique<RowModel>(model.pairs()));
  lanes_.model = &m_;
  lanes_.tendon_dof_adr = tables_.tendon_dof_adr.data();
  lanes_.tendon_dofs = tables_.tendon_dofs.data();
  lanes_.columns = tables_.columns.data();
  lanes_.segments = tables_.segments.data();
  lanes_.segment_adr = tables_.segment_adr.data();
  lanes_.actuators = tables_.actuators.data();
  lanes_.has_negative_zeros = tables_.has_negative_zeros;
  lanes_.has_damping = tables_.has_damping;
  lanes_.has_single_passive = single_.passive;
  lanes_.has_single_actuation = single_.actuation;
  lanes_.is_still_tendon = tables_.is_still_tendon.data();
  lanes_.fluid_bodies = tables_.fluid_bodies.data();
  lanes_.fluid_body_count = static_cast<int>(tables_.fluid_bodies.size());
  lanes_.pairs = tables_.pairs.data();
  lanes_.pair_count = static_cast<int>(tables_.pairs.size());
  lanes_.box_pairs = tables_.box_pairs.data();
  lanes_.boxes = tables_.boxes.data();
  lanes_.may_touch = may_touch_.data();
}

// Returns whether all rows have the shared model's numbers. must_hold: the lanes must hold the rows' numbers
// afterwards, so they are gathered, unless the lanes hold the shared ones already.
bool LaneStepper::gather_own(OwnNumbers& own, bool must_hold) {
  std::array<const double*, kMaxWidth> from{};
  bool are_shared = true;
  for (int lane = 0; lane < code_.width; ++lane) {
    from[lane] = own.of(*row_models_[lane < count_ ? lane : 0]);
    are_shared &= from[lane] == own.of(m_);
  }
  if (!must_hold || (own.are_shared && are_shared)) return are_shared;
  code_.gather(lanes_.*own.numbers, from.data(), own.count);
  own.are_shared = are_shared;
  has_changed_ = true;
  return are_shared;
}

// Gathers the rows' numbers of mjModel. Those that all rows share stay in the lanes from step to step.
void LaneStepper::gather_own() {
  for (int row = 0; row < count_; ++row) models_[row]->follow(*row_models_[row], row_models_[row] != &m_);
  const bool had_shared = has_shared_;
  has_shared_ = std::all_of(row_models_.begin(), row_models_.begin() + count_,
                            [&](const mjModel* model) { return model == &m_; });
  if (has_shared_ && had_shared) return;
  const bool had_own_frames = lanes_.has_own_frames;
  has_changed_ = lanes_.has_own_frames = false;
  lanes_.has_own_sizes = false;
  for (OwnNumbers& own : own_)
    if (!gather_own(own, true) && own.numbers == &Lanes::geom_size) lanes_.has_own_sizes = true;
  for (OwnNumbers& own : frames_) lanes_.has_own_frames |= !gather_own(own, false);
  for (OwnNumbers& own : frames_) gather_own(own, lanes_.has_own_frames);
  if (has_changed_ || had_own_frames != lanes_.has_own_frames) {
    code_.adopt(lanes_);
    // obstacle() refuses a shared model with numbers that are not finite or too large. Rows with such numbers of their
    // own are left to MuJoCo.
    for (const OwnNumbers& own : own_)
      if (!own.are_shared) lanes_.unlike |= code_.bad(lanes_.*own.numbers, own.count);
    for (const OwnNumbers& own : frames_)
      if (lanes_.has_own_frames && !own.are_shared) lanes_.unlike |= code_.bad(lanes_.*own.numbers, own.count);
  }
  lanes_.heights = nullptr;
  for (int lane = 0; lane < code_.width; ++lane) {
    heights_[lane] = row_models_[lane < count_ ? lane : 0]->hfield_data;
    if (heights_[lane] != m_.hfield_data) lanes_.heights = heights_.data();
  }
}

// Copies the rows' arrays to lanes. Lanes without a row get a copy of the first row.
void LaneStepper::gather(const std::vector<LaneArray>& arrays) {
  std::array<const double*, kMaxWidth> from{};
  for (const LaneArray& array : arrays) {
    for (int lane = 0; lane < code_.width; ++lane) from[lane] = data_[lane < count_ ? lane : 0]->*array.data;
    code_.gather(lanes_.*array.numbers, from.data(), array.count);
  }
}

void LaneStepper::scatter(const std::vector<LaneArray>& arrays) {
  std::array<double*, kMaxWidth> to{};
  for (const LaneArray& array : arrays) {
    for (int lane = 0; lane < code_.width; ++lane) to[lane] = lane < count_ ? data_[lane]->*array.data : spare_.data();
    code_.scatter(to.data(), lanes_.*array.numbers, array.count);
  }
}

// Copies qfrc_applied and xfrc_applied to lanes, unless they are 0 in all rows, as in most environments.
void LaneStepper::gather_forces(Work* const* works) {
  lanes_.has_forces = false;
  for (int row = 0; row < count_; ++row) lanes_.has_forces |= works[row]->has_forces();
  if (!lanes_.has_forces) return;
  gather(forces_);
  for (const LaneArray& array : forces_) leave_bad(lanes_.*array.numbers, array.count);
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
    row_models_[row] = &works[row]->stepped();
    data_[row] = works[row]->data();
  }
  // With RK4, MuJoCo computes sensors before the other stages and the forces after them, in the same arrays. Lanes do
  // not compute both, so if both are read, the step leaves all of mjData as MuJoCo does.
  reads_forces_ = works[0]->reads_forces();
  is_whole_ =
      works[0]->reads_all() || (reads_forces_ && sensors_ != SensorNeeds::nothing && m_.opt.integrator == mjINT_RK4);
  gather_own();
  makes_ = maker_ && maker_->follow(row_models_, count);
  lanes_.left_to_mujoco = lanes_.unlike;
  gather(input_);
  gather_forces(works);
  leave_bad(lanes_.act, m_.na);
  leave_bad(lanes_.ctrl, m_.nu);
  leave_bad(lanes_.mocap_pos, 3 * m_.nmocap);
  leave_bad(lanes_.mocap_quat, 4 * m_.nmocap);
  for (std::int64_t frame = 1; frame <= frames; ++frame) {
    const bool is_last = frame == frames;
    leave_bad(lanes_.qpos, m_.nq);
    leave_bad(lanes_.qvel, m_.nv);
    if (before_substep || is_last) scatter(state_);
    if (before_substep) {
      for_live_rows([&](int row, const mjModel& /*m*/, mjData& /*d*/) { (*before_substep)(row, frame - 1); });
      gather(control_);
      gather_forces(works);
      leave_bad(lanes_.ctrl, m_.nu);
    }
    for (int row = 0; row < count && is_last; ++row) works[row]->save(before[row]);
    forward({is_last && m_.opt.integrator != mjINT_RK4, is_last && sensors_ != SensorNeeds::nothing});
    integrate(is_last);
    if (live() == 0) return 0;
    for (int row = 0; row < count && !single_.integration; ++row) data_[row]->time += m_.opt.timestep;
  }
  leave_bad(lanes_.qpos, m_.nq);
  leave_bad(lanes_.qvel, m_.nv);
  const bool computes_forces = reads_forces_ && !is_whole_;
  if (computes_forces) {
    code_.rnePostConstraint(lanes_, maker_->found(), solver_->constraints());
    scatter(after_constraints_);
  }
  scatter(state_);
  if (is_whole_ && !single_.actuation) scatter_moments();
  const bool is_current = works[0]->keeps_current(), is_shown = is_current && shows_current();
  if (is_shown) show_current(works);
  for (int row = 0; row < count; ++row) works[row]->note_step(is_whole_, is_shown, computes_forces);
  return live();
}

// Whether lanes can compute what callbacks see of the new state. If not, Work::note_step calls mj_step1 row by row.
bool LaneStepper::shows_current() const {
  return !is_whole_ && !single_.actuation && !single_.passive &&
         (sensors_ == SensorNeeds::nothing || !reads_constraints_before_forces(m_));
}

// Computes the stages of mj_step1 for the new state, except constraints, which nobody reads.
void LaneStepper::show_current(Work* const* works) {
  for (int row = 0; row < count_; ++row) works[row]->keep_raw_qpos();
  code_.kinematics(lanes_);
  code_.comPos(lanes_);
  code_.tendon(lanes_);
  code_.transmission(lanes_);
  code_.fwdVelocity(lanes_);
  code_.comVel(lanes_);
  code_.passive(lanes_);
  code_.rne(lanes_);
  scatter(state_);
  scatter(shown_);
  if (sensors_ == SensorNeeds::nothing) return;
  scatter(for_sensors_);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { sense_state(m, d); });
}

// mj_forward. The order differs from MuJoCo's where that does not change the results: constraints come last, before
// sensors and energies.
void LaneStepper::forward(Readers readers) {
  code_.kinematics(lanes_);
  code_.comPos(lanes_);
  if (single_.actuation || single_.passive) scatter(poses_);
  if (!single_.actuation) code_.tendon(lanes_);
  code_.crb(lanes_);
  code_.factorM(lanes_);
  if (!single_.actuation) {
    code_.transmission(lanes_);
    code_.fwdVelocity(lanes_);
  }
  code_.comVel(lanes_);
  if (single_.actuation || single_.passive) scatter(motions_);
  if (single_.actuation) actuate_row_by_row();
  if (single_.passive)
    compute_passive_row_by_row();
  else
    code_.passive(lanes_);
  code_.rne(lanes_);
  if (!single_.actuation) code_.fwdActuation(lanes_);
  code_.fwdAcceleration(lanes_);
  leave_bad(lanes_.qacc_smooth, m_.nv);
  if (live() == 0) return;
  const bool reads_constraints = readers.sensors && sensors_ == SensorNeeds::constraints;
  const bool is_made = makes_ && !(readers.after_step && is_whole_) &&
                       !(reads_constraints && (is_whole_ || !senses_in_lanes_)) && constrain_in_lanes();
  if (readers.after_step && reads_forces_ && !is_made) is_whole_ = true;
  const bool is_held = (readers.after_step && is_whole_) || reads_constraints;
  if (!is_made) {
    scatter(for_limits_);
    collide();
    constrain(is_held);
  } else if (readers.after_step || readers.sensors) {
    scatter(from_solver_);
  }
  leave_bad(lanes_.qacc, m_.nv);  // as mj_checkAcc
  if (readers.sensors && senses_in_lanes_ && !is_whole_ && (is_made || !reads_constraints))
    sense_in_lanes();
  else if (readers.sensors)
    sense_row_by_row(is_held);
  if (readers.after_step) show();
}

// MuJoCo's functions compute tendons and actuators row by row.
void LaneStepper::actuate_row_by_row() {
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) {
    mj_tendon(&m, &d);
    mj_transmission(&m, &d);
    if (mj_isSparse(&m))
      mju_mulMatVecSparse(d.ten_velocity, d.ten_J, d.qvel, m_.ntendon, d.ten_J_rownnz, d.ten_J_rowadr, d.ten_J_colind,
                          nullptr);
    else
      mju_mulMatVec(d.ten_velocity, d.ten_J, d.qvel, m_.ntendon, m_.nv);
    mju_mulMatVec(d.actuator_velocity, d.actuator_moment, d.qvel, m_.nu, m_.nv);
    mj_fwdActuation(&m, &d);
  });
  for (const auto* list : {&lengths_, &speeds_, &actuation_}) gather(*list);
  if (!mj_isSparse(&m_)) gather(tendons_);
}

// MuJoCo's functions compute the passive forces row by row.
void LaneStepper::compute_passive_row_by_row() {
  if (!single_.actuation) {
    scatter(lengths_);
    scatter(speeds_);
    scatter(tendons_);
  }
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_passive(&m, &d); });
  gather(passive_);
}

void LaneStepper::sense_in_lanes() {
  static const Contacts kNoContacts{};
  static const Constraints kNoConstraints{};
  if (sees_from_cameras_) {
    scatter(for_cameras_);
    for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_camlight(&m, &d); });
    gather(cameras_);
  }
  if (sensors_ == SensorNeeds::constraints)
    code_.sensors(lanes_, maker_->found(), solver_->constraints());
  else
    code_.sensors(lanes_, kNoContacts, kNoConstraints);
  scatter(sensed_);
  if (has_rangefinders_) scatter(for_rays_);
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { sense_singly(m, d); });
}

void LaneStepper::sense_row_by_row(bool holds_constraints) {
  scatter(shown_);
  scatter(state_);
  scatter(for_sensors_);
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) { sense(m, d, holds_constraints); });
}

// Writes to mjData what callbacks can read, and everything else if somebody reads it (is_whole_).
void LaneStepper::show() {
  scatter(shown_);
  if (!is_whole_) return;
  scatter(others_);
  if (!single_.actuation) scatter(tendons_);
  const bool has_paths = !tables_.segments.empty(), has_energy = (m_.opt.enableflags & mjENBL_ENERGY) != 0;
  if (!has_paths && !has_energy) return;
  scatter(state_);
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
  scatter(warmstart_);
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
  if ((near & live()) != 0) scatter(for_geoms_);
  for_live_rows([&](int row, const mjModel& /*m*/, mjData& d) {
    if (near >> row & 1)
      mj_collision(&models_[row]->with_near_pairs(row, may_touch_.data()), &d);
    else
      d.ncon = 0;
  });
}

// Calls mj_collision row by row, with MuJoCo's own search for pairs. A model with a list of pairs does not compute the
// frames of geoms that only the search reads, so this computes them.
void LaneStepper::search() {
  scatter(searches_ ? for_geoms_ : poses_);
  for_live_rows([&](int /*row*/, const mjModel& m, mjData& d) {
    for (int geom = 0; geom < m.ngeom && !searches_; ++geom) update_frame(m, d, geom);
    mj_collision(&m, &d);
  });
}

// MuJoCo makes the constraints row by row, and lanes solve them if they can. is_held: mjData must hold the constraints
// and their forces afterwards.
void LaneStepper::constrain(bool is_held) {
  int contacts = 0;
  std::uint32_t constrained = 0, solvable = 0;
  for_live_rows([&](int /*row*/, const mjModel& /*m*/, mjData& d) { contacts += d.ncon; });
  if (contacts > 0 || m_.neq > 0) scatter(for_contacts_);
  if (m_.neq > 0) scatter(for_equality_);
  if (!single_.actuation) scatter(tendons_);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    mj_makeConstraint(&m, &d);
    if (d.nefc > 0) constrained |= 1u << row;
    if (solver_ && solver_->solves(d)) solvable |= 1u << row;
  });
  if ((solvable & (solvable - 1)) == 0) solvable = 0;  // for a single row, MuJoCo's solver is faster
  if ((constrained & ~solvable) != 0) scatter(for_solver_);
  for_live_rows([&](int row, const mjModel& m, mjData& d) {
    if (solvable >> row & 1) return;
    if (d.nefc > 0) {
      mj_projectConstraint(&m, &d);
      mj_referenceConstraint(&m, &d);
    }
    mj_fwdConstraint(&m, &d);
  });
  if (solvable != 0) solver_->solve(lanes_, solvable, row_models_, data_, is_held);
  if (constrained != 0) return gather(from_solver_);
  const auto count = static_cast<std::size_t>(m_.nv) * static_cast<std::size_t>(code_.width);
  std::copy_n(lanes_.qacc_smooth, count, lanes_.qacc);
  std::fill_n(lanes_.qfrc_constraint, count, 0.0);
}

// Copies the moments of actuators to mjData. The lanes have no array of the moments that do not depend on the state.
void LaneStepper::scatter_moments() {
  if (tables_.has_moments) return scatter(moments_);
  for (int row = 0; row < count_; ++row)
    std::copy(tables_.actuator_moment.begin(), tables_.actuator_moment.end(), data_[row]->actuator_moment);
}

// MuJoCo's function integrates row by row. It also advances the time.
void LaneStepper::integrate_singly() {
  for (const auto* list : {&poses_, &motions_, &for_implicit_, &from_solver_}) scatter(*list);
  if (!single_.actuation) {
    scatter(speeds_);
    scatter(lengths_);
    scatter(tendons_);
    scatter_moments();
  }
  for_live_rows([](int /*row*/, const mjModel& m, mjData& d) { mj_implicit(&m, &d); });
  gather(integrated_);
}

void LaneStepper::integrate(bool is_last) {
  if (single_.integration) return integrate_singly();
  if (m_.opt.integrator == mjINT_EULER) {
    code_.Euler(lanes_);
    code_.advanceActivations(lanes_, 0);
    if (is_last && is_whole_ && tables_.has_damping) scatter(of_euler_);
    return;
  }
  for (int stage = 1; stage < 4; ++stage) {
    code_.RungeKutta(lanes_, stage);
    code_.advanceActivations(lanes_, stage);
    leave_bad(lanes_.qpos, m_.nq);
    leave_bad(lanes_.qvel, m_.nv);
    if (live() == 0) return;
    // mj_RungeKutta keeps four X, four F and dX on mjData's stack. This leaves less of it for constraints, so MuJoCo
    // may fail. Marking as much of the stack as used makes the same happen here. The stack is large enough for these
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

int best_width(const Model& model, std::int64_t rows) {
  int best = 0;
  for (const int width : widths())
    if (width <= kBestWidth && width <= rows) best = width;
  return obstacle(model).empty() ? best : 0;
}

std::size_t stepper_bytes(const Model& model, int width) {
  const mjModel& m = *model.stepped();
  const auto tables = static_cast<std::size_t>(m.ntendon + m.nu) * static_cast<std::size_t>(m.nv);  // of ModelTables
  return LaneArrays(m).bytes(width) + Solver::bytes(width, m) + tables * sizeof(double);
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
