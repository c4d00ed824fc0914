// The arrays of mjData that can be read, with MuJoCo's names.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core {

// Lists the arrays. They point into the model and mjData, which must not move.
std::vector<Array> data_arrays(const mjModel_& model, const mjData_& data);

// Shortens the array to `count` contacts if it is an array of contacts and longer. 0: does not shorten it.
Array with_contacts(Array array, std::int64_t count);

// is_force: whether Work::complete_forces computes the array (cacc, cfrc_int, cfrc_ext). is_frame: whether
// Work::complete_frames does (positions and orientations of geoms, cameras and lights). Steps need not compute them.
bool is_force(const std::string& array);
bool is_frame(const std::string& array);
inline bool is_on_demand(const std::string& array) { return is_force(array) || is_frame(array); }
// The names of all arrays that steps do not compute, for messages.
std::vector<std::string> on_demand_arrays();
// Whether the array can be read after every step, even if Work::is_whole is false. These can: qfrc_applied,
// xfrc_applied, frames, the state (except mocap_quat), and the arrays of mjenv_sim (except cfrc_ext and contacts).
bool is_always_readable(const std::string& array);

}  // namespace mjenv::core
