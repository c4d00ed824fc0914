#include "engine/lanes/mujoco2/solver.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

namespace mjenv::core::lanes {
namespace {

bool is_elliptic(const mjModel& m) { return m.opt.cone == mjCONE_ELLIPTIC; }
bool removes_slip(const mjModel& m) { return m.opt.noslip_iterations > 0; }
// Constraints::is_aligned and is_numbered of the main solver
bool is_aligned(const mjModel& m) { return m.opt.solver != mjSOL_PGS && (is_elliptic(m) || mj_isSparse(&m)); }
bool is_numbered(const mjModel& m) { return !is_aligned(m) && (is_elliptic(m) || removes_slip(m)); }

void append(Counts<Constraints>& counts, const Counts<Constraints>& more) {
  counts.insert(counts.end(), more.begin(), more.end());
}

// MuJoCo's dualState for constraint i: whether the force that PGS has found is in the quadratic zone.
bool is_quadratic_of(const mjData& d, int i) {
  if (i < d.ne) return true;
  const double force = d.efc_force[i];
  return i < d.ne + d.nf ? std::fabs(force) < d.efc_frictionloss[i] : force > 0;
}

// The arrays that only some solvers have
Counts<Constraints> special_counts(const mjModel& m, int most_places) {
  using C = Constraints;
  const auto nv = static_cast<std::size_t>(m.nv), places = static_cast<std::size_t>(most_places);
  const bool is_pgs = m.opt.solver == mjSOL_PGS;
  Counts<Constraints> result;
  if (is_pgs || is_numbered(m)) append(result, {{&C::JM2, places * nv}, {&C::AR, places * places}});
  if (is_pgs || removes_slip(m)) append(result, {{&C::R, places}});
  if (removes_slip(m)) append(result, {{&C::noslip_tolerance, 1}});
  if (is_elliptic(m)) append(result, {{&C::scale, places}});
  if (mj_isSparse(&m)) append(result, {{&C::products, std::max(places, 2 * nv)}});
  if (is_elliptic(m) && m.opt.solver == mjSOL_NEWTON) append(result, {{&C::Hcone, nv * nv}, {&C::LTJ, 6 * nv}});
  return result;
}

// Those of Solver::numbered_
Counts<Constraints> numbered_counts(const mjModel& m) {
  using C = Constraints;
  if (!is_aligned(m) || !removes_slip(m)) return {};
  constexpr std::size_t kPlaces = C::kMostNumbered;
  const auto nv = static_cast<std::size_t>(m.nv);
  return {{&C::J, kPlaces * nv}, {&C::JM2, kPlaces * nv}, {&C::AR, kPlaces * kPlaces}, {&C::b, kPlaces},
          {&C::force, kPlaces},  {&C::R, kPlaces},        {&C::frictionloss, kPlaces}, {&C::scale, kPlaces}};
}

}  // namespace

std::string Solver::unsupported_feature(const mjModel& m) {
  if (!mj_isSparse(&m)) return "";
  if (m.opt.solver == mjSOL_PGS) return "PGS with sparse Jacobians";
  if (removes_slip(m)) return "noslip with sparse Jacobians";
  return m.ntendon > 0 ? "sparse Jacobians of tendons" : "";
}

std::unique_ptr<Solver> Solver::make(const Code& code, const mjModel& m) {
  return unsupported_feature(m).empty() ? std::unique_ptr<Solver>(new Solver(code, m)) : nullptr;
}

std::size_t Solver::bytes(int width, const mjModel& m) {
  if (!unsupported_feature(m).empty()) return 0;
  const int places = places_of(m);
  return RowSolver::bytes(width, m, places, special_counts(m, places)) +
         Memory<Constraints>::bytes(width, numbered_counts(m));
}

int Solver::places_of(const mjModel& m) { return is_aligned(m) ? kSharedPlaces : kPlaces; }

Solver::Solver(const Code& code, const mjModel& m)
    : RowSolver(code, m, places_of(m), special_counts(m, places_of(m))),
      is_elliptic_(is_elliptic(m)),
      removes_slip_(removes_slip(m)),
      numbered_memory_(numbered_, code.width, numbered_counts(m)),
      starts_(is_numbered(m) || removes_slip_ ? Constraints::kMostNumbered : 0) {
  constraints_.is_aligned = is_aligned(m);
  constraints_.is_numbered = is_numbered(m);
  numbered_.is_numbered = true;
  constraints_.starts = numbered_.starts = starts_.data();
  numbered_.column_counts = constraints_.column_counts;
  numbered_.columns = constraints_.columns;
  constraints_.is_sparse = mj_isSparse(&m) != 0;
  if (constraints_.is_sparse) make_pattern(m);
}

// The memory for sparse Jacobians. Without constraints, the Hessian has the elements of M.
void Solver::make_pattern(const mjModel& m) {
  const auto nv = static_cast<std::size_t>(nv_), places = static_cast<std::size_t>(places_), all = nv * nv;
  elements_.resize(3 * all + 3 * nv + 2 * places + std::max(nv, places));
  element_columns_.resize(nv * (nv + places) + 2 * nv);
  unsigned char* byte = elements_.data();
  const auto bytes = [&](std::size_t count) { return std::exchange(byte, byte + count); };
  int* number = element_columns_.data();
  const auto numbers = [&](std::size_t count) { return std::exchange(number, number + count); };
  unsigned char* const of_M = bytes(all);
  for (int i = 0; i < nv_; ++i)
    for (int j = i; j >= 0; j = m.dof_simplenum[i] ? -1 : m.dof_parentid[j]) of_M[i * nv_ + j] = 255;
  Pattern& pattern = constraints_.pattern;
  pattern = {of_M, bytes(all), bytes(all), numbers(all), numbers(nv), bytes(nv), bytes(nv), bytes(nv)};
  std::fill_n(pattern.is_changed, nv_, 1);  // nothing is listed yet
  constraints_.most_places = places_;
  constraints_.holders = bytes(places);
  constraints_.couples = bytes(places);
  constraints_.product_lanes = bytes(std::max(nv, places));
  constraints_.dof_places = numbers(nv * places);
  constraints_.dof_place_counts = numbers(nv);
}

// MuJoCo fails if its stack is too small to make or solve the constraints. Rows in which this might happen are left to
// MuJoCo, so that they fail there.
bool Solver::can_solve(const mjData& d, int constraints) const {
  return constraints <= kMaxConstraints &&
         d.nstack - d.pstack >= stack_numbers(constraints, nv_, constraints_.is_sparse);
}

int Solver::shared_places(const Contacts& contacts) const {
  int places = places_without_contacts(contacts);
  for (int i = 0; i < contacts.contact_count; ++i)
    places +=
        constraints_of(contacts.pairs[contacts.contacts[i].pair], is_elliptic_ ? mjCONE_ELLIPTIC : mjCONE_PYRAMIDAL);
  return places;
}

bool Solver::has_room(const Contacts& contacts) const {
  return !constraints_.is_aligned || shared_places(contacts) <= places_;
}

void Solver::run(Lanes& lanes) {
  switch (lanes.model->opt.solver) {
    case mjSOL_PGS: return code_.solPGS(lanes, constraints_);
    case mjSOL_CG: return code_.solCG(lanes, constraints_);
    default: return code_.solNewton(lanes, constraints_);
  }
}

void Solver::solve(Lanes& lanes, std::uint32_t rows, const RowModels& models, const RowData& data, bool is_read) {
  RowSolver::load(rows, data);
  for (int lane = 0; lane < code_.width; ++lane) load(lane, *models[row_of(lane, rows)]);
  run(lanes);
  for (int lane = 0; lane < code_.width; ++lane)
    if ((rows & ~lanes.left_to_mujoco) >> lane & 1) finish(lanes, lane, *data[lane], is_read);
}

void Solver::solve(Lanes& lanes, const Contacts& contacts, const RowModels& models, const RowData& data) {
  const int width = code_.width;
  int most = 0, bounded = 0;
  std::uint32_t rows = 0;
  for (int lane = 0; lane < width; ++lane) {
    if (!(contacts.rows >> lane & 1) || contacts.constraints[lane] == 0) continue;
    most = std::max(most, contacts.constraints[lane]);
    bounded = std::max(bounded, contacts.bounded[lane]);
    rows |= 1U << lane;
  }
  if (rows != 0) {
    if (constraints_.is_aligned) {
      const int cones = places_without_contacts(contacts);
      set_size(rows, shared_places(contacts), cones - contacts.limit_count, is_elliptic_ ? cones : -1);
    } else {
      set_size(rows, most, bounded);
    }
    for (int lane = 0; lane < width; ++lane) {
      constraints_.at_first[lane] = in_blocks(contacts.constraints[lane]);
      load(lane, *models[row_of(lane, rows)]);
    }
    code_.makeConstraint(lanes, contacts, constraints_);
    if (!starts_.empty()) number(contacts);
    run(lanes);
  }
  constraints_.rows = rows;
  set_rest(lanes, rows);
  for (int lane = 0; lane < width; ++lane)
    if (contacts.rows >> lane & 1) data[lane]->nefc = contacts.constraints[lane];
}

void Solver::remove_slip(Lanes& lanes, const Contacts& contacts) {
  const std::uint32_t rows = constraints_.rows;
  if (!removes_slip_ || rows == 0) return;
  if (!constraints_.is_aligned) {
    code_.solNoSlip(lanes, constraints_, is_dual_);
  } else {
    copy_to_numbered(contacts);
    code_.solNoSlip(lanes, numbered_, false);
    copy_forces_back();
  }
  set_rest(lanes, rows);
}

// Sets starts_ and origins_.
void Solver::number(const Contacts& contacts) {
  std::fill(starts_.begin(), starts_.end(), Constraints::Starts{});
  std::array<int, kMaxWidth> counts{};
  int place = 0;
  const auto add = [&](std::uint32_t rows, int size, int block) {
    for (int k = 0; k < size; ++k, ++place)
      for (int lane = 0; lane < code_.width; ++lane) {
        if (!((rows & contacts.rows) >> lane & 1)) continue;
        const int constraint = counts[lane]++;
        origins_[lane][constraint] = place;
        const auto bit = static_cast<unsigned char>(1U << lane);
        if (k % block == 0) starts_[constraint].blocks[block] |= bit;
        if (block == 2) starts_[constraint].blocks[1] |= bit;
      }
  };
  for (int i = 0; i < contacts.equality_count; ++i) add(contacts.equals[i].rows, contacts.equals[i].equality->size, 1);
  for (int i = 0; i < contacts.friction_count; ++i) add(contacts.frictions[i].rows, 1, 1);
  for (int i = 0; i < contacts.limit_count; ++i) add(contacts.limits[i].rows, 1, 1);
  for (int i = 0; i < contacts.contact_count; ++i) {
    const ContactPair& pair = contacts.pairs[contacts.contacts[i].pair];
    const int size = constraints_of(pair, is_elliptic_ ? mjCONE_ELLIPTIC : mjCONE_PYRAMIDAL);
    add(contacts.contacts[i].rows, size, size == 1 ? 1 : (is_elliptic_ ? size : 2));
  }
}

// Copies what noslip reads from the aligned places.
void Solver::copy_to_numbered(const Contacts& contacts) {
  const Constraints& from = constraints_;
  Constraints& to = numbered_;
  const int width = code_.width;
  to.rows = from.rows;
  to.meaninertia = from.meaninertia;
  to.noslip_tolerance = from.noslip_tolerance;
  std::copy_n(from.noslip_most, width, to.noslip_most);
  int most = 0, bounded = 0;
  for (int lane = 0; lane < width; ++lane) {
    to.at_first[lane] = from.rows >> lane & 1 ? contacts.constraints[lane] : 0;
    most = std::max(most, to.at_first[lane]);
    if (to.at_first[lane] > 0) bounded = std::max(bounded, contacts.bounded[lane]);
  }
  to.bounded = bounded;
  to.size = to.cones = in_fours(most);
  for (int i = 0; i < to.size; ++i)
    for (int lane = 0; lane < width; ++lane) {
      const bool is_there = i < to.at_first[lane];
      const int place = is_there ? origins_[lane][i] : 0, number = i * width + lane, origin = place * width + lane;
      const auto copied = [&](const double* array, int index) { return is_there ? array[index] : 0; };
      to.b[number] = copied(from.b, origin);
      to.force[number] = copied(from.force, origin);
      to.R[number] = copied(from.R, origin);
      to.scale[number] = copied(from.scale, origin);
      to.frictionloss[number] = place < from.bounded ? copied(from.frictionloss, origin) : 0;
      for (int k = 0; k < nv_; ++k)
        to.J[(i * nv_ + k) * width + lane] = copied(from.J, (place * nv_ + k) * width + lane);
    }
}

void Solver::copy_forces_back() {
  const int width = code_.width;
  for (int lane = 0; lane < width; ++lane)
    for (int i = 0; i < numbered_.at_first[lane]; ++i)
      constraints_.force[origins_[lane][i] * width + lane] = numbered_.force[i * width + lane];
}

void Solver::load(int lane, const mjModel& m) {
  constraints_.tolerance[lane] = m.opt.tolerance;
  constraints_.meaninertia[lane] = m.stat.meaninertia;
  constraints_.most[lane] = std::max(0, m.opt.iterations);
  constraints_.most_evaluations[lane] = 50;  // LSmaxiter
  if (!removes_slip_) return;
  constraints_.noslip_most[lane] = m.opt.noslip_iterations;
  constraints_.noslip_tolerance[lane] = m.opt.noslip_tolerance;
}

void Solver::finish(const Lanes& lanes, int lane, mjData& d, bool is_read) const {
  const Constraints& c = constraints_;
  for (int i = 0; i < nv_; ++i) {
    d.qacc[i] = d.qacc_warmstart[i] = lanes.qacc[i * code_.width + lane];
    d.qfrc_constraint[i] = lanes.qfrc_constraint[i * code_.width + lane];
  }
  d.solver_iter = c.iterations[lane];
  if (!is_read) return;
  write_references(lane, d);
  write_forces(lane, d);
  write_states(lane, d);
}

// efc_state, of rows without elliptic cones.
void Solver::write_states(int lane, mjData& d) const {
  const Constraints& c = constraints_;
  for (int at = 0; at < c.size; ++at) {
    const int i = constraint_at(lane, at);
    if (i < 0) continue;
    const bool is_friction = i >= d.ne && i < d.ne + d.nf;
    const bool is_quadratic = is_dual_ ? is_quadratic_of(d, i) : (c.quadratic[at] >> lane & 1) != 0;
    if (is_friction && !is_quadratic)
      d.efc_state[i] = d.efc_force[i] > 0 ? mjCNSTRSTATE_LINEARNEG : mjCNSTRSTATE_LINEARPOS;
    else
      d.efc_state[i] = is_quadratic ? mjCNSTRSTATE_QUADRATIC : mjCNSTRSTATE_SATISFIED;
  }
}

}  // namespace mjenv::core::lanes
