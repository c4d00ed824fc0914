#include <mjenv/task.hpp>

namespace mjenv::robots {

// Three links in a viscous plane, rewarded for moving along +x (Coulom, 2002).
void swimmer(Robot& r) {
  r.model("swimmer.xml").frame_skip(4).time_limit(1000).reward_threshold(360).needs(2, 0);
  if (!r.v5) r.fixed_model().fixed_frame_skip();

  const double w_forward = r.real("forward_reward_weight", 1, "weight of the velocity along x");
  const auto w_ctrl = r.real("ctrl_cost_weight", 1e-4, "weight of the squared action");
  const auto noise = r.noise(0.1);
  const auto hide_xy = r.flag("exclude_current_positions_from_observation", true, "do not observe x and y");
  const auto norm = r.norm();

  if (r.v5) r.structure(hide_xy ? 2 : 0);
  r.observe("qpos", [=](const Sim& s) { return s.qpos(hide_xy ? 2 : 0); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += rng.uniform(-noise, noise);
  });
  const auto position = [=](const Eigen::Vector2d& xy, Info& info) {
    info("x_position", xy[0]), info("y_position", xy[1]), info("distance_from_origin", norm(xy));
  };
  if (r.v5) r.reset_info([=](const Sim& s, Info& info) { position(s.qpos().head<2>(), info); });

  r.carry([](const Sim& s) { return s.qpos().head<2>(); });
  r.step([=, v5 = r.v5](const Sim& s, const Carried& xy_before, Info& info) -> Outcome {
    const Eigen::Vector2d xy = s.qpos().head<2>();
    const Eigen::Vector2d velocity = (xy - xy_before) / s.dt;
    const double forward = w_forward * velocity[0];
    const np::Scalar ctrl = w_ctrl * np::sum_square(s.action);

    if (!v5) info("reward_fwd", forward), info("reward_ctrl", -ctrl);
    position(xy, info);
    info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
    if (v5)
      info("reward_forward", forward), info("reward_ctrl", -ctrl);
    else
      info("forward_reward", forward);
    return {forward - ctrl, false};
  });
}

}  // namespace mjenv::robots
