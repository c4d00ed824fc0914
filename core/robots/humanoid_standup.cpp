#include <mjenv/task.hpp>

namespace mjenv::robots {

// The humanoid on its back, rewarded for the height of its torso.
void humanoid_standup(Robot& r) {
  r.model("humanoidstandup.xml").frame_skip(5).time_limit(1000).needs(3, 6);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  r.camera({1, 4.0, {0, 0, 0.8925}, -20});

  if (r.v5) r.real("uph_cost_weight", 1, "Gymnasium has this option, but it has no effect");
  const double w_ctrl = r.v5 ? r.real("ctrl_cost_weight", 0.1, "weight of the squared controls") : Real{0.1, false};
  const double w_impact =
      r.v5 ? r.real("impact_cost_weight", 5e-7, "weight of the squared contact forces") : Real{0.5e-6, false};
  const auto cost_range =
      r.v5 ? r.range("impact_cost_range", {-kInfinity, 10}, "bounds to which the contact cost is clipped")
           : std::array<double, 2>{-kInfinity, 10};
  const auto noise = r.v5 ? r.noise(1e-2) : 1e-2;
  const auto hide_xy = !r.v5 || r.flag("exclude_current_positions_from_observation", true, "do not observe x and y");
  const auto cinert = !r.v5 || r.flag("include_cinert_in_observation", true, "observe body inertias");
  const auto cvel = !r.v5 || r.flag("include_cvel_in_observation", true, "observe body velocities");
  const auto qfrc = !r.v5 || r.flag("include_qfrc_actuator_in_observation", true, "observe actuator forces");
  const auto cfrc = !r.v5 || r.flag("include_cfrc_ext_in_observation", true, "observe contact forces");

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
  const auto position = [](const Sim& s, Info& info) {
    info("x_position", s.qpos()[0]), info("y_position", s.qpos()[1]);
    info("z_distance_from_origin", s.qpos()[2] - s.init_qpos()[2]);
    info("tendon_length", s.ten_length()), info("tendon_velocity", s.ten_velocity());
  };
  if (r.v5) r.reset_info(position);

  r.step([=, v5 = r.v5](const Sim& s, Info& info) -> Outcome {
    const double up = (s.qpos()[2] - 0) / s.timestep;  // as in Gymnasium: not divided by s.dt
    const double ctrl = w_ctrl * np::sum_square(s.ctrl());
    const double impact = np::clip(w_impact * np::sum_square(s.cfrc_ext()), cost_range[0], cost_range[1]);

    if (v5) position(s, info);
    info("reward_linup", up), info("reward_quadctrl", -ctrl), info("reward_impact", -impact);
    return {((up - ctrl) - impact) + 1, false};
  });
}

}  // namespace mjenv::robots
