#include "engine/lanes/constraint_maker.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>

namespace mjenv::core::lanes {
namespace {

// getsolparam, and what mj_makeImpedance computes of it alone. Returns false if MuJoCo would warn.
bool set_solparam(ConstraintNumbers& n, const mjModel& m, const mjtNum* solref, const mjtNum* solimp) {
  if ((solref[0] > 0) != (solref[1] > 0)) return false;
  const double ref0 = solref[0] > 0 ? mju_max(solref[0], 2 * m.opt.timestep) : solref[0], ref1 = solref[1];
  n.dmin = mju_min(mjMAXIMP, mju_max(mjMINIMP, solimp[0]));
  n.dmax = mju_min(mjMAXIMP, mju_max(mjMINIMP, solimp[1]));
  n.width = mju_max(0, solimp[2]);
  n.midpoint = mju_min(mjMAXIMP, mju_max(mjMINIMP, solimp[3]));
  n.power = mju_max(1, solimp[4]);
  n.below = 1 / std::pow(n.midpoint, n.power - 1);
  n.above = 1 / std::pow(1 - n.midpoint, n.power - 1);
  if (ref0 > 0)
    n.stiffness = 1 / mju_max(mjMINVAL, n.dmax * n.dmax * ref0 * ref0 * ref1 * ref1);
  else
    n.stiffness = -ref0 / mju_max(mjMINVAL, n.dmax * n.dmax);
  if (ref1 > 0)
    n.damping = 2 / mju_max(mjMINVAL, n.dmax * ref0);
  else
    n.damping = -ref1 / mju_max(mjMINVAL, n.dmax);
  n.impratio = mju_max(mjMINVAL, m.opt.impratio);
  return true;
}

// Whether MuJoCo's search for pairs surely has enough of mjData's stack. Else it may fail.
bool has_room_to_search(const mjModel& m, const mjData& d) {
  const std::int64_t bodies = m.nbody;
  return d.nstack - d.pstack >= bodies * bodies + 16 * bodies;
}

bool set_limit(ConstraintNumbers& n, const mjModel& m, int joint) {
  n.diagApprox = m.dof_invweight0[m.jnt_dofadr[joint]];
  return set_solparam(n, m, m.jnt_solref + mjNREF * joint, m.jnt_solimp + mjNIMP * joint);
}

bool set_friction(ConstraintNumbers& n, const mjModel& m, int dof) {
  if (!set_solparam(n, m, m.dof_solref + mjNREF * dof, m.dof_solimp + mjNIMP * dof)) return false;
  n.diagApprox = m.dof_invweight0[dof];
  n.frictionloss = m.dof_frictionloss[dof];
  n.stiffness = 0;
  return true;
}

}  // namespace

template <typename Compute>
const ConstraintNumbers* ConstraintMaker::Numbers::get(std::size_t index, const Compute& compute) {
  unsigned char& is_known = are_known_[index];
  if (is_known == unknown) is_known = compute(numbers_[index]) ? usual : mixed;
  return is_known == usual ? &numbers_[index] : nullptr;
}

const ConstraintNumbers* ConstraintMaker::Numbers::of_limit(const mjModel& m, int joint) {
  return get(static_cast<std::size_t>(joint), [&](ConstraintNumbers& n) { return set_limit(n, m, joint); });
}

const ConstraintNumbers* ConstraintMaker::Numbers::of_contact(ConstraintMaker& maker, const mjModel& m, int pair) {
  return get(pairs_ + static_cast<std::size_t>(pair),
             [&](ConstraintNumbers& n) { return maker.set_contact(n, m, pair); });
}

const ConstraintNumbers* ConstraintMaker::Numbers::of_friction(const mjModel& m, int dof) {
  return get(dofs_ + static_cast<std::size_t>(dof), [&](ConstraintNumbers& n) { return set_friction(n, m, dof); });
}

bool ConstraintMaker::set_contact(ConstraintNumbers& n, const mjModel& m, int pair) {
  const ContactPair& geoms = contacts_.pairs[pair];
  const mjtNum *friction = m.pair_friction + 5 * pair, *solref = m.pair_solref + mjNREF * pair,
               *solimp = m.pair_solimp + mjNIMP * pair;
  if (are_searched_) {
    mix_one(geoms.geom1, geoms.geom2, m, mixed_);
    friction = mixed_.friction.data();
    solref = mixed_.solref.data();
    solimp = mixed_.solimp.data();
  }
  const int body1 = m.geom_bodyid[geoms.geom1], body2 = m.geom_bodyid[geoms.geom2];
  const double translation = m.body_invweight0[2 * body1] + m.body_invweight0[2 * body2];
  for (int i = 0; i < 5; ++i) n.friction[i] = mju_max(mjMINMU, friction[i]);
  const bool is_elliptic = m.opt.cone == mjCONE_ELLIPTIC;
  n.diagApprox =
      geoms.dim == 1 || is_elliptic ? translation : translation + n.friction[0] * n.friction[0] * translation;
  return set_solparam(n, m, solref, solimp);
}

std::unique_ptr<ConstraintMaker> ConstraintMaker::make(const Code& code, const mjModel& m, const ModelTables& tables) {
  constexpr int kHarmless =
      mjDSBL_PASSIVE | mjDSBL_ACTUATION | mjDSBL_GRAVITY | mjDSBL_CLAMPCTRL | mjDSBL_FILTERPARENT | mjDSBL_SENSOR;
  if (!tables.lists_pairs || (m.opt.disableflags & ~kHarmless) != 0 || tables.constrains_tendons || m.neq > 0 ||
      m.njmax == 0 || m.nconmax == 0)
    return nullptr;
  for (int j = 0; j < m.njnt; ++j)
    if (m.jnt_limited[j] && m.jnt_type[j] == mjJNT_BALL) return nullptr;
  for (const ContactPair& pair : tables.contact_pairs)
    if (pair.dim != 1 && pair.dim != 3 && pair.dim != 4 && pair.dim != 6) return nullptr;
  return std::unique_ptr<ConstraintMaker>(new ConstraintMaker(code, m, tables));
}

ConstraintMaker::ConstraintMaker(const Code& code, const mjModel& m, const ModelTables& tables)
    : code_(code),
      m_(m),
      memory_(contacts_, code.width,
              {{&Contacts::limit_dist, Contacts::kMost},
               {&Contacts::dist, Contacts::kMost},
               {&Contacts::pos, 3 * Contacts::kMost},
               {&Contacts::frame, 9 * Contacts::kMost},
               {&Contacts::single_dist, Contacts::kMostSingle},
               {&Contacts::single_pos, 3 * Contacts::kMostSingle},
               {&Contacts::single_frame, 9 * Contacts::kMostSingle}}),
      shared_(static_cast<std::size_t>(m.njnt), tables.contact_pairs.size(), static_cast<std::size_t>(m.nv)),
      own_(static_cast<std::size_t>(code.width), shared_),
      frictions_(static_cast<std::size_t>(m.nv)),
      are_searched_(tables.searched.has_value()) {
  static_assert(Contacts::kMostSingle == mjMAXCONPAIR);
  contacts_.maker = this;
  contacts_.collide = [](void* maker, int pair, unsigned rows) {
    return static_cast<ConstraintMaker*>(maker)->collide(pair, rows);
  };
  if (are_searched_ && !tables.contact_pairs.empty())  // makes room
    mix_one(tables.contact_pairs[0].geom1, tables.contact_pairs[0].geom2, m, mixed_);
  contacts_.frictions = frictions_.data();
  contacts_.joints = tables.limited_joints.data();
  contacts_.joint_count = static_cast<int>(tables.limited_joints.size());
  contacts_.pairs = tables.contact_pairs.data();
  contacts_.columns = tables.contact_columns.data();
}

// The lanes that have no such limit or contact take another lane's numbers.
template <typename Entry, typename Get>
bool ConstraintMaker::set_numbers(Entry& entry, const Get& get) {
  const ConstraintNumbers* some = nullptr;
  for (int lane = 0; lane < code_.width; ++lane) {
    entry.numbers[lane] = nullptr;
    if (!(entry.rows >> lane & 1)) continue;
    some = entry.numbers[lane] = get(lane);
    if (!some) return false;
  }
  for (int lane = 0; lane < code_.width; ++lane)
    if (!entry.numbers[lane]) entry.numbers[lane] = some;
  return true;
}

bool ConstraintMaker::follow(const RowModels& models, int count) {
  for (int row = 0; row < count; ++row) {
    const bool is_shared = models[row] == &m_;
    used_[row] = is_shared ? &shared_ : &own_[row];
    if (!is_shared) used_[row]->forget();
  }
  const bool are_shared =
      std::all_of(models.begin(), models.begin() + count, [&](const mjModel* m) { return m == &m_; });
  if (are_shared && shared_rows_ == count) return true;  // as in the last step
  shared_rows_ = 0;
  contacts_.friction_count = 0;
  std::fill_n(contacts_.frictional, kMaxWidth, 0);
  for (int dof = 0; dof < m_.nv; ++dof) {
    Contacts::Friction& friction = frictions_[contacts_.friction_count];
    friction = {dof, 0, {}};
    for (int row = 0; row < count; ++row)
      if (models[row]->dof_frictionloss[dof] > 0) friction.rows |= 1U << row;
    if (friction.rows == 0) continue;
    for (int row = 0; row < count; ++row) contacts_.frictional[row] += friction.rows >> row & 1;
    ++contacts_.friction_count;
    if (!set_numbers(friction, [&](int lane) { return used_[lane]->of_friction(*models[lane], dof); })) return false;
  }
  if (are_shared) shared_rows_ = count;
  return true;
}

// As in mj_collideGeoms: of contacts of two boxes at the same place, the last counts.
int ConstraintMaker::collide(int pair, int lane) {
  const ContactPair& geoms = contacts_.pairs[pair];
  const mjModel& m = *(*models_)[lane];
  mjData& d = *(*data_)[lane];
  const int width = code_.width, type1 = m.geom_type[geoms.geom1], type2 = m.geom_type[geoms.geom2];
  for (const int geom : {geoms.geom1, geoms.geom2}) {
    for (int i = 3 * geom; i < 3 * geom + 3; ++i) d.geom_xpos[i] = lanes_->geom_xpos[i * width + lane];
    for (int i = 9 * geom; i < 9 * geom + 9; ++i) d.geom_xmat[i] = lanes_->geom_xmat[i * width + lane];
  }
  std::array<mjContact, mjMAXCONPAIR> found;
  const int count = mjCOLLISIONFUNC[type1][type2](&m, &d, found.data(), geoms.geom1, geoms.geom2, geoms.margin);
  if (count > mjMAXCONPAIR) return -1;
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const mjContact& con = found[i];
    const auto is_same = [&](const mjContact& other) { return std::equal(con.pos, con.pos + 3, other.pos); };
    if (type1 == mjGEOM_BOX && type2 == mjGEOM_BOX && std::any_of(found.data() + i + 1, found.data() + count, is_same))
      continue;
    contacts_.single_dist[kept * width + lane] = con.dist;
    for (int k = 0; k < 3; ++k) contacts_.single_pos[(3 * kept + k) * width + lane] = con.pos[k];
    for (int k = 0; k < 9; ++k) contacts_.single_frame[(9 * kept + k) * width + lane] = k < 6 ? con.frame[k] : 0;
    contacts_.single_rows[kept++] |= 1U << lane;
  }
  return kept;
}

