// The stages of MuJoCo's step, and which of them lanes compute for a model. docs/lanes.md shows the same tables.
#pragma once

#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core::lanes {

// A feature of a model that keeps the whole model out of lanes.
struct Obstacle {
  const char* name;    // in docs/lanes.md
  const char* reason;  // also in docs/lanes.md
  // Finds the feature in a model, and returns its name; "" if the model does not have it.
  std::string (*find)(const Model& model);
};
const std::vector<Obstacle>& obstacles();

// A stage of a step, or several stages that are computed in the same way.
struct Stage {
  const char* name;        // in docs/lanes.md, as the next two
  const char* in_lanes;    // what lanes compute of it
  const char* row_by_row;  // what MuJoCo's functions compute row by row
  const char* functions;   // the functions of Code that belong to it
  bool (*is_there)(const Model& model);
  // obstacle: the feature of the model because of which MuJoCo's functions compute the whole stage row by row; "" if
  // there is none. partly: the part of the stage that they always compute row by row; "" if there is none.
  std::string (*obstacle)(const Model& model);
  std::string (*partly)(const Model& model);
};
const std::vector<Stage>& stages();

// How a stage of a model without obstacles is computed: "absent", "lanes", "row by row: WHY" or "lanes; row by row:
// WHAT".
std::string how(const Stage& stage, const Model& model);

}  // namespace mjenv::core::lanes
