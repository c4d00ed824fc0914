// Two links have to swing up and to balance; a motor turns the second against the first.
#include "randomize.hpp"

namespace suite {
namespace {

void swingup(Robot& r, bool sparse) {
  r.model_text(model("acrobot").c_str()).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const int upper = r.body("upper_arm"), lower = r.body("lower_arm"), target = r.site("target"), tip = r.site("tip");
  const auto norm = r.norm();
  const auto site_size = r.array("site_size");

  r.observe("orientations", [=](const Sim& s) {
    return Vector4d(s.xmat(upper)(0, 2), s.xmat(lower)(0, 2), s.xmat(upper)(2, 2), s.xmat(lower)(2, 2));
  });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [](Start& start, RandomState& random) {
    for (double& angle : start.qpos) angle = random.uniform(-kPi, kPi);
  };
  episodes(r, reset, [=](const Sim& s) {
    const double radius = s[site_size][3 * target];
    const double distance = norm((s.site_xpos(target) - s.site_xpos(tip)).eval());
    return tolerance(distance, {0, radius}, {sparse ? 0.0 : 1.0});
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/acrobot-swingup-v0", r) { suite::swingup(r, false); }
MJENV_TASK("dm_control/acrobot-swingup_sparse-v0", r) { suite::swingup(r, true); }
