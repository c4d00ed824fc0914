#include "engine/lanes/mujoco2/model_tables.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "engine/lanes/mujoco2/sensing.hpp"
#include "engine/mujoco.hpp"

namespace mjenv::core::lanes {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

bool is_ellipsoid(const mjModel& m, int geom) { return m.geom_fluid[mjNFLUID * geom] > 0; }

// Whether the Jacobians of tendons are sparse, for which there is no lane code.
bool has_sparse_tendons(const mjModel& m) { return m.ntendon > 0 && mj_isSparse(&m); }

// Whether an actuator is a slider-crank or has a reference site.
bool has_other_actuators(const mjModel& m) {
  for (int i = 0; i < m.nu; ++i) {
    const int type = m.actuator_trntype[i];
    if (type == mjTRN_SLIDERCRANK || (type == mjTRN_SITE && m.actuator_trnid[2 * i + 1] >= 0)) return true;
  }
  return false;
}

// The dofs that a tendon's length may depend on, in ascending order.
std::vector<int> dofs_of_tendon(const mjModel& m, int tendon) {
  std::vector<int> dofs;
  for (int j = m.tendon_adr[tendon]; j < m.tendon_adr[tendon] + m.tendon_num[tendon]; ++j) {
    const int type = m.wrap_type[j], object = m.wrap_objid[j];
    if (type == mjWRAP_PULLEY) continue;
    const std::vector<int> some = type == mjWRAP_JOINT  ? std::vector{m.jnt_dofadr[object]}
                                  : type == mjWRAP_SITE ? dofs_of(m, m.site_bodyid[object])
                                                        : dofs_of(m, m.geom_bodyid[object]);
    dofs.insert(dofs.end(), some.begin(), some.end());
  }
  std::sort(dofs.begin(), dofs.end());
  dofs.erase(std::unique(dofs.begin(), dofs.end()), dofs.end());
  return dofs;
}

// Whether an actuator acts on a slide or a hinge
bool acts_on_dof(const mjModel& m, int actuator) {
  const int type = m.actuator_trntype[actuator];
  if (type != mjTRN_JOINT && type != mjTRN_JOINTINPARENT) return false;
  const int joint = m.jnt_type[m.actuator_trnid[2 * actuator]];
  return joint == mjJNT_SLIDE || joint == mjJNT_HINGE;
}

bool compares_plane(const mjModel& m, int geom1, int geom2) {
  return m.geom_type[geom1] == mjGEOM_PLANE && !(m.geom_rbound[geom1] > 0) && m.geom_rbound[geom2] > 0;
}

std::vector<GeomPair> tested_pairs(const mjModel& m, const Pairs& listed) {
  std::vector<GeomPair> pairs;
  for (std::size_t i = 0; i < listed.geom1.size(); ++i) {
    const int first = listed.geom1[i], second = listed.geom2[i];
    pairs.push_back({first, second, compares_plane(m, first, second), -1, pair_numbers(m, first, second)});
  }
  return pairs;
}

// Returns the box with these two opposite corners.
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

// The limit of the gap between the boxes is the margin and the radii, plus a hundred-thousandth of the geoms' sizes,
// because MuJoCo's search for contacts of convex shapes is not exact. BoxPair::kRounding allows for rounding errors.
BoxPair box_pair_of(const mjModel& m, const GeomPair& pair, const std::vector<GeomBox>& boxes, double margin) {
  constexpr double kShare = 1e-5, kGround = 2e-4;
  const GeomBox &box1 = boxes[pair.geom1], &box2 = boxes[pair.geom2];
  double size = box1.round + box2.round;
  for (int k = 0; k < 3; ++k) size += (pair.has_plane ? 0 : box1.half[k]) + box2.half[k];
  const bool is_ground = m.geom_type[pair.geom1] == mjGEOM_HFIELD;
  // The limit for height fields is greater for two reasons. MuJoCo makes a field's prisms higher by the margin. And
  // boxes_apart divides kCollinear by the distance between the geom and the field's centre, but the centre of a prism
  // can be nearer to the geom.
  const double most = is_ground ? 2 * margin + kGround : margin;
  return {most + box1.round + box2.round + kShare * size, is_ground};
}

// Whether the tendon's Jacobian is 0 in every state.
bool is_still(const mjModel& m, int tendon, const std::vector<int>& dofs) {
  const int adr = m.tendon_adr[tendon];
  return dofs.empty() ||
         (m.wrap_type[adr] == mjWRAP_JOINT && std::all_of(m.wrap_prm + adr, m.wrap_prm + adr + m.tendon_num[tendon],
                                                          [](mjtNum coef) { return coef == 0; }));
}

void append(std::vector<int>& columns, const std::vector<int>& dofs) {
  columns.insert(columns.end(), dofs.begin(), dofs.end());
}

// Appends the parts of a tendon, in the order of mj_tendon.
void append_segments(const mjModel& m, int tendon, std::vector<Segment>& segments) {
  double divisor = 1;
  for (int j = m.tendon_adr[tendon]; j < m.tendon_adr[tendon] + m.tendon_num[tendon] - 1; ++j) {
    if (m.wrap_type[j] == mjWRAP_PULLEY) divisor = m.wrap_prm[j];
    if (m.wrap_type[j] != mjWRAP_SITE || m.wrap_type[j + 1] == mjWRAP_PULLEY) continue;
    const bool is_wrapped = m.wrap_type[j + 1] != mjWRAP_SITE;
    const int site1 = m.wrap_objid[j], site2 = m.wrap_objid[is_wrapped ? j + 2 : j + 1];
    segments.push_back(
        {site1, site2, divisor, is_wrapped ? m.wrap_objid[j + 1] : -1, is_wrapped ? mju_round(m.wrap_prm[j + 1]) : -1});
  }
}

Actuator actuator_of(const mjModel& m, int id, const ModelTables& tables, std::vector<int>& columns) {
  using Transmission = Actuator::Transmission;
  const int object = m.actuator_trnid[2 * id];
  Actuator actuator{Transmission::site, object, 0, static_cast<int>(columns.size()), 0};
  if (m.actuator_trntype[id] == mjTRN_TENDON) {
    actuator.transmission = Transmission::tendon;
    const int* const dofs = tables.tendon_dofs.data();
    append(columns, {dofs + tables.tendon_dof_adr[object], dofs + tables.tendon_dof_adr[object + 1]});
  } else if (m.actuator_trntype[id] == mjTRN_SITE) {
    append(columns, dofs_of(m, m.site_bodyid[object]));
  } else {
    actuator.dof = m.jnt_dofadr[object];
    const int type = m.jnt_type[object];
    actuator.transmission = type == mjJNT_FREE   ? Transmission::free
                            : type == mjJNT_BALL ? Transmission::ball
                                                 : Transmission::dof;
    const int size = type == mjJNT_FREE ? 6 : type == mjJNT_BALL ? 3 : 1;
    for (int k = 0; k < size; ++k) columns.push_back(actuator.dof + k);
  }
  actuator.count = static_cast<int>(columns.size()) - actuator.first_column;
  return actuator;
}

}  // namespace

