#include <mjenv/task.hpp>

namespace mjenv::robots {

// A planar two-legged runner, rewarded for its velocity along +x (Wawrzynski, 2009).
void half_cheetah(Robot& r) {
  r.model("half_cheetah.xml").frame_skip(5).time_limit(1000).reward_threshold(4800).needs(1, 0);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  r.camera({MJENV_BODY_UNSET, 4.0});

  const double w_forward = r.real("forward_reward_weight", 1, "weight of the velocity along x");
  const auto w_ctrl = r.real("ctrl_cost_weight", 0.1, "weight of the squared action");
  const auto noise = r.noise(0.1);
  const auto hide_x = r.flag("exclude_current_positions_from_observation", true, "do not observe x");

  if (r.v5) r.structure(hide_x ? 1 : 0);
  r.observe("qpos", [=](const Sim& s) { return s.qpos(hide_x ? 1 : 0); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += noise * rng.normal();
  });
  if (r.v5) r.reset_info([](const Sim& s, Info& info) { info("x_position", s.qpos()[0]); });

  r.carry([](const Sim& s) { return s.qpos().head<1>(); });
  r.step([=, v5 = r.v5](const Sim& s, const Carried& x_before, Info& info) -> Outcome {
    const double x = s.qpos()[0], velocity = (x - x_before[0]) / s.dt;
    const double forward = w_forward * velocity;
    const np::Scalar ctrl = w_ctrl * np::sum_square(s.action);

    info("x_position", x), info("x_velocity", velocity);
    info(v5 ? "reward_forward" : "reward_run", forward), info("reward_ctrl", -ctrl);
    return {forward - ctrl, false};
  });
}

}  // namespace mjenv::robots
