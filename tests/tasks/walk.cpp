// A robot with four legs on rough ground, whose steps kick it: contacts, time in the air, and heights of the ground.
#include <mjenv/task.hpp>

using namespace mjenv;

MJENV_TASK("tests/Walk-v0", r) {
  r.model("./rough.xml").frame_skip(2).time_limit(60);
  const double kicks = r.real("kicks", 0.2, "how often a step kicks the trunk", 0, 1);
  if (r.flag("current", false, "see the new state")) r.current();
  const int trunk = r.body("trunk"),
            ground = r.geom(r.text("ground", "ground", "the geom whose heights are read").c_str());
  const Terrain terrain = r.terrain(r.text("terrain", "ground", "the geom of the height field").c_str());
  const std::array<int, 4> feet{r.geom("fl_foot"), r.geom("fr_foot"), r.geom("rl_foot"), r.geom("rr_foot")};
  const Carry air = r.carry(4), flights = r.carry(4);

  r.reset([=](Start& start, Rng& rng) {
    start.qpos[0] = rng.uniform(-20, 20);  // some rows begin beside the terrain
    start.qpos[1] = rng.uniform(-10, 10);
    start.qpos[2] = 0.6;
    for (int i = 3; i < 19; ++i) start.qpos[i] += rng.uniform(-0.1, 0.1);
  });
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe("touching", [=](const Sim& s) {
    const auto found = s.touching(feet, ground);
    return Eigen::Vector4d(found[0], found[1], found[2], found[3]);
  });
  r.observe("air", [=](const Sim& s) { return s[air]; });
  r.observe("flights", [=](const Sim& s) { return s[flights]; });
  r.observe("height", [=](const Sim& s) { return terrain.height(s, s.qpos()[0], s.qpos()[1]); });
  const std::vector<std::array<double, 2>> points{{0, 0}, {0.3, 0.1}, {-0.2, 0.15}, {5, -7}};
  r.observe("around", [=](const Sim& s) { return terrain.around(s, trunk, points); });
  r.step([=](const Sim& s, Row& row, Info& info) -> Outcome {
    const auto landed = air_time(row[air], s.touching(feet, ground), s.dt);
    for (std::size_t i = 0; i < 4; ++i) row[flights][static_cast<Eigen::Index>(i)] = landed[i];
    const bool is_kicked = row.rng.random() < kicks;
    for (int i = 0; i < 6; ++i) {
      const double kick = row.rng.uniform(-0.5, 0.5);
      if (is_kicked) row.qvel()[i] += kick;
    }
    info("kicked", is_kicked);
    return {s.qvel()[0], false};
  });
}
