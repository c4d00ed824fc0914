#include "engine/lanes/mujoco2/constraint_maker.hpp"

#include <algorithm>
#include <cstddef>
#include <exception>

namespace mjenv::core::lanes {
namespace {

// Whether mjData's stack is certainly large enough for MuJoCo's search for pairs. If it is not, the search may fail.
bool has_room_to_search(const mjModel& m, const mjData& d) {
  const std::int64_t bodies = m.nbody;
  return d.nstack - d.pstack >= bodies * bodies + 16 * bodies;
}

}  // namespace

std::unique_ptr<ConstraintMaker> ConstraintMaker::make(const Code& code, const mjModel& m, const ModelTables& tables) {
  if (!tables.knows_pairs) return nullptr;
  return std::unique_ptr<ConstraintMaker>(new ConstraintMaker(code, m, tables));
}

ConstraintMaker::ConstraintMaker(const Code& code, const mjModel& m, const ModelTables& tables)
    : RowMaker(code, m, tables.contact_pairs, tables.equalities, tables.is_still_tendon,
               {{&Contacts::single_dist, Contacts::kMostSingle},
                {&Contacts::single_pos, 3 * Contacts::kMostSingle},
                {&Contacts::single_frame, 9 * Contacts::kMostSingle}}),
      are_always_searched_(tables.searched.has_value()),
      tables_(tables) {
  static_assert(Contacts::kMostSingle == mjMAXCONPAIR);
  contacts_.maker = this;
  contacts_.collide = [](void* maker, int pair, unsigned rows) {
    return static_cast<ConstraintMaker*>(maker)->collide(pair, rows);
  };
}

bool ConstraintMaker::follow(const RowModels& models, const RowData& data, int count) {
  // If a row's own values may change which contacts MuJoCo finds, its model lists no pairs, so without lanes MuJoCo
  // would search for them.
  contacts_.are_searched =
      are_always_searched_ || rows_in_which(models, count, [](const mjModel& m) { return m.npair == 0; });
  return RowMaker::follow(models, data, count);
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
  return set_numbers();
}

}  // namespace mjenv::core::lanes
