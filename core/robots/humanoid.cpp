#include <mjenv/task.hpp>

namespace mjenv::robots {

// A humanoid in space, rewarded for walking along +x without falling (Tassa, Erez and Todorov, 2012).
void humanoid(Robot& r) {
  r.model("humanoid.xml").frame_skip(5).time_limit(1000).needs(3, 6);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  r.camera({1, 4.0, {0, 0, 2.0}, -20});

  const double w_forward = r.real("forward_reward_weight", 1.25, "weight of the velocity along x");
  const double w_ctrl = r.real("ctrl_cost_weight", 0.1, "weight of the squared controls");
  const double w_contact = r.v5 ? r.real("contact_cost_weight", 5e-7, "weight of the squared contact forces") : Real{};
  const auto cost_range =
      r.v5 ? r.range("contact_cost_range", {-kInfinity, 10}, "bounds to which the contact cost is clipped")
           : std::array<double, 2>{};
  const auto bonus = r.real("healthy_reward", 5, "reward for each step while healthy");
  const auto ends = r.flag("terminate_when_unhealthy", true, "terminate the episode when unhealthy");
  const auto z_range = r.range("healthy_z_range", {1, 2}, "open bounds of the height while healthy, m");
  const auto noise = r.noise(1e-2);
  const auto hide_xy = r.flag("exclude_current_positions_from_observation", true, "do not observe x and y");
  const auto cinert = !r.v5 || r.flag("include_cinert_in_observation", true, "observe body inertias");
  const auto cvel = !r.v5 || r.flag("include_cvel_in_observation", true, "observe body velocities");
  const auto qfrc = !r.v5 || r.flag("include_qfrc_actuator_in_observation", true, "observe actuator forces");
  const auto cfrc = !r.v5 || r.flag("include_cfrc_ext_in_observation", true, "observe contact forces");
  const auto norm = r.norm();

  const int world = r.v5 ? 1 : 0, root = r.v5 ? 6 : 0;  // v5 leaves out the world and the unactuated root

  if (r.v5) r.structure(hide_xy ? 2 : 0);
  r.observe("qpos", [=](const Sim& s) { return s.qpos(hide_xy ? 2 : 0); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe_if(cinert, "cinert", [=](const Sim& s) { return s.cinert(world); });
  r.observe_if(cvel, "cvel", [=](const Sim& s) { return s.cvel(world); });
  r.observe_if(qfrc, "qfrc_actuator", [=](const Sim& s) { return s.qfrc_actuator(root); });
  r.observe_if(cfrc, "cfrc_ext", [=](const Sim& s) { return s.cfrc_ext(world); });
  r.observe_nothing("ten_length");
  r.observe_nothing("ten_velocity");

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += rng.uniform(-noise, noise);
  });
  const auto position = [=](const Sim& s, Info& info) {
    const double x = s.qpos()[0], y = s.qpos()[1];
    info("x_position", x), info("y_position", y);
    info("tendon_length", s.ten_length()), info("tendon_velocity", s.ten_velocity());
    info("distance_from_origin", norm(x, y));
  };
  if (r.v5) r.reset_info(position);

  r.carry([](const Sim& s) { return s.mass_center_xy(); });
  r.step([=, v5 = r.v5](const Sim& s, const Carried& xy_before, Info& info) -> Outcome {
    const Eigen::Vector2d xy = s.mass_center_xy();  // from before the last integration, not from the new qpos
    const Eigen::Vector2d velocity = (xy - xy_before) / s.dt;
    const double z = s.qpos()[2];
    const bool healthy = z_range[0] < z && z < z_range[1];

    const double forward = w_forward * velocity[0];
    const double survive = (v5 ? healthy : healthy || ends) * bonus;  // v4 also pays it when the robot falls
    const double ctrl = w_ctrl * np::sum_square(s.ctrl());
    // v4 computes no contact cost
    const double contact = v5 ? np::clip(w_contact * np::sum_square(s.cfrc_ext()), cost_range[0], cost_range[1]) : 0;

    if (v5) {
      position(s, info);
      info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
      info("reward_survive", numpy_typed(survive, bonus)), info("reward_forward", forward);
      info("reward_ctrl", -ctrl), info("reward_contact", -contact);
      return {(forward + survive) - (ctrl + contact), ends && !healthy};
    }
    info("reward_linvel", forward), info("reward_quadctrl", -ctrl), info("reward_alive", PythonFloat{survive});
    info("x_position", xy[0]), info("y_position", xy[1]), info("distance_from_origin", norm(xy));
    info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
    info("forward_reward", forward);
    return {(forward + survive) - ctrl, ends && !healthy};
  });
}

}  // namespace mjenv::robots
