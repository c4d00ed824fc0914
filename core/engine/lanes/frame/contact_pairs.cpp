#include "engine/lanes/frame/contact_pairs.hpp"

#include <algorithm>
#include <cstddef>

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

Shapes shapes_of(const mjModel& m, int geom1, int geom2) {
  const int first = m.geom_type[geom1], second = m.geom_type[geom2];
  if (first == mjGEOM_PLANE && second == mjGEOM_SPHERE) return Shapes::plane_sphere;
  if (first == mjGEOM_PLANE && second == mjGEOM_CAPSULE) return Shapes::plane_capsule;
  if (first == mjGEOM_PLANE && second == mjGEOM_ELLIPSOID) return Shapes::plane_ellipsoid;
  if (first == mjGEOM_PLANE && second == mjGEOM_CYLINDER) return Shapes::plane_cylinder;
  if (first == mjGEOM_PLANE && second == mjGEOM_BOX) return Shapes::plane_box;
  if (first == mjGEOM_SPHERE && second == mjGEOM_SPHERE) return Shapes::sphere_sphere;
  if (first == mjGEOM_SPHERE && second == mjGEOM_CAPSULE) return Shapes::sphere_capsule;
  if (first == mjGEOM_SPHERE && second == mjGEOM_BOX) return Shapes::sphere_box;
  if (first == mjGEOM_CAPSULE && second == mjGEOM_CAPSULE) return Shapes::capsule_capsule;
  return Shapes::others;
}

}  // namespace

bool constrains(const mjModel& m, int flag) { return (m.opt.disableflags & (flag | mjDSBL_CONSTRAINT)) == 0; }

bool is_sparse(const mjModel& m) {
  return m.opt.jacobian == mjJAC_SPARSE || (m.opt.jacobian == mjJAC_AUTO && m.nv >= 60);
}

std::vector<int> dofs_of(const mjModel& m, int body) {
  std::vector<int> dofs;
  while (body && !m.body_dofnum[body]) body = m.body_parentid[body];
  if (!body) return dofs;
  for (int i = m.body_dofadr[body] + m.body_dofnum[body] - 1; i >= 0; i = m.dof_parentid[i]) dofs.push_back(i);
  return dofs;
}

int append_difference(std::vector<int>& columns, const std::vector<int>& dofs, const std::vector<int>& others) {
  int count = 0;
  for (const int dof : dofs) {
    if (std::count(others.begin(), others.end(), dof)) continue;
    columns.push_back(dof);
    ++count;
  }
  return count;
}

Chain chain_of(const mjModel& m, std::vector<int> dofs, const std::vector<int>& others, std::vector<int>& columns) {
  Chain chain{static_cast<int>(columns.size()), 0, false};
  if (!is_sparse(m)) return chain;
  append_difference(dofs, others, std::vector<int>(dofs));
  std::sort(dofs.begin(), dofs.end());
  columns.insert(columns.end(), dofs.begin(), dofs.end());
  chain.count = static_cast<int>(dofs.size());
  for (int i = 1; i < chain.count; ++i)
    chain.couples |= m.dof_simplenum[dofs[i]] || m.dof_parentid[dofs[i]] != dofs[i - 1];
  return chain;
}

std::vector<ContactPair> contact_pairs(const mjModel& m, const Pairs& listed, std::vector<int>& columns) {
  std::vector<ContactPair> pairs;
  for (std::size_t i = 0; i < listed.geom1.size(); ++i) {
    const int first = listed.geom1[i], second = listed.geom2[i];
    const int body1 = m.geom_bodyid[first], body2 = m.geom_bodyid[second];
    ContactPair pair{};
    pair.geom1 = first;
    pair.geom2 = second;
    pair.dim = listed.dim[i];
    pair.shapes = shapes_of(m, first, second);
    pair.can_be_missed = (body1 != 0 && body2 != 0) || needs_search(m, std::max(body1, body2));
    pair.root1 = m.body_rootid[body1];
    pair.root2 = m.body_rootid[body2];
    const std::vector<int> dofs1 = dofs_of(m, body1), dofs2 = dofs_of(m, body2);
    pair.first_column = static_cast<int>(columns.size());
    pair.count1 = append_difference(columns, dofs1, dofs2);
    pair.count2 = append_difference(columns, dofs2, dofs1);
    pair.chain = chain_of(m, dofs1, dofs2, columns);
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace mjenv::core::lanes
