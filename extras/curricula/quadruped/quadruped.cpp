// A robot with four legs has to trot at a commanded velocity: forward, to the left, and turning left.
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <mjenv/task.hpp>

using namespace mjenv;

namespace {

using Joints = Eigen::Matrix<double, 12, 1>;

constexpr double kPi = 3.14159265358979323846;

// The trunk's orientation, and its velocities in the trunk's frame.
Eigen::Quaterniond orientation(const Sim& s) { return {s.qpos()[3], s.qpos()[4], s.qpos()[5], s.qpos()[6]}; }
Eigen::Vector3d velocity(const Sim& s) { return orientation(s).conjugate() * Eigen::Vector3d(s.qvel().head<3>()); }
Eigen::Vector3d spin(const Sim& s) { return s.qvel().segment<3>(3); }
// The vertical direction in the trunk's frame: 0, 0, 1 when the trunk is level.
Eigen::Vector3d up(const Sim& s) { return orientation(s).conjugate() * Eigen::Vector3d::UnitZ(); }

// The value of a term of the reward: 1 if the error is 0.
double closeness(double squared_error, double width) { return std::exp(-squared_error / (width * width)); }

}  // namespace

MJENV_TASK("QuadrupedVelocity-v0", r) {
  r.model("./quadruped.xml").frame_skip(2).time_limit(500).needs_exactly(19, 18);

  // The ranges of the command are the curriculum: a training can begin with narrow ones and go on with wide ones.
  const auto forward = r.range("command_forward", {0, 0.8}, "range of the commanded velocity forward, m/s");
  const auto left = r.range("command_left", {-0.3, 0.3}, "range of the commanded velocity to the left, m/s");
  const auto turn = r.range("command_turn", {-0.5, 0.5}, "range of the commanded turn to the left, rad/s");
  const double noise = r.noise(0.05);
  const double stride = r.real("stride", 0.5, "time of a stride of the trot, s", 0.05, 10);
  const double lift = r.real("lift", 0.06, "how high the trot lifts a foot, m", 0, 1);
  const double w_velocity = r.real("velocity_reward", 1, "weight of keeping the commanded velocity");
  const double w_turn = r.real("turn_reward", 0.5, "weight of keeping the commanded turn");
  const double w_gait = r.real("gait_reward", 0.5, "weight of lifting the feet as in a trot");
  const double w_alive = r.real("alive_reward", 0.2, "reward of each step");
  const double w_bounce = r.real("bounce_cost", 1, "weight of the squared vertical velocity");
  const double w_tilt = r.real("tilt_cost", 1, "weight of the squared tilt and, times 0.05, of its speed");
  const double w_jerk = r.real("jerk_cost", 0.02, "weight of the squared change of the action");
  const double w_torque = r.real("torque_cost", 0.0002, "weight of the squared torques of the joints");

  const Carry command = r.carry(3);
  // In a trot, the first and the last foot are in the air together, then the other two.
  const std::array<int, 4> feet{r.site("fl_foot"), r.site("fr_foot"), r.site("rl_foot"), r.site("rr_foot")};
  const auto phase = [=](const Sim& s) { return 2 * kPi * s.time() / stride; };

  r.observe("up", up, "the vertical direction, seen from the trunk");
  r.observe("velocity", velocity, "of the trunk, in its frame, m/s");
  r.observe("spin", spin, "angular velocity of the trunk, in its frame, rad/s");
  r.observe(
      "joints", [](const Sim& s) { return s.qpos(7); }, "angles of the joints, rad; standing: 0");
  r.observe(
      "joint_speeds", [](const Sim& s) { return s.qvel(6); }, "rad/s");
  r.observe("last_action", [](const Sim& s) { return s.ctrl(); });
  r.observe(
      "command", [=](const Sim& s) { return s[command]; }, "forward and left, m/s, and turn to the left, rad/s");
  r.observe(
      "clock", [=](const Sim& s) { return Eigen::Vector2d(std::cos(phase(s)), std::sin(phase(s))); },
      "cosine and sine of the phase of the trot");

  r.reset([=](Start& start, Rng& rng) {
    start[command] << rng.uniform(forward[0], forward[1]), rng.uniform(left[0], left[1]), rng.uniform(turn[0], turn[1]);
    for (int i = 7; i < 19; ++i) start.qpos[i] += rng.uniform(-noise, noise);
    for (int i = 0; i < 18; ++i) start.qvel[i] = noise * rng.normal();
  });

  // The last action.
  r.carry([](const Sim& s) { return Joints(s.ctrl()); });

  r.step([=](const Sim& s, const Carried& before, Info& info) -> Outcome {
    const Eigen::Vector3d v = velocity(s), w = spin(s), wanted = s[command], vertical = up(s);

    double miss = 0;
    for (std::size_t i = 0; i < feet.size(); ++i) {
      const double swing = std::sin(phase(s) + (i == 0 || i == 3 ? 0 : kPi));
      const double height = s.site_xpos(feet[i])[2] - 0.022;
      miss += std::pow(height - lift * std::max(swing, 0.0), 2);
    }

    const double velocity_reward = w_velocity * closeness((v - wanted).head<2>().squaredNorm(), 0.3);
    const double turn_reward = w_turn * closeness(std::pow(w[2] - wanted[2], 2), 0.5);
    const double gait_reward = w_gait * closeness(miss, 0.06);
    const double bounce_cost = w_bounce * v[2] * v[2];
    const double tilt_cost = w_tilt * (vertical.head<2>().squaredNorm() + 0.05 * w.head<2>().squaredNorm());
    const double jerk_cost = w_jerk * (s.ctrl() - before).squaredNorm();
    const double torque_cost = w_torque * s.qfrc_actuator(6).squaredNorm();
    const bool fallen = !s.finite() || s.qpos()[2] < 0.18 || vertical[2] < 0.6;

    info("forward", v[0], "velocity forward, m/s");
    info("error", std::abs(v[0] - wanted[0]), "how far the velocity forward is from the commanded one, m/s");
    info("reward_velocity", velocity_reward, "for keeping the commanded velocity");
    info("reward_turn", turn_reward, "for keeping the commanded turn");
    info("reward_gait", gait_reward, "for lifting the feet as in a trot");
    info("reward_bounce", -bounce_cost, "cost of vertical velocity");
    info("reward_tilt", -tilt_cost, "cost of tilt and its speed");
    info("reward_jerk", -jerk_cost, "cost of changes of the action");
    info("reward_torque", -torque_cost, "cost of torques");
    return {w_alive + velocity_reward + turn_reward + gait_reward - bounce_cost - tilt_cost - jerk_cost - torque_cost,
            fallen};
  });
}
