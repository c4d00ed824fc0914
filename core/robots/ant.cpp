#include <mjenv/task.hpp>

namespace mjenv::robots {

// A four-legged robot in space, rewarded for moving its torso along +x (Schulman et al., 2015).
void ant(Robot& r) {
  r.model("ant.xml").frame_skip(5).time_limit(1000).reward_threshold(6000).needs(3, 0);
  if (!r.v5) r.fixed_frame_skip();
  r.camera({MJENV_BODY_UNSET, 4.0});

  const double w_forward = r.v5 ? r.real("forward_reward_weight", 1, "weight of the velocity along x") : Real{1, false};
  const auto w_ctrl = r.real("ctrl_cost_weight", 0.5, "weight of the squared action");
  const auto v4_forces =
      r.v5 ? false : r.flag("use_contact_forces", false, "observe contact forces and subtract their cost");
  const auto w_contact = r.real("contact_cost_weight", 5e-4, "weight of the squared contact forces");
  const auto bonus = r.real("healthy_reward", 1, "reward for each step while healthy");
  const auto torso = r.v5 ? r.body_option("main_body", 1, "the body whose velocity is rewarded") : r.body("torso");
  const auto ends = r.flag("terminate_when_unhealthy", true, "terminate the episode when unhealthy");
  const auto z_range = r.range("healthy_z_range", {0.2, 1.0}, "closed bounds of the torso's height while healthy, m");
  const auto force_range = r.range("contact_force_range", {-1, 1}, "bounds to which contact forces are clipped");
  const auto noise = r.noise(0.1);
  const auto hide_xy = r.flag("exclude_current_positions_from_observation", true, "do not observe x and y");
  const auto forces = r.v5 ? r.flag("include_cfrc_ext_in_observation", true, "observe contact forces") : v4_forces;
  const auto norm = r.norm();

  const auto contacts = [=](const Sim& s, int body) { return np::clip(s.cfrc_ext(body), force_range); };

  if (r.v5) r.structure(hide_xy ? 2 : 0);
  r.observe("qpos", [=](const Sim& s) { return s.qpos(hide_xy ? 2 : 0); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe_if(forces, "cfrc_ext", [=, first = r.v5 ? 1 : 0](const Sim& s) { return contacts(s, first); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += noise * rng.normal();
  });
  if (r.v5)
    r.reset_info([=](const Sim& s, Info& info) {
      const double x = s.qpos()[0], y = s.qpos()[1];
      info("x_position", x), info("y_position", y), info("distance_from_origin", norm(x, y));
    });

  r.carry([=](const Sim& s) { return s.body_xy(torso); });
  r.step([=, v5 = r.v5](const Sim& s, const Carried& xy_before, Info& info) -> Outcome {
    const Eigen::Vector2d xy = s.body_xy(torso);  // from before the last integration, not from the new qpos
    const Eigen::Vector2d velocity = (xy - xy_before) / s.dt;
    const double z = s.qpos()[2];
    const bool healthy = s.finite() && z_range[0] <= z && z <= z_range[1];

    const double forward = velocity[0] * w_forward;
    const double survive = (v5 ? healthy : healthy || ends) * bonus;  // v4 also pays it when the robot falls
    const np::Scalar ctrl = w_ctrl * np::sum_square(s.action);
    const double contact = v5 || forces ? w_contact * np::sum_square(contacts(s, 0)) : 0.0;
    const Outcome outcome{(forward + survive) - (v5 || forces ? ctrl + contact : ctrl), ends && !healthy};

    if (v5) {
      const double x = s.qpos()[0], y = s.qpos()[1];
      info("x_position", x), info("y_position", y), info("distance_from_origin", norm(x, y));
      info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
      info("reward_forward", forward), info("reward_ctrl", -ctrl), info("reward_contact", -contact);
      info("reward_survive", numpy_typed(survive, bonus));
      return outcome;
    }
    info("reward_forward", forward);
    if (forces)
      info("reward_ctrl", -contact);  // v4 overwrites the control cost with the contact cost
    else
      info("reward_ctrl", -ctrl);
    info("reward_survive", PythonFloat{survive});
    info("x_position", xy[0]), info("y_position", xy[1]), info("distance_from_origin", norm(xy));
    info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
    info("forward_reward", forward);
    return outcome;
  });
}

}  // namespace mjenv::robots
