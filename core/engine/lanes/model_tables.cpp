#include "engine/lanes/model_tables.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

bool has_negative_zero(const mjtNum* numbers, int count) {
  return std::any_of(numbers, numbers + count, [](double x) { return x == 0 && std::signbit(x); });
}

bool has_ellipsoids(const mjModel& m) {
  for (int g = 0; g < m.ngeom; ++g)
    if (m.geom_fluid[mjNFLUID * g] > 0) return true;
  return false;
}

bool has_springs_of_rotations(const mjModel& m) {
  for (int j = 0; j < m.njnt; ++j)
    if ((m.jnt_type[j] == mjJNT_FREE || m.jnt_type[j] == mjJNT_BALL) && m.jnt_stiffness[j] != 0) return true;
  return false;
}

bool has_spatial_tendons(const mjModel& m) {
  for (int i = 0; i < m.nwrap; ++i)
    if (m.wrap_type[i] != mjWRAP_JOINT) return true;
  return false;
}

// A motor, position or velocity of a slide or hinge
bool is_plain(const mjModel& m, int actuator) {
  const int joint = m.actuator_trnid[2 * actuator], transmission = m.actuator_trntype[actuator];
  if (transmission != mjTRN_JOINT && transmission != mjTRN_JOINTINPARENT) return false;
  if (m.jnt_type[joint] != mjJNT_SLIDE && m.jnt_type[joint] != mjJNT_HINGE) return false;
  return m.actuator_dyntype[actuator] == mjDYN_NONE && m.actuator_gaintype[actuator] == mjGAIN_FIXED &&
         (m.actuator_biastype[actuator] == mjBIAS_NONE || m.actuator_biastype[actuator] == mjBIAS_AFFINE);
}

bool has_other_actuators(const mjModel& m) {
  for (int i = 0; i < m.nu; ++i)
    if (!is_plain(m, i)) return true;
  return false;
}

// As in mj_tendon.
std::vector<double> tendon_jacobian(const mjModel& m) {
  std::vector<double> jacobian(static_cast<std::size_t>(m.ntendon) * static_cast<std::size_t>(m.nv));
  for (int i = 0; i < m.ntendon; ++i)
    for (int j = m.tendon_adr[i]; j < m.tendon_adr[i] + m.tendon_num[i]; ++j)
      jacobian[i * m.nv + m.jnt_dofadr[m.wrap_objid[j]]] = m.wrap_prm[j];
  return jacobian;
}

// As in mj_transmission.
std::vector<double> moments(const mjModel& m) {
  std::vector<double> moment(static_cast<std::size_t>(m.nu) * static_cast<std::size_t>(m.nv));
  for (int i = 0; i < m.nu; ++i) moment[i * m.nv + m.jnt_dofadr[m.actuator_trnid[2 * i]]] = m.actuator_gear[6 * i];
  return moment;
}

// As in mj_passive.
std::vector<int> bodies_in_fluid(const mjModel& m) {
  std::vector<int> bodies;
  if (!(m.opt.viscosity > 0 || m.opt.density > 0)) return bodies;
  for (int i = 1; i < m.nbody; ++i)
    if (!(m.body_mass[i] < mjMINVAL)) bodies.push_back(i);
  return bodies;
}

// As in mj_collideGeoms.
std::vector<GeomPair> tested_pairs(const mjModel& m, const Pairs& listed) {
  std::vector<GeomPair> pairs;
  for (std::size_t i = 0; i < listed.geom1.size(); ++i) {
    int first = listed.geom1[i], second = listed.geom2[i];
    if (m.geom_type[first] > m.geom_type[second]) std::swap(first, second);
    const double radius1 = m.geom_rbound[first], radius2 = m.geom_rbound[second], margin = listed.margin[i];
    GeomPair pair{first, second, false, -1, kInfinite};
    if (radius1 > 0 && radius2 > 0)
      pair.limit = largest_square(radius1 + radius2 + margin);
    else if (m.geom_type[first] == mjGEOM_PLANE && radius2 > 0)
      pair = {first, second, true, -1, margin + radius2};
    pairs.push_back(pair);
  }
  return pairs;
}

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

