// A cheetah has to run at 10 m/s.
#include "randomize.hpp"

MJENV_TASK("dm_control/cheetah-run-v0", r) {
  using namespace suite;
  r.model_text(model("cheetah").c_str()).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const auto limited = r.array<std::uint8_t>("jnt_limited");
  const auto range = r.array("jnt_range");
  const Sensor velocity = r.sensor("torso_subtreelinvel");

  r.observe("position", [](const Sim& s) { return s.qpos(1); });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    for (Eigen::Index i = 0; i < limited.count; ++i)
      if (start[limited][i]) start.qpos[i] = random.uniform(start[range][2 * i], start[range][2 * i + 1]);
    start.advance(200);  // falls to the ground
    start.set_time(0);
  };
  episodes(r, reset, [=](const Sim& s) {
    return tolerance(s.sensor(velocity)[0], {10, kInfinity}, {10, Sigmoid::linear, 0});
  });
}
