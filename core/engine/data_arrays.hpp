// The arrays of mjData that can be read, with MuJoCo's names, and the forces of its contacts.
#pragma once

#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core {

// Lists the arrays. They point into the model and mjData, which must not move. contact_forces: of Work, with 6 numbers
// for each of max_contacts.
std::vector<Array> data_arrays(const mjModel_& model, const mjData_& data, const double* contact_forces);

// is_force: whether Work::complete_forces computes the array (cacc, cfrc_int, cfrc_ext). is_frame: whether
// Work::complete_frames does (positions and orientations of geoms, cameras and lights). is_contact_force: whether
// Work::complete_contact_forces does (contact.force). Steps compute none of them.
bool is_force(const std::string& array);
bool is_frame(const std::string& array);
bool is_contact_force(const std::string& array);
inline bool is_on_demand(const std::string& array) {
  return is_force(array) || is_frame(array) || is_contact_force(array);
}
// The names of the arrays of is_force and is_frame, for messages.
std::vector<std::string> on_demand_arrays();
// Whether the array can be read after every step, even if Work::is_whole is false: this holds for the arrays of
// mjenv_sim, the state, and frames.
bool is_after_every_step(const std::string& array);

}  // namespace mjenv::core
