#include <cmath>

#include <mjenv/task.hpp>

namespace mjenv::robots {

// Two poles on a cart, rewarded for keeping their tip up and still.
void inverted_double_pendulum(Robot& r) {
  r.model("inverted_double_pendulum.xml").frame_skip(5).time_limit(1000).reward_threshold(9100).needs_exactly(3, 3);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  if (!r.v5) r.camera({0, 4.1225, {0, 0, 0.12250000000000005}});

  const auto bonus = r.v5 ? r.real("healthy_reward", 10, "reward for each step while the tip is up") : Real{10, false};
  const auto noise = r.v5 ? r.noise(0.1) : 0.1;
  const int tip = r.site(0);
  const int forces = r.v5 ? 1 : 3;  // how many constraint forces are observed; v5 leaves out those that are always 0

  r.observe("cart", [](const Sim& s) { return s.qpos().head<1>(); });
  r.observe("sin", [](const Sim& s) { return s.qpos(1).unaryExpr([](double x) { return std::sin(x); }); });
  r.observe("cos", [](const Sim& s) { return s.qpos(1).unaryExpr([](double x) { return std::cos(x); }); });
  r.observe("qvel", [](const Sim& s) { return np::clip(s.qvel(), {-10, 10}); });
  r.observe("qfrc_constraint", [=](const Sim& s) { return np::clip(s.qfrc_constraint(forces), {-10, 10}); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += rng.normal() * noise;
  });

  r.step([=, v5 = r.v5](const Sim& s, Info& info) -> Outcome {
    const double x = s.site_xpos(tip)[0], y = s.site_xpos(tip)[2];
    const bool fell = y <= 1;  // NaN compares false, so a NaN does not end the episode
    const double distance = 0.01 * np::power2(x) + np::power2(y - 2);
    const double velocity = 1e-3 * np::power2(s.qvel()[1]) + 5e-3 * np::power2(s.qvel()[2]);
    const double survive = v5 ? bonus * !fell : bonus;  // v4 also pays it in the step in which the robot falls

    if (v5) info("reward_survive", python_typed(survive, bonus));
    if (v5) info("distance_penalty", -distance), info("velocity_penalty", -velocity);
    return {(survive - distance) - velocity, fell};
  });
}

}  // namespace mjenv::robots