bool has_adhesion(const mjModel& m) {
  return std::any_of(m.actuator_trntype, m.actuator_trntype + m.nu, [](int type) { return type == mjTRN_BODY; });
}

int count_of_fluid_geoms(const mjModel& m) {
  for (int geom = 0; geom < m.ngeom; ++geom)
    if (is_ellipsoid(m, geom)) return m.ngeom;
  return 0;
}

int count_of_subtrees(const mjModel& m) { return m.nsensor > 0 ? m.nbody : 0; }
int count_of_cameras(const mjModel& m) { return sees_from_cameras(m) ? m.ncam : 0; }
int is_implicit(const mjModel& m) { return m.opt.integrator == mjINT_IMPLICIT ? 1 : 0; }

bool has_moments(const mjModel& m) {
  if (!actuation_obstacle(m).empty()) return m.opt.integrator == mjINT_IMPLICIT;
  for (int i = 0; i < m.nu; ++i)
    if (!acts_on_dof(m, i)) return true;
  return false;
}

PairNumbers pair_numbers(const mjModel& m, int geom1, int geom2) {
  const double radius1 = m.geom_rbound[geom1], radius2 = m.geom_rbound[geom2];
  const double margin = mixed_margin(m.geom_margin[geom1], m.geom_margin[geom2]),
               gap = mixed_margin(m.geom_gap[geom1], m.geom_gap[geom2]), reach = radius1 + radius2 + margin;
  double limit = kInfinite;
  if (radius1 > 0 && radius2 > 0)
    limit = largest_square(reach);
  else if (compares_plane(m, geom1, geom2))
    limit = margin + radius2;
  return {limit, margin, margin - gap, reach};
}

bool has_negative_zero(const double* numbers, int count) {
  return std::any_of(numbers, numbers + count, [](double x) { return x == 0 && std::signbit(x); });
}

