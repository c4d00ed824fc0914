// The task of live.c, in C++.
#include <mjenv/task.hpp>

MJENV_TASK("CppLive-v0", r) {
  r.model_text(
       "<mujoco><option timestep='0.01'/><worldbody><geom name='floor' type='plane' size='5 5 .1'/>"
       "<body name='cart' pos='0 0 1'><joint name='slide' type='slide' axis='1 0 0'/><geom type='box' size='.1 .1 .1'/>"
       "</body><body pos='1 0 .099'><freejoint/><geom size='.1'/></body></worldbody>"
       "<actuator><motor joint='slide' gear='10' ctrllimited='true' ctrlrange='-1 1'/></actuator></mujoco>")
      .time_limit(5);
  const auto speed = r.live("speed", 0.5, "the commanded speed, m/s", -2, 2);
  const auto gains = r.live("gains", std::vector<double>{1, 2, 3}, "of the reward");
  const auto level = r.keep(1, 0, 50);
  const auto steps = r.carry(1);
  const auto goals = r.keep(1);
  r.observe("speed", [=](const mjenv::Sim& s) { return s[speed]; });
  r.observe("gains", [=](const mjenv::Sim& s) { return s[gains]; });
  r.observe("level", [=](const mjenv::Sim& s) { return s[level]; });
  r.observe("steps", [=](const mjenv::Sim& s) { return s[steps]; });
  r.observe("goals", [=](const mjenv::Sim& s) { return s[goals]; });
  r.observe("x", [=](const mjenv::Sim& s) { return s.qpos()[0]; });
  r.reset([=](mjenv::Start& start, mjenv::Rng& rng) {
    start[level][0] += 1;
    start[goals][0] += start[gains][2];
    start.qpos[0] = start[speed] + 0 * rng.uniform(0, 1);
    if (start[speed] == -1) throw std::runtime_error("no such speed");
  });
  r.step([=](const mjenv::Sim& s, mjenv::Row& row, mjenv::Info&) -> mjenv::Outcome {
    row[steps][0] += 1;
    row[goals][0] += s[gains][1];
    return {s[speed] * s[gains][0], false};
  });
}
