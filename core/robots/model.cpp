#include <mjenv/task.hpp>

namespace mjenv::robots {

// The physics of the caller's model alone: no reward, no end of an episode.
void model(Robot& r) {
  r.model("").frame_skip(1);  // the caller has to choose the model
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.reset([](Start&, Rng&) {});
  r.step([](const Sim&, Info&) -> Outcome { return {0, false}; });
}

}  // namespace mjenv::robots
