// The arrays of mjData that can be read, with MuJoCo's names.
#pragma once

#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core {

// Neither the model nor mjData may move.
std::vector<Array> data_arrays(const mjModel_& model, const mjData_& data);

// Whether Work::complete_forces computes the array (cacc, cfrc_int, cfrc_ext), or Work::complete_frames (positions and
// orientations of geoms, cameras and lights). Steps do not compute these arrays.
bool is_force(const std::string& array);
bool is_frame(const std::string& array);
inline bool is_on_demand(const std::string& array) { return is_force(array) || is_frame(array); }
// These arrays, for messages.
std::vector<std::string> on_demand_arrays();
// Whether the array can be read after every step (Work::is_whole): those of mjenv_sim, the state, and frames.
bool is_after_every_step(const std::string& array);

}  // namespace mjenv::core
