#include "task/sim_view.hpp"

#include <algorithm>
#include <limits>

#include "engine/mujoco.hpp"
#include "error.hpp"
#include "task/api.hpp"

namespace mjenv::core {

SimView::SimView(Work& work, int frame_skip, const Needs& needs, std::size_t carry_count)
    : work_(work),
      frame_skip_(frame_skip),
      carried_(carry_count),
      action_(work.layout().nu),
      info_(needs.info),
      velocities_(work.layout().nv) {
  if (!needs.action.low.empty()) action_.resize(needs.action.low.size());
  hide_action();
  for (const auto& name : needs.arrays) share(name);
  needs_ = needs;
  work_.expect(needs.parts | (needs.contacts ? Lag::others : 0U));
  expose();
}

// Writes the pointers and sizes that callbacks use.
void SimView::expose() {
  const mjModel* m = &work_.model();
  const mjData* d = work_.data();
  if (needs_.contacts) contacts_.resize(static_cast<std::size_t>(max_contacts(*m)));
  mjenv_sim& c = sim_;
  c.struct_size = sizeof c;
  c.api = &task_api();
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
  c.geom_xpos = needs_.parts & Lag::frames ? d->geom_xpos : nullptr;
  c.geom_xmat = needs_.parts & Lag::frames ? d->geom_xmat : nullptr;
  c.site_xpos = d->site_xpos, c.site_xmat = d->site_xmat;
  c.subtree_com = d->subtree_com, c.cinert = d->cinert, c.cvel = d->cvel;
  c.cfrc_ext = needs_.parts & Lag::forces ? d->cfrc_ext : nullptr;
  c.sensordata = d->sensordata;
  c.actuator_length = d->actuator_length, c.actuator_velocity = d->actuator_velocity;
  c.actuator_force = d->actuator_force;
  c.qfrc_actuator = d->qfrc_actuator, c.qfrc_passive = d->qfrc_passive;
  c.qfrc_bias = d->qfrc_bias, c.qfrc_constraint = d->qfrc_constraint;
  c.ten_length = d->ten_length, c.ten_velocity = d->ten_velocity;
  c.contacts = needs_.contacts ? contacts_.data() : nullptr;
  // qpos0 is that of the compiled model, even if the row has its own, because Gymnasium's init_qpos never changes.
  c.qpos0 = work_.compiled().get()->qpos0, c.body_mass = m->body_mass;
  c.arrays = shared_.data();
  c.action_count = static_cast<std::int32_t>(action_.size());
}

void SimView::need_action(ActionBounds bounds) {
  action_.assign(bounds.low.size(), 0);
  needs_.action = std::move(bounds);
  expose();
}

int SimView::need_own(const std::string& array) {
  const OwnArray own = OwnArray::written(work_.compiled(), array);
  const bool is_real = own.original.type == MJENV_DTYPE_FLOAT64 || own.original.type == MJENV_DTYPE_FLOAT32;
  if ((own.place != OwnArray::Place::model_array && !is_applied_force(array)) || !is_real)
    fail(MJENV_E_TYPE, "array " + quoted(array) +
                           " is neither an array of mjModel with real numbers nor qfrc_applied nor xfrc_applied");
  if (std::find(needs_.own.begin(), needs_.own.end(), array) != needs_.own.end())
    fail(MJENV_E_VALUE, "array " + quoted(array) + " is already an own array of this task");
  needs_.own.push_back(array);
  return static_cast<int>(needs_.own.size()) - 1;
}

void SimView::show(const Action& action) {
  sim_.action_dtype = action.dtype;
  for (std::int64_t i = 0; i < action.count; ++i) action_[static_cast<std::size_t>(i)] = action[i];
}

void SimView::hide_action() { std::fill(action_.begin(), action_.end(), std::numeric_limits<double>::quiet_NaN()); }

void SimView::need(const std::string& what) {
  if (what == "contacts") {
    needs_.contacts = true;
  } else if (const unsigned part = part_of(what) & Lag::on_demand) {
    needs_.parts |= part;
  } else {
    fail(MJENV_E_NAME, quoted(what) + " is not computed on demand; these are: contacts, " + listed(on_demand_arrays()));
  }
  work_.expect(part_of(what));
  expose();
  complete();
}

const Array& SimView::share(const std::string& name) {
  if (data_arrays_.empty()) data_arrays_ = work_.arrays();
  const Array* found = find(data_arrays_, name);
  if (found) work_.expect(part_of(name));
  if (!found) found = find(work_.compiled().arrays(), name);
  if (!found) fail(MJENV_E_NAME, "neither mjData nor mjModel has an array " + quoted(name));
  if (found->stride)
    fail(MJENV_E_NAME, quoted(name) + " is not one contiguous array" +
                           (name.rfind("contact.", 0) == 0 ? ": ask for \"contacts\" with mjenv_build_need" : ""));
  needs_.arrays.push_back(name);
  shared_.push_back(found->data);
  shared_originals_.push_back(found->data);
  if (part_of(name) & Lag::on_demand)
    need(name);
  else
    expose();
  return *found;
}

void SimView::use(const OwnArrays& arrays, const std::byte* block) {
  const mjModel& m = work_.model();
  sim_.timestep = m.opt.timestep;
  sim_.dt = m.opt.timestep * frame_skip_;
  sim_.body_mass = m.body_mass;
  for (std::size_t i = 0; i < shared_.size(); ++i)
    for (const OwnArray& array : arrays.list())
      if (array.original.data && shared_originals_[i] == array.original.data) shared_[i] = block + array.offset;
}

void SimView::list_contacts() {
  const mjModel* m = &work_.model();
  const mjData* d = work_.data();
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
  listed_ = work_.computation();
}

}  // namespace mjenv::core
