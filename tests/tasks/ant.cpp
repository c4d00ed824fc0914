// Ant-v5, written outside of the library in C++: a plug-in with the id CppAnt-v5.
#include <array>
#include <mjenv/task.hpp>

using namespace mjenv;

MJENV_TASK("CppAnt-v5", r) {
  r.model("ant.xml").frame_skip(5).time_limit(1000).reward_threshold(6000).needs(3, 0);
  r.camera({MJENV_BODY_UNSET, 4.0});

  const double w_forward = r.real("forward_reward_weight", 1, "weight of the velocity along x");
  const auto w_ctrl = r.real("ctrl_cost_weight", 0.5, "weight of the squared action");
  const auto w_contact = r.real("contact_cost_weight", 5e-4, "weight of the squared contact forces");
  const auto bonus = r.real("healthy_reward", 1, "reward for each step while healthy");
  const auto torso = r.body_option("main_body", 1, "the body whose velocity is rewarded");
  const auto ends = r.flag("terminate_when_unhealthy", true, "terminate the episode when unhealthy");
  const auto z_range = r.range("healthy_z_range", {0.2, 1.0}, "closed bounds of the torso's height while healthy, m");
  const auto force_range = r.range("contact_force_range", {-1, 1}, "bounds to which contact forces are clipped");
  const auto noise = r.noise(0.1);
  const auto hide_xy = r.flag("exclude_current_positions_from_observation", true, "do not observe x and y");
  const auto forces = r.flag("include_cfrc_ext_in_observation", true, "observe contact forces");
  const auto norm = r.norm();

  const auto contacts = [=](const Sim& s, int body) { return np::clip(s.cfrc_ext(body), force_range); };

  r.structure(hide_xy ? 2 : 0);
  r.observe("qpos", [=](const Sim& s) { return s.qpos(hide_xy ? 2 : 0); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe_if(forces, "cfrc_ext", [=](const Sim& s) { return contacts(s, 1); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += noise * rng.normal();
  });
  const auto position = [=](const Sim& s, Info& info) {
    const double x = s.qpos()[0], y = s.qpos()[1];
    info("x_position", x), info("y_position", y), info("distance_from_origin", norm(x, y));
  };
  r.reset_info(position);

  r.carry([=](const Sim& s) { return s.body_xy(torso); });
  r.step([=](const Sim& s, const Carried& xy_before, Row& /*row*/, Info& info) -> Outcome {
    const Eigen::Vector2d velocity = (s.body_xy(torso) - xy_before) / s.dt;
    const double z = s.qpos()[2];
    const bool healthy = s.finite() && z_range[0] <= z && z <= z_range[1];

    const double forward = velocity[0] * w_forward;
    const double survive = healthy * bonus;
    const np::Scalar ctrl = w_ctrl * np::sum_square(s.action);
    const double contact = w_contact * np::sum_square(contacts(s, 0));

    position(s, info);
    info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
    info("reward_forward", forward), info("reward_ctrl", -ctrl), info("reward_contact", -contact);
    info("reward_survive", numpy_typed(survive, bonus));
    return {(forward + survive) - (ctrl + contact), ends && !healthy};
  });
}
