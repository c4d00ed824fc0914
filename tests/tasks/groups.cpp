// The task of groups.c, in C++.
#include <mjenv/task.hpp>

MJENV_TASK("CppGroups-v0", r) {
  r.model_text(
       "<mujoco><option timestep='0.01'/><worldbody><body><joint type='slide' axis='1 0 0'/><geom size='.1'/></body>"
       "<body pos='0 0 1'><freejoint/><geom size='.1'/></body></worldbody></mujoco>")
      .time_limit(5);
  r.group("policy");
  r.observe("cart", [](const mjenv::Sim& s) { return s.qpos()[0]; });
  r.observe("ball", [](const mjenv::Sim& s) { return s.qpos(1); });
  r.group("critic");
  r.observe("mass", [](const mjenv::Sim& s) { return s.c().body_mass[1]; });
  r.observe_nothing("empty");
  r.observe("velocity", [](const mjenv::Sim& s) { return s.qvel(); });
  r.group("");
  r.observe("clock", [](const mjenv::Sim& s) { return s.time(); });
  r.reset([](mjenv::Start& start, mjenv::Rng& rng) {
    start.qpos[0] = rng.uniform(-1, 1);
    start.qvel[0] = rng.uniform(-1, 1);
  });
  r.step([](const mjenv::Sim& s, mjenv::Info&) -> mjenv::Outcome { return {s.qpos()[0], s.qpos()[3] < 0.99}; });
}
