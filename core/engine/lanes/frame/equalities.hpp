// The equality constraints of a model, and the dofs on which they act.
#pragma once

#include <vector>

#include "engine/lanes/frame/constraints.hpp"

namespace mjenv::core::lanes {

// The model's equality constraints, active or not, without those for which MuJoCo never makes a constraint, because no
// dof moves what they constrain. is_still_tendon: for each tendon, whether its Jacobian is always 0. columns:
// Lanes::columns, to which this appends what the equalities name.
std::vector<Equality> possible_equalities(const mjModel_& m, const std::vector<unsigned char>& is_still_tendon,
                                          std::vector<int>& columns);

}  // namespace mjenv::core::lanes
