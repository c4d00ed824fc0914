// Lists the geom pairs that can ever touch, so that collision detection need not search for them.
#pragma once

#include <optional>
#include <utility>
#include <vector>

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

// Explicit pairs for mjModel's pair_* arrays. They have the order of MuJoCo's search, and the parameters that MuJoCo
// would compute for each contact. So the contacts are the same bit for bit. In each pair, the type of geom1 is not
// above that of geom2.
struct Pairs {
  std::vector<int> dim, geom1, geom2;
  std::vector<double> solref, solimp, margin, gap, friction;
  // Only for MuJoCo 4. searched: the geoms for whose pairs it searches all the same (needs_search). contype and
  // conaffinity: those of bodies, which are 0 if a body takes no part in the search.
  std::vector<int> signature, searched, contype, conaffinity;
  std::vector<double> solreffriction, adhesion;
};

// Lists all pairs that can touch, without those for which MuJoCo searches all the same. Returns no value if there are
// too many, if a setting or excluded bodies change what MuJoCo's search finds, or if the search might miss a contact
// that the list finds: it excludes pairs of moving geoms by float32 computations, and could miss a contact in which the
// bounding spheres overlap by less than about 1e-7 times the coordinates. misses_none: the model is known to have no
// such contacts.
std::optional<Pairs> explicit_pairs(const mjModel_& model, bool misses_none);

// Lists all pairs that MuJoCo's search can find in any state, in the order of the search. The caller must determine
// which of them the search finds in a given state. Returns no value if there are too many, or if a setting changes what
// the search finds.
std::optional<Pairs> searched_pairs(const mjModel_& model);

// Lists the pairs of geoms that the search can find only in models with other values of contype and conaffinity.
// Returns no value if there are too many.
std::optional<std::vector<std::pair<int, int>>> pairs_kept_apart(const mjModel_& model);

// Whether the flags of two models that differ only in numbers let the search find the same pairs.
bool are_searched_alike(const mjModel_& a, const mjModel_& b);

// Whether the values of contype and conaffinity let these geoms touch.
bool are_types_compatible(const mjModel_& model, int geom1, int geom2);

// Makes collision detection in a view of the model test these pairs and no others. The view keeps pointers to `pairs`.
void set_pairs(mjModel_& view, Pairs& pairs);

// Computes the parameters of the listed pairs anew, for a model whose geoms have other parameters.
void mix_again(const Pairs& listed, const mjModel_& model, Pairs& mixed);
// Computes them for one pair. The type of geom1 must not be above that of geom2. Allocates no memory if `mixed` has
// room for a pair.
void mix_one(int geom1, int geom2, const mjModel_& model, Pairs& mixed);

}  // namespace mjenv::core
