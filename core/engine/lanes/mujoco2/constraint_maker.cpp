#include "engine/lanes/mujoco2/constraint_maker.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <exception>

namespace mjenv::core::lanes {
namespace {

// MuJoCo's getsolparam, and what mj_makeImpedance computes from nothing but its result. Returns false if MuJoCo would
// warn of the numbers.
bool set_solparam(ConstraintNumbers& n, const mjModel& m, const mjtNum* solref, const mjtNum* solimp) {
  if ((solref[0] > 0) != (solref[1] > 0)) return false;
  const bool is_safe = solref[0] > 0 && !(m.opt.disableflags & mjDSBL_REFSAFE);
  const double ref0 = is_safe ? mju_max(solref[0], 2 * m.opt.timestep) : solref[0], ref1 = solref[1];
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

// Whether mjData's stack is certainly large enough for MuJoCo's search for pairs. If it is not, the search may fail.
bool has_room_to_search(const mjModel& m, const mjData& d) {
  const std::int64_t bodies = m.nbody;
  return d.nstack - d.pstack >= bodies * bodies + 16 * bodies;
}

bool set_limit(ConstraintNumbers& n, const mjModel& m, Object object, int id) {
  if (object == Object::tendon) {
    n.diagApprox = m.tendon_invweight0[id];
    return set_solparam(n, m, m.tendon_solref_lim + mjNREF * id, m.tendon_solimp_lim + mjNIMP * id);
  }
  n.diagApprox = m.dof_invweight0[m.jnt_dofadr[id]];
  return set_solparam(n, m, m.jnt_solref + mjNREF * id, m.jnt_solimp + mjNIMP * id);
}

const mjtNum& frictionloss_of(const mjModel& m, Object object, int id) {
  return (object == Object::tendon ? m.tendon_frictionloss : m.dof_frictionloss)[id];
}

bool set_friction(ConstraintNumbers& n, const mjModel& m, Object object, int id) {
  const bool is_tendon = object == Object::tendon;
  if (!set_solparam(n, m, (is_tendon ? m.tendon_solref_fri : m.dof_solref) + mjNREF * id,
                    (is_tendon ? m.tendon_solimp_fri : m.dof_solimp) + mjNIMP * id))
    return false;
  n.diagApprox = (is_tendon ? m.tendon_invweight0 : m.dof_invweight0)[id];
  n.frictionloss = frictionloss_of(m, object, id);
  n.stiffness = 0;
  return true;
}

// mj_diagApprox is written to use the rotational weight for the rotations of a weld. But it compares efc_type with
// mjEQ_WELD, so it resets its counter weldcnt before each constraint, and uses the translational weight for all of
// them.
bool set_equality(ConstraintNumbers& n, const mjModel& m, int id) {
  const int type = m.eq_type[id];
  n.diagApprox = 0;
  for (const int object : {m.eq_obj1id[id], m.eq_obj2id[id]}) {
    if (type == mjEQ_CONNECT || type == mjEQ_WELD)
      n.diagApprox += m.body_invweight0[2 * object];
    else if (object >= 0)
      n.diagApprox += type == mjEQ_JOINT ? m.dof_invweight0[m.jnt_dofadr[object]] : m.tendon_invweight0[object];
  }
  return set_solparam(n, m, m.eq_solref + mjNREF * id, m.eq_solimp + mjNIMP * id);
}

// The rows, as bits, for whose model `has` returns true.
template <typename Has>
unsigned rows_in_which(const RowModels& models, int count, const Has& has) {
  unsigned rows = 0;
  for (int row = 0; row < count; ++row)
    if (has(*models[row])) rows |= 1U << row;
  return rows;
}

// Lists those joints or tendons that have limits in some row. Returns how many there are.
int list_limited(std::vector<Contacts::Limited>& list, const std::vector<int>& ids, mjtByte* mjModel::*are_limited,
                 const RowModels& models, int count) {
  std::size_t found = 0;
  for (const int id : ids) {
    const unsigned rows = rows_in_which(models, count, [&](const mjModel& m) { return (m.*are_limited)[id] != 0; });
    if (rows != 0) list[found++] = {id, rows};
  }
  return static_cast<int>(found);
}

}  // namespace

ConstraintMaker::ModelNumbers::ModelNumbers(const mjModel& m, std::size_t pairs) {
  const auto count = [](int number) { return static_cast<std::size_t>(number); };
  pairs_ = count(m.njnt);
  dofs_ = pairs_ + pairs;
  tendon_limits_ = dofs_ + count(m.nv);
  tendon_frictions_ = tendon_limits_ + count(m.ntendon);
  equalities_ = tendon_frictions_ + count(m.ntendon);
  numbers_.resize(equalities_ + count(m.neq));
  validity_.resize(numbers_.size());
}

template <typename Compute>
const ConstraintNumbers* ConstraintMaker::ModelNumbers::get(std::size_t first, int index, const Compute& compute) {
  ConstraintNumbers& numbers = numbers_[first + static_cast<std::size_t>(index)];
  unsigned char& validity = validity_[first + static_cast<std::size_t>(index)];
  if (validity == unknown) validity = compute(numbers) ? valid : invalid;
  return validity == valid ? &numbers : nullptr;
}

const ConstraintNumbers* ConstraintMaker::ModelNumbers::of_equality(const mjModel& m, int id) {
  return get(equalities_, id, [&](ConstraintNumbers& n) { return set_equality(n, m, id); });
}

const ConstraintNumbers* ConstraintMaker::ModelNumbers::of_friction(const mjModel& m, Object object, int id) {
  return get(object == Object::tendon ? tendon_frictions_ : dofs_, id,
             [&](ConstraintNumbers& n) { return set_friction(n, m, object, id); });
}

const ConstraintNumbers* ConstraintMaker::ModelNumbers::of_limit(const mjModel& m, Object object, int id) {
  return get(object == Object::tendon ? tendon_limits_ : 0, id,
             [&](ConstraintNumbers& n) { return set_limit(n, m, object, id); });
}

const ConstraintNumbers* ConstraintMaker::ModelNumbers::of_contact(ConstraintMaker& maker, const mjModel& m, int pair) {
  return get(pairs_, pair, [&](ConstraintNumbers& n) { return maker.set_contact(n, m, pair); });
}

bool ConstraintMaker::set_contact(ConstraintNumbers& n, const mjModel& m, int pair) {
  const ContactPair& geoms = contacts_.pairs[pair];
  const mjtNum *friction = m.pair_friction + 5 * pair, *solref = m.pair_solref + mjNREF * pair,
               *solimp = m.pair_solimp + mjNIMP * pair;
  if (&m != &m_ || m.npair == 0) {
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
  if (!tables.knows_pairs) return nullptr;
  return std::unique_ptr<ConstraintMaker>(new ConstraintMaker(code, m, tables));
}

ConstraintMaker::ConstraintMaker(const Code& code, const mjModel& m, const ModelTables& tables)
    : code_(code),
      m_(m),
      memory_(contacts_, code.width,
              {{&Contacts::limit_dist, Contacts::kCapacity},
               {&Contacts::limit_axis, 3 * Contacts::kCapacity},
               {&Contacts::dist, Contacts::kCapacity},
               {&Contacts::pos, 3 * Contacts::kCapacity},
               {&Contacts::frame, 9 * Contacts::kCapacity},
               {&Contacts::single_dist, Contacts::kMostSingle},
               {&Contacts::single_pos, 3 * Contacts::kMostSingle},
               {&Contacts::single_frame, 9 * Contacts::kMostSingle}}),
      shared_(m, tables.contact_pairs.size()),
      own_(static_cast<std::size_t>(code.width), shared_),
      joints_(tables.joints.size()),
      tendons_(tables.tendons.size()),
      equals_(tables.equalities.size()),
      frictions_(static_cast<std::size_t>(m.nv + m.ntendon)),
      are_always_searched_(tables.searched.has_value()),
      has_friction_(constrains(m, mjDSBL_FRICTIONLOSS)),
      tables_(tables) {
  static_assert(Contacts::kMostSingle == mjMAXCONPAIR);
  contacts_.maker = this;
  contacts_.collide = [](void* maker, int pair, unsigned rows) {
    return static_cast<ConstraintMaker*>(maker)->collide(pair, rows);
  };
  if (!tables.contact_pairs.empty())  // so that later calls allocate no memory
    mix_one(tables.contact_pairs[0].geom1, tables.contact_pairs[0].geom2, m, mixed_);
  contacts_.frictions = frictions_.data();
  contacts_.equals = equals_.data();
  contacts_.joints = joints_.data();
  contacts_.tendons = tendons_.data();
  contacts_.pairs = tables.contact_pairs.data();
}

// Sets the numbers of a new entry (a limit, contact, equality or friction). Lanes that do not have it get the numbers
// of another lane. Returns false if MuJoCo would warn of the numbers.
template <typename Entry, typename Get>
bool ConstraintMaker::set_numbers(Entry& entry, const Get& get) {
  const ConstraintNumbers* some = nullptr;
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(entry.rows >> lane & 1)) continue;
    some = entry.numbers[lane] = get(lane);
    if (!some) return false;
  }
  for (int lane = 0; lane < code_.width; ++lane)
    if (!entry.numbers[lane]) entry.numbers[lane] = some;
  return true;
}

bool ConstraintMaker::add_equality(const Equality& equality, const RowModels& models, int count) {
  Contacts::Equal& equal = equals_[contacts_.equality_count];
  equal = {
      &equality, rows_in_which(models, count, [&](const mjModel& m) { return m.eq_active[equality.id] != 0; }), {}};
  if (equal.rows == 0) return true;
  for (int row = 0; row < count; ++row)
    if (equal.rows >> row & 1) contacts_.bounded[row] += equality.size;
  ++contacts_.equality_count;
  return set_numbers(equal, [&](int lane) { return used_[lane]->of_equality(*models[lane], equality.id); });
}

bool ConstraintMaker::add_friction(Object object, int id, const RowModels& models, int count) {
  Contacts::Friction& friction = frictions_[contacts_.friction_count];
  friction = {object,
              id,
              rows_in_which(models, count, [&](const mjModel& m) { return frictionloss_of(m, object, id) > 0; }),
              {}};
  if (friction.rows == 0) return true;
  for (int row = 0; row < count; ++row) contacts_.bounded[row] += friction.rows >> row & 1;
  ++contacts_.friction_count;
  return set_numbers(friction, [&](int lane) { return used_[lane]->of_friction(*models[lane], object, id); });
}

bool ConstraintMaker::follow(const RowModels& models, int count) {
  for (int row = 0; row < count; ++row) {
    const bool is_shared = models[row] == &m_;
    used_[row] = is_shared ? &shared_ : &own_[row];
    if (!is_shared) used_[row]->forget();
  }
  const bool are_shared =
      std::all_of(models.begin(), models.begin() + count, [&](const mjModel* m) { return m == &m_; });
  // If a row's own values may change which contacts MuJoCo finds, its model lists no pairs, so without lanes MuJoCo
  // would search for them.
  contacts_.are_searched = are_always_searched_ || std::any_of(models.begin(), models.begin() + count,
                                                               [](const mjModel* m) { return m->npair == 0; });
  if (are_shared && shared_rows_ == count) return true;  // nothing has changed since the last step
  shared_rows_ = 0;
  contacts_.equality_count = contacts_.friction_count = 0;
  std::fill_n(contacts_.bounded, kMaxWidth, 0);
  contacts_.joint_count = list_limited(joints_, tables_.joints, &mjModel::jnt_limited, models, count);
  contacts_.tendon_count = list_limited(tendons_, tables_.tendons, &mjModel::tendon_limited, models, count);
  for (const Equality& equality : tables_.equalities)
    if (!add_equality(equality, models, count)) return false;
  for (int dof = 0; dof < m_.nv && has_friction_; ++dof)
    if (!add_friction(Object::dof, dof, models, count)) return false;
  for (int tendon = 0; tendon < m_.ntendon && has_friction_; ++tendon)
    if (!tables_.is_still_tendon[tendon] && !add_friction(Object::tendon, tendon, models, count)) return false;
  if (are_shared) shared_rows_ = count;
  return true;
}

// Computes one lane's contacts. Of several contacts of two boxes at the same position, only the last one counts, as in
// mj_collideGeoms.
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
  const double margin = mixed_margin(m.geom_margin[geoms.geom1], m.geom_margin[geoms.geom2]);
  const int count = mjCOLLISIONFUNC[type1][type2](&m, &d, found.data(), geoms.geom1, geoms.geom2, margin);
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
  int most_contacts = 0, most_constraints = 0;
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    most_contacts = std::max(most_contacts, c.found[lane]);
    most_constraints = std::max(most_constraints, c.constraints[lane]);
  }
  if (most_contacts > m_.nconmax || most_constraints > m_.njmax) return false;
  const mjData& first = *data[__builtin_ctz(rows)];  // the stacks of all rows have the same size, and are empty
  if (c.are_searched && !has_room_to_search(m_, first)) return false;
  if (most_constraints > 0 && (!solver.can_solve(first, most_constraints) || !solver.has_room(c))) return false;
  for (int i = 0; i < c.limit_count; ++i)
    if (!set_numbers(c.limits[i], [&](int lane) {
          return used_[lane]->of_limit(*models[lane], c.limits[i].object, c.limits[i].id);
        }))
      return false;
  for (int i = 0; i < c.contact_count; ++i)
    if (!set_numbers(c.contacts[i],
                     [&](int lane) { return used_[lane]->of_contact(*this, *models[lane], c.contacts[i].pair); }))
      return false;
  return true;
}

}  // namespace mjenv::core::lanes
