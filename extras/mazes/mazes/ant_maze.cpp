// Gymnasium's Ant has to walk to a goal in a maze. Its rewards are in the info alone.
#include "maze.hpp"

namespace mazes {
namespace {

void ant_maze(Robot& r, const Map& map, std::int64_t time_limit, bool is_dense) {
  r.model_text(Maze(map, 4, 0.5).model(ant_model).c_str()).frame_skip(5).time_limit(time_limit).needs(3, 0);
  if (!r.v5) r.fixed_frame_skip();
  r.camera({MJENV_BODY_UNSET, 4.0});
  const Quest quest(r, Maze(map_option(r, map), 4, 0.5), is_dense);

  const double w_forward = r.v5 ? r.real("forward_reward_weight", 1, "weight of the velocity along x") : Real{1, false};
  const auto w_ctrl = r.real("ctrl_cost_weight", 0.5, "weight of the squared action");
  const auto v4_forces = r.v5 ? false : r.flag("use_contact_forces", false, "observe contact forces");
  const auto w_contact = r.real("contact_cost_weight", 5e-4, "weight of the squared contact forces");
  const auto bonus = r.real("healthy_reward", 1, "reward for each step while healthy");
  const auto torso = r.v5 ? r.body_option("main_body", 1, "the body whose velocity is measured") : r.body("torso");
  const auto ends = r.flag("terminate_when_unhealthy", true, "v4: whether only healthy robots earn healthy_reward");
  const auto z_range = r.range("healthy_z_range", {0.2, 1.0}, "closed bounds of the torso's height while healthy, m");
  const auto force_range = r.range("contact_force_range", {-1, 1}, "bounds to which contact forces are clipped");
  const auto forces = r.v5 ? r.flag("include_cfrc_ext_in_observation", true, "observe contact forces") : v4_forces;
  const auto norm = r.norm();

  const auto contacts = [=](const Sim& s, int body) { return np::clip(s.cfrc_ext(body), force_range); };
  const auto place = [](const Sim& s) -> Vector2d { return s.qpos().head<2>(); };

  r.group("observation");
  r.observe("qpos", [](const Sim& s) { return s.qpos(2); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe_if(forces, "cfrc_ext", [=, first = r.v5 ? 1 : 0](const Sim& s) { return contacts(s, first); });
  r.group("achieved_goal");
  r.observe("position", place);
  quest.observe(r);

  r.reset([=](Start& start, Rng& rng) { start.qpos.head<2>() = quest.begin(start, rng); });
  r.reset_info([=, v5 = r.v5](const Sim& s, Info& info) {
    const Vector2d at = place(s);
    if (v5) info("x_position", at[0]), info("y_position", at[1]), info("distance_from_origin", norm(at));
    quest.reset_info(s, at, info);
  });

  r.carry([=](const Sim& s) { return s.body_xy(torso); });
  r.step([=, v5 = r.v5](const Sim& s, const Carried& xy_before, Row& row, Info& info) -> Outcome {
    const Vector2d at = place(s), xy = s.body_xy(torso);  // xy is from before the last integration
    const Vector2d velocity = (xy - xy_before) / s.dt;
    const double z = s.qpos()[2];
    const bool healthy = s.finite() && z_range[0] <= z && z <= z_range[1];
    const double forward = velocity[0] * w_forward;
    const double survive = (v5 ? healthy : healthy || ends) * bonus;
    const np::Scalar ctrl = w_ctrl * np::sum_square(s.action);
    const double contact = v5 || forces ? w_contact * np::sum_square(contacts(s, 0)) : 0.0;

    if (v5) {
      info("x_position", at[0]), info("y_position", at[1]), info("distance_from_origin", norm(at));
      info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
      info("reward_forward", forward), info("reward_ctrl", -ctrl), info("reward_contact", -contact);
      info("reward_survive", numpy_typed(survive, bonus));
    } else {
      info("reward_forward", forward);
      if (forces)
        info("reward_ctrl", -contact);  // v4 overwrites the control cost with the contact cost
      else
        info("reward_ctrl", -ctrl);
      info("reward_survive", PythonFloat{survive});
      info("x_position", xy[0]), info("y_position", xy[1]), info("distance_from_origin", norm(xy));
      info("x_velocity", velocity[0]), info("y_velocity", velocity[1]);
      info("forward_reward", forward);
    }
    return quest.step(at, row, info);
  });
}

}  // namespace
}  // namespace mazes

#define ANT_MAZE_OF(version, name, map, steps)                                                       \
  MJENV_TASK("mazes/AntMaze_" name "-" version, r) { mazes::ant_maze(r, mazes::map, steps, false); } \
  MJENV_TASK("mazes/AntMaze_" name "Dense-" version, r) { mazes::ant_maze(r, mazes::map, steps, true); }
#define ANT_MAZE(name, map, steps) ANT_MAZE_OF("v4", name, map, steps) ANT_MAZE_OF("v5", name, map, steps)

ANT_MAZE("UMaze", u_maze, 700)
ANT_MAZE("Open", open, 700)
ANT_MAZE("Open_Diverse_G", open_g, 700)
ANT_MAZE("Open_Diverse_GR", open_gr, 700)
ANT_MAZE("Medium", medium, 1000)
ANT_MAZE("Medium_Diverse_G", medium_g, 1000)
ANT_MAZE("Medium_Diverse_GR", medium_gr, 1000)
ANT_MAZE("Large", large, 1000)
ANT_MAZE("Large_Diverse_G", large_g, 1000)
ANT_MAZE("Large_Diverse_GR", large_gr, 1000)
