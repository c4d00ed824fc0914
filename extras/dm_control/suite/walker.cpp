// A walker has to stand, to walk at 1 m/s or to run at 8 m/s.
#include "randomize.hpp"

namespace suite {
namespace {

constexpr int kBodies = 7;

// speed: 0 to stand
void walker(Robot& r, double speed) {
  r.model_text(model("walker").c_str()).frame_skip(10).time_limit(kEpisode).current();
  const Randomizer joints(r);
  const int torso = r.body("torso");
  const Sensor velocity = r.sensor("torso_subtreelinvel");

  r.observe("orientations", [](const Sim& s) {
    Eigen::Matrix<double, 2 * kBodies, 1> axes;
    for (int i = 0; i < kBodies; ++i) axes.segment<2>(2 * i) << s.xmat(1 + i)(0, 0), s.xmat(1 + i)(0, 2);
    return axes;
  });
  r.observe("height", [=](const Sim& s) { return s.xpos(torso)[2]; });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    joints.randomize_limited_and_rotational_joints(start, random);
  };
  episodes(r, reset, [=](const Sim& s) {
    const double standing = tolerance(s.xpos(torso)[2], {1.2, kInfinity}, {1.2 / 2});
    const double stand = (3 * standing + (1 + s.xmat(torso)(2, 2)) / 2) / 4;
    if (speed == 0) return stand;
    const double move = tolerance(s.sensor(velocity)[0], {speed, kInfinity}, {speed / 2, Sigmoid::linear, 0.5});
    return stand * (5 * move + 1) / 6;
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/walker-stand-v0", r) { suite::walker(r, 0); }
MJENV_TASK("dm_control/walker-walk-v0", r) { suite::walker(r, 1); }
MJENV_TASK("dm_control/walker-run-v0", r) { suite::walker(r, 8); }
