#include <cmath>

#include <mjenv/task.hpp>

namespace mjenv::robots {

// A pole on a cart, rewarded for each step it stands (Barto, Sutton and Anderson, 1983).
void inverted_pendulum(Robot& r) {
  r.model("inverted_pendulum.xml").frame_skip(2).time_limit(1000).reward_threshold(950).needs_exactly(2, 2);
  if (!r.v5) r.fixed_model().fixed_frame_skip();
  r.camera({0, 2.04});
  r.reward_type(r.v5 ? MJENV_DTYPE_NATIVE_INT : MJENV_DTYPE_NATIVE_FLOAT);

  const auto noise = r.v5 ? r.noise(0.01) : 0.01;

  if (r.v5) r.structure();
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });

  r.reset([=](Start& start, Rng& rng) {
    for (double& q : start.qpos) q += rng.uniform(-noise, noise);
    for (double& v : start.qvel) v += rng.uniform(-noise, noise);
  });

  r.step([v5 = r.v5](const Sim& s, Info& info) -> Outcome {
    const bool fell = !s.finite() || std::abs(s.qpos()[1]) > 0.2;
    const double reward = v5 ? !fell : 1;  // v4 also pays it in the step in which the robot falls
    if (v5) info("reward_survive", Typed{reward, MJENV_DTYPE_NATIVE_INT});
    return {reward, fell};
  });
}

}  // namespace mjenv::robots
