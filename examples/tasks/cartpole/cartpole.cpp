// A pole that hangs from a cart has to be swung up and balanced by pushing the cart.
#include <cmath>
#include <mjenv/task.hpp>

using namespace mjenv;

MJENV_TASK("CartpoleSwingup-v0", r) {
  r.model("./cartpole.xml").frame_skip(2).time_limit(500);

  // Options that the caller of make can set, with their defaults.
  const double w_ctrl = r.real("ctrl_cost_weight", 0.01, "weight of the squared action");
  const double noise = r.noise(0.05);

  // Objects of the model, looked up once.
  const int tip = r.site("tip");
  const Joint slide = r.joint("slide"), hinge = r.joint("hinge");

  r.observe(
      "cart", [=](const Sim& s) { return s.qpos(slide); }, "position of the cart, m");
  r.observe(
      "pole", [=](const Sim& s) { return Eigen::Vector2d(std::cos(s.qpos(hinge)), std::sin(s.qpos(hinge))); },
      "cosine and sine of the pole's angle; upright: 1, 0");
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });

  r.reset([=](Start& start, Rng& rng) {
    const double hanging = 3.141592653589793;
    start.qpos << rng.uniform(-noise, noise), hanging + rng.uniform(-noise, noise);
    start.qvel << 0, rng.uniform(-noise, noise);
  });

  // Called after the simulation has made the step. -0.6 m <= height <= 0.6 m.
  r.step([=](const Sim& s, Info& info) -> Outcome {
    const double height = s.site_xpos(tip)[2], cost = w_ctrl * s.ctrl().squaredNorm();
    const bool off = std::abs(s.qpos(slide)) > 1.8;
    info("height", height, "of the tip above the rail, m");
    info("reward_ctrl", -cost, "cost of the squared action");
    return {height / 0.6 - cost, off};
  });
}