int ConstraintMaker::collide(int pair, unsigned rows) {
  std::fill_n(contacts_.single_rows, Contacts::kMostSingle, 0U);
  int most = 0;
  try {
    for (int lane = 0; lane < code_.width; ++lane) {
      if (!(rows >> lane & 1)) continue;
      const int count = collide(pair, lane);
      if (count < 0) return -1;
      most = std::max(most, count);
    }
  } catch (const std::exception&) {
    return -1;
  }
  return most;
}

bool ConstraintMaker::find(const Lanes& lanes, std::uint32_t rows, const Solver& solver, const RowModels& models,
                           const RowData& data) {
  Contacts& c = contacts_;
  c.rows = rows;
  lanes_ = &lanes;
  models_ = &models;
  data_ = &data;
  if (!code_.instantiateLimit(lanes, c) || !code_.collision(lanes, c)) return false;
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    if (c.found[lane] > m_.nconmax || c.constraints[lane] > m_.njmax) return false;
    if (are_searched_ && !has_room_to_search(m_, *data[lane])) return false;
    if (!solver.can_solve(*data[lane], c.constraints[lane])) return false;
  }
  if (!solver.has_room(c)) return false;
  for (int i = 0; i < c.limit_count; ++i)
    if (!set_numbers(c.limits[i], [&](int lane) { return used_[lane]->of_limit(*models[lane], c.limits[i].joint); }))
      return false;
  for (int i = 0; i < c.contact_count; ++i)
    if (!set_numbers(c.contacts[i],
                     [&](int lane) { return used_[lane]->of_contact(*this, *models[lane], c.contacts[i].pair); }))
      return false;
  return true;
}

}  // namespace mjenv::core::lanes
