// Tables for lanes that depend on the model alone, so they are computed once.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/lanes/frame/contact_pairs.hpp"
#include "engine/lanes/frame/equalities.hpp"
#include "engine/lanes/mujoco2/lanes.hpp"
#include "engine/model.hpp"

namespace mjenv::core::lanes {

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
  std::vector<int> columns;  // Lanes::columns
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

// Computes the numbers of a pair of geoms in this model. The type of the first must not be above that of the second.
PairNumbers pair_numbers(const mjModel& m, int geom1, int geom2);

// Whether one of the numbers is -0.
bool has_negative_zero(const double* numbers, int count);

// The greatest x with sqrt(x) <= radius, as double precision rounds the root; a negative number if the radius is
// negative.
double largest_square(double radius);

}  // namespace mjenv::core::lanes
