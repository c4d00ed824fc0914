// The robot of quadruped.cpp follows a joystick on rough ground: the commanded velocity changes in mid-episode. The rows
// that follow it well begin their next episode on harder ground. joystick.py is the same task in NumPy, with equal bits.
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <mjenv/task.hpp>

using namespace mjenv;

namespace {

// The ground of terrain.py: patches of 6 m by 6 m.
constexpr int kLevels = 6, kTypes = 3;
constexpr double kPatch = 6, kEpisode = 500;

Eigen::Quaterniond orientation(const Sim& s) { return {s.qpos()[3], s.qpos()[4], s.qpos()[5], s.qpos()[6]}; }
// The trunk's velocity and the vertical direction in the trunk's frame.
Eigen::Vector3d velocity(const Sim& s) { return orientation(s).conjugate() * Eigen::Vector3d(s.qvel().head<3>()); }
Eigen::Vector3d up(const Sim& s) { return orientation(s).conjugate() * Eigen::Vector3d::UnitZ(); }

// The value of a term of the reward: 1 if the error is 0.
double closeness(double squared_error, double width) { return 1 / (1 + squared_error / (width * width)); }
// The sum of squares, added in NumPy's order.
template <typename V>
double squares(const V& values) {
  return np::sum(values.size(), [&](Eigen::Index i) { return values[i] * values[i]; });
}
// A wave between -1 and 1 with period 1, which is -1 at 0 and rises as fast as it falls.
double wave(double phase) { return 1 - std::abs(4 * (phase - std::floor(phase)) - 2); }

std::vector<std::array<double, 2>> grid() {
  std::vector<std::array<double, 2>> points;
  for (int i = -2; i <= 2; ++i)
    for (int j = -1; j <= 1; ++j) points.push_back({0.2 * i, 0.2 * j});
  return points;
}

}  // namespace

