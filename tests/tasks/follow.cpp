// Maps between the action and the simulation: a filter, PD torques that arrive one mj_step late, and gusts. And a step that
// moves a marker of the model and kicks the trunk.
#include <algorithm>
#include <mjenv/task.hpp>

using namespace mjenv;

MJENV_TASK("tests/Follow-v0", r) {
  r.model("./follow.xml").frame_skip(4).time_limit(50);
  const double kp = r.real("kp", 30, "N m/rad"), kd = r.real("kd", 1, "N m s/rad");
  const double limit = r.real("limit", 40, "the greatest height of the trunk, m; 0: fails in before_substep");
  const bool current = r.flag("current", false, "see the new state, and move the marker");
  const int trunk = r.body("trunk"), marker = r.geom("marker");
  const std::array<Joint, 2> joints{r.joint("hip"), r.joint("knee")};
  const auto home = r.array("key_qpos");
  const Carry target = r.carry(2), torque = r.carry(2);
  const Own gust = r.own("xfrc_applied");
  Own place;
  if (current) place = r.current().own("geom_pos");
  r.action(2, -1, 1);

  r.reset([=](Start& start, Rng& rng) {
    for (int i = 0; i < 9; ++i) start.qpos[i] = start[home][i] + rng.uniform(-0.05, 0.05);
  });
  r.before_step([=](const Sim& s, Row& row, Control& control) {
    for (int i = 0; i < 2; ++i) {
      const double wanted = s[home][joints[i].qpos] + 0.5 * std::clamp(s.action[i], -0.8, 0.8);
      row[target][i] += 0.4 * (wanted - row[target][i]);
    }
    control[gust][6 * trunk] = row.rng.uniform(-20, 20);
  });
  r.before_substep([=](const Sim& s, Row& row, Control& control) {
    if (control.substep == 3 && s.qpos()[2] > limit) throw std::runtime_error("the trunk flies");
    control[gust][6 * trunk + 2] = control.substep;
    for (int i = 0; i < 2; ++i) {
      control.ctrl[i] = row[torque][i];
      row[torque][i] = kp * (row[target][i] - s.qpos(joints[i])) - kd * s.qvel(joints[i]);
    }
  });
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe("ctrl", [](const Sim& s) { return s.ctrl(); });
  r.observe("target", [=](const Sim& s) { return s[target]; });
  r.observe("sites", [=](const Sim& s) { return s.xpos(trunk); });
  const auto forces = r.array("xfrc_applied");
  r.observe("gust", [=](const Sim& s) { return s[forces].segment(6 * trunk, 6); });
  if (current) {
    const auto places = r.array("geom_pos");
    r.observe("marker", [=](const Sim& s) {
      Eigen::Matrix<double, 6, 1> both;
      both << s[places].segment(3 * marker, 3), s.geom_xpos(marker);
      return both;
    });
  }
  r.step([=](const Sim& s, Row& row, Info& info) -> Outcome {
    info("speed", s.qvel()[0]);
    if (current) row[place][3 * marker] += 0.25;
    row.qvel()[1] += 0.1 * s.action[0];
    return {s.action.vector().sum(), false};
  });
}
