// A ball has to roll to a goal in a maze.
#include "maze.hpp"

namespace mazes {
namespace {

constexpr double kFastest = 5;  // m/s along each axis

void point_maze(Robot& r, const Map& map, std::int64_t time_limit, bool is_dense) {
  r.model_text(Maze(map, 1, 0.4).model(point_model).c_str()).fixed_frame_skip().time_limit(time_limit);
  r.camera({MJENV_BODY_UNSET, map.size() > 8 ? 12.5 : 8.8});
  const Quest quest(r, Maze(map_option(r, map), 1, 0.4), is_dense);

  r.group("observation");
  r.observe("qpos", [](const Sim& s) { return s.qpos(); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.group("achieved_goal");
  r.observe("position", [](const Sim& s) { return s.qpos(); });
  quest.observe(r);

  r.reset([=](Start& start, Rng& rng) { start.qpos = quest.begin(start, rng); });
  r.reset_info([=](const Sim& s, Info& info) { quest.reset_info(s, s.qpos(), info); });
  r.before_step([](const Sim& s, Control& control) {
    control.qvel() = np::clip(s.qvel(), {-kFastest, kFastest});
    control.forward();
    control.ctrl = np::clip(s.action.vector(), {-1, 1});
  });
  r.step([=](const Sim& s, Row& row, Info& info) { return quest.step(s.qpos(), row, info); });
}

}  // namespace
}  // namespace mazes

#define POINT_MAZE(name, map, steps)                                                               \
  MJENV_TASK("mazes/PointMaze_" name "-v3", r) { mazes::point_maze(r, mazes::map, steps, false); } \
  MJENV_TASK("mazes/PointMaze_" name "Dense-v3", r) { mazes::point_maze(r, mazes::map, steps, true); }

POINT_MAZE("UMaze", u_maze, 300)
POINT_MAZE("Open", open, 300)
POINT_MAZE("Open_Diverse_G", open_g, 300)
POINT_MAZE("Open_Diverse_GR", open_gr, 300)
POINT_MAZE("Medium", medium, 600)
POINT_MAZE("Medium_Diverse_G", medium_g, 600)
POINT_MAZE("Medium_Diverse_GR", medium_gr, 600)
POINT_MAZE("Large", large, 800)
POINT_MAZE("Large_Diverse_G", large_g, 800)
POINT_MAZE("Large_Diverse_GR", large_gr, 800)
