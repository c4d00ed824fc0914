#include "engine/lanes/constraint_maker.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

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

bool set_limit(ConstraintNumbers& n, const mjModel& m, int joint) {
  n.diagApprox = m.dof_invweight0[m.jnt_dofadr[joint]];
  return set_solparam(n, m, m.jnt_solref + mjNREF * joint, m.jnt_solimp + mjNIMP * joint);
}

bool set_contact(ConstraintNumbers& n, const mjModel& m, int pair) {
  const int body1 = m.geom_bodyid[m.pair_geom1[pair]], body2 = m.geom_bodyid[m.pair_geom2[pair]];
  const double translation = m.body_invweight0[2 * body1] + m.body_invweight0[2 * body2];
  n.friction1 = mju_max(mjMINMU, m.pair_friction[5 * pair]);
  n.friction2 = mju_max(mjMINMU, m.pair_friction[5 * pair + 1]);
  n.diagApprox = m.pair_dim[pair] == 1 ? translation : translation + n.friction1 * n.friction1 * translation;
  return set_solparam(n, m, m.pair_solref + mjNREF * pair, m.pair_solimp + mjNIMP * pair);
}

bool has_friction(const mjModel& m) {
  return std::any_of(m.dof_frictionloss, m.dof_frictionloss + m.nv, [](double x) { return !(x <= 0); });
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

const ConstraintNumbers* ConstraintMaker::Numbers::of_contact(const mjModel& m, int pair) {
  return get(static_cast<std::size_t>(m.njnt) + static_cast<std::size_t>(pair),
             [&](ConstraintNumbers& n) { return set_contact(n, m, pair); });
}

std::unique_ptr<ConstraintMaker> ConstraintMaker::make(const Code& code, const mjModel& m, const ModelTables& tables) {
  if (!tables.lists_pairs || m.opt.disableflags != 0 || tables.constrains_tendons || m.njmax == 0 || m.nconmax == 0)
    return nullptr;
  for (int j = 0; j < m.njnt; ++j)
    if (m.jnt_limited[j] && m.jnt_type[j] == mjJNT_BALL) return nullptr;
  return std::unique_ptr<ConstraintMaker>(new ConstraintMaker(code, m, tables));
}

ConstraintMaker::ConstraintMaker(const Code& code, const mjModel& m, const ModelTables& tables)
    : code_(code),
      m_(m),
      memory_(contacts_, code.width,
              {{&Contacts::limit_dist, Contacts::kMost},
               {&Contacts::dist, Contacts::kMost},
               {&Contacts::pos, 3 * Contacts::kMost},
               {&Contacts::frame, 9 * Contacts::kMost}}),
      shared_(static_cast<std::size_t>(m.njnt) + static_cast<std::size_t>(m.npair)),
      own_(static_cast<std::size_t>(code.width), shared_) {
  contacts_.joints = tables.limited_joints.data();
  contacts_.joint_count = static_cast<int>(tables.limited_joints.size());
  contacts_.pairs = tables.contact_pairs.data();
  contacts_.columns = tables.contact_columns.data();
}

bool ConstraintMaker::follow(const RowModels& models, int count) {
  bool have_friction = false;
  for (int row = 0; row < count; ++row) {
    const bool is_shared = models[row] == &m_;
    used_[row] = is_shared ? &shared_ : &own_[row];
    if (!is_shared) used_[row]->forget();
    have_friction |= has_friction(*models[row]);
  }
  return !have_friction;
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

bool ConstraintMaker::find(const Lanes& lanes, std::uint32_t rows, const Solver& solver, const RowModels& models,
                           const RowData& data) {
  Contacts& c = contacts_;
  c.rows = rows;
  if (!code_.instantiateLimit(lanes, c) || !code_.collision(lanes, c)) return false;
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    if (c.found[lane] > m_.nconmax || c.constraints[lane] > m_.njmax) return false;
    if (!solver.can_solve(*data[lane], c.constraints[lane])) return false;
  }
  for (int i = 0; i < c.limit_count; ++i)
    if (!set_numbers(c.limits[i], [&](int lane) { return used_[lane]->of_limit(*models[lane], c.limits[i].joint); }))
      return false;
  for (int i = 0; i < c.contact_count; ++i)
    if (!set_numbers(c.contacts[i],
                     [&](int lane) { return used_[lane]->of_contact(*models[lane], c.contacts[i].pair); }))
      return false;
  return true;
}

}  // namespace mjenv::core::lanes
