// What lanes need of the model alone, computed once.
#pragma once

#include <optional>
#include <vector>

#include "engine/lanes/lanes.hpp"
#include "engine/model.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {

// The stages that MuJoCo's functions compute row by row, because lanes lack a feature of the model.
struct SingleStages {
  explicit SingleStages(const mjModel_& m);
  bool actuation;  // tendons, actuators, their lengths, velocities and forces, and the actuators' states
  bool passive;    // passive forces
};

struct ModelTables {
  explicit ModelTables(const Model& model);

  std::vector<double> ten_J;            // mjData's
  std::vector<double> actuator_moment;  // mjData's
  std::vector<int> fluid_bodies;
  std::vector<GeomPair> pairs;  // of the pairs that can collide, if they are listed
  std::vector<BoxPair> box_pairs;
  std::vector<GeomBox> boxes;  // for each geom, if there are box_pairs
  bool lists_pairs;
  std::optional<Pairs> searched;           // the pairs, if Model lists none
  std::vector<ContactPair> contact_pairs;  // the same pairs
  std::vector<int> contact_columns;        // Contacts::columns
  std::vector<int> limited_joints;
  bool has_negative_zeros, has_damping;
  bool constrains_tendons;  // tendons have limits or friction

 private:
  void compare_boxes(const mjModel_& m);
};

// The greatest x with sqrt(x) <= radius, as double precision rounds the root; a negative number if the radius is negative.
double largest_square(double radius);

}  // namespace mjenv::core::lanes
