// The task of groups.c in C++, a task with goals, and tasks whose callbacks are optional.
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

MJENV_TASK("tests/Goal-v0", r) {
  r.model_text(
       "<mujoco><worldbody><body><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/><geom size='.1'/>"
       "</body></worldbody></mujoco>")
      .time_limit(9);
  const mjenv::Carry target = r.carry(2);
  const auto reward = [](const mjenv::Goal& achieved, const mjenv::Goal& desired) {
    if (desired[0] > 9) throw std::runtime_error("the goal is out of reach");
    return -std::abs(achieved[0] - desired[0]) - 2 * std::abs(achieved[1] - desired[1]);
  };
  r.observe("achieved_goal", [](const mjenv::Sim& s) { return s.qpos(); });
  r.observe("desired_goal", [=](const mjenv::Sim& s) { return s[target]; });
  r.observe("observation", [](const mjenv::Sim& s) { return s.qvel(); });
  r.compute_reward(reward);
  r.reset([=](mjenv::Start& start, mjenv::Rng& rng) {
    for (int i = 0; i < 2; ++i) start.qvel[i] = rng.uniform(-1, 1);
    for (int i = 0; i < 2; ++i) start[target][i] = rng.uniform(-1, 1);
  });
  r.step([=](const mjenv::Sim& s, mjenv::Info&) -> mjenv::Outcome { return {reward(s.qpos(), s[target]), false}; });
}

// Each callback that a task can lack is under an option.
static void optional(mjenv::Robot& r, bool on) {
  r.model_text(
      "<mujoco><worldbody><body><joint name='x' type='slide' axis='1 0 0'/><geom "
      "size='.1'/></body></worldbody><actuator>"
      "<motor joint='x' ctrllimited='true' ctrlrange='-9 9'/></actuator></mujoco>");
  if (r.flag("limited", false, "")) r.time_limit(9);
  if (r.flag("asks", false, "")) r.real("asked", 1, "");
  if (r.flag("before_step", on, "")) r.before_step([](const mjenv::Sim&, mjenv::Control& c) { c.ctrl[0] = 3; });
  if (r.flag("before_substep", on, "")) r.before_substep([](const mjenv::Sim&, mjenv::Control& c) { c.ctrl[0] += 4; });
  if (r.flag("carry", on, "")) r.carry([](const mjenv::Sim&) { return Eigen::Matrix<double, 1, 1>(7); });
  if (r.flag("reset_info", on, "")) r.reset_info([](const mjenv::Sim&, mjenv::Info& info) { info("told", 8); });
  if (r.flag("compute_reward", on, ""))
    r.compute_reward([](const mjenv::Goal& achieved, const mjenv::Goal& desired) { return achieved[0] - desired[0]; });
  r.observe("achieved_goal", [](const mjenv::Sim& s) { return s.qpos(); });
  r.observe("desired_goal", [](const mjenv::Sim& s) { return s.qpos(); });
  r.reset([](mjenv::Start&, mjenv::Rng&) {});
  r.step([](const mjenv::Sim& s, const mjenv::Carried& before, mjenv::Info&) -> mjenv::Outcome {
    return {10 * s.ctrl()[0] + (before.size() > 0 ? before[0] : 0), false};
  });
}
MJENV_TASK("tests/Off-v0", r) { optional(r, false); }
MJENV_TASK("tests/On-v0", r) { optional(r, true); }
