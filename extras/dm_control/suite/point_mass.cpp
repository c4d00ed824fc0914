// A ball has to slide to a target. In the task "hard", each motor pushes in a direction that the reset draws.
#include "randomize.hpp"

namespace suite {
namespace {

void point_mass(Robot& r, bool hard) {
  r.model_text(model("point_mass").c_str()).time_limit(kEpisode).current();
  const Randomizer joints(r);
  const auto norm = r.norm();
  const int target = r.geom("target"), ball = r.geom("pointmass");
  const auto geom_size = r.array("geom_size");
  const Own wrap_prm = hard ? r.own("wrap_prm") : Own{};  // the coefficients of both tendons

  r.observe("position", [](const Sim& s) { return s.qpos(); });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    joints.randomize_limited_and_rotational_joints(start, random);
    if (!hard) return;
    const auto direction = [&] {
      const double x = random.randn(), y = random.randn();
      return normalized(norm, Vector2d(x, y));
    };
    const auto dot = [&](const Vector2d& a, const Vector2d& b) {
      return norm.fused() ? std::fma(a[1], b[1], a[0] * b[0]) : a[0] * b[0] + a[1] * b[1];
    };
    const Vector2d first = direction();
    Vector2d second = direction();
    while (std::fabs(dot(first, second)) > 0.9) second = direction();
    start[wrap_prm].head<4>() << first, second;
  };
  episodes(r, reset, [=](const Sim& s) {
    const double radius = s[geom_size][3 * target];
    const double distance = norm((s.geom_xpos(target) - s.geom_xpos(ball)).eval());
    return tolerance(distance, {0, radius}, {radius}) * small_control(s);
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/point_mass-easy-v0", r) { suite::point_mass(r, false); }
MJENV_TASK("dm_control/point_mass-hard-v0", r) { suite::point_mass(r, true); }
