// A linear quadratic regulator: motors have to bring a chain of balls on springs to rest.
#include "randomize.hpp"

namespace suite {
namespace {

constexpr int kMaxBalls = 6;

void lqr(Robot& r, int balls, int motors) {
  r.model_text(lqr_model(balls, motors).c_str()).current();  // without a limit of time
  // The motors have no bounds. dm_control's action_spec has MuJoCo's largest number.
  r.action(motors, -1e10, 1e10);
  r.before_step([](const Sim& s, Control& control) { control.ctrl = s.action.vector(); });
  const auto norm = r.norm();
  const Own stiffness = r.own("jnt_stiffness");
  // numpy.dot(v, v)
  const auto dot = [=](const auto& v) {
    double sum = 0;
    for (const double x : v) sum = norm.fused() ? std::fma(x, x, sum) : sum + x * x;
    return sum;
  };

  r.observe("position", [](const Sim& s) { return s.qpos(); });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    // dm_control draws the springs, and dampers of 0, when it makes the environment, so they are a seed's first draws.
    if (random.is_new())
      for (double& spring : start[stiffness]) {
        spring = random.uniform(15, 25);
        random.uniform(0, 0);
      }
    Vector<kMaxBalls> direction(balls);
    for (double& x : direction) x = random.randn();
    const double length = norm(direction);
    for (int i = 0; i < balls; ++i) start.qpos[i] = std::sqrt(2.0) * direction[i] / length;
  };
  episodes(r, reset, [=](const Sim& s) -> Outcome {
    Vector<2 * kMaxBalls> state(2 * balls);
    state << s.qpos(), s.qvel();
    return {1 - (0.5 * dot(s.qpos()) + 0.5 * dot(s.ctrl()) * 0.1), norm(state) < 1e-6};
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/lqr-lqr_2_1-v0", r) { suite::lqr(r, 2, 1); }
MJENV_TASK("dm_control/lqr-lqr_6_2-v0", r) { suite::lqr(r, 6, 2); }
