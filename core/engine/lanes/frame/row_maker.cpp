#include "engine/lanes/frame/row_maker.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>

namespace mjenv::core::lanes {
namespace {

const mjtNum& frictionloss_of(const mjModel& m, Object object, int id) {
  return (object == Object::tendon ? m.tendon_frictionloss : m.dof_frictionloss)[id];
}

// mju_max and mju_min
double greater(double a, double b) { return a >= b ? a : b; }
double smaller(double a, double b) { return a <= b ? a : b; }

}  // namespace

bool RowMaker::set_solparam(ConstraintNumbers& n, const mjModel& m, const mjtNum* solref, const mjtNum* solimp) {
  if ((solref[0] > 0) != (solref[1] > 0)) return false;
  const bool is_safe = solref[0] > 0 && !(m.opt.disableflags & mjDSBL_REFSAFE);
  const double ref0 = is_safe ? greater(solref[0], 2 * m.opt.timestep) : solref[0], ref1 = solref[1];
  n.dmin = smaller(mjMAXIMP, greater(mjMINIMP, solimp[0]));
  n.dmax = smaller(mjMAXIMP, greater(mjMINIMP, solimp[1]));
  n.width = greater(0, solimp[2]);
  n.midpoint = smaller(mjMAXIMP, greater(mjMINIMP, solimp[3]));
  n.power = greater(1, solimp[4]);
  n.below = 1 / power(n.midpoint, n.power - 1);
  n.above = 1 / power(1 - n.midpoint, n.power - 1);
  if (ref0 > 0)
    n.stiffness = 1 / greater(mjMINVAL, n.dmax * n.dmax * ref0 * ref0 * ref1 * ref1);
  else
    n.stiffness = -ref0 / greater(mjMINVAL, n.dmax * n.dmax);
  if (ref1 > 0)
    n.damping = 2 / greater(mjMINVAL, n.dmax * ref0);
  else
    n.damping = -ref1 / greater(mjMINVAL, n.dmax);
  n.impratio = greater(mjMINVAL, m.opt.impratio);
  return true;
}

bool RowMaker::set_contact(ConstraintNumbers& n, const mjModel& m, int pair) {
  const ContactPair& geoms = contacts_.pairs[pair];
  mix_one(geoms.geom1, geoms.geom2, m, mixed_);
  const int body1 = m.geom_bodyid[geoms.geom1], body2 = m.geom_bodyid[geoms.geom2];
  const double translation = m.body_invweight0[2 * body1] + m.body_invweight0[2 * body2];
  for (int i = 0; i < 5; ++i) n.friction[i] = greater(mjMINMU, mixed_.friction[i]);
  const bool is_elliptic = m.opt.cone == mjCONE_ELLIPTIC;
  n.diagApprox =
      geoms.dim == 1 || is_elliptic ? translation : translation + n.friction[0] * n.friction[0] * translation;
  return set_solparam(n, m, mixed_.solref.data(), mixed_.solimp.data());
}

// The mj_diagApprox of MuJoCo 2.2.2 is written to use the rotational weights for the rotations of a weld. But it compares
// efc_type with mjEQ_WELD, so it resets its counter weldcnt before each constraint, and uses the translational weights for
// all of them.
bool RowMaker::set_equality(ConstraintNumbers& n, const mjModel& m, int id) {
  const int type = m.eq_type[id];
  n.diagApprox = n.diagApproxTurn = 0;
  for (const int object : {m.eq_obj1id[id], m.eq_obj2id[id]}) {
    if (type == mjEQ_CONNECT || type == mjEQ_WELD) {
      const mjtNum* const weights = m.body_invweight0 + 2 * (are_sites(m, id) ? m.site_bodyid[object] : object);
      n.diagApprox += weights[0];
      n.diagApproxTurn += weights[kWeighsTurns ? 1 : 0];
    } else if (object >= 0) {
      n.diagApprox += type == mjEQ_JOINT ? m.dof_invweight0[m.jnt_dofadr[object]] : m.tendon_invweight0[object];
    }
  }
  return set_solparam(n, m, m.eq_solref + mjNREF * id, m.eq_solimp + mjNIMP * id);
}

// For friction, MuJoCo's K is 0.
bool RowMaker::set(ConstraintNumbers& n, const mjModel& m, Kind kind, int id) {
  const auto set_of = [&](const mjtNum* weight, const mjtNum* solref, const mjtNum* solimp) {
    n.diagApprox = *weight;
    return set_solparam(n, m, solref + mjNREF * id, solimp + mjNIMP * id);
  };
  switch (kind) {
    case Kind::equality: return set_equality(n, m, id);
    case Kind::contact: return set_contact(n, m, id);
    case Kind::joint_limit: return set_of(m.dof_invweight0 + m.jnt_dofadr[id], m.jnt_solref, m.jnt_solimp);
    case Kind::tendon_limit: return set_of(m.tendon_invweight0 + id, m.tendon_solref_lim, m.tendon_solimp_lim);
    default: break;
  }
  const bool is_tendon = kind == Kind::tendon_friction;
  if (!(is_tendon ? set_of(m.tendon_invweight0 + id, m.tendon_solref_fri, m.tendon_solimp_fri)
                  : set_of(m.dof_invweight0 + id, m.dof_solref, m.dof_solimp)))
    return false;
  n.frictionloss = frictionloss_of(m, is_tendon ? Object::tendon : Object::dof, id);
  n.stiffness = 0;
  return true;
}

const ConstraintNumbers* RowMaker::numbers(int lane, Kind kind, int id) {
  const std::size_t at = first_[static_cast<std::size_t>(kind)] + static_cast<std::size_t>(id);
  ConstraintNumbers& found = used_[lane]->numbers[at];
  unsigned char& validity = used_[lane]->validity[at];
  if (validity == ModelNumbers::unknown)
    validity = set(found, *models_[lane], kind, id) ? ModelNumbers::valid : ModelNumbers::invalid;
  return validity == ModelNumbers::valid ? &found : nullptr;
}

bool RowMaker::set_numbers() {
  Contacts& c = contacts_;
  for (int i = 0; i < c.limit_count; ++i)
    if (!set_numbers(c.limits[i], c.limits[i].object == Object::tendon ? Kind::tendon_limit : Kind::joint_limit,
                     c.limits[i].id))
      return false;
  for (int i = 0; i < c.contact_count; ++i)
    if (c.contacts[i].rows != 0 && !set_numbers(c.contacts[i], Kind::contact, c.contacts[i].pair)) return false;
  return true;
}

RowMaker::RowMaker(const Code& code, const mjModel& m, const std::vector<ContactPair>& pairs,
                   const std::vector<Equality>& equalities, const std::vector<unsigned char>& is_still_tendon,
                   const Counts<Contacts>& special)
    : code_(code),
      m_(m),
      memory_(contacts_, code.width,
              [&] {
                Counts<Contacts> counts{{&Contacts::limit_dist, Contacts::kCapacity},
                                        {&Contacts::limit_axis, 3 * Contacts::kCapacity},
                                        {&Contacts::dist, Contacts::kCapacity},
                                        {&Contacts::pos, 3 * Contacts::kCapacity},
                                        {&Contacts::frame, 9 * Contacts::kCapacity}};
                counts.insert(counts.end(), special.begin(), special.end());
                return counts;
              }()),
      equalities_(equalities),
      equals_(equalities.size()) {
  std::size_t count = 0;  // in the order of Kind
  for (const std::int64_t more : std::initializer_list<std::int64_t>{m.neq, m.nv, m.ntendon, m.njnt, m.ntendon,
                                                                     static_cast<std::int64_t>(pairs.size())}) {
    first_.push_back(count);
    count += static_cast<std::size_t>(more);
  }
  shared_.numbers.resize(count);
  shared_.validity.resize(count);
  own_.resize(static_cast<std::size_t>(code.width), shared_);
  for (int j = 0; j < m.njnt && constrains(m, mjDSBL_LIMIT); ++j)
    if (m.jnt_type[j] != mjJNT_FREE) joints_.push_back(j);
  for (int i = 0; i < m.ntendon; ++i) {
    if (is_still_tendon[static_cast<std::size_t>(i)]) continue;
    if (constrains(m, mjDSBL_LIMIT)) tendons_.push_back(i);
    if (constrains(m, mjDSBL_FRICTIONLOSS)) frictional_tendons_.push_back(i);
  }
  limited_joints_.resize(joints_.size());
  limited_tendons_.resize(tendons_.size());
  frictions_.resize(static_cast<std::size_t>(m.nv) + static_cast<std::size_t>(m.ntendon));
  if (!pairs.empty()) mix_one(pairs[0].geom1, pairs[0].geom2, m, mixed_);  // so that later calls allocate no memory
  contacts_.equals = equals_.data();
  contacts_.frictions = frictions_.data();
  contacts_.joints = limited_joints_.data();
  contacts_.tendons = limited_tendons_.data();
  contacts_.pairs = pairs.data();
  contacts_.pair_count = static_cast<int>(pairs.size());
}

// Returns false if MuJoCo would warn of the numbers, or if a friction is negative.
bool RowMaker::add_friction(Object object, int id, int count) {
  Contacts::Friction& friction = frictions_[static_cast<std::size_t>(contacts_.friction_count)];
  friction = {object,
              id,
              rows_in_which(models_, count, [&](const mjModel& m) { return frictionloss_of(m, object, id) != 0; }),
              {}};
  if (friction.rows == 0) return true;
  for (int row = 0; row < count; ++row) contacts_.bounded[row] += friction.rows >> row & 1;
  ++contacts_.friction_count;
  return !rows_in_which(models_, count, [&](const mjModel& m) { return frictionloss_of(m, object, id) < 0; }) &&
         set_numbers(friction, object == Object::tendon ? Kind::tendon_friction : Kind::dof_friction, id);
}

bool RowMaker::add_equality(const Equality& equality, const RowModels& models, const RowData& data, int count) {
  Contacts::Equal& equal = equals_[static_cast<std::size_t>(contacts_.equality_count)];
  equal = {&equality, 0, {}};
  for (int row = 0; row < count; ++row) {
    if (!is_active(*models[row], *data[row], equality.id)) continue;
    equal.rows |= 1U << row;
    contacts_.bounded[row] += equality.size;
  }
  if (equal.rows == 0) return true;
  ++contacts_.equality_count;
  return set_numbers(equal, Kind::equality, equality.id);
}

bool RowMaker::follow(const RowModels& models, const RowData& data, int count) {
  models_ = models;
  bool are_shared = true;
  for (int row = 0; row < count; ++row) {
    const bool is_shared = models[row] == &m_;
    are_shared &= is_shared;
    used_[row] = is_shared ? &shared_ : &own_[static_cast<std::size_t>(row)];
    if (!is_shared) std::fill(used_[row]->validity.begin(), used_[row]->validity.end(), ModelNumbers::unknown);
  }
  if (are_shared && shared_rows_ == count) return true;  // nothing has changed since the last step
  shared_rows_ = 0;
  contacts_.equality_count = contacts_.friction_count = 0;
  std::fill_n(contacts_.bounded, kMaxWidth, 0);
  const auto list_limited = [&](std::vector<Contacts::Limited>& list, const std::vector<int>& ids,
                                const auto& are_limited) {
    std::size_t found = 0;
    for (const int id : ids) {
      const unsigned rows = rows_in_which(models, count, [&](const mjModel& m) { return (m.*are_limited)[id] != 0; });
      if (rows != 0) list[found++] = {id, rows};
    }
    return static_cast<int>(found);
  };
  contacts_.joint_count = list_limited(limited_joints_, joints_, &mjModel::jnt_limited);
  contacts_.tendon_count = list_limited(limited_tendons_, tendons_, &mjModel::tendon_limited);
  for (const Equality& equality : equalities_)
    if (!add_equality(equality, models, data, count)) return false;
  for (int dof = 0; dof < m_.nv && constrains(m_, mjDSBL_FRICTIONLOSS); ++dof)
    if (!add_friction(Object::dof, dof, count)) return false;
  for (const int tendon : frictional_tendons_)
    if (!add_friction(Object::tendon, tendon, count)) return false;
  if (are_shared) shared_rows_ = count;
  return true;
}

}  // namespace mjenv::core::lanes
