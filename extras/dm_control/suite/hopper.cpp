// A hopper has to stand, or to hop forward at 2 m/s.
#include "randomize.hpp"

namespace suite {
namespace {

void hopper(Robot& r, bool hops) {
  r.model_text(model("hopper").c_str()).frame_skip(4).time_limit(kEpisode).current();
  if (hops) r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const Randomizer joints(r);
  const int torso = r.body("torso"), foot = r.body("foot");
  const std::array<Sensor, 2> touch{r.sensor("touch_toe"), r.sensor("touch_heel")};
  const Sensor velocity = r.sensor("torso_subtreelinvel");

  r.observe("position", [](const Sim& s) { return s.qpos(1); });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  r.observe("touch", [=](const Sim& s) { return log1p(s, touch); });
  const auto reset = [=](Start& start, RandomState& random) {
    joints.randomize_limited_and_rotational_joints(start, random);
  };
  episodes(r, reset, [=](const Sim& s) {
    const double standing = tolerance(s.xipos(torso)[2] - s.xipos(foot)[2], {0.6, 2});
    if (!hops) return standing * small_control(s);
    return standing * tolerance(s.sensor(velocity)[0], {2, kInfinity}, {1, Sigmoid::linear, 0.5});
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/hopper-stand-v0", r) { suite::hopper(r, false); }
MJENV_TASK("dm_control/hopper-hop-v0", r) { suite::hopper(r, true); }
