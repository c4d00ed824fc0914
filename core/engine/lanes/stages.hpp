// The stages of MuJoCo's step, and which of them lanes compute for a model. docs/lanes.md shows the same tables.
#pragma once

#include <string>
#include <vector>

#include "engine/model.hpp"

namespace mjenv::core::lanes {

// Why a feature of a model keeps it out of lanes.
struct Obstacle {
  const char* name;    // in docs/lanes.md
  const char* reason;  // there, too
  // What the model has of it, "" if nothing
  std::string (*find)(const Model& model);
};
const std::vector<Obstacle>& obstacles();

// A stage of a step, or several that are computed in the same way.
struct Stage {
  const char* name;        // in docs/lanes.md, as the next two
  const char* in_lanes;    // what lanes compute of it
  const char* row_by_row;  // what MuJoCo's functions compute row by row
  const char* functions;   // the functions of Code that belong to it
  bool (*is_there)(const Model& model);
  // What the model has because of which MuJoCo's functions compute the stage row by row, "" if nothing; and what of the stage
  // they compute row by row in any case, or where it occurs
  std::string (*alone)(const Model& model);
  std::string (*partly)(const Model& model);
};
const std::vector<Stage>& stages();

// How a stage of a model without obstacles is computed: "absent", "lanes", "row by row: WHY" or "lanes; row by row: WHAT".
std::string how(const Stage& stage, const Model& model);

}  // namespace mjenv::core::lanes