// The box between two corners
GeomBox box_between(const double* low, const double* high) {
  GeomBox box{};
  for (int k = 0; k < 3; ++k) {
    box.middle[k] = (low[k] + high[k]) / 2;
    box.half[k] = (high[k] - low[k]) / 2;
  }
  return box;
}

GeomBox box_of_mesh(const mjModel& m, int mesh) {
  double low[3] = {kInfinite, kInfinite, kInfinite}, high[3] = {-kInfinite, -kInfinite, -kInfinite};
  const float* const vertices = m.mesh_vert + std::ptrdiff_t{3} * m.mesh_vertadr[mesh];
  for (int i = 0; i < 3 * m.mesh_vertnum[mesh]; ++i) {
    low[i % 3] = std::min<double>(low[i % 3], vertices[i]);
    high[i % 3] = std::max<double>(high[i % 3], vertices[i]);
  }
  return box_between(low, high);
}

GeomBox box_of_field(const mjModel& m, int field) {
  const double* const size = m.hfield_size + std::ptrdiff_t{4} * field;
  const float* const data = m.hfield_data + m.hfield_adr[field];
  double top = 0;
  for (int i = 0; i < m.hfield_nrow[field] * m.hfield_ncol[field]; ++i) top = std::max<double>(top, data[i]);
  const double low[3] = {-size[0], -size[1], -size[3]}, high[3] = {size[0], size[1], top * size[2]};
  return box_between(low, high);
}

GeomBox box_of(const mjModel& m, int geom) {
  const double* const size = m.geom_size + std::ptrdiff_t{3} * geom;
  switch (m.geom_type[geom]) {
    case mjGEOM_HFIELD: return box_of_field(m, m.geom_dataid[geom]);
    case mjGEOM_SPHERE: return {{}, {}, size[0]};
    case mjGEOM_CAPSULE: return {{}, {0, 0, size[1]}, size[0]};
    case mjGEOM_CYLINDER: return {{}, {size[0], size[0], size[1]}, 0};
    case mjGEOM_ELLIPSOID:
    case mjGEOM_BOX: return {{}, {size[0], size[1], size[2]}, 0};
    case mjGEOM_MESH: return box_of_mesh(m, m.geom_dataid[geom]);
    default: return {};
  }
}

// By how much more than their margin geoms are apart for which MuJoCo's function is not asked. A hundred-thousandth of their
// sizes is far more than rounding can change.
BoxPair limits_of(const mjModel& m, const GeomPair& pair, const std::vector<GeomBox>& boxes, double margin) {
  constexpr double kShare = 1e-5, kGround = 2e-4;
  const GeomBox &box1 = boxes[pair.geom1], &box2 = boxes[pair.geom2];
  double size = box1.round + box2.round;
  for (int k = 0; k < 3; ++k) size += (pair.has_plane ? 0 : box1.half[k]) + box2.half[k];
  const bool is_ground = m.geom_type[pair.geom1] == mjGEOM_HFIELD;
  // A height field's prisms are higher by the margin, and their centres can be nearer to the geom than that of the field.
  const double most = is_ground ? 2 * margin + kGround : margin;
  return {most + box1.round + box2.round + kShare * size, is_ground};
}

// The dofs that move a body, as in mj_jac.
std::vector<int> dofs_of(const mjModel& m, int body) {
  std::vector<int> dofs;
  while (body && !m.body_dofnum[body]) body = m.body_parentid[body];
  if (!body) return dofs;
  for (int i = m.body_dofadr[body] + m.body_dofnum[body] - 1; i >= 0; i = m.dof_parentid[i]) dofs.push_back(i);
  return dofs;
}

// Appends the dofs that are in the first list alone. Returns how many.
int append_difference(std::vector<int>& columns, const std::vector<int>& dofs, const std::vector<int>& others) {
  int count = 0;
  for (const int dof : dofs) {
    if (std::count(others.begin(), others.end(), dof)) continue;
    columns.push_back(dof);
    ++count;
  }
  return count;
}

