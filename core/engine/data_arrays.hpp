// The arrays of mjData that can be read, with MuJoCo's names.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core {

// Lists the arrays. They point into the model and mjData, which must not move. present: returns the model with the values
// of the row that mjData holds.
std::vector<Array> data_arrays(const mjModel_& model, const mjData_& data,
                               const std::function<const mjModel_&()>& present);

// Shortens the array to `count` contacts if it is an array of contacts and longer. 0: does not shorten it.
Array with_contacts(Array array, std::int64_t count);

// The parts of mjData that a step may leave behind, as bits of a set. It computes all else: the state (except
// mocap_quat), qfrc_applied, xfrc_applied, and the arrays of mjenv_sim (except these parts and contacts).
struct Lag {
  static constexpr unsigned frames = 1;  // positions and orientations of geoms, cameras and lights
  static constexpr unsigned forces = 2;  // cacc, cfrc_int, cfrc_ext
  static constexpr unsigned others = 4;  // all other arrays; only steps in lanes leave them behind
  static constexpr unsigned on_demand = frames | forces;
};
// The part to which an array belongs; 0: every step computes it.
unsigned part_of(const std::string& array);
// The names of the arrays of Lag::on_demand, for messages.
std::vector<std::string> on_demand_arrays();

}  // namespace mjenv::core
