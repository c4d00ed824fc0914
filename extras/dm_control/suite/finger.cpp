// A finger has to spin a body, or to turn its tip to a target.
#include "randomize.hpp"

namespace suite {
namespace {

constexpr int kAttempts = 1000;

// The x and z of what a finger's sensors see, relative to the body's hinge, and its other observations.
struct Finger {
  Sensor proximal, distal, proximal_velocity, distal_velocity, hinge_velocity, tip, target, spinner;
  std::array<Sensor, 2> touch;

  explicit Finger(Robot& r)
      : proximal(r.sensor("proximal")),
        distal(r.sensor("distal")),
        proximal_velocity(r.sensor("proximal_velocity")),
        distal_velocity(r.sensor("distal_velocity")),
        hinge_velocity(r.sensor("hinge_velocity")),
        tip(r.sensor("tip")),
        target(r.sensor("target")),
        spinner(r.sensor("spinner")),
        touch{r.sensor("touchtop"), r.sensor("touchbottom")} {}

  Vector2d place(const Sim& s, const Sensor& of) const {
    return {s.sensor(of)[0] - s.sensor(spinner)[0], s.sensor(of)[2] - s.sensor(spinner)[2]};
  }
};

Finger observe_finger(Robot& r) {
  const Finger finger(r);
  r.observe("position", [=](const Sim& s) {
    const Vector2d tip = finger.place(s, finger.tip);
    return Vector4d(s.sensor(finger.proximal)[0], s.sensor(finger.distal)[0], tip[0], tip[1]);
  });
  r.observe("velocity", [=](const Sim& s) {
    return Vector3d(s.sensor(finger.proximal_velocity)[0], s.sensor(finger.distal_velocity)[0],
                    s.sensor(finger.hinge_velocity)[0]);
  });
  r.observe("touch", [=](const Sim& s) { return log1p(s, finger.touch); });
  return finger;
}

void turn(Robot& r, const char* name) {
  r.model_text(model(name).c_str()).frame_skip(2).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const Finger finger = observe_finger(r);
  const Randomizer joints(r);
  const auto norm = r.norm();
  const Joint hinge = r.joint("hinge");
  const int target = r.site("target"), cap = r.geom("cap1");
  const Own site_pos = r.own("site_pos");
  const auto geom_size = r.array("geom_size"), site_size = r.array("site_size"), xanchor = r.array("xanchor");

  const auto distance = [=](const Sim& s) {
    const Vector2d to_target = finger.place(s, finger.target) - finger.place(s, finger.tip);
    return norm(to_target) - s[site_size][3 * target];
  };
  r.observe("target_position", [=](const Sim& s) { return finger.place(s, finger.target); });
  r.observe("dist_to_target", distance);
  const auto reset = [=](Start& start, RandomState& random) {
    const double angle = random.uniform(-kPi, kPi);
    const double radius = np::sum(start[geom_size].segment<3>(3 * cap));
    const auto at = start.sim()[xanchor].segment<3>(3 * hinge.index);
    start[site_pos][3 * target] = at[0] + radius * std::sin(angle);
    start[site_pos][3 * target + 2] = at[2] + radius * std::cos(angle);
    draw_without_contacts(
        start, [&] { joints.randomize_limited_and_rotational_joints(start, random); }, kAttempts);
  };
  episodes(r, reset, [=](const Sim& s) { return distance(s) <= 0 ? 1.0 : 0.0; });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/finger-spin-v0", r) {
  using namespace suite;
  r.model_text(model("finger_spin").c_str()).frame_skip(2).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const Finger finger = observe_finger(r);
  const Randomizer joints(r);
  const auto reset = [=](Start& start, RandomState& random) {
    draw_without_contacts(
        start, [&] { joints.randomize_limited_and_rotational_joints(start, random); }, kAttempts);
  };
  episodes(r, reset, [=](const Sim& s) { return s.sensor(finger.hinge_velocity)[0] <= -15 ? 1.0 : 0.0; });
}
MJENV_TASK("dm_control/finger-turn_easy-v0", r) { suite::turn(r, "finger_turn_easy"); }
MJENV_TASK("dm_control/finger-turn_hard-v0", r) { suite::turn(r, "finger_turn_hard"); }
