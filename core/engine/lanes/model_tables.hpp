// What lanes need of the model alone, computed once.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/lanes/lanes.hpp"
#include "engine/model.hpp"
#include "engine/pairs.hpp"

namespace mjenv::core::lanes {

// The stages that MuJoCo's functions compute row by row, because lanes lack a feature of the model.
struct SingleStages {
  explicit SingleStages(const mjModel_& m);
  bool actuation;  // tendons, actuators, their lengths, velocities and forces
  bool passive;    // passive forces
};

// What the model has because of which that is so, "" if nothing.
std::string why_actuated_singly(const mjModel_& m);
std::string why_resisted_singly(const mjModel_& m);

struct ModelTables {
  explicit ModelTables(const Model& model);

  std::vector<double> ten_J;            // mjData's, if tendons lie along joints
  std::vector<double> actuator_moment;  // mjData's, of actuators on slides and hinges and on tendons along joints
  const bool has_moments;
  std::vector<Actuator> actuators;
  std::vector<Segment> segments;
  std::vector<int> segment_adr;
  std::vector<int> fluid_bodies;
  std::vector<GeomPair> pairs;  // of the pairs that can collide, if they are listed
  std::vector<BoxPair> box_pairs;
  std::vector<GeomBox> boxes;  // for each geom, if there are box_pairs
  bool lists_pairs;
  std::optional<Pairs> searched;           // the pairs, if Model lists none
  std::vector<ContactPair> contact_pairs;  // the same pairs
  std::vector<Equality> equalities;
  std::vector<int> columns;  // Lanes::columns
  std::vector<int> limited_joints, limited_tendons;
  std::vector<int> tendon_dof_adr, tendon_dofs;
  std::vector<unsigned char> is_still_tendon;  // all of its Jacobian is 0
  bool has_negative_zeros, has_damping;

 private:
  void compare_boxes(const mjModel_& m);
};

// Whether lanes compute moments of actuators that are not the model's own.
bool has_moments(const mjModel_& m);

// Whether constraints that this flag of mjtDisableBit disables are made.
bool constrains(const mjModel_& m, int flag);

// The greatest x with sqrt(x) <= radius, as double precision rounds the root; a negative number if the radius is negative.
double largest_square(double radius);

}  // namespace mjenv::core::lanes
