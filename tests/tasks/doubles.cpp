// Tasks that name two fields or two terms alike: their records would be shorter than what is written.
#include <mjenv/task.hpp>

using namespace mjenv;

static void describe(Robot& r) {
  r.model("hopper.xml").frame_skip(4);
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.reset([](Start&, Rng&) {});
}

MJENV_TASK("TwoFields-v0", r) {
  describe(r);
  r.step([](const Sim&, Info& info) -> Outcome {
    info("speed", 1.0);
    info("speed", 2.0);
    return {0, false};
  });
}

MJENV_TASK("TwoTerms-v0", r) {
  describe(r);
  r.observe("qpos", [](const Sim& s) { return s.qvel(); });
  r.step([](const Sim&, Info&) -> Outcome { return {0, false}; });
}
