#include "task/robot.hpp"

namespace mjenv::core {

// The physics of the caller's model alone: no reward, no end of an episode.
void model(Robot& r) {
  r.xml_file("").frame_skip(1);
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.reset([](Start&, Rng&) {});
  r.step([](const Sim&, const Carried&, Info&) -> Outcome { return {0, false}; });
}

}  // namespace mjenv::core
