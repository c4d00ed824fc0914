#include "engine/work.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <utility>

#include "engine/mujoco.hpp"
#include "error.hpp"

namespace mjenv::core {
namespace {

constexpr std::array<mjtWarning, 3> divergence{mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC};

// The arrays that complete_forces and complete_frames compute.
constexpr std::array<const char*, 3> force_arrays{"cacc", "cfrc_int", "cfrc_ext"};
constexpr std::array<const char*, 6> frame_arrays{"geom_xpos", "geom_xmat",  "cam_xpos",
                                                  "cam_xmat",  "light_xpos", "light_xdir"};

// The arrays of mjData in mjenv_sim that are not computed on demand, and the rest of the state.
constexpr std::array<const char*, 29> shown_arrays{"time",
                                                   "qpos",
                                                   "qvel",
                                                   "act",
                                                   "qacc_warmstart",
                                                   "ctrl",
                                                   "qacc",
                                                   "xpos",
                                                   "xquat",
                                                   "xmat",
                                                   "xipos",
                                                   "ximat",
                                                   "xanchor",
                                                   "xaxis",
                                                   "site_xpos",
                                                   "site_xmat",
                                                   "subtree_com",
                                                   "cinert",
                                                   "cvel",
                                                   "sensordata",
                                                   "actuator_length",
                                                   "actuator_velocity",
                                                   "actuator_force",
                                                   "qfrc_actuator",
                                                   "qfrc_passive",
                                                   "qfrc_bias",
                                                   "qfrc_constraint",
                                                   "ten_length",
                                                   "ten_velocity"};

template <typename Names>
bool contains(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool is_force(const std::string& array) { return contains(force_arrays, array); }
bool is_frame(const std::string& array) { return contains(frame_arrays, array); }

// How many points the paths of the tendons have.
std::int64_t path_points(const mjModel& m, const mjData& d) {
  return m.ntendon == 0 ? 0 : std::int64_t{d.ten_wrapadr[m.ntendon - 1]} + d.ten_wrapnum[m.ntendon - 1];
}

// How many elements of an array mjData holds, if that depends on the state (Array::held).
std::function<std::int64_t()> held_elements(const mjModel& m, const mjData& d, const std::string& name) {
  if (name == "wrap_obj") return [&] { return path_points(m, d); };
  if (name == "wrap_xpos") return [&] { return 3 * path_points(m, d); };
  return held_by_constraints(m, d, name);
}

template <typename T>
T* put(T* to, const T* from, std::size_t count) {
  return std::copy_n(from, count, to);
}

}  // namespace

std::optional<StateLayout::Part> StateLayout::part(const std::string& array) const {
  if (kNormalizesMocap && array == "mocap_quat") return Part{size - more, more};
  std::size_t offset = 0;
  for (const auto& [name, count] : {std::pair<const char*, std::size_t>{"time", 1},
                                    {"qpos", nq},
                                    {"qvel", nv},
                                    {"act", na},
                                    {"qacc_warmstart", nv},
                                    {"ctrl", nu}}) {
    if (array == name) return Part{offset, count};
    offset += count;
  }
  return std::nullopt;
}

void Work::Delete::operator()(mjData_* data) const { mj_deleteData(data); }

Work::Work(std::shared_ptr<const Model> model, int frame_skip, const Needs& needs, std::size_t carry_count)
    : model_(std::move(model)), frame_skip_(frame_skip), layout_(*model_), carried_(carry_count), info_(needs.info) {
  const ErrorTrap trap(ErrorTrap::Memory::is_checked);
  const mjModel* m = model_->get();
  data_.reset(mj_makeData(m));
  if (!data_) throw std::bad_alloc();
  action_.assign(layout_.nu, std::numeric_limits<double>::quiet_NaN());
  expose();
  for (const auto& name : needs.arrays) share(name);
  needs_ = needs;
  expose();
}

// Writes the pointers and sizes that callbacks use.
void Work::expose() {
  const mjModel* m = &model();
  const mjData* d = data_.get();
  if (needs_.contacts) contacts_.resize(static_cast<std::size_t>(max_contacts(*m)));
  mjenv_sim& c = sim_;
  c.struct_size = sizeof c;
  c.api = needs_.api;
  const auto size = [](mjtSize count) { return static_cast<std::int32_t>(count); };
  c.nq = size(m->nq), c.nv = size(m->nv), c.na = size(m->na), c.nu = size(m->nu);
  c.nbody = size(m->nbody), c.njnt = size(m->njnt), c.ngeom = size(m->ngeom), c.nsite = size(m->nsite);
  c.ntendon = size(m->ntendon), c.nsensordata = size(m->nsensordata);
  c.timestep = m->opt.timestep;
  c.dt = m->opt.timestep * frame_skip_;
  c.time = &d->time;
  c.action = action_.data();
  c.carried = carried_.data();
  c.qpos = d->qpos, c.qvel = d->qvel, c.act = d->act, c.ctrl = d->ctrl, c.qacc = d->qacc;
  c.xpos = d->xpos, c.xquat = d->xquat, c.xmat = d->xmat, c.xipos = d->xipos, c.ximat = d->ximat;
  c.xanchor = d->xanchor, c.xaxis = d->xaxis;
  c.geom_xpos = needs_.frames ? d->geom_xpos : nullptr;
  c.geom_xmat = needs_.frames ? d->geom_xmat : nullptr;
  c.site_xpos = d->site_xpos, c.site_xmat = d->site_xmat;
  c.subtree_com = d->subtree_com, c.cinert = d->cinert, c.cvel = d->cvel;
  c.cfrc_ext = needs_.forces ? d->cfrc_ext : nullptr;
  c.sensordata = d->sensordata;
  c.actuator_length = d->actuator_length, c.actuator_velocity = d->actuator_velocity;
  c.actuator_force = d->actuator_force;
  c.qfrc_actuator = d->qfrc_actuator, c.qfrc_passive = d->qfrc_passive;
  c.qfrc_bias = d->qfrc_bias, c.qfrc_constraint = d->qfrc_constraint;
  c.ten_length = d->ten_length, c.ten_velocity = d->ten_velocity;
  c.contacts = needs_.contacts ? contacts_.data() : nullptr;
  // A task's initial positions are those that the model had when the task was built, as Gymnasium's init_qpos.
  c.qpos0 = model_->get()->qpos0, c.body_mass = m->body_mass;
  c.arrays = shared_.data();
}

void Work::need(const std::string& what) {
  if (what == "contacts")
    needs_.contacts = true;
  else if (on_demand(what))
    (is_force(what) ? needs_.forces : needs_.frames) = true;
  else
    fail(MJENV_E_NAME, quoted(what) + " is not computed on demand; these are: contacts, " +
                           listed({force_arrays.begin(), force_arrays.end()}) + ", " +
                           listed({frame_arrays.begin(), frame_arrays.end()}));
  expose();
  complete_needs();
}

void Work::expect(const std::string& array) { reads_all_ |= !after_every_step(array); }

const Array& Work::share(const std::string& name) {
  if (data_arrays_.empty()) data_arrays_ = arrays();
  const auto in = [&](const std::vector<Array>& list) {
    const auto found = std::find_if(list.begin(), list.end(), [&](const Array& a) { return a.name == name; });
    return found == list.end() ? nullptr : &*found;
  };
  const Array* found = in(data_arrays_);
  if (found) expect(name);
  if (!found) found = in(model_->arrays());
  if (!found) fail(MJENV_E_NAME, "neither mjData nor mjModel has an array " + quoted(name));
  if (found->stride)
    fail(MJENV_E_NAME, quoted(name) + " does not lie in one piece: ask for \"contacts\" with mjenv_build_need");
  needs_.arrays.push_back(name);
  shared_.push_back(found->data);
  shared_originals_.push_back(found->data);
  if (on_demand(name))
    need(name);
  else
    expose();
  return *found;
}

std::vector<Array> Work::arrays() const {
  const mjModel* m = model_->get();
  const mjData* d = data_.get();
  std::vector<Array> list{{"time", MJENV_TYPE_FLOAT64, {}, &d->time},
                          {"energy", MJENV_TYPE_FLOAT64, {2}, d->energy},
                          {"ncon", MJENV_TYPE_INT32, {}, &d->ncon},
                          {"nefc", MJENV_TYPE_INT32, {}, &d->nefc},
                          {kSolverIterations, MJENV_TYPE_INT32, {}, solver_iterations(*d)}};
  if (kSolverIterationsCount > 1) list.back().shape = {kSolverIterationsCount};
  for_each_array(*m, d,
                 [&](const char* name, const auto* data, std::int64_t rows, std::int64_t columns, bool is_vector) {
                   using T = std::decay_t<decltype(*data)>;
                   if constexpr (!std::is_same_v<T, mjContact> && !std::is_same_v<T, std::uintptr_t>) {
                     const auto type = std::is_same_v<T, int>       ? MJENV_TYPE_INT32
                                       : std::is_same_v<T, mjtBool> ? MJENV_TYPE_UINT8
                                                                    : MJENV_TYPE_FLOAT64;
                     list.push_back({name, type, is_vector ? std::vector{rows} : std::vector{rows, columns}, data, 0,
                                     held_elements(*m, *d, name)});
                   }
                 });
  // Without mu and H, which MuJoCo computes only for elliptic cones: else they hold what was there before.
  const auto add_of_contacts = [&](const char* name, const auto* data, int columns) {
    using T = std::decay_t<decltype(*data)>;
    const auto type = std::is_same_v<T, int> ? MJENV_TYPE_INT32 : MJENV_TYPE_FLOAT64;
    std::vector<std::int64_t> shape{max_contacts(*m)};
    if (columns > 1) shape.push_back(columns);
    list.push_back({name, type, std::move(shape), data, sizeof(mjContact), [d] { return d->ncon; }});
  };
  const mjContact* contact = d->contact;
  add_of_contacts("contact.dist", &contact->dist, 1);
  add_of_contacts("contact.pos", contact->pos, 3);
  add_of_contacts("contact.frame", contact->frame, 9);
  add_of_contacts("contact.includemargin", &contact->includemargin, 1);
  add_of_contacts("contact.friction", contact->friction, 5);
  add_of_contacts("contact.solref", contact->solref, mjNREF);
  add_of_contacts("contact.solimp", contact->solimp, mjNIMP);
  add_of_contacts("contact.dim", &contact->dim, 1);
  add_of_contacts("contact.geom1", &contact->geom1, 1);
  add_of_contacts("contact.geom2", &contact->geom2, 1);
  add_of_contacts("contact.exclude", &contact->exclude, 1);
  add_of_contacts("contact.efc_address", &contact->efc_address, 1);
  return list;
}

void Work::use(const OwnArrays& arrays, std::byte* block) {
  if (!view_) view_.emplace(*model_);
  view_->use(arrays, block);
  const mjModel& m = model();
  sim_.timestep = m.opt.timestep;
  sim_.dt = m.opt.timestep * frame_skip_;
  sim_.body_mass = m.body_mass;
  for (const OwnArray& array : arrays.list()) {
    std::byte* values = block + array.offset;
    if (array.place == OwnArray::Place::data_input) {
      void* input;
      std::memcpy(&input, reinterpret_cast<const std::byte*>(data_.get()) + array.member, sizeof input);
      std::memcpy(input, values, array.bytes);
      continue;
    }
    for (std::size_t i = 0; i < shared_.size(); ++i)
      if (shared_originals_[i] == array.original.data) shared_[i] = values;
  }
}

void Work::apply(const Force& force) {
  std::copy(force.values.begin(), force.values.end(), data_->xfrc_applied + 6 * std::ptrdiff_t{force.body});
}

void Work::clear() {
  mj_resetData(&model(), data_.get());
  put(data_->qpos, model_->get()->qpos0, layout_.nq);
  forces_lag_ = frames_lag_ = false;
  contacts_lag_ = is_whole_ = true;
}

void Work::begin() {
  if (layout_.more > 0) return clear();
  const mjModel* m = model_->get();
  mjData* d = data_.get();
  clear_stack(*d);
  d->time = 0;
  put(d->qpos, m->qpos0, layout_.nq);
  for (mjtNum* array : {d->qvel, d->qacc_warmstart}) std::fill_n(array, layout_.nv, 0.0);
  std::fill_n(d->act, layout_.na, 0.0);
  std::fill_n(d->ctrl, layout_.nu, 0.0);
  for (mjtNum* array : {d->cacc, d->cfrc_int, d->cfrc_ext}) std::fill_n(array, 6 * m->nbody, 0.0);
  clear_caches(*m, *d);
  std::fill_n(d->qHDiagInv, layout_.nv, 0.0);
  clear_warnings();
  forces_lag_ = false;
}

void Work::load(const double* state) {
  mjData* d = data_.get();
  clear_stack(*d);  // an error that is thrown out of MuJoCo does not reset its stack
  clear_warnings();
  diverged_early_ = false;
  d->time = *state++;
  for (const auto& [array, count] : {std::pair{d->qpos, layout_.nq},
                                     {d->qvel, layout_.nv},
                                     {d->act, layout_.na},
                                     {d->qacc_warmstart, layout_.nv},
                                     {d->ctrl, layout_.nu}}) {
    put(array, state, count);
    state += count;
  }
  load_rest(state);
}

void Work::load_rest(const double* rest) {
  if (layout_.more > 0) load_more(*model_->get(), *data_, rest);
}

void Work::save(double* state) const {
  const mjData* d = data_.get();
  *state++ = d->time;
  state = put(state, static_cast<const mjtNum*>(d->qpos), layout_.nq);
  state = put(state, static_cast<const mjtNum*>(d->qvel), layout_.nv);
  state = put(state, static_cast<const mjtNum*>(d->act), layout_.na);
  state = put(state, static_cast<const mjtNum*>(d->qacc_warmstart), layout_.nv);
  state = put(state, static_cast<const mjtNum*>(d->ctrl), layout_.nu);
  if (layout_.more > 0) save_more(*model_->get(), *d, state);
}

void Work::forward() {
  mj_forward(&stepped(), data_.get());
  frames_lag_ = contacts_lag_ = is_whole_ = true;
}

void Work::act(const Action& action) {
  clear_warnings();
  sim_.action_dtype = action.dtype;
  for (std::int64_t i = 0; i < action.count; ++i) data_->ctrl[i] = action[i];
}

void Work::step(std::int64_t frames, double* before) {
  for (std::int64_t i = 1; i < frames; ++i) mj_step(&stepped(), data_.get());
  diverged_early_ = diverged();
  save(before);
  repeat_step();
}

void Work::repeat_step() {
  mj_step(&stepped(), data_.get());
  note_step();
}

bool Work::after_every_step(const std::string& array) { return contains(shown_arrays, array) || is_frame(array); }

bool Work::on_demand(const std::string& array) { return is_force(array) || is_frame(array); }

void Work::complete() {
  complete_forces();
  complete_frames();
}

void Work::complete_frames() {
  if (!frames_lag_) return;
  const mjModel* m = &model();
  mjData* d = data_.get();
  for (int g = 0; g < m->ngeom; ++g) update_frame(*m, *d, g);
  mj_camlight(m, d);
  frames_lag_ = false;
}

void Work::complete_forces() {
  if (!forces_lag_) return;
  mj_rnePostConstraint(&model(), data_.get());
  forces_lag_ = false;
}

void Work::list_contacts() {
  const mjModel* m = &model();
  const mjData* d = data_.get();
  const int count = std::min(d->ncon, max_contacts(*m));
  for (int i = 0; i < count; ++i) {
    const mjContact& from = d->contact[i];
    mjenv_contact& to = contacts_[static_cast<std::size_t>(i)];
    to.geom1 = from.geom1;
    to.geom2 = from.geom2;
    to.distance = from.dist;
    std::copy_n(from.pos, 3, to.position);
    std::copy_n(from.frame, 9, to.frame);
    mj_contactForce(m, d, i, to.force);
  }
  sim_.contact_count = count;
  contacts_lag_ = false;
}

void Work::clear_warnings() {
  for (const auto kind : divergence) data_->warning[kind].number = 0;
}

bool Work::diverged() const {
  return std::any_of(divergence.begin(), divergence.end(), [&](auto kind) { return data_->warning[kind].number > 0; });
}

int Work::constraint_count() const { return data_->nefc; }

bool Work::was_reset() const { return diverged() && resets_diverged(model()); }

}  // namespace mjenv::core