double largest_square(double radius) {
  if (radius < 0) return -1;
  if (std::isinf(radius)) return radius;
  double square = radius * radius;
  while (std::sqrt(square) > radius) square = std::nextafter(square, 0);
  while (std::sqrt(std::nextafter(square, kInfinite)) <= radius) square = std::nextafter(square, kInfinite);
  return square;
}

std::string actuation_obstacle(const mjModel& m) {
  if ((m.opt.disableflags & mjDSBL_ACTUATION) != 0) return "the model disables actuation";
  if (has_adhesion(m)) return "adhesion";
  if (has_other_actuators(m)) return "slider-cranks or reference sites";
  return has_sparse_tendons(m) ? "sparse Jacobians of tendons" : "";
}

std::string passive_obstacle(const mjModel& m) { return has_sparse_tendons(m) ? "sparse Jacobians of tendons" : ""; }

ModelTables::ModelTables(const Model& model) : has_moments(lanes::has_moments(*model.get())) {
  const mjModel& m = *model.get();
  const bool actuates = actuation_obstacle(m).empty();
  const bool finds_contacts = constrains(m, mjDSBL_CONTACT) && m.nconmax > 0;
  if (finds_contacts && !model.pairs()) searched = searched_pairs(m);
  knows_pairs = !finds_contacts || model.pairs() || searched;
  if (finds_contacts && knows_pairs) {
    const Pairs& listed = searched ? *searched : *model.pairs();
    pairs = tested_pairs(m, listed);
    contact_pairs = lanes::contact_pairs(m, listed, columns);
    compare_boxes(m);
    kept_apart = pairs_kept_apart(m);
  }
  for (int i = 0; i < m.ntendon; ++i) {
    const std::vector<int> dofs = dofs_of_tendon(m, i);
    tendon_dof_adr.push_back(static_cast<int>(tendon_dofs.size()));
    tendon_dofs.insert(tendon_dofs.end(), dofs.begin(), dofs.end());
    is_still_tendon.push_back(is_still(m, i, dofs));
  }
  tendon_dof_adr.push_back(static_cast<int>(tendon_dofs.size()));
  equalities = possible_equalities(m, is_still_tendon, columns);
  for (int i = 0; i < m.nu && actuates; ++i) actuators.push_back(actuator_of(m, i, *this, columns));
  for (int i = 0; i < m.ntendon && actuates; ++i) {
    segment_adr.push_back(static_cast<int>(segments.size()));
    if (m.wrap_type[m.tendon_adr[i]] != mjWRAP_JOINT) append_segments(m, i, segments);
  }
  segment_adr.push_back(static_cast<int>(segments.size()));
  has_ellipsoids.resize(static_cast<std::size_t>(m.nbody));
  for (int geom = 0; geom < m.ngeom; ++geom)
    if (is_ellipsoid(m, geom)) has_ellipsoids[m.geom_bodyid[geom]] = 1;
  if (m.opt.integrator == mjINT_IMPLICIT) list_trees(m);
}

void ModelTables::list_trees(const mjModel& m) {
  for (int dof = 0; dof < m.nv; ++dof) {
    ancestor_adr.push_back(static_cast<int>(ancestors.size()));
    for (int i = dof; i >= 0; i = m.dof_parentid[i]) ancestors.push_back(i);
  }
  ancestor_adr.push_back(static_cast<int>(ancestors.size()));
  for (int body = 0; body < m.nbody; ++body) {
    moved_adr.push_back(static_cast<int>(moved_bodies.size()));
    for (int i = body; i < m.nbody; ++i) {
      int bearer = i;
      while (bearer > body) bearer = m.body_parentid[bearer];
      if (bearer == body) moved_bodies.push_back(i);
    }
  }
  moved_adr.push_back(static_cast<int>(moved_bodies.size()));
}

// Chooses the pairs whose bounding boxes are compared: those whose contacts MuJoCo's functions compute.
void ModelTables::compare_boxes(const mjModel& m) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (contact_pairs[i].shapes != Shapes::others) continue;
    if (boxes.empty())
      for (int geom = 0; geom < m.ngeom; ++geom) boxes.push_back(box_of(m, geom));
    pairs[i].box_pair = static_cast<int>(box_pairs.size());
    box_pairs.push_back(box_pair_of(m, pairs[i], boxes, pairs[i].numbers.margin));
  }
}

}  // namespace mjenv::core::lanes
