// Lists the geom pairs that can ever touch, so that collision detection need not search for them.
#pragma once

#include <optional>
#include <vector>

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

// Explicit pairs for mjModel's pair_* arrays. Their order is that of MuJoCo's search, and their parameters are those
// that MuJoCo would compute, so the contacts are the same bit for bit.
struct Pairs {
  std::vector<int> dim, geom1, geom2;
  std::vector<double> solref, solimp, margin, gap, friction;
  // Only MuJoCo 4 has these. no_type is the contype and conaffinity of bodies that take part in no search.
  std::vector<int> signature, no_type;
  std::vector<double> solreffriction, adhesion;
};

// Returns no value if MuJoCo's search might find other contacts than a list gives: it excludes moving geoms by float32
// numbers, and could miss a contact of less than 1e-7 m. `trusted` says that this does not happen in this model.
std::optional<Pairs> explicit_pairs(const mjModel_& model, bool trusted);

// All pairs that MuJoCo's search can find, in its order; which of them it finds in a state is for the caller to see.
// Returns no value if there are too many, or if a setting changes what the search finds.
std::optional<Pairs> searched_pairs(const mjModel_& model);

// Makes collision detection in a view of the model use the pairs alone. The view refers to them.
void set_pairs(mjModel_& view, Pairs& pairs);

// Computes the parameters of the same pairs for a model that differs in the parameters of its geoms.
void mix_again(const Pairs& listed, const mjModel_& model, Pairs& mixed);
// The same for one pair, of the geoms in the order of their types. Allocates no memory if `mixed` has room for a pair.
void mix_one(int geom1, int geom2, const mjModel_& model, Pairs& mixed);

}  // namespace mjenv::core
