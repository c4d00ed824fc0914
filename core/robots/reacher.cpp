#include <cmath>

#include <mjenv/task.hpp>

namespace mjenv::robots {

// A two-joint arm whose fingertip reaches for a target in the plane.
void reacher(Robot& r) {
  r.model("reacher.xml").frame_skip(2).time_limit(50).reward_threshold(-3.75).needs_exactly(4, 4);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  r.camera({0});

  const double w_dist = r.v5 ? r.real("reward_dist_weight", 1, "weight of the distance to the target") : Real{1, false};
  const double w_ctrl = r.v5 ? r.real("reward_control_weight", 1, "weight of the squared action") : Real{1, false};
  const auto norm = r.norm();
  const int fingertip = r.body("fingertip"), target = r.body("target");

  r.observe("cos", [](const Sim& s) { return s.qpos().head<2>().unaryExpr([](double x) { return std::cos(x); }); });
  r.observe("sin", [](const Sim& s) { return s.qpos().head<2>().unaryExpr([](double x) { return std::sin(x); }); });
  r.observe("target", [](const Sim& s) { return s.qpos(2); });
  r.observe("qvel", [](const Sim& s) { return s.qvel().head<2>(); });
  // v5 leaves out z, which is always 0
  r.observe("to_target",
            [=, size = r.v5 ? 2 : 3](const Sim& s) { return (s.xpos(fingertip) - s.xpos(target)).head(size).eval(); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q = rng.uniform(-0.1, 0.1) + q;
    double x = 0, y = 0;
    do {
      x = rng.uniform(-0.2, 0.2);
      y = rng.uniform(-0.2, 0.2);
    } while (!(norm(x, y) < 0.2));
    start.qpos.tail<2>() << x, y;
    for (double& v : start.qvel) v += rng.uniform(-0.005, 0.005);
    start.qvel.tail<2>().setZero();
  });

  const auto distance = [=](const Sim& s) { return norm((s.xpos(fingertip) - s.xpos(target)).eval()); };
  if (!r.v5) r.carry([=](const Sim& s) { return Eigen::Matrix<double, 1, 1>(distance(s)); });
  r.step([=, v5 = r.v5](const Sim& s, const Carried& before, Info& info) -> Outcome {
    const double dist = -(v5 ? distance(s) : before[0]) * w_dist;  // v4 rewards the state before the action
    const np::Scalar ctrl = -np::sum_square(s.action) * w_ctrl;
    info("reward_dist", dist), info("reward_ctrl", ctrl);
    return {dist + ctrl, false};
  });
}

}  // namespace mjenv::robots
