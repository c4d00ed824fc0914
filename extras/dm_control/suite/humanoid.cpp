// A humanoid has to stand, to walk at 1 m/s or to run at 10 m/s, in any direction. humanoid_CMU's trunk is its thorax,
// whose y is up.
#include "randomize.hpp"

namespace suite {
namespace {

struct Body {
  const char *model, *trunk, *velocity;
  int frame_skip, up;  // up: the axis of the trunk
  std::array<const char*, 4> limbs;
};
const Body kSimple{"humanoid", "torso", "torso_subtreelinvel",
                   5,          2,       {"left_hand", "left_foot", "right_hand", "right_foot"}};
const Body kCmu{"humanoid_CMU", "thorax", "thorax_subtreelinvel", 10, 1, {"lhand", "lfoot", "rhand", "rfoot"}};

// speed: 0 to stand
void humanoid(Robot& r, const Body& body, double speed, bool pure_state = false) {
  r.model_text(model(body.model).c_str()).frame_skip(body.frame_skip).time_limit(kEpisode).current();
  const Randomizer joints(r);
  const auto norm = r.norm();
  const int trunk = r.body(body.trunk), head = r.body("head"), up = body.up;
  const Sensor velocity = r.sensor(body.velocity);
  std::array<int, 4> limbs{};
  for (std::size_t i = 0; i < 4; ++i) limbs[i] = r.body(body.limbs[i]);

  if (pure_state) {
    r.observe("position", [](const Sim& s) { return s.qpos(); });
  } else {
    r.observe("joint_angles", [](const Sim& s) { return s.qpos(7); });
    r.observe("head_height", [=](const Sim& s) { return s.xpos(head)[2]; });
    r.observe("extremities", [=](const Sim& s) {
      Eigen::Matrix<double, 12, 1> places;
      for (int i = 0; i < 4; ++i)
        places.segment<3>(3 * i) =
            in_frame(norm, s.xpos(limbs[static_cast<std::size_t>(i)]) - s.xpos(trunk), s.xmat(trunk));
      return places;
    });
    r.observe("torso_vertical", [=](const Sim& s) { return Vector3d(s.xmat(trunk).row(2)); });
    r.observe("com_velocity", [=](const Sim& s) { return s.sensor(velocity); });
  }
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    draw_without_contacts(start, [&] { joints.randomize_limited_and_rotational_joints(start, random); });
  };
  episodes(r, reset, [=](const Sim& s) {
    const double standing = tolerance(s.xpos(head)[2], {1.4, kInfinity}, {1.4 / 4});
    const double upright = tolerance(s.xmat(trunk)(2, up), {0.9, kInfinity}, {1.9, Sigmoid::linear, 0});
    const double posture = small_control(s) * (standing * upright);
    const Vector2d across = s.sensor(velocity).head<2>();
    if (speed == 0) return posture * mean_tolerance(across, {2});
    const double move = tolerance(norm(across), {speed, kInfinity}, {speed, Sigmoid::linear, 0});
    return posture * ((5 * move + 1) / 6);
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/humanoid-stand-v0", r) { suite::humanoid(r, suite::kSimple, 0); }
MJENV_TASK("dm_control/humanoid-walk-v0", r) { suite::humanoid(r, suite::kSimple, 1); }
MJENV_TASK("dm_control/humanoid-run-v0", r) { suite::humanoid(r, suite::kSimple, 10); }
MJENV_TASK("dm_control/humanoid-run_pure_state-v0", r) { suite::humanoid(r, suite::kSimple, 10, true); }
MJENV_TASK("dm_control/humanoid_CMU-stand-v0", r) { suite::humanoid(r, suite::kCmu, 0); }
MJENV_TASK("dm_control/humanoid_CMU-walk-v0", r) { suite::humanoid(r, suite::kCmu, 1); }
MJENV_TASK("dm_control/humanoid_CMU-run-v0", r) { suite::humanoid(r, suite::kCmu, 10); }
