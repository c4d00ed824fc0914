// What lanes need of the model alone, computed once.
#pragma once

#include <vector>

#include "engine/lanes/lanes.hpp"
#include "engine/model.hpp"

namespace mjenv::core::lanes {

struct ModelTables {
  explicit ModelTables(const Model& model);

  std::vector<double> ten_J;            // mjData's
  std::vector<double> actuator_moment;  // mjData's
  std::vector<int> fluid_bodies;
  std::vector<GeomPair> pairs;  // of the pairs that Model lists
  bool lists_pairs;
  std::vector<ContactPair> contact_pairs;  // the same pairs
  std::vector<int> contact_columns;        // Contacts::columns
  std::vector<int> limited_joints;
  bool has_negative_zeros, has_damping;
  bool constrains_tendons;  // tendons have limits or friction
};

// The greatest x with sqrt(x) <= radius, as double precision rounds the root; a negative number if the radius is negative.
double largest_square(double radius);

}  // namespace mjenv::core::lanes
