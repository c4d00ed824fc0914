// A cart has to balance one or more poles, or to swing them up first.
#include "randomize.hpp"

namespace suite {
namespace {

constexpr int kMaxPoles = 3;

void balance(Robot& r, bool swing_up, bool sparse, int poles = 1) {
  r.model_text(cartpole_model(poles).c_str()).time_limit(kEpisode).current();
  constexpr int first = 2;  // body: after the world and the cart

  r.observe("position", [=](const Sim& s) {
    Vector<1 + 2 * kMaxPoles> position(1 + 2 * poles);
    position[0] = s.qpos()[0];
    for (int i = 0; i < poles; ++i) {
      position[1 + 2 * i] = s.xmat(first + i)(2, 2);
      position[2 + 2 * i] = s.xmat(first + i)(0, 2);
    }
    return position;
  });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    auto& q = start.qpos;
    if (swing_up) {
      q[0] = .01 * random.randn();
      q[1] = kPi + .01 * random.randn();
      for (int i = 1; i < poles; ++i) q[1 + i] = .1 * random.randn();
    } else {
      q[0] = random.uniform(-.1, .1);
      for (int i = 0; i < poles; ++i) q[1 + i] = random.uniform(-.034, .034);
    }
    for (double& v : start.qvel) v = 0.01 * random.randn();
  };
  episodes(r, reset, [=](const Sim& s) {
    const double cart = s.qpos()[0];
    const auto cosine = [&](Eigen::Index i) { return s.xmat(first + static_cast<int>(i))(2, 2); };
    if (sparse) {
      double upright = 1;
      for (int i = 0; i < poles; ++i) upright *= tolerance(cosine(i), {.995, 1});
      return tolerance(cart, {-.25, .25}) * upright;
    }
    const double upright = np::sum(poles, [&](Eigen::Index i) { return (cosine(i) + 1) / 2; }) / poles;
    const double centered = (1 + tolerance(cart, {}, {2})) / 2;
    double slow = 1;
    for (const double v : s.qvel(1)) slow = std::min(slow, tolerance(v, {}, {5}, square_of_element));
    return upright * small_control(s) * ((1 + slow) / 2) * centered;
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/cartpole-balance-v0", r) { suite::balance(r, false, false); }
MJENV_TASK("dm_control/cartpole-balance_sparse-v0", r) { suite::balance(r, false, true); }
MJENV_TASK("dm_control/cartpole-swingup-v0", r) { suite::balance(r, true, false); }
MJENV_TASK("dm_control/cartpole-swingup_sparse-v0", r) { suite::balance(r, true, true); }
MJENV_TASK("dm_control/cartpole-two_poles-v0", r) { suite::balance(r, true, false, 2); }
MJENV_TASK("dm_control/cartpole-three_poles-v0", r) {
  suite::balance(r, true, r.flag("sparse", false, "reward only poles that stand upright on a centred cart"), 3);
}
