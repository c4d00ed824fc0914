// The geom pairs that can ever touch, so that collision detection can skip its search for them.
#pragma once

#include <optional>
#include <vector>

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core {

// Explicit pairs for mjModel's pair_* arrays, in the order in which MuJoCo's search finds them and with the parameters
// that it would mix, so that the contacts are the same bit for bit.
struct Pairs {
  std::vector<int> dim, geom1, geom2;
  std::vector<double> solref, solimp, margin, gap, friction;
};

// Returns no value where MuJoCo's search may find other contacts than such a list gives. MuJoCo prunes pairs of moving
// geoms in float32, which could miss a touch of less than 1e-7 m; `trusted` says that this is known to change nothing.
std::optional<Pairs> explicit_pairs(const mjModel_& model, bool trusted);

}  // namespace mjenv::core
