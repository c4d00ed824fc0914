#include "engine/work.hpp"

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <new>

namespace mjenv::core {
namespace {

constexpr std::array<mjtWarning, 3> divergence{mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC};

template <typename T>
T* put(T* to, const T* from, std::size_t count) {
  return std::copy_n(from, count, to);
}

}  // namespace

void Work::Delete::operator()(mjData_* data) const { mj_deleteData(data); }

Work::Work(std::shared_ptr<const Model> model, int frame_skip) : model_(std::move(model)), layout_(*model_) {
  const ErrorTrap trap(ErrorTrap::Memory::is_checked);
  const mjModel* m = model_->get();
  data_.reset(mj_makeData(m));
  if (!data_) throw std::bad_alloc();
  const mjData* d = data_.get();
  sim_.work_ = this;
  sim_.timestep = m->opt.timestep;
  sim_.dt = m->opt.timestep * frame_skip;
  sim_.view_ = {m->nq,     m->nv,   m->nu,       m->nbody,         m->ntendon,         &d->time,      d->qpos,
                d->qvel,   d->ctrl, m->qpos0,    d->xpos,          d->xipos,           d->site_xpos,  m->body_mass,
                d->cinert, d->cvel, d->cfrc_ext, d->qfrc_actuator, d->qfrc_constraint, d->ten_length, d->ten_velocity};
}

std::vector<Array> Work::arrays() const {
  const mjModel* m = model_->get();
  const mjData* d = data_.get();
  std::vector<Array> list{{"time", MJENV_TYPE_FLOAT64, {}, &d->time},
                          {"energy", MJENV_TYPE_FLOAT64, {2}, d->energy},
                          {"ncon", MJENV_TYPE_INT32, {}, &d->ncon},
                          {"nefc", MJENV_TYPE_INT32, {}, &d->nefc},
                          {"solver_iter", MJENV_TYPE_INT32, {}, &d->solver_iter}};
  MJDATA_POINTERS_PREAMBLE(m)
  const auto add = [&](const char* name, const auto* data, int rows, int columns, bool flat) {
    using T = std::decay_t<decltype(*data)>;
    if constexpr (!std::is_same_v<T, mjContact>) {
      const auto type = std::is_same_v<T, int> ? MJENV_TYPE_INT32 : MJENV_TYPE_FLOAT64;
      list.push_back(
          {name, type, flat ? std::vector<std::int64_t>{rows} : std::vector<std::int64_t>{rows, columns}, data});
    }
  };
#define X(type, name, rows, columns) add(#name, d->name, m->rows, columns, std::string(#columns) == "1");
  MJDATA_POINTERS
#undef X
  return list;
}

void Work::clear() {
  mj_resetData(model_->get(), data_.get());
  forces_lag_ = frames_lag_ = false;
}

void Work::begin() {
  const mjModel* m = model_->get();
  mjData* d = data_.get();
  d->pstack = 0;
  d->time = 0;
  put(d->qpos, m->qpos0, layout_.nq);
  for (mjtNum* array : {d->qvel, d->qacc_warmstart}) std::fill_n(array, layout_.nv, 0.0);
  std::fill_n(d->act, layout_.na, 0.0);
  std::fill_n(d->ctrl, layout_.nu, 0.0);
  for (mjtNum* array : {d->cacc, d->cfrc_int, d->cfrc_ext}) std::fill_n(array, 6 * m->nbody, 0.0);
  std::fill_n(d->qH, m->nM, 0.0);  // only mj_Euler writes these two
  std::fill_n(d->qHDiagInv, layout_.nv, 0.0);
  clear_warnings();
  forces_lag_ = false;
}

void Work::load(const double* state) {
  mjData* d = data_.get();
  d->pstack = 0;  // an error that was thrown out of MuJoCo leaves its stack as it was
  d->time = *state++;
  for (const auto& [array, count] : {std::pair{d->qpos, layout_.nq},
                                     {d->qvel, layout_.nv},
                                     {d->act, layout_.na},
                                     {d->qacc_warmstart, layout_.nv},
                                     {d->ctrl, layout_.nu}}) {
    put(array, state, count);
    state += count;
  }
}

void Work::save(double* state) const {
  const mjData* d = data_.get();
  *state++ = d->time;
  state = put(state, static_cast<const mjtNum*>(d->qpos), layout_.nq);
  state = put(state, static_cast<const mjtNum*>(d->qvel), layout_.nv);
  state = put(state, static_cast<const mjtNum*>(d->act), layout_.na);
  state = put(state, static_cast<const mjtNum*>(d->qacc_warmstart), layout_.nv);
  put(state, static_cast<const mjtNum*>(d->ctrl), layout_.nu);
}

void Work::forward() {
  mj_forward(model_->stepped(), data_.get());
  frames_lag_ = true;
}

void Work::step(const Action& action, std::int64_t frames, double* before) {
  mjData* d = data_.get();
  clear_warnings();
  sim_.action = action;
  for (Eigen::Index i = 0; i < action.count; ++i) d->ctrl[i] = action[i];
  for (std::int64_t i = 1; i < frames; ++i) mj_step(model_->stepped(), d);
  save(before);
  repeat_step();
}

void Work::repeat_step() {
  mj_step(model_->stepped(), data_.get());
  forces_lag_ = frames_lag_ = true;
}

bool Work::on_demand(const std::string& array) {
  constexpr std::array<const char*, 9> names{"cacc",     "cfrc_int", "cfrc_ext",   "geom_xpos", "geom_xmat",
                                             "cam_xpos", "cam_xmat", "light_xpos", "light_xdir"};
  return std::find(names.begin(), names.end(), array) != names.end();
}

void Work::complete() {
  complete_forces();
  if (!frames_lag_) return;
  const mjModel* m = model_->get();
  mjData* d = data_.get();
  for (int g = 0; g < m->ngeom; ++g)
    mj_local2Global(d, d->geom_xpos + 3 * g, d->geom_xmat + 9 * g, m->geom_pos + 3 * g, m->geom_quat + 4 * g,
                    m->geom_bodyid[g], m->geom_sameframe[g]);
  mj_camlight(m, d);
  frames_lag_ = false;
}

void Work::complete_forces() {
  if (!forces_lag_) return;
  mj_rnePostConstraint(model_->get(), data_.get());
  forces_lag_ = false;
}

void Work::clear_warnings() {
  for (const auto kind : divergence) data_->warning[kind].number = 0;
}

bool Work::diverged() const {
  return std::any_of(divergence.begin(), divergence.end(), [&](auto kind) { return data_->warning[kind].number > 0; });
}

Sim::Vec Sim::cfrc_ext(int first) const {
  work_->complete_forces();
  return bodies(view_.cfrc_ext, 6, first);
}

Eigen::Vector2d Sim::mass_center_xy() const {
  Eigen::Vector2d moment(0, 0);
  for (int body = 0; body < view_.nbody; ++body) moment += view_.body_mass[body] * Vec2(view_.xipos + 3 * body);
  return moment / np::sum(Vec(view_.body_mass, view_.nbody));
}

bool Sim::finite() const {
  const auto all_finite = [](const Vec& v) {
    return std::all_of(v.data(), v.data() + v.size(), [](double x) { return std::isfinite(x); });
  };
  return all_finite(qpos()) && all_finite(qvel());
}

}  // namespace mjenv::core
