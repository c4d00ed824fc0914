#include "engine/lanes/mujoco4/collider.hpp"

#include <algorithm>

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {

namespace {

// Whether MuJoCo finds no contacts at all.
bool is_disabled(const mjModel& m) { return (m.opt.disableflags & (mjDSBL_CONTACT | mjDSBL_CONSTRAINT)) != 0; }

}  // namespace

std::string Collider::obstacle(const Model& model) {
  if (is_disabled(*model.get())) return "";
  return searched_pairs(*model.get()) ? "" : "the search for pairs of geoms";
}

// No tendon counts as still: of one whose Jacobian is 0, MakeConstraint leaves the rows to MuJoCo.
ListedPairs::ListedPairs(const Model& model)
    : is_still_tendon(static_cast<std::size_t>(model.get()->ntendon)),
      equalities(possible_equalities(*model.get(), is_still_tendon, columns)) {
  if (is_disabled(*model.get())) return;
  listed = *searched_pairs(*model.get());
  pairs = contact_pairs(*model.get(), listed, columns);
}

Collider::Collider(const Model& model, const Code& code)
    : ListedPairs(model), RowMaker(code, *model.stepped(), pairs, equalities, is_still_tendon), without_contacts_(m_) {
  without_contacts_.opt.disableflags |= mjDSBL_CONTACT;
}

void Collider::list_pairs(Lanes& lanes) const {
  lanes.columns = columns.data();
  lanes.pair_margin = listed.margin.data();
  lanes.pair_gap = listed.gap.data();
}

bool Collider::find_contacts(const Lanes& lanes, std::uint32_t rows) {
  contacts_.rows = rows;
  return is_disabled(m_) || code_.collision(lanes, contacts_);
}

bool Collider::find(const Lanes& lanes, std::uint32_t rows) {
  contacts_.rows = rows;
  return code_.instantiateLimit(lanes, contacts_) && find_contacts(lanes, rows) && set_numbers();
}

// Meanwhile its stack holds lists of the pairs of bodies and of geoms, and what a pair's function computes.
std::int64_t Collider::bytes_of(const mjModel& m, const Contacts& found, std::int64_t contacts) {
  return contacts * static_cast<std::int64_t>(sizeof(mjContact) + sizeof(double)) +
         std::int64_t{128} * found.pair_count + m.nbody * (8 * m.nbody + 256) + 4096;
}

bool Collider::has_room(const RowData& data) const {
  for (int lane = 0; lane < code_.width; ++lane)
    if (contacts_.rows >> lane & 1 && bytes_of(m_, contacts_, contacts_.found[lane]) > data[lane]->narena) return false;
  return true;
}

void Collider::write(int row, const mjModel& m, mjData& d) {
  mj_collision(&without_contacts_, &d);  // clears the contacts and constraints
  for (int n = 0; n < contacts_.contact_count; ++n) {
    if (!(contacts_.contacts[n].found_rows >> row & 1)) continue;
    const ContactPair& geoms = contacts_.pairs[contacts_.contacts[n].pair];
    mix_one(geoms.geom1, geoms.geom2, m, mixed_);
    const auto copy = [&](mjtNum* to, const double* from, int count) {
      for (int i = 0; i < count; ++i) to[i] = from[(n * count + i) * code_.width + row];
    };
    mjContact con{};
    copy(&con.dist, contacts_.dist, 1);
    copy(con.pos, contacts_.pos, 3);
    copy(con.frame, contacts_.frame, 9);
    con.dim = geoms.dim;
    con.includemargin = mixed_.margin[0];
    con.exclude = con.dist >= con.includemargin;
    std::copy_n(mixed_.solref.data(), mjNREF, con.solref);
    std::copy_n(mixed_.solimp.data(), mjNIMP, con.solimp);
    for (int i = 0; i < 5; ++i) con.friction[i] = std::max<mjtNum>(mjMINMU, mixed_.friction[i]);
    con.geom1 = con.geom[0] = geoms.geom1;
    con.geom2 = con.geom[1] = geoms.geom2;
    for (int i = 0; i < 2; ++i) con.flex[i] = con.elem[i] = con.vert[i] = -1;
    con.efc_address = -1;
    if (mj_addContact(&m, &d, &con)) return;
  }
}

}  // namespace mjenv::core::lanes
