// HumanoidStandup-v5 for a training by stages: a row begins lying or upright, and a force lifts the torso until it is
// high. Observations and rewards are those of HumanoidStandup-v5, so that the trained policy is one for that id.
#include <algorithm>
#include <cmath>
#include <mjenv/task.hpp>

using namespace mjenv;

MJENV_TASK("StandupLesson-v0", r) {
  r.model("humanoidstandup.xml").frame_skip(5).time_limit(400).needs_exactly(24, 23);

  const auto upright =
      r.live("upright", 0, "1: episodes begin upright and end when the torso falls below 0.85 m", 0, 1);
  const auto lift = r.live("lift", 0, "the force that lifts the torso of a row that began lying, N", 0, 1000);
  const double low = r.real("lift_low", 0.95, "height of the torso up to which the whole force acts, m");
  const double high = r.real("lift_high", 1.15, "height of the torso above which no force acts, m");

  const int torso = r.body("torso");
  const auto force = r.own("xfrc_applied");
  const Carry began_upright = r.carry(1);

  r.observe("qpos", [](const Sim& s) { return s.qpos(2); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe("cinert", [](const Sim& s) { return s.cinert(1); });
  r.observe("cvel", [](const Sim& s) { return s.cvel(1); });
  r.observe("qfrc_actuator", [](const Sim& s) { return s.qfrc_actuator(6); });
  r.observe("cfrc_ext", [](const Sim& s) { return s.cfrc_ext(1); });

  r.reset([=](Start& start, Rng& rng) {
    start[began_upright][0] = start[upright] > 0.5;
    if (start[upright] > 0.5) {  // the model's posture, turned about y by 90 degrees, feet on the ground
      start.qpos[2] = 1.22;
      start.qpos[3] = start.qpos[5] = std::sqrt(0.5);
      for (int i = 3; i < 24; ++i) start.qpos[i] += rng.uniform(-0.04, 0.04);
      start.qpos[13] -= 0.07;  // the knees, which cannot be straight
      start.qpos[17] -= 0.07;
      for (int i = 0; i < 23; ++i) start.qvel[i] = rng.uniform(-0.05, 0.05);
    } else {
      for (double& q : start.qpos) q += rng.uniform(-0.01, 0.01);
      for (double& v : start.qvel) v += rng.uniform(-0.01, 0.01);
    }
  });

  r.step([=](const Sim& s, Row& row, Info&) -> Outcome {
    const double z = s.qpos()[2];
    const bool stood = row[began_upright][0] > 0.5;
    const double share = std::clamp((high - z) / (high - low), 0.0, 1.0);
    const bool helped = !stood && s.time() < 1.5;
    row[force][6 * torso + 2] = helped ? s[lift] * share : 0;
    const double ctrl = 0.1 * np::sum_square(s.ctrl());
    const double impact = std::min(5e-7 * np::sum_square(s.cfrc_ext()), 10.0);
    return {z / s.timestep - ctrl - impact + 1, !helped && z < 0.85};
  });
}
