// An arm has to bring a ball or a peg to its target, or to insert it into a cup or a slot.
#include "arm.hpp"

namespace suite {
namespace {

void bring(Robot& r, const char* name, bool peg, bool insert) {
  r.model_text(model(name).c_str()).frame_skip(10).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const bool full = fully_observable(r);
  const Arm arm(r);
  const int object = r.body(peg ? "peg" : "ball"), target = r.body(peg ? "target_peg" : "target_ball");
  const int receptacle = insert ? r.body(peg ? "slot" : "cup") : -1;
  const Joint x = r.joint(peg ? "peg_x" : "ball_x"), z = r.joint(peg ? "peg_z" : "ball_z"),
              y = r.joint(peg ? "peg_y" : "ball_y");
  const Own body_pos = r.own("body_pos"), body_quat = r.own("body_quat");
  const int grasp = r.site("grasp"), pinch = r.site("pinch");
  const int of_object = r.site(peg ? "peg" : "ball"), of_target = r.site(peg ? "target_peg" : "target_ball");

  arm.observe(r, full);
  if (full) {
    r.observe("object_pos", [=](const Sim& s) { return Arm::pose(s, object); });
    r.observe("object_vel", [=](const Sim& s) { return Vector3d(s.qvel(x), s.qvel(z), s.qvel(y)); });
    r.observe("target_pos", [=](const Sim& s) { return Arm::pose(s, target); });
  }
  const auto reset = [=](Start& start, RandomState& random) {
    const auto place = [&](int body, double at_x, double at_z, double angle) {
      start[body_pos][3 * body] = at_x;
      start[body_pos][3 * body + 2] = at_z;
      start[body_quat][4 * body] = std::cos(angle / 2);
      start[body_quat][4 * body + 2] = std::sin(angle / 2);
    };
    draw_without_contacts(start, [&] {
      arm.randomize(start, random);
      const double target_x = random.uniform(-.4, .4), target_z = random.uniform(.1, .4);
      const double target_angle = insert ? random.uniform(-kPi / 3, kPi / 3) : random.uniform(-kPi, kPi);
      if (insert) place(receptacle, target_x, target_z, target_angle);
      place(target, target_x, target_z, target_angle);

      double object_x = target_x, object_z = target_z, object_angle = target_angle;
      switch (random.choice({.1, .1, 1 - .1 - .1})) {
        case 0: {  // in the hand
          start.forward();
          const Sim s = start.sim();
          object_x = s.site_xpos(grasp)[0];
          object_z = s.site_xpos(grasp)[2];
          object_angle = kPi - std::atan2(s.site_xmat(grasp)(2, 0), s.site_xmat(grasp)(0, 0));
          break;
        }
        case 1: break;  // at the target
        default:
          object_x = random.uniform(-.5, .5);
          object_z = random.uniform(0, .7);
          object_angle = random.uniform(0, 2 * kPi);
          start.qvel[x.qvel] = random.uniform(-5, 5);
      }
      start.qpos[x.qpos] = object_x;
      start.qpos[z.qpos] = object_z;
      start.qpos[y.qpos] = object_angle;
    });
  };

  const auto is_close = [=](const Sim& s, int site, int other) {
    constexpr double close = .01;
    return tolerance(arm.distance(s, site, other), {0, close}, {close * 2});
  };
  if (!peg) {
    episodes(r, reset, [=](const Sim& s) { return is_close(s, of_object, of_target); });
    return;
  }
  const int peg_grasp = r.site("peg_grasp"), peg_pinch = r.site("peg_pinch"), tip = r.site("peg_tip"),
            target_tip = r.site("target_peg_tip");
  episodes(r, reset, [=](const Sim& s) {
    const double grasping = (is_close(s, peg_grasp, grasp) + is_close(s, peg_pinch, pinch)) / 2;
    const double bringing = (is_close(s, of_object, of_target) + is_close(s, target_tip, tip)) / 2;
    return std::max(bringing, grasping / 3);
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/manipulator-bring_ball-v0", r) { suite::bring(r, "manipulator_bring_ball", false, false); }
MJENV_TASK("dm_control/manipulator-bring_peg-v0", r) { suite::bring(r, "manipulator_bring_peg", true, false); }
MJENV_TASK("dm_control/manipulator-insert_ball-v0", r) { suite::bring(r, "manipulator_insert_ball", false, true); }
MJENV_TASK("dm_control/manipulator-insert_peg-v0", r) { suite::bring(r, "manipulator_insert_peg", true, true); }
