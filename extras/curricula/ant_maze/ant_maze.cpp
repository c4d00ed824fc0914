// AntMaze_UMaze-v5 for a training, with its observations: the reward is the velocity along the shortest way to the goal,
// a goal that is reached moves, and an episode ends when the Ant falls.
#include <algorithm>
#include <cmath>
#include <mjenv/task.hpp>

using namespace mjenv;
using Eigen::Vector2d;

namespace {

constexpr double kReach = 0.45;  // m: how near to a goal reaches it
constexpr double kNoise = 1;     // m: how far starts and goals lie from the middle of a cell
constexpr double kApart = 2;     // m: the least distance of a goal from where the robot is when it is drawn

// The wall within the U has x < 2 and |y| < 2. The robot's legs take 1 m more: the way is around x < 3 and |y| < 3.
constexpr double kEdge = 3;
const Vector2d kCorners[] = {{kEdge, kEdge}, {kEdge, -kEdge}};

Vector2d draw(Rng& rng) {
  static const double cells[7][2] = {{-4, 4}, {0, 4}, {4, 4}, {4, 0}, {4, -4}, {0, -4}, {-4, -4}};
  const double* cell = cells[rng.integers(0, 7)];
  const double x = cell[0] + rng.uniform(-kNoise, kNoise), y = cell[1] + rng.uniform(-kNoise, kNoise);
  return {x, y};
}

Vector2d draw_apart(const Vector2d& from, Rng& rng) {
  Vector2d at = draw(rng);
  while ((at - from).norm() < kApart) at = draw(rng);
  return at;
}

// The nearest place outside of the wall and 1 m around it.
Vector2d outside(const Vector2d& at) {
  const double x = kEdge - at[0], y = kEdge - std::abs(at[1]);
  if (x <= 0 || y <= 0) return at;
  return x < y ? Vector2d(kEdge, at[1]) : Vector2d(at[0], std::copysign(kEdge, at[1]));
}

// Whether the straight line between two places outside keeps outside.
bool is_free(const Vector2d& a, const Vector2d& b) {
  if (std::min(a[1], b[1]) >= kEdge || std::max(a[1], b[1]) <= -kEdge) return true;
  const auto x_beside = [&](const Vector2d& end) {  // of the line's part with |y| <= 3, at this end
    const double y = std::clamp(end[1], -kEdge, kEdge);
    return y == end[1] ? end[0] : a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
  };
  return std::min(x_beside(a), x_beside(b)) >= kEdge - 1e-9;
}

// The length of the shortest way, m.
double way(const Vector2d& from, const Vector2d& to) {
  const Vector2d a = outside(from), b = outside(to);
  const double ends = (from - a).norm() + (to - b).norm();
  if (is_free(a, b)) return ends + (a - b).norm();
  double least = (a - kCorners[a[1] < 0]).norm() + 2 * kEdge + (kCorners[b[1] < 0] - b).norm();
  for (const Vector2d& corner : kCorners)
    if (is_free(a, corner) && is_free(corner, b)) least = std::min(least, (a - corner).norm() + (corner - b).norm());
  return ends + least;
}

}  // namespace

MJENV_TASK("AntMazeLesson-v0", r) {
  r.model("ant.xml").frame_skip(5).time_limit(700).needs(3, 0);
  const int torso = r.body("torso");
  const int target = 3 * r.site("target");  // which the maze's model has
  const auto site_pos = r.own("site_pos");
  const Carry goal = r.carry(2);
  const auto place = [](const Sim& s) -> Vector2d { return s.qpos().head<2>(); };

  r.group("observation");
  r.observe("qpos", [](const Sim& s) { return s.qpos(2); });
  r.observe("qvel", [](const Sim& s) { return s.qvel(); });
  r.observe("cfrc_ext", [](const Sim& s) { return np::clip(s.cfrc_ext(1), {-1, 1}); });
  r.group("achieved_goal");
  r.observe("position", place);
  r.group("desired_goal");
  r.observe("goal", [=](const Sim& s) { return s[goal]; });

  r.reset([=](Start& start, Rng& rng) {
    start[goal] = start[site_pos].segment<2>(target) = draw(rng);
    start.qpos.head<2>() = draw_apart(start[goal], rng);
  });

  r.carry(place);
  r.step([=](const Sim& s, const Carried& before, Row& row, Info& info) -> Outcome {
    const Vector2d at = place(s), to = row[goal];
    const bool reached = (at - to).norm() <= kReach;
    if (reached) row[goal] = row[site_pos].segment<2>(target) = draw_apart(at, row.rng);
    info("success", reached);
    const double z = s.qpos()[2], velocity = (way(before, to) - way(at, to)) / s.dt;
    const bool fell = !s.finite() || z < 0.2 || z > 1 || s.xmat(torso)(2, 2) <= 0;
    return {velocity + 0.3 + 20 * reached - 0.05 * np::sum_square(s.action), fell};
  });
}
