// An arm has to put a box at the target, which may be so high that the box must stand on a stack of others.
#include "arm.hpp"

namespace suite {
namespace {

constexpr int kMaxBoxes = 4;

struct Box {
  int body, site;
  Joint x, y, z;
};

void stack(Robot& r, const char* name, int count) {
  r.model_text(model(name).c_str()).frame_skip(10).time_limit(kEpisode).current();
  r.reward_type(MJENV_DTYPE_NATIVE_FLOAT);
  const bool full = fully_observable(r);
  const Arm arm(r);
  const int target = r.body("target"), target_geom = r.geom("target"), target_site = r.site("target"),
            grasp = r.site("grasp");
  const auto geom_size = r.array("geom_size");
  const Own body_pos = r.own("body_pos");
  std::array<Box, kMaxBoxes> boxes{};
  for (int i = 0; i < count; ++i) {
    const std::string box = "box" + std::to_string(i);
    boxes[static_cast<std::size_t>(i)] = {r.body(box.c_str()), r.site(box.c_str()), r.joint((box + "_x").c_str()),
                                          r.joint((box + "_y").c_str()), r.joint((box + "_z").c_str())};
  }

  arm.observe(r, full);
  if (full) {
    r.observe("box_pos", [=](const Sim& s) {
      Vector<4 * kMaxBoxes> poses(4 * count);
      for (int i = 0; i < count; ++i) poses.segment<4>(4 * i) = Arm::pose(s, boxes[static_cast<std::size_t>(i)].body);
      return poses;
    });
    r.observe("box_vel", [=](const Sim& s) {
      Vector<3 * kMaxBoxes> velocities(3 * count);
      for (int i = 0; i < count; ++i) {
        const Box& box = boxes[static_cast<std::size_t>(i)];
        velocities.segment<3>(3 * i) << s.qvel(box.x), s.qvel(box.y), s.qvel(box.z);
      }
      return velocities;
    });
    r.observe("target_pos", [=](const Sim& s) { return Vector2d(s.xpos(target)[0], s.xpos(target)[2]); });
  }
  const auto reset = [=](Start& start, RandomState& random) {
    draw_without_contacts(start, [&] {
      arm.randomize(start, random);
      const auto height = static_cast<double>(2 * random.randint(0, count) + 1);
      start[body_pos][3 * target + 2] = start[geom_size][3 * target_geom] * height;
      start[body_pos][3 * target] = random.uniform(-.37, .37);
      for (int i = 0; i < count; ++i) {
        const Box& box = boxes[static_cast<std::size_t>(i)];
        start.qpos[box.x.qpos] = random.uniform(.1, .3);
        start.qpos[box.z.qpos] = random.uniform(0, .7);
        start.qpos[box.y.qpos] = random.uniform(0, 2 * kPi);
      }
    });
  };
  episodes(r, reset, [=](const Sim& s) {
    double nearest = kInfinity;
    for (int i = 0; i < count; ++i)
      nearest = std::min(nearest, arm.distance(s, boxes[static_cast<std::size_t>(i)].site, target_site));
    const double close = tolerance(nearest, {}, {2 * s[geom_size][3 * target_geom]});
    const double released = tolerance(arm.distance(s, grasp, target_site), {.1, kInfinity}, {.01});
    return close * released;
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/stacker-stack_2-v0", r) { suite::stack(r, "stacker_stack_2", 2); }
MJENV_TASK("dm_control/stacker-stack_4-v0", r) { suite::stack(r, "stacker_stack_4", 4); }
