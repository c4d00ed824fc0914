#include "engine/pairs.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "engine/mujoco.hpp"

namespace mjenv::core {
namespace {

// If there are more pairs than this, MuJoCo's search is faster than testing each pair of a list.
constexpr std::size_t kMaxPairs = 512;
// The limit for lists that lanes test, which is higher because lanes test pairs faster than MuJoCo does.
constexpr std::size_t kMaxSearchedPairs = 4096;

bool is_surface(const mjModel& m, int geom) {
  return m.geom_type[geom] == mjGEOM_PLANE || m.geom_type[geom] == mjGEOM_HFIELD;
}

// Whether a list of pairs can replace MuJoCo's search: the model has no setting that changes what the search finds,
// except excluded bodies, which list_pairs considers.
bool can_replace_search(const mjModel& m) {
  if (m.npair > 0 || m.opt.enableflags & kSearchEnabled || m.opt.disableflags & kSearchDisabled ||
      has_search_settings(m))
    return false;
  for (int g = 0; g < m.ngeom; ++g)
    if (is_surface(m, g) && m.geom_bodyid[g] != 0) return false;
  return true;
}

// Whether MuJoCo's filter lets these geoms collide if their values of contype and conaffinity do.
bool can_touch(const mjModel& m, int g1, int g2) {
  const auto types = std::minmax(m.geom_type[g1], m.geom_type[g2]);
  if (!mjCOLLISIONFUNC[types.first][types.second]) return false;
  const int weld1 = m.body_weldid[m.geom_bodyid[g1]], weld2 = m.body_weldid[m.geom_bodyid[g2]];
  if (weld1 == weld2 || (m.body_dofnum[weld1] == 0 && m.body_dofnum[weld2] == 0)) return false;
  const bool filter_parent = !(m.opt.disableflags & mjDSBL_FILTERPARENT) && weld1 && weld2;
  const int parent1 = m.body_weldid[m.body_parentid[weld1]], parent2 = m.body_weldid[m.body_parentid[weld2]];
  return !filter_parent || (weld1 != parent2 && weld2 != parent1);
}

// The weight of g1 when MuJoCo mixes the solref and solimp of two geoms.
double mix_of(const mjModel& m, int g1, int g2) {
  const double s1 = m.geom_solmix[g1], s2 = m.geom_solmix[g2];
  if (s1 >= mjMINVAL && s2 >= mjMINVAL) return s1 / (s1 + s2);
  if (s1 < mjMINVAL && s2 < mjMINVAL) return 0.5;
  return s1 < mjMINVAL ? 0.0 : 1.0;
}

// Appends a pair with the parameters that MuJoCo would compute at each contact. g1's type must not be above g2's.
void append(Pairs& pairs, const mjModel& m, int g1, int g2) {
  const bool equal = m.geom_priority[g1] == m.geom_priority[g2];
  const int first = m.geom_priority[g1] > m.geom_priority[g2] ? g1 : g2;

  pairs.geom1.push_back(g1);
  pairs.geom2.push_back(g2);
  pairs.dim.push_back(equal ? std::max(m.geom_condim[g1], m.geom_condim[g2]) : m.geom_condim[first]);
  pairs.margin.push_back(mixed_margin(m.geom_margin[g1], m.geom_margin[g2]));
  pairs.gap.push_back(mixed_margin(m.geom_gap[g1], m.geom_gap[g2]));
  append_more(pairs, m, g1, g2, first, equal);

  std::array<double, 3> friction{};
  for (int i = 0; i < 3; ++i)
    friction[i] =
        equal ? std::max(m.geom_friction[3 * g1 + i], m.geom_friction[3 * g2 + i]) : m.geom_friction[3 * first + i];
  pairs.friction.insert(pairs.friction.end(), {friction[0], friction[0], friction[1], friction[2], friction[2]});

  const double mix = mix_of(m, g1, g2);
  const double *ref1 = m.geom_solref + mjNREF * g1, *ref2 = m.geom_solref + mjNREF * g2;
  const bool standard = ref1[0] > 0 && ref2[0] > 0;
  for (int i = 0; i < mjNREF; ++i) {
    const double mixed = standard ? mix * ref1[i] + (1 - mix) * ref2[i] : std::min(ref1[i], ref2[i]);
    pairs.solref.push_back(equal ? mixed : m.geom_solref[mjNREF * first + i]);
  }
  const double *imp1 = m.geom_solimp + mjNIMP * g1, *imp2 = m.geom_solimp + mjNIMP * g2;
  for (int i = 0; i < mjNIMP; ++i)
    pairs.solimp.push_back(equal ? imp1[i] * mix + imp2[i] * (1 - mix) : m.geom_solimp[mjNIMP * first + i]);
}

bool are_excluded(const mjModel& m, int body1, int body2) {
  const int signature = (body1 + 1) * (1 << 16) + body2 + 1;
  return std::count(m.exclude_signature, m.exclude_signature + m.nexclude, signature) > 0;
}

// Lists the pairs that can touch. Returns no value if a list cannot replace MuJoCo's search, if there are more pairs
// than `most`, or if one of them is between two bodies other than the world and between_bodies is false. are_all: the
// list also has the pairs for which MuJoCo searches all the same.
std::optional<Pairs> list_pairs(const mjModel& m, bool between_bodies, bool are_all, std::size_t most) {
  if (!can_replace_search(m)) return std::nullopt;
  Pairs pairs;
  // MuJoCo sorts the pairs by bodies. This loop gives the same order, because geoms are numbered body by body.
  for (int b1 = 0; b1 < m.nbody; ++b1)
    for (int b2 = b1 + 1; b2 < m.nbody; ++b2) {
      if (are_excluded(m, b1, b2)) continue;
      std::vector<std::pair<int, int>> found;
      for (int g1 = m.body_geomadr[b1]; g1 < m.body_geomadr[b1] + m.body_geomnum[b1]; ++g1)
        for (int g2 = m.body_geomadr[b2]; g2 < m.body_geomadr[b2] + m.body_geomnum[b2]; ++g2) {
          if (!can_touch(m, g1, g2) || !are_types_compatible(m, g1, g2)) continue;
          if (!between_bodies && b1 != 0) return std::nullopt;
          if (pairs.dim.size() + found.size() == most) return std::nullopt;
          found.push_back(m.geom_type[g1] > m.geom_type[g2] ? std::pair(g2, g1) : std::pair(g1, g2));
        }
      if (!are_all && b1 == 0 && needs_search(m, b2)) {
        for (const auto& [g1, g2] : found) pairs.searched.insert(pairs.searched.end(), {g1, g2});
        continue;
      }
      if (kSortsPairs) std::sort(found.begin(), found.end());
      for (const auto& [g1, g2] : found) append(pairs, m, g1, g2);
    }
  return pairs;
}

void clear(Pairs& mixed) {
  for (auto* array : {&mixed.dim, &mixed.geom1, &mixed.geom2, &mixed.signature}) array->clear();
  for (auto* array : {&mixed.solref, &mixed.solimp, &mixed.margin, &mixed.gap, &mixed.friction, &mixed.solreffriction,
                      &mixed.adhesion})
    array->clear();
}

}  // namespace

bool are_searched_alike(const mjModel& a, const mjModel& b) {
  return ((a.opt.enableflags ^ b.opt.enableflags) & kSearchEnabled) == 0 &&
         ((a.opt.disableflags ^ b.opt.disableflags) & (kSearchDisabled | mjDSBL_FILTERPARENT)) == 0;
}

bool are_types_compatible(const mjModel& m, int g1, int g2) {
  return (m.geom_contype[g1] & m.geom_conaffinity[g2]) || (m.geom_contype[g2] & m.geom_conaffinity[g1]);
}

std::optional<std::vector<std::pair<int, int>>> pairs_kept_apart(const mjModel& m) {
  std::vector<std::pair<int, int>> pairs;
  for (int g1 = 0; g1 < m.ngeom; ++g1)
    for (int g2 = g1 + 1; g2 < m.ngeom; ++g2) {
      const auto bodies = std::minmax(m.geom_bodyid[g1], m.geom_bodyid[g2]);
      if (are_types_compatible(m, g1, g2) || !can_touch(m, g1, g2) || are_excluded(m, bodies.first, bodies.second))
        continue;
      if (pairs.size() == kMaxSearchedPairs) return std::nullopt;
      pairs.emplace_back(g1, g2);
    }
  return pairs;
}

std::optional<Pairs> explicit_pairs(const mjModel& m, bool misses_none) {
  auto pairs = m.nexclude > 0 ? std::nullopt : list_pairs(m, misses_none, false, kMaxPairs);
  if (pairs) exclude_bodies(*pairs, m);
  return pairs;
}

std::optional<Pairs> searched_pairs(const mjModel& m) {
  for (int g = 0; g < m.ngeom; ++g)
    if (m.geom_margin[g] < 0 || (m.geom_bodyid[g] != 0 && !(m.geom_rbound[g] > 0))) return std::nullopt;
  return list_pairs(m, true, true, kMaxSearchedPairs);
}

void set_pairs(mjModel& view, Pairs& pairs) {
  use_pairs(view, pairs);
  view.npair = static_cast<int>(pairs.dim.size());
  view.pair_dim = pairs.dim.data();
  view.pair_geom1 = pairs.geom1.data();
  view.pair_geom2 = pairs.geom2.data();
  view.pair_solref = pairs.solref.data();
  view.pair_solimp = pairs.solimp.data();
  view.pair_margin = pairs.margin.data();
  view.pair_gap = pairs.gap.data();
  view.pair_friction = pairs.friction.data();
}

void mix_one(int geom1, int geom2, const mjModel& m, Pairs& mixed) {
  clear(mixed);
  append(mixed, m, geom1, geom2);
}

void mix_again(const Pairs& listed, const mjModel& m, Pairs& mixed) {
  clear(mixed);
  mixed.contype = listed.contype;
  mixed.conaffinity = listed.conaffinity;
  for (std::size_t i = 0; i < listed.geom1.size(); ++i) append(mixed, m, listed.geom1[i], listed.geom2[i]);
}

}  // namespace mjenv::core
