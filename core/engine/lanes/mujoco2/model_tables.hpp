// Tables for lanes that depend on the model alone, so they are computed once.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/lanes/mujoco2/lanes.hpp"
#include "engine/model.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {

// Which stages MuJoCo's functions compute row by row, because the model has a feature for which there is no lane code.
struct SingleStages {
  explicit SingleStages(const mjModel_& m);
  bool actuation;  // tendons, actuators, their lengths, velocities and forces
  bool passive;    // passive forces; only if `actuation`, too
};

// The feature of the model because of which MuJoCo computes tendons and actuators, or passive forces, row by row; "" if
// there is none.
std::string actuation_obstacle(const mjModel_& m);
std::string passive_obstacle(const mjModel_& m);

struct ModelTables {
  explicit ModelTables(const Model& model);

  const bool has_moments;
  std::vector<Actuator> actuators;
  std::vector<Segment> segments;
  std::vector<int> segment_adr;
  bool knows_pairs;             // whether the pairs that can collide are known; if not, MuJoCo must search for them
  std::vector<GeomPair> pairs;  // these pairs
  std::vector<BoxPair> box_pairs;
  std::vector<GeomBox> boxes;     // for each geom, if there are box_pairs
  std::optional<Pairs> searched;  // the parameters of the pairs, if Model has no list of pairs
  // The pairs that only their contype and conaffinity keep out of the list; no value if there are too many.
  std::optional<std::vector<std::pair<int, int>>> kept_apart{std::in_place};
  std::vector<ContactPair> contact_pairs;  // for each of `pairs`
  std::vector<Equality> equalities;
  std::vector<int> columns;          // Lanes::columns
  std::vector<int> joints, tendons;  // those that can have limits
  std::vector<int> tendon_dof_adr, tendon_dofs;
  std::vector<unsigned char> is_still_tendon;  // for each tendon: its Jacobian is always 0
  std::vector<unsigned char> has_ellipsoids;   // for each body: fluids act on its geoms as on ellipsoids
  std::vector<int> ancestor_adr, ancestors, moved_adr, moved_bodies;  // as in Lanes
 private:
  void compare_boxes(const mjModel_& m);
  void list_trees(const mjModel_& m);
};

// Whether an actuator is an adhesion. Its moment depends on contacts and their constraints, so MuJoCo's functions find
// them row by row before they compute actuators.
bool has_adhesion(const mjModel_& m);

// The counts of arrays that lanes have only for some models: of geoms, if fluids act on some of them as on ellipsoids; of
// bodies, if there are sensors; of cameras, if sensors see from them; and 1 for the integrator implicit, 0 for others.
int count_of_fluid_geoms(const mjModel_& m);
int count_of_subtrees(const mjModel_& m);
int count_of_cameras(const mjModel_& m);
int is_implicit(const mjModel_& m);

// Whether lanes need an array of moments. If MuJoCo's functions compute the moments: whether the integrator implicit
// reads them. Otherwise: whether an actuator acts on something other than a slide or a hinge.
bool has_moments(const mjModel_& m);

// A number of mjOption, or the first of several.
inline const double* first(const double& number) { return &number; }
template <std::size_t count>
const double* first(const double (&numbers)[count]) {
  return numbers;
}

// Computes the numbers of a pair of geoms in this model. The type of the first must not be above that of the second.
PairNumbers pair_numbers(const mjModel& m, int geom1, int geom2);

// Whether one of the numbers is -0.
bool has_negative_zero(const double* numbers, int count);

// Whether the model makes the constraints that this flag (mjtDisableBit) could disable.
bool constrains(const mjModel_& m, int flag);

// The greatest x with sqrt(x) <= radius, as double precision rounds the root; a negative number if the radius is
// negative.
double largest_square(double radius);

}  // namespace mjenv::core::lanes
