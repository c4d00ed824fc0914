// A ball on a height field of its row's own, whose numbers are float32 in MuJoCo. A reset draws the field from RandomState and
// lets the ball fall on it; a step changes one height. Both see the row's own field: the contacts of the ball, the heights
// around it, and how long it was in the air.
#include <mjenv/task.hpp>

using namespace mjenv;

MJENV_TASK("tests/Terrain-v0", r) {
  r.model("./terrain.xml").frame_skip(4).time_limit(25).current();
  const Own heights = r.own("hfield_data"), colours = r.own("geom_rgba");
  const auto field = r.array<float>("hfield_data"), rgba = r.array<float>("geom_rgba");
  const int ball = r.body("ball"), ground_geom = r.geom("ground");
  const std::array<int, 1> balls{r.geom("ball")};
  const Terrain ground = r.terrain("ground");
  const Carry touched = r.carry(1), air = r.carry(1);

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
    const auto at = start.sim().xpos(ball);
    start[touched][0] = at[2] - ground.height(start, at[0], at[1]);
    start.set_time(0);
  });
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe("field", [=](const Sim& s) { return s[field].cast<double>(); });
  r.observe("rgba", [=](const Sim& s) { return s[rgba].cast<double>(); });
  r.observe("touched", [=](const Sim& s) { return s[touched]; });
  r.observe("touching", [=](const Sim& s) { return s.touching(balls, ground_geom)[0] ? 1 : 0; });
  r.observe("air", [=](const Sim& s) { return s[air]; });
  r.observe("below", [=](const Sim& s) { return ground.height(s, s.xpos(ball)[0], s.xpos(ball)[1]); });
  const std::vector<std::array<double, 2>> points{{0.3, 0.1}, {-0.2, 0.4}, {9, -7}};
  r.observe("around", [=](const Sim& s) { return ground.around(s, ball, points); });
  r.step([=](const Sim& s, Row& row, Info& info) -> Outcome {
    const std::int64_t at = row.rng.integers(0, 30);
    row[heights][at] = row.rng.random();
    info("height", s.qpos()[2]);
    info("flight", air_time(row[air], s.touching(balls, ground_geom), s.dt)[0]);
    return {s.qpos()[0], false};
  });
}
