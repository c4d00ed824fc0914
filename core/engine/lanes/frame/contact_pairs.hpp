// The pairs of geoms that can touch, and the dofs on which their contacts act.
#pragma once

#include <vector>

#include "engine/lanes/frame/constraints.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {

// Whether the model makes the constraints that this flag (mjtDisableBit) could disable.
bool constrains(const mjModel_& m, int flag);

// mj_isSparse
bool is_sparse(const mjModel_& m);

// The dofs that move a body, as in mj_jac.
std::vector<int> dofs_of(const mjModel_& m, int body);

// Appends the elements of `dofs` that `others` lacks to the columns. Returns how many there are.
int append_difference(std::vector<int>& columns, const std::vector<int>& dofs, const std::vector<int>& others);

// Appends the dofs that move at least one of two bodies, in ascending order, if Jacobians are sparse.
Chain chain_of(const mjModel_& m, std::vector<int> dofs, const std::vector<int>& others, std::vector<int>& columns);

// columns: Lanes::columns, to which this appends what the pairs name.
std::vector<ContactPair> contact_pairs(const mjModel_& m, const Pairs& listed, std::vector<int>& columns);

}  // namespace mjenv::core::lanes
