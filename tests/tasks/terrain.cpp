// A ball on a height field of its row's own, whose numbers are float32 in MuJoCo. A reset draws the field from RandomState and
// lets the ball fall on it; a step changes one height.
#include <mjenv/task.hpp>

using namespace mjenv;

MJENV_TASK("tests/Terrain-v0", r) {
  r.model("./terrain.xml").frame_skip(4).time_limit(25).current();
  const Own heights = r.own("hfield_data"), colours = r.own("geom_rgba");
  const auto field = r.array<float>("hfield_data"), rgba = r.array<float>("geom_rgba");
  const int ball = r.body("ball");
  const Carry touched = r.carry(1);

  r.reset([=](Start& start, RandomState& random) {
    const std::vector<std::int64_t> order = random.permutation(heights.count);
    for (Eigen::Index i = 0; i < heights.count; ++i)
      start[heights][i] = static_cast<double>(order[static_cast<std::size_t>(i)]) / 30;
    random.shuffle(start[heights].head(7));
    start[colours][0] = static_cast<double>(random.choice(5)) / 10;
    start[colours][4] += 0.01;  // counts the resets
    start.qpos[0] = random.uniform(-1, 1);
    start.forward();
    for (int i = 0; start.contact_count() == 0; start.advance(1))
      if (++i > 200) throw std::runtime_error("the ball falls through the ground");
    start[touched][0] = start.sim().xpos(ball)[2];
    start.set_time(0);
  });
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe("field", [=](const Sim& s) { return s[field].cast<double>(); });
  r.observe("rgba", [=](const Sim& s) { return s[rgba].cast<double>(); });
  r.observe("touched", [=](const Sim& s) { return s[touched]; });
  r.step([=](const Sim& s, Row& row, Info& info) -> Outcome {
    const std::int64_t at = row.rng.integers(0, 30);
    row[heights][at] = row.rng.random();
    info("height", s.qpos()[2]);
    return {s.qpos()[0], false};
  });
}
