#include "engine/lanes/frame/row_solver.hpp"

#include <algorithm>
#include <cstddef>
#include <limits>

namespace mjenv::core::lanes {
namespace {

// The arrays of Constraints that every version has.
Counts<Constraints> counts(const mjModel& m, int most_places, const Counts<Constraints>& special) {
  using C = Constraints;
  const auto nv = static_cast<std::size_t>(m.nv), places = static_cast<std::size_t>(most_places);
  Counts<C> all{
      {&C::J, places * nv}, {&C::D, places},     {&C::vel, places},     {&C::aref, places},         {&C::b, places},
      {&C::jar, places},    {&C::force, places}, {&C::damping, places}, {&C::spring, places},       {&C::tolerance, 1},
      {&C::meaninertia, 1}, {&C::low, places},   {&C::high, places},    {&C::frictionloss, places}, {&C::bend, places}};
  const Counts<C> of_PGS{{&C::ARinv, places}, {&C::A, places}, {&C::least, places}, {&C::greatest, places}};
  const Counts<C> of_primal{{&C::Jv, places}, {&C::quad, 3 * places}, {&C::Ma, nv},   {&C::Mv, nv},
                            {&C::grad, nv},   {&C::search, nv},       {&C::Mgrad, nv}};
  const Counts<C> of_CG{{&C::Mgraddif, nv}}, of_newton{{&C::vec, nv}, {&C::H, nv * nv}};
  const auto append = [&](const Counts<C>& more) { all.insert(all.end(), more.begin(), more.end()); };
  if (m.opt.solver == mjSOL_PGS) {
    append(of_PGS);
  } else {
    append(of_primal);
    append(m.opt.solver == mjSOL_CG ? of_CG : of_newton);
  }
  append(special);
  return all;
}

}  // namespace

RowSolver::RowSolver(const Code& code, const mjModel& m, int places, const Counts<Constraints>& special)
    : code_(code),
      nv_(static_cast<int>(m.nv)),
      is_dual_(m.opt.solver == mjSOL_PGS),
      places_(places),
      memory_(constraints_, code.width, counts(m, places, special)),
      bits_(static_cast<std::size_t>(4 * places)),
      columns_(static_cast<std::size_t>(places * (nv_ + 1))),
      zeros_(static_cast<std::size_t>(nv_)),
      constraints_at_(static_cast<std::size_t>(code.width * places)) {
  constraints_.quadratic = bits_.data();
  constraints_.old = bits_.data() + places;
  constraints_.dims = bits_.data() + 2 * places;
  constraints_.middle = bits_.data() + 3 * places;
  constraints_.column_counts = columns_.data();
  constraints_.columns = columns_.data() + places;
}

std::size_t RowSolver::bytes(int width, const mjModel& m, int places, const Counts<Constraints>& special) {
  return Memory<Constraints>::bytes(width, counts(m, places, special));
}

void RowSolver::set_size(std::uint32_t rows, int most, int bounded, int cones) {
  constraints_.rows = rows;
  const bool is_numbered = constraints_.is_numbered, has_rest = is_dual_ && !is_numbered;
  constraints_.size = is_numbered ? in_fours(most) : has_rest ? most / 4 * 4 + Constraints::kRest : most;
  constraints_.bounded = has_rest && bounded > 0 ? constraints_.size : bounded;
  constraints_.cones = cones < 0 ? constraints_.size : cones;
}

int RowSolver::places_without_contacts(const Contacts& contacts) {
  int places = contacts.friction_count + contacts.limit_count;
  for (int i = 0; i < contacts.equality_count; ++i) places += contacts.equals[i].equality->size;
  return places;
}

void RowSolver::load(std::uint32_t rows, const RowData& data) {
  int most = 0, bounded = 0;
  for (int lane = 0; lane < code_.width; ++lane) {
    if (!(rows >> lane & 1)) continue;
    most = std::max(most, data[lane]->nefc);
    bounded = std::max(bounded, data[lane]->ne + data[lane]->nf);
  }
  set_size(rows, most, bounded);
  for (int lane = 0; lane < code_.width; ++lane)
    for (int at = 0; at < constraints_.size; ++at)
      constraint_at(lane, at) = usual_constraint_at(at, data[row_of(lane, rows)]->nefc);
  load_places(rows, data);
}

int RowSolver::usual_constraint_at(int place, int count) const {
  if (place < in_blocks(count)) return place;
  const int in_rest = place - (constraints_.size - Constraints::kRest);
  return is_dual_ && in_rest >= 0 && in_rest < count - in_blocks(count) ? in_blocks(count) + in_rest : -1;
}

void RowSolver::load_places(std::uint32_t rows, const RowData& data) {
  RowData from{};
  for (int lane = 0; lane < code_.width; ++lane) load_row(lane, *(from[lane] = data[row_of(lane, rows)]));
  gather_J(from);
}

void RowSolver::gather_J(const RowData& from) {
  std::array<const double*, kMaxWidth> numbers{};
  for (int at = 0; at < constraints_.size; ++at) {
    for (int lane = 0; lane < code_.width; ++lane) {
      const int constraint = constraint_at(lane, at);
      numbers[lane] =
          constraint < 0 ? zeros_.data() : from[lane]->efc_J + static_cast<std::ptrdiff_t>(constraint) * nv_;
    }
    code_.gather(constraints_.J + static_cast<std::ptrdiff_t>(at) * nv_ * code_.width, numbers.data(), nv_);
  }
}

void RowSolver::load_row(int lane, const mjData& d) {
  Constraints& c = constraints_;
  for (int at = 0; at < c.size; ++at) {
    const int i = constraint_at(lane, at), number = at * code_.width + lane;
    const double* const KBIP = d.efc_KBIP + static_cast<std::ptrdiff_t>(4) * std::max(i, 0);
    c.D[number] = i < 0 ? 0 : d.efc_D[i];
    c.damping[number] = i < 0 ? 0 : KBIP[1];
    c.spring[number] = i < 0 ? 0 : KBIP[0] * KBIP[2] * (d.efc_pos[i] - d.efc_margin[i]);
    if (is_dual_) c.R[number] = i < 0 ? 0 : d.efc_R[i];
    if (!c.has_references) continue;
    c.vel[number] = i < 0 ? 0 : d.efc_vel[i];
    c.aref[number] = i < 0 ? 0 : d.efc_aref[i];
  }
  if (c.bounded > 0) load_bounds(lane, d);
}

void RowSolver::load_bounds(int lane, const mjData& d) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity(),
                   kNoBound = std::numeric_limits<double>::quiet_NaN();
  Constraints& c = constraints_;
  for (int at = 0; at < c.bounded; ++at) {
    const int i = constraint_at(lane, at), number = at * code_.width + lane;
    const bool is_friction = i >= d.ne && i < d.ne + d.nf, is_equality = i >= 0 && i < d.ne;
    const double R = is_friction ? d.efc_R[i] : 0, loss = is_friction ? d.efc_frictionloss[i] : 0;
    c.low[number] = is_friction ? -(R * loss) : kNoBound;
    c.high[number] = is_friction ? R * loss : is_equality ? kNoBound : 0;
    c.frictionloss[number] = loss;
    c.bend[number] = is_friction ? -0.5 * R * loss * loss : 0;
    if (!is_dual_) continue;
    c.least[number] = is_friction ? -loss : is_equality ? -kInfinite : 0;
    c.greatest[number] = is_friction ? loss : kInfinite;
  }
}

