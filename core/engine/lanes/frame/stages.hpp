// The stages of MuJoCo's step, in the order in which a version's stepper computes them, and which of them lanes compute
// for a model. docs/lanes.md shows the same tables.
#pragma once

#include <string>
#include <vector>

#include "engine/lanes/frame/version.hpp"
#include "engine/model.hpp"
#include "engine/mujoco.hpp"
#include "engine/work.hpp"

namespace mjenv::core::lanes {

// A feature of a model that keeps the whole model out of lanes.
struct Obstacle {
  const char* name;    // in docs/lanes.md
  const char* reason;  // also in docs/lanes.md
  // Finds the feature in a model, and returns its name; "" if the model does not have it.
  std::string (*find)(const Model& model);
};

// A function of Code.
struct Function {
  const char* name;
  void (*Code::*compute)(Lanes&) = nullptr;  // null: the version's stepper calls it at its own place
  bool is_shown = false;                     // callbacks see its results in a new state
};

// A stage of a step, or several stages that are computed in the same way.
struct Stage {
  const char* name;        // in docs/lanes.md, as the next two
  const char* in_lanes;    // what lanes compute of it
  const char* row_by_row;  // what MuJoCo's functions compute row by row
  std::vector<Function> functions;
  bool (*is_there)(const Model& model);
  // obstacle: the feature of the model because of which MuJoCo's functions compute the whole stage row by row; "" if
  // there is none. partly: the part of the stage that they always compute row by row; "" if there is none.
  std::string (*obstacle)(const Model& model);
  std::string (*partly)(const Model& model);
  // With an obstacle, this computes the stage for each row. party: what it reads is copied to mjData before, and what
  // it writes is copied to lanes afterwards. Null: the version's stepper does this at its own place.
  void (*compute)(Work& work, const mjModel& m, mjData& d) = nullptr;
  Party party = kNobody;
};

// How a stage of a model without obstacles is computed: "absent", "lanes", "row by row: WHY" or "lanes; row by row:
// WHAT".
std::string how(const Stage& stage, const Model& model);

// ---- What each version defines ----

const std::vector<Obstacle>& obstacles();
const std::vector<Stage>& stages();

}  // namespace mjenv::core::lanes
