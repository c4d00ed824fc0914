// A pendulum has to swing up and to balance.
#include "randomize.hpp"

MJENV_TASK("dm_control/pendulum-swingup-v0", r) {
  using namespace suite;
  r.model_text(model("pendulum").c_str()).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const int pole = r.body("pole");
  const double upright = std::cos(8 * (kPi / 180));

  r.observe("orientation", [=](const Sim& s) { return Vector2d(s.xmat(pole)(2, 2), s.xmat(pole)(0, 2)); });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [](Start& start, RandomState& random) { start.qpos[0] = random.uniform(-kPi, kPi); };
  episodes(r, reset, [=](const Sim& s) { return tolerance(s.xmat(pole)(2, 2), {upright, 1}); });
}
