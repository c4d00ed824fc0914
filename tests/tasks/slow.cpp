// Tasks whose definitions take a while, so that threads that load the plug-in at the same time run them together.
#include <mjenv/task.hpp>

#include <chrono>
#include <thread>

using namespace mjenv;

static void define(Robot& r) {
  std::this_thread::sleep_for(std::chrono::milliseconds(1));
  r.model("hopper.xml").frame_skip(4);
  r.real("weight", 1, "of the speed");
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.reset([](Start&, Rng&) {});
  r.step([](const Sim&, Info&) -> Outcome { return {0, false}; });
}

MJENV_TASK("SlowOne-v0", r) { define(r); }
MJENV_TASK("SlowTwo-v0", r) { define(r); }
MJENV_TASK("SlowThree-v0", r) { define(r); }
