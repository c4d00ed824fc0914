#include <mjenv/task.hpp>

namespace mjenv::robots {

// An arm that pushes a cylinder to a goal on a table.
void pusher(Robot& r) {
  // v4's object weighs next to nothing
  r.model(r.v5 ? "pusher_v5.xml" : "pusher.xml").frame_skip(5).time_limit(100).reward_threshold(0).needs(7, 7);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  r.camera({-1, 4.0});

  const double w_near =
      r.v5 ? r.real("reward_near_weight", 0.5, "weight of the arm's distance to the object") : Real{0.5, false};
  const double w_dist =
      r.v5 ? r.real("reward_dist_weight", 1, "weight of the object's distance to the goal") : Real{1, false};
  const double w_ctrl = r.v5 ? r.real("reward_control_weight", 0.1, "weight of the squared action") : Real{0.1, false};
  const auto norm = r.norm();
  const int arm = r.body("tips_arm"), object = r.body("object"), goal = r.body("goal");

  r.observe("qpos", [](const Sim& s) { return s.qpos().head<7>(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel().head<7>(); });
  r.observe("tips_arm", [=](const Sim& s) { return s.xpos(arm); });
  r.observe("object", [=](const Sim& s) { return s.xpos(object); });
  r.observe("goal", [=](const Sim& s) { return s.xpos(goal); });

  r.reset([=](Start& start, Rng& rng) {
    double x = 0, y = 0;
    do {
      x = rng.uniform(-0.3, 0);
      y = rng.uniform(-0.2, 0.2);
    } while (!(norm(x, y) > 0.17));  // the object starts away from the goal
    start.qpos.tail<4>() << x, y, 0, 0;
    for (double& v : start.qvel) v += rng.uniform(-0.005, 0.005);
    start.qvel.tail<4>().setZero();
  });

  const auto distances = [=](const Sim& s) {
    return Eigen::Vector2d(norm((s.xpos(object) - s.xpos(arm)).eval()), norm((s.xpos(object) - s.xpos(goal)).eval()));
  };
  if (!r.v5) r.carry(distances);
  r.step([=, v5 = r.v5](const Sim& s, const Carried& before, Info& info) -> Outcome {
    const Eigen::Vector2d distance = v5 ? distances(s) : before;  // v4 rewards the state before the action
    const double near = -distance[0], dist = -distance[1];
    const np::Scalar ctrl = -np::sum_square(s.action);

    info("reward_dist", v5 ? dist * w_dist : dist);
    info("reward_ctrl", v5 ? ctrl * w_ctrl : ctrl);  // v4 reports them without weights
    if (v5) info("reward_near", near * w_near);
    return {(dist * w_dist + ctrl * w_ctrl) + near * w_near, false};
  });
}

}  // namespace mjenv::robots