std::vector<ContactPair> pairs_in_contact(const mjModel& m, const Pairs& listed, bool are_searched,
                                          std::vector<int>& columns) {
  std::vector<ContactPair> pairs;
  for (std::size_t i = 0; i < listed.geom1.size(); ++i) {
    int first = listed.geom1[i], second = listed.geom2[i];
    if (m.geom_type[first] > m.geom_type[second]) std::swap(first, second);
    const int body1 = m.geom_bodyid[first], body2 = m.geom_bodyid[second];
    ContactPair pair{};
    pair.geom1 = first;
    pair.geom2 = second;
    pair.dim = listed.dim[i];
    pair.shapes = shapes_of(m, first, second);
    pair.is_searched = are_searched && body1 != 0 && body2 != 0;
    pair.reach = m.geom_rbound[first] + m.geom_rbound[second] + listed.margin[i];
    pair.root1 = m.body_rootid[body1];
    pair.root2 = m.body_rootid[body2];
    pair.margin = listed.margin[i];
    pair.includemargin = listed.margin[i] - listed.gap[i];
    const std::vector<int> dofs1 = dofs_of(m, body1), dofs2 = dofs_of(m, body2);
    pair.first_column = static_cast<int>(columns.size());
    pair.count1 = append_difference(columns, dofs1, dofs2);
    pair.count2 = append_difference(columns, dofs2, dofs1);
    pairs.push_back(pair);
  }
  return pairs;
}

bool any_positive(const mjtNum* numbers, int count) {
  return std::any_of(numbers, numbers + count, [](double x) { return x > 0; });
}

}  // namespace

double largest_square(double radius) {
  if (radius < 0) return -1;
  if (std::isinf(radius)) return radius;
  double square = radius * radius;
  while (std::sqrt(square) > radius) square = std::nextafter(square, 0);
  while (std::sqrt(std::nextafter(square, kInfinite)) <= radius) square = std::nextafter(square, kInfinite);
  return square;
}

SingleStages::SingleStages(const mjModel& m) {
  actuation =
      (m.opt.disableflags & mjDSBL_ACTUATION) != 0 || m.na > 0 || has_other_actuators(m) || has_spatial_tendons(m);
  passive = (m.opt.disableflags & mjDSBL_PASSIVE) != 0 || (actuation && m.ntendon > 0) || has_ellipsoids(m) ||
            has_springs_of_rotations(m);
}

ModelTables::ModelTables(const Model& model) {
  const mjModel& m = *model.get();
  const SingleStages single(m);
  if (!single.actuation) {
    ten_J = tendon_jacobian(m);
    actuator_moment = moments(m);
  }
  if (!single.passive) fluid_bodies = bodies_in_fluid(m);
  if (!model.pairs()) searched = searched_pairs(m);
  lists_pairs = model.pairs() || searched;
  if (lists_pairs) {
    const Pairs& listed = searched ? *searched : *model.pairs();
    pairs = tested_pairs(m, listed);
    contact_pairs = pairs_in_contact(m, listed, searched.has_value(), contact_columns);
    compare_boxes(m);
  }
  for (int j = 0; j < m.njnt; ++j)
    if (m.jnt_limited[j]) limited_joints.push_back(j);
  has_negative_zeros = has_negative_zero(m.jnt_axis, 3 * m.njnt) || has_negative_zero(m.jnt_pos, 3 * m.njnt);
  has_damping = any_positive(m.dof_damping, m.nv);
  constrains_tendons = any_positive(m.tendon_frictionloss, m.ntendon) ||
                       std::any_of(m.tendon_limited, m.tendon_limited + m.ntendon, [](mjtByte is) { return is != 0; });
}

// Compares the bounding boxes of the geoms whose contacts MuJoCo's functions compute.
void ModelTables::compare_boxes(const mjModel& m) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (contact_pairs[i].shapes != Shapes::others) continue;
    if (boxes.empty())
      for (int geom = 0; geom < m.ngeom; ++geom) boxes.push_back(box_of(m, geom));
    pairs[i].boxes = static_cast<int>(box_pairs.size());
    box_pairs.push_back(limits_of(m, pairs[i], boxes, contact_pairs[i].margin));
  }
}

}  // namespace mjenv::core::lanes
