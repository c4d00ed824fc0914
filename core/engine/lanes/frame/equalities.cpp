#include "engine/lanes/frame/equalities.hpp"

#include <algorithm>
#include <iterator>

#include "engine/lanes/frame/contact_pairs.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

// Appends to the columns the elements that both lists have. Returns how many there are.
int append_shared(std::vector<int>& columns, const std::vector<int>& dofs, const std::vector<int>& others) {
  const auto is_shared = [&](int dof) { return std::count(others.begin(), others.end(), dof) > 0; };
  std::copy_if(dofs.begin(), dofs.end(), std::back_inserter(columns), is_shared);
  return static_cast<int>(std::count_if(dofs.begin(), dofs.end(), is_shared));
}

BodyPair pair_of(const mjModel& m, int body1, int body2, std::vector<int>& columns) {
  const std::vector<int> dofs1 = dofs_of(m, body1), dofs2 = dofs_of(m, body2);
  BodyPair pair{body1, body2, static_cast<int>(columns.size()), 0, 0, 0, false};
  pair.negates = is_sparse(m) && m.body_simple[body1] && m.body_simple[body2];
  pair.count1 = append_difference(columns, dofs1, dofs2);
  pair.count2 = append_difference(columns, dofs2, dofs1);
  pair.count_both = append_shared(columns, dofs1, dofs2);
  return pair;
}

}  // namespace

std::vector<Equality> possible_equalities(const mjModel& m, const std::vector<unsigned char>& is_still_tendon,
                                          std::vector<int>& columns) {
  std::vector<Equality> equalities;
  for (int i = 0; i < m.neq && constrains(m, mjDSBL_EQUALITY); ++i) {
    Equality equality{i, m.eq_type[i], 1, m.eq_obj1id[i], m.eq_obj2id[i], are_sites(m, i), {}, {}};
    if (equality.type == mjEQ_CONNECT || equality.type == mjEQ_WELD) {
      const auto body_of = [&](int object) { return equality.has_sites ? m.site_bodyid[object] : object; };
      const int body1 = body_of(equality.object1), body2 = body_of(equality.object2);
      equality.size = equality.type == mjEQ_WELD ? 6 : 3;
      equality.bodies = pair_of(m, body2, body1, columns);
      if (equality.bodies.count1 + equality.bodies.count2 + equality.bodies.count_both == 0) continue;
      equality.chain = chain_of(m, dofs_of(m, body1), dofs_of(m, body2), columns);
    } else if (equality.type == mjEQ_JOINT) {
      std::vector<int> dofs;
      for (const int joint : {equality.object1, equality.object2})
        if (joint >= 0) dofs.push_back(m.jnt_dofadr[joint]);
      equality.chain = chain_of(m, dofs, {}, columns);
    } else if (equality.type == mjEQ_TENDON) {
      const auto is_still = [&](int tendon) { return tendon < 0 || is_still_tendon[tendon]; };
      if (is_still(equality.object1) && is_still(equality.object2)) continue;
    }
    equalities.push_back(equality);
  }
  return equalities;
}

}  // namespace mjenv::core::lanes
