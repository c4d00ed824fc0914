// An arm has to reach for a large or a small target.
#include "randomize.hpp"

namespace suite {
namespace {

void reacher(Robot& r, const char* name) {
  r.model_text(model(name).c_str()).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const Randomizer joints(r);
  const auto norm = r.norm();
  const int target = r.geom("target"), finger = r.geom("finger");
  const auto geom_size = r.array("geom_size");
  const Own geom_pos = r.own("geom_pos");

  const auto to_target = [=](const Sim& s) -> Vector2d {
    return s.geom_xpos(target).head<2>() - s.geom_xpos(finger).head<2>();
  };
  r.observe("position", [](const Sim& s) { return s.qpos(); });
  r.observe("to_target", to_target);
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    joints.randomize_limited_and_rotational_joints(start, random);
    const double angle = random.uniform(0, 2 * kPi), radius = random.uniform(.05, .20);
    start[geom_pos].segment<2>(3 * target) << radius * std::sin(angle), radius * std::cos(angle);
  };
  episodes(r, reset, [=](const Sim& s) {
    const double radii = s[geom_size][3 * target] + s[geom_size][3 * finger];
    return tolerance(norm(to_target(s)), {0, radii});
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/reacher-easy-v0", r) { suite::reacher(r, "reacher_easy"); }
MJENV_TASK("dm_control/reacher-hard-v0", r) { suite::reacher(r, "reacher_hard"); }
