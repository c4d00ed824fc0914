#include <mjenv/task.hpp>

namespace mjenv::robots {

// A planar two-legged walker, rewarded for its velocity along +x (Levine and Koltun, 2013).
void walker2d(Robot& r) {
  // v4's model has a slippery right foot
  r.model(r.v5 ? "walker2d_v5.xml" : "walker2d.xml").frame_skip(4).time_limit(1000).needs(3, 0);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  r.camera({2, 4.0, {0, 0, 1.15}, -20});

  const double w_forward = r.real("forward_reward_weight", 1, "weight of the velocity along x");
  const auto w_ctrl = r.real("ctrl_cost_weight", 1e-3, "weight of the squared action");
  const auto bonus = r.real("healthy_reward", 1, "reward for each step while healthy");
  const auto ends = r.flag("terminate_when_unhealthy", true, "terminate the episode when unhealthy");
  const auto z_range = r.range("healthy_z_range", {0.8, 2.0}, "open bounds of the height while healthy, m");
  const auto angle_range = r.range("healthy_angle_range", {-1, 1}, "open bounds of the pitch while healthy, rad");
  const auto noise = r.noise(5e-3);
  const auto hide_x = r.flag("exclude_current_positions_from_observation", true, "do not observe x");

  const auto within = [](double x, const std::array<double, 2>& range) { return range[0] < x && x < range[1]; };

  if (r.v5) r.structure(hide_x ? 1 : 0);
  r.observe("qpos", [=](const Sim& s) { return s.qpos(hide_x ? 1 : 0); });
  r.observe("qvel", [](const Sim& s) { return np::clip(s.qvel(), {-10, 10}); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += rng.uniform(-noise, noise);
  });
  if (r.v5)
    r.reset_info([](const Sim& s, Info& info) {
      info("x_position", s.qpos()[0]), info("z_distance_from_origin", s.qpos()[1] - s.init_qpos()[1]);
    });

  r.carry([](const Sim& s) { return s.qpos().head<1>(); });
  r.step([=, v5 = r.v5](const Sim& s, const Carried& x_before, Info& info) -> Outcome {
    const double x = s.qpos()[0], z = s.qpos()[1], angle = s.qpos()[2];
    const double velocity = (x - x_before[0]) / s.dt;
    const bool healthy = within(z, z_range) && within(angle, angle_range);

    const double forward = w_forward * velocity;
    const double survive = (v5 ? healthy : healthy || ends) * bonus;  // v4 also pays it when the robot falls
    const np::Scalar ctrl = w_ctrl * np::sum_square(s.action);

    info("x_position", x);
    if (v5) info("z_distance_from_origin", z - s.init_qpos()[1]);
    info("x_velocity", velocity);
    if (v5) info("reward_forward", forward), info("reward_ctrl", -ctrl);
    if (v5) info("reward_survive", numpy_typed(survive, bonus));
    return {(forward + survive) - ctrl, ends && !healthy};
  });
}

}  // namespace mjenv::robots
