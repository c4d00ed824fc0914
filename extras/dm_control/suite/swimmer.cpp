// A swimmer has to bring its nose to a target.
#include "randomize.hpp"

namespace suite {
namespace {

constexpr int kMaxLinks = 15;

void swimmer(Robot& r, int links) {
  r.model_text(swimmer_model(links).c_str()).frame_skip(15).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const Randomizer joints(r);
  const auto norm = r.norm();
  const int target = r.geom("target"), nose = r.geom("nose"), head = r.body("head");
  const auto geom_size = r.array("geom_size");
  const Own geom_pos = r.own("geom_pos"), light_pos = r.own("light_pos");
  const int light = r.index("light", "target_light");

  const auto to_target = [=](const Sim& s) -> Vector2d {
    return in_frame(norm, s.geom_xpos(target) - s.geom_xpos(nose), s.xmat(head)).head<2>();
  };
  r.observe("joints", [](const Sim& s) { return s.qpos(3); });
  r.observe("to_target", to_target);
  r.observe("body_velocities", [=](const Sim& s) {
    constexpr int first = 12;  // the sensors before are not of links
    Vector<3 * kMaxLinks> velocities(3 * links);
    for (int i = 0; i < links; ++i) {
      const auto sensors = s.sensordata().segment<6>(first + 6 * i);  // a velocimeter and a gyro
      velocities.segment<3>(3 * i) << sensors[0], sensors[1], sensors[5];
    }
    return velocities;
  });
  const auto reset = [=](Start& start, RandomState& random) {
    joints.randomize_limited_and_rotational_joints(start, random);
    const double reach = random.rand() < .2 ? .3 : 2;
    const double x = random.uniform(-reach, reach), y = random.uniform(-reach, reach);
    start[geom_pos].segment<2>(3 * target) << x, y;
    start[light_pos].segment<2>(3 * light) << x, y;
  };
  episodes(r, reset, [=](const Sim& s) {
    const double size = s[geom_size][3 * target];
    return tolerance(norm(to_target(s)), {0, size}, {5 * size, Sigmoid::long_tail});
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/swimmer-swimmer6-v0", r) { suite::swimmer(r, 6); }
MJENV_TASK("dm_control/swimmer-swimmer15-v0", r) { suite::swimmer(r, 15); }
