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
  return model.pairs() ? "" : "the search for pairs of geoms";
}

ListedPairs::ListedPairs(const Model& model) {
  if (!is_disabled(*model.get()) && model.pairs()) pairs = contact_pairs(*model.get(), *model.pairs(), columns);
}

// No tendon counts as still: of one whose Jacobian is 0, MakeConstraint leaves the rows to MuJoCo.
Collider::Collider(const Model& model, const Code& code)
    : ListedPairs(model),
      RowMaker(code, *model.stepped(), pairs,
               std::vector<unsigned char>(static_cast<std::size_t>(model.get()->ntendon))),
      without_contacts_(m_) {
  without_contacts_.opt.disableflags |= mjDSBL_CONTACT;
}

bool Collider::follows(const mjModel& row) const {
  return is_disabled(m_) || row.npair == m_.npair;  // rows that search for pairs have no list
}

bool Collider::find_contacts(const Lanes& lanes, std::uint32_t rows) {
  contacts_.rows = rows;
  return is_disabled(m_) || code_.collision(lanes, contacts_);
}

bool Collider::find(const Lanes& lanes, std::uint32_t rows) {
  contacts_.rows = rows;
  return code_.instantiateLimit(lanes, contacts_) && find_contacts(lanes, rows) && set_numbers();
}

// Meanwhile its stack holds a list of the pairs, and what a pair's function computes.
std::int64_t Collider::bytes_of(const mjModel& m, std::int64_t contacts) {
  return contacts * static_cast<std::int64_t>(sizeof(mjContact) + sizeof(double)) + 128 * m.npair + 4096;
}

bool Collider::has_room(const RowData& data) const {
  for (int lane = 0; lane < code_.width; ++lane)
    if (contacts_.rows >> lane & 1 && bytes_of(m_, contacts_.found[lane]) > data[lane]->narena) return false;
  return true;
}

void Collider::write(int row, const mjModel& m, mjData& d) const {
  mj_collision(&without_contacts_, &d);  // clears the contacts and constraints
  for (int n = 0; n < contacts_.contact_count; ++n) {
    if (!(contacts_.contacts[n].found_rows >> row & 1)) continue;
    const int pair = contacts_.contacts[n].pair;
    const auto copy = [&](mjtNum* to, const double* from, int count) {
      for (int i = 0; i < count; ++i) to[i] = from[(n * count + i) * code_.width + row];
    };
    mjContact con{};
    copy(&con.dist, contacts_.dist, 1);
    copy(con.pos, contacts_.pos, 3);
    copy(con.frame, contacts_.frame, 9);
    con.dim = m.pair_dim[pair];
    con.includemargin = m.pair_margin[pair];
    con.exclude = con.dist >= con.includemargin;
    std::copy_n(m.pair_solref + mjNREF * pair, mjNREF, con.solref);
    std::copy_n(m.pair_solimp + mjNIMP * pair, mjNIMP, con.solimp);
    for (int i = 0; i < 5; ++i) con.friction[i] = std::max<mjtNum>(mjMINMU, m.pair_friction[5 * pair + i]);
    con.geom1 = con.geom[0] = m.pair_geom1[pair];
    con.geom2 = con.geom[1] = m.pair_geom2[pair];
    for (int i = 0; i < 2; ++i) con.flex[i] = con.elem[i] = con.vert[i] = -1;
    con.efc_address = -1;
    if (mj_addContact(&m, &d, &con)) return;
  }
}

}  // namespace mjenv::core::lanes
