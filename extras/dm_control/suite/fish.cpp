// A fish has to keep upright, or to swim to a target.
#include "randomize.hpp"

namespace suite {
namespace {

constexpr int kJoints = 7;  // after the root

double upright(const Sim& s, int torso) { return s.xmat(torso)(2, 2); }

void fish(Robot& r, bool swims) {
  r.model_text(model(swims ? "fish_swim" : "fish_upright").c_str()).frame_skip(10).time_limit(kEpisode).current();
  if (!swims) r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const int torso = r.body("torso"), mouth = r.geom("mouth"), target = r.geom("target");
  const auto norm = r.norm();
  const auto geom_size = r.array("geom_size");
  const Own geom_pos = swims ? r.own("geom_pos") : Own{};

  const auto to_target = [=](const Sim& s) {
    return in_frame(norm, s.geom_xpos(target) - s.geom_xpos(mouth), s.geom_xmat(mouth));
  };
  r.observe("joint_angles", [](const Sim& s) { return s.qpos(7); });
  r.observe("upright", [=](const Sim& s) { return upright(s, torso); });
  if (swims) r.observe("target", to_target);
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    start.qpos.segment<4>(3) = random_quaternion(norm, [&] { return random.randn(); });
    for (double& angle : start.qpos.tail<kJoints>()) angle = random.uniform(-.2, .2);
    if (!swims) return;
    double* place = start[geom_pos].data() + 3 * target;
    place[0] = random.uniform(-.4, .4);
    place[1] = random.uniform(-.4, .4);
    place[2] = random.uniform(.1, .3);
  };
  episodes(r, reset, [=](const Sim& s) {
    if (!swims) return tolerance(upright(s, torso), {1, 1}, {1});
    const double radii = s[geom_size][3 * mouth] + s[geom_size][3 * target];
    const double in_target = tolerance(norm(to_target(s)), {0, radii}, {2 * radii});
    return (7 * in_target + 0.5 * (upright(s, torso) + 1)) / 8;
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/fish-upright-v0", r) { suite::fish(r, false); }
MJENV_TASK("dm_control/fish-swim-v0", r) { suite::fish(r, true); }