void RowSolver::set_rest(Lanes& lanes, std::uint32_t rows) const {
  if (rows == 0) {
    const auto count = static_cast<std::size_t>(nv_) * static_cast<std::size_t>(code_.width);
    std::copy_n(lanes.qacc_smooth, count, lanes.qacc);
    std::fill_n(lanes.qfrc_constraint, count, 0.0);
    return;
  }
  for (int lane = 0; lane < code_.width; ++lane) {
    if (rows >> lane & 1) continue;
    for (int i = 0; i < nv_; ++i) {
      lanes.qacc[i * code_.width + lane] = lanes.qacc_smooth[i * code_.width + lane];
      lanes.qfrc_constraint[i * code_.width + lane] = 0;
    }
  }
}

void RowSolver::write_references(int lane, mjData& d) const {
  const Constraints& c = constraints_;
  for (int at = 0; at < c.size; ++at) {
    const int i = constraint_at(lane, at), number = at * code_.width + lane;
    if (i < 0) continue;
    d.efc_vel[i] = c.vel[number];
    d.efc_aref[i] = c.aref[number];
    d.efc_b[i] = c.b[number];
  }
}

void RowSolver::write_forces(int lane, mjData& d) const {
  for (int at = 0; at < constraints_.size; ++at) {
    const int i = constraint_at(lane, at);
    if (i >= 0) d.efc_force[i] = constraints_.force[at * code_.width + lane];
  }
}

}  // namespace mjenv::core::lanes
