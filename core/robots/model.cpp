#include <mjenv/task.hpp>

namespace mjenv::robots {

// Simulates the caller's model without a task: there is no reward, and episodes do not terminate.
void model(Robot& r) {
  r.model("").frame_skip(1);  // no default, so the caller must give a model
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.reset([](Start&, Rng&) {});
  r.step([](const Sim&, Info&) -> Outcome { return {0, false}; });
}

}  // namespace mjenv::robots