MJENV_TASK("QuadrupedJoystick-v0", r) {
  r.model("./rough.xml").frame_skip(2).time_limit(static_cast<std::int64_t>(kEpisode)).needs_exactly(19, 18);

  // The program can change these while rows run.
  const auto forward = r.live("command_forward", {-0.4, 0.8}, "range of the commanded velocity forward, m/s");
  const auto left = r.live("command_left", {-0.3, 0.3}, "range of the commanded velocity to the left, m/s");
  const auto turn = r.live("command_turn", {-0.6, 0.6}, "range of the commanded turn to the left, rad/s");
  const auto least = r.live("least_level", 0, "the easiest ground, 0 to 5", 0, kLevels - 1);
  const auto most = r.live("most_level", kLevels - 1, "the hardest ground, 0 to 5", 0, kLevels - 1);

  const double hold = r.real("command_seconds", 4, "mean time until a command changes, s", 0.1, 1000);
  const double noise = r.noise(0.05);
  const double stride = r.real("stride", 0.5, "time of a stride of the trot, s", 0.05, 10);
  const double lift = r.real("lift", 0.08, "how high the trot lifts a foot above the ground, m", 0, 1);
  const double w_velocity = r.real("velocity_reward", 1.5, "weight of keeping the commanded velocity");
  const double w_turn = r.real("turn_reward", 0.75, "weight of keeping the commanded turn");
  const double w_gait = r.real("gait_reward", 0.5, "weight of lifting the feet as in a trot");
  const double w_air = r.real("air_time_reward", 0.5, "weight of the feet's time in the air beyond 0.1 s, at landing");
  const double w_alive = r.real("alive_reward", 0.2, "reward of each step");
  const double w_bounce = r.real("bounce_cost", 1, "weight of the squared vertical velocity");
  const double w_tilt = r.real("tilt_cost", 0.5, "weight of the squared tilt and, times 0.05, of its speed");
  const double w_jerk = r.real("jerk_cost", 0.02, "weight of the squared change of the action");
  const double w_torque = r.real("torque_cost", 0.0002, "weight of the squared torques of the joints");

  const Carry command = r.carry(3), air = r.carry(4), touched = r.carry(4), last = r.carry(12);
  // Kept over resets: the level of the row, and the sum of the velocity's terms in its last episode.
  const Carry level = r.keep(1, 0, kLevels - 1), score = r.keep(1);

  const int trunk = r.body("trunk"), floor = r.geom("floor"), ground = r.geom("ground");
  const Terrain terrain = r.terrain("ground");
  const std::array<int, 4> feet{r.geom("fl_foot"), r.geom("fr_foot"), r.geom("rl_foot"), r.geom("rr_foot")};
  const std::array<int, 4> sites{r.site("fl_foot"), r.site("fr_foot"), r.site("rl_foot"), r.site("rr_foot")};
  const auto friction = r.array("geom_friction"), kp = r.array("actuator_gainprm");

  const auto draw = [=](Rng& rng, const auto& of, auto to) {
    for (const auto& range : {forward, left, turn}) {
      const double low = of[range][0], high = of[range][1];
      *to++ = low + (high - low) * rng.random();
    }
  };

  // What the policy sees. The option `noise` of make_vec adds noise to it, and `history` repeats it.
  r.group("policy");
  r.observe("up", up, "the vertical direction, seen from the trunk");
  r.observe("velocity", velocity, "of the trunk, in its frame, m/s");
  r.observe(
      "spin", [](const Sim& s) { return s.qvel().segment<3>(3); },
      "angular velocity of the trunk, in its frame, rad/s");
  r.observe(
      "joints", [](const Sim& s) { return s.qpos(7); }, "angles of the joints, rad; standing: 0");
  r.observe(
      "joint_speeds", [](const Sim& s) { return s.qvel(6); }, "rad/s");
  r.observe("last_action", [=](const Sim& s) { return s[last]; });
  r.observe(
      "command", [=](const Sim& s) { return s[command]; }, "forward and left, m/s, and turn to the left, rad/s");
  r.observe(
      "clock", [=](const Sim& s) { return Eigen::Vector2d(wave(s.time() / stride), wave(s.time() / stride + 0.25)); },
      "the phase of the trot, as two waves");

  // What only the critic sees: the same without noise, and what sensors do not measure.
  r.group("critic");
  r.observe("true_up", up);
  r.observe("true_velocity", velocity);
  r.observe("true_spin", [](const Sim& s) { return s.qvel().segment<3>(3); });
  r.observe("true_joints", [](const Sim& s) { return s.qpos(7); });
  r.observe("true_joint_speeds", [](const Sim& s) { return s.qvel(6); });
  r.observe("true_command", [=](const Sim& s) { return s[command]; });
  r.observe("true_clock",
            [=](const Sim& s) { return Eigen::Vector2d(wave(s.time() / stride), wave(s.time() / stride + 0.25)); });
  r.observe(
      "heights", [=, points = grid()](const Sim& s) { return s.qpos()[2] - terrain.around(s, trunk, points).array(); },
      "of the trunk above 15 points of the ground around it, m");
  r.observe(
      "feet", [=](const Sim& s) { return s[touched]; }, "1 for each foot that touches the ground");
  r.observe("friction", [=](const Sim& s) { return s[friction][3 * feet[0]]; });
  r.observe(
      "mass", [=](const Sim& s) { return s.c().body_mass[trunk]; }, "of the trunk, kg");
  r.observe(
      "kp", [=](const Sim& s) { return s[kp][0]; }, "of the first actuator");

  r.reset([=](Start& start, Rng& rng) {
    const double easiest = start[least], hardest = start[most], well = start[score][0] / kEpisode;
    const double next = start[level][0] + (well > 0.6 ? 1 : well < 0.4 ? -1 : 0);
    start[level][0] = std::max(easiest, std::min(next, hardest));
    start[score][0] = 0;
    // The episode begins in the middle of a patch of this level.
    const double type = static_cast<double>(rng.integers(0, kTypes));
    start.qpos[0] = kPatch * (start[level][0] + 0.5 - 0.5 * kLevels) + rng.uniform(-1, 1);
    start.qpos[1] = kPatch * (type + 0.5 - 0.5 * kTypes) + rng.uniform(-1, 1);
    start.qpos[2] += terrain.height(start, start.qpos[0], start.qpos[1]) + 0.02;
    const double sine = rng.uniform(-1, 1);  // of half the heading
    start.qpos[3] = std::sqrt(1 - sine * sine);
    start.qpos[6] = sine;
    for (int i = 7; i < 19; ++i) start.qpos[i] += rng.uniform(-noise, noise);
    for (int i = 0; i < 18; ++i) start.qvel[i] = rng.uniform(-noise, noise);
    draw(rng, start, start[command].data());
  });

  r.step([=](const Sim& s, Row& row, Info& info) -> Outcome {
    const Eigen::Vector3d v = velocity(s), vertical = up(s), wanted = row[command];
    const auto spin = s.qvel().segment<3>(3);

    const auto on_ground = s.touching(feet, ground), on_floor = s.touching(feet, floor);
    std::array<bool, 4> touches{};
    for (std::size_t i = 0; i < 4; ++i) {
      touches[i] = on_ground[i] || on_floor[i];
      row[touched][static_cast<Eigen::Index>(i)] = touches[i];
    }
    double flight = 0;
    for (const double time : air_time(row[air], touches, s.dt)) flight += time > 0 ? time - 0.1 : 0;

    // In a trot, the first and the last foot are in the air together, then the other two.
    double miss = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const double swing = wave(s.time() / stride + (i == 0 || i == 3 ? 0.25 : 0.75));
      const auto foot = s.site_xpos(sites[i]);
      const double off = foot[2] - terrain.height(s, foot[0], foot[1]) - 0.022 - lift * std::max(swing, 0.0);
      miss += off * off;
    }

    const Eigen::Vector2d off = (v - wanted).head<2>();
    const double turned = spin[2] - wanted[2], follow = closeness(squares(off), 0.25);
    const double velocity_reward = w_velocity * follow;
    const double turn_reward = w_turn * closeness(turned * turned, 0.4);
    const double gait_reward = w_gait * closeness(miss, 0.06);
    const double air_reward = w_air * flight;
    const double bounce_cost = w_bounce * (v[2] * v[2]);
    const double tilt_cost = w_tilt * (squares(vertical.head<2>()) + 0.05 * squares(spin.head<2>()));
    const Eigen::Map<const Eigen::VectorXd> action = s.action.vector();
    const double jerk_cost = w_jerk * squares(action - row[last]);
    const double torque_cost = w_torque * squares(s.qfrc_actuator(6));
    const double above = s.qpos()[2] - terrain.height(s, s.qpos()[0], s.qpos()[1]);
    const bool fallen = !s.finite() || above < 0.16 || vertical[2] < 0.5;

    row[last] = action;
    row[score][0] += follow;
    // Drawn in each step, so that the number of draws does not depend on the time.
    const bool changes = row.rng.random() < s.dt / hold;
    std::array<double, 3> next{};
    draw(row.rng, s, next.data());
    if (changes) row[command] << next[0], next[1], next[2];

    info("error", std::sqrt(squares(off)), "how far the velocity is from the commanded one, m/s");
    info("level", row[level][0], "of the ground, 0 to 5");
    info("reward_velocity", velocity_reward, "for keeping the commanded velocity");
    info("reward_turn", turn_reward, "for keeping the commanded turn");
    info("reward_gait", gait_reward, "for lifting the feet as in a trot");
    info("reward_air", air_reward, "for the feet's time in the air");
    info("reward_bounce", -bounce_cost, "cost of vertical velocity");
    info("reward_tilt", -tilt_cost, "cost of tilt and its speed");
    info("reward_jerk", -jerk_cost, "cost of changes of the action");
    info("reward_torque", -torque_cost, "cost of torques");
    return {w_alive + velocity_reward + turn_reward + gait_reward + air_reward - bounce_cost - tilt_cost - jerk_cost -
                torque_cost,
            fallen};
  });
}
