#include "engine/lanes/frame/stages.hpp"

#include "engine/lanes/frame/stepper.hpp"

namespace mjenv::core::lanes {

std::string how(const Stage& stage, const Model& model) {
  if (!stage.is_there(model)) return "absent";
  if (const std::string why = stage.obstacle(model); !why.empty()) return "row by row: " + why;
  const std::string what = stage.partly(model);
  return what.empty() ? "lanes" : "lanes; row by row: " + what;
}

std::string stage_lines(const Model& model) {
  const std::string all = obstacle(model);
  std::string lines;
  for (const Stage& stage : stages())
    lines += std::string(stage.name) + ": " + (all.empty() ? how(stage, model) : "row by row: " + all) + "\n";
  return lines;
}

std::string obstacle(const Model& model) {
  for (const Obstacle& one : obstacles())
    if (std::string found = one.find(model); !found.empty()) return found;
  return "";
}

}  // namespace mjenv::core::lanes
