// A cup has to catch the ball on its string.
#include "randomize.hpp"

MJENV_TASK("dm_control/ball_in_cup-catch-v0", r) {
  using namespace suite;
  r.model_text(model("ball_in_cup").c_str()).frame_skip(10).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const Joint x = r.joint("ball_x"), z = r.joint("ball_z");
  const int target = r.site("target"), ball = r.body("ball"), ball_geom = r.geom("ball");
  const auto site_size = r.array("site_size"), geom_size = r.array("geom_size");

  r.observe("position", [](const Sim& s) { return s.qpos(); });
  r.observe("velocity", [](const Sim& s) { return s.qvel(); });
  const auto reset = [=](Start& start, RandomState& random) {
    draw_without_contacts(start, [&] {
      start.qpos[x.qpos] = random.uniform(-.2, .2);
      start.qpos[z.qpos] = random.uniform(.2, .5);
    });
  };
  episodes(r, reset, [=](const Sim& s) {
    const auto is_inside = [&](int axis) {
      const double distance = std::fabs(s.site_xpos(target)[axis] - s.xpos(ball)[axis]);
      return distance < s[site_size][3 * target + axis] - s[geom_size][3 * ball_geom];
    };
    return is_inside(0) && is_inside(2) ? 1.0 : 0.0;
  });
}
