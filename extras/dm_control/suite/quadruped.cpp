// A quadruped has to walk at 0.5 m/s, run at 5 m/s, climb out of a bowl, or bring a ball to the middle of the floor.
#include "bowl.hpp"
#include "randomize.hpp"

namespace suite {
namespace {

constexpr int kHinges = 16, kActuators = 12;
constexpr std::array<const char*, 8> kToes{"force_toe_front_left",  "force_toe_front_right", "force_toe_back_right",
                                           "force_toe_back_left",   "torque_toe_front_left", "torque_toe_front_right",
                                           "torque_toe_back_right", "torque_toe_back_left"};

// asinh(x) = log(x + sqrt(x^2 + 1)), computed as glibc does, because other C libraries round differently. Each range of
// x has a formula without cancellation.
double asinh(double x) {
  const double size = std::fabs(x), square = size * size;
  constexpr double largest = 268435456, ln2 = 0.6931471805599453;  // above 2^28, x^2 + 1 rounds to x^2
  double result = size;
  if (size > largest)
    result = std::log(size) + ln2;
  else if (size > 2)
    result = std::log(2 * size + 1 / (std::sqrt(square + 1) + size));
  else if (size >= 1 / largest)
    result = std::log1p(size + square / (1 + std::sqrt(1 + square)));
  return std::copysign(result, x);
}

// tanh(x) for x >= 0, computed as glibc does, by expm1.
double tanh(double x) {
  if (x < 0x1p-55) return x;
  if (x >= 22) return 1;
  if (x >= 1) return 1 - 2 / (std::expm1(2 * x) + 2);
  const double fall = std::expm1(-2 * x);
  return -fall / (fall + 2);
}

// Whether NumPy multiplies matrices with fused multiply-add. OpenBLAS does so on every CPU with FMA, even where its
// norms do not. On such CPUs the C library's sine of 692 has this value.
bool fuses_matrices(const np::Norm& norm) {
  volatile double angle = 692;  // keeps the compiler from computing the sine
  return norm.fused() || std::sin(angle) == 0x1.80869e3fad89ap-1;
}

void observe_quadruped(Robot& r) {
  const int torso = r.body("torso");
  const Sensor velocity = r.sensor("velocimeter"), accelerometer = r.sensor("imu_accel"), gyro = r.sensor("imu_gyro");
  std::array<Sensor, kToes.size()> toes{};
  for (std::size_t i = 0; i < toes.size(); ++i) toes[i] = r.sensor(kToes[i]);

  r.observe("egocentric_state", [](const Sim& s) {
    Eigen::Matrix<double, 2 * kHinges + kActuators, 1> state;
    state << s.qpos().segment<kHinges>(7), s.qvel().segment<kHinges>(6), s.act();
    return state;
  });
  r.observe("torso_velocity", [=](const Sim& s) { return s.sensor(velocity); });
  r.observe("torso_upright", [=](const Sim& s) { return s.xmat(torso)(2, 2); });
  r.observe("imu", [=](const Sim& s) {
    Eigen::Matrix<double, 6, 1> imu;
    imu << s.sensor(accelerometer), s.sensor(gyro);
    return imu;
  });
  r.observe("force_torque", [=](const Sim& s) {
    Eigen::Matrix<double, 3 * kToes.size(), 1> signals;
    Eigen::Index at = 0;
    for (const Sensor& toe : toes)
      for (const double x : s.sensor(toe)) signals[at++] = asinh(x);
    return signals;
  });
}

// 1 within an angle (radians) of upright, and 0 upside-down.
double upright_reward(const Sim& s, int torso, double angle = 0) {
  const double least = std::cos(angle);
  return tolerance(s.xmat(torso)(2, 2), {least, kInfinity}, {1 + least, Sigmoid::linear, 0});
}

// Begins the episode with the torso at x, y, just high enough that nothing touches.
void rise_without_contacts(Start& start, const Vector4d& orientation, double x, double y) {
  constexpr int attempts = 10000;
  double z = 0;
  for (int i = 0; i < attempts; ++i, z += 0.01) {
    start.restart();
    start.qpos.head<3>() << x, y, z;
    start.qpos.segment<4>(3) = orientation;
    start.forward();
    if (start.contact_count() == 0) return;
  }
  throw std::runtime_error("Failed to find a non-contacting configuration.");
}

void move(Robot& r, const char* name, double speed) {
  r.model_text(model(name).c_str()).frame_skip(4).time_limit(kEpisode).current();
  const auto norm = r.norm();
  const int torso = r.body("torso");
  const Sensor velocity = r.sensor("velocimeter");
  observe_quadruped(r);
  const auto reset = [=](Start& start, RandomState& random) {
    rise_without_contacts(start, random_quaternion(norm, [&] { return random.randn(); }), 0, 0);
  };
  episodes(r, reset, [=](const Sim& s) {
    const double forward = tolerance(s.sensor(velocity)[0], {speed, kInfinity}, {speed, Sigmoid::linear, 0.5});
    return upright_reward(s, torso) * forward;
  });
}

}  // namespace
}  // namespace suite

MJENV_TASK("dm_control/quadruped-walk-v0", r) { suite::move(r, "quadruped_walk", 0.5); }
MJENV_TASK("dm_control/quadruped-run-v0", r) { suite::move(r, "quadruped_run", 5); }
MJENV_TASK("dm_control/quadruped-escape-v0", r) {
  using namespace suite;
  r.model_text(model("quadruped_escape").c_str()).frame_skip(4).time_limit(kEpisode).current();
  const auto norm = r.norm();
  const int torso = r.body("torso"), workspace = r.site("workspace");
  const Own heights = r.own("hfield_data");
  const auto size = r.array("hfield_size");
  constexpr int kFans = 4, kBeams = 5;
  std::array<Sensor, kFans * kBeams> beams{};
  for (int i = 0; i < kFans * kBeams; ++i)
    beams[static_cast<std::size_t>(i)] =
        r.sensor(("rf_" + std::to_string(i / kBeams) + std::to_string(i % kBeams)).c_str());

  observe_quadruped(r);
  r.observe("origin", [=](const Sim& s) { return (-in_frame(norm, s.xpos(torso), s.xmat(torso))).eval(); });
  r.observe("rangefinder", [=](const Sim& s) {
    Eigen::Matrix<double, kFans * kBeams, 1> ranges;
    for (std::size_t i = 0; i < beams.size(); ++i) {
      const double range = s.sensor(beams[i])[0];
      ranges[static_cast<Eigen::Index>(i)] = range == -1 ? 1 : suite::tanh(range);  // -1: the beam meets nothing
    }
    return ranges;
  });
  const auto reset = [=, bowl = Bowl()](Start& start, RandomState& random, const auto& show) {
    if (heights.count != Bowl::kSide * Bowl::kSide)
      throw std::runtime_error("the terrain has " + std::to_string(heights.count) + " heights, not 201 x 201");
    Bowl::Bumps bumps;
    for (int row = 0; row < Bowl::kBumps; ++row)
      for (int column = 0; column < Bowl::kBumps; ++column) bumps(row, column) = random.uniform(0.15, 1);
    bowl.write(bumps, start[heights]);
    show();
    rise_without_contacts(start, random_quaternion(norm, [&] { return random.randn(); }), 0, 0);
  };
  episodes(r, reset, [=](const Sim& s) {
    const double radius = s[size][0];
    const double escape = tolerance(norm(s.site_xpos(workspace)), {radius, kInfinity}, {radius, Sigmoid::linear, 0});
    return upright_reward(s, torso, 20 * (kPi / 180)) * escape;
  });
}
MJENV_TASK("dm_control/quadruped-fetch-v0", r) {
  using namespace suite;
  r.model_text(model("quadruped_fetch").c_str()).frame_skip(4).time_limit(kEpisode).current();
  const auto norm = r.norm();
  const int torso = r.body("torso"), ball = r.body("ball"), ball_geom = r.geom("ball"), floor = r.geom("floor"),
            target = r.site("target"), workspace = r.site("workspace");
  const Joint root = r.joint("root"), ball_root = r.joint("ball_root");
  const auto geom_size = r.array("geom_size"), site_size = r.array("site_size");

  observe_quadruped(r);
  r.observe("ball_state", [=, fused = fuses_matrices(norm)](const Sim& s) {
    const auto velocity = [&](const Joint& joint) { return s.qvel().segment<3>(joint.qvel); };
    const std::array<Vector3d, 3> seen{s.xpos(ball) - s.xpos(torso), velocity(ball_root) - velocity(root),
                                       s.qvel().segment<3>(ball_root.qvel + 3)};
    Eigen::Matrix<double, 9, 1> state;
    for (int i = 0; i < 3; ++i)
      state.segment<3>(3 * i) = in_frame(fused, seen[static_cast<std::size_t>(i)], s.xmat(torso));
    return state;
  });
  r.observe("target_position",
            [=](const Sim& s) { return in_frame(norm, s.site_xpos(target) - s.xpos(torso), s.xmat(torso)); });
  const auto reset = [=](Start& start, RandomState& random) {
    const double azimuth = random.uniform(0, 2 * kPi);
    const double far = 0.9 * start[geom_size][3 * floor];
    const double x = random.uniform(-far, far), y = random.uniform(-far, far);
    rise_without_contacts(start, {std::cos(azimuth / 2), 0, 0, std::sin(azimuth / 2)}, x, y);
    for (int i = 0; i < 2; ++i) start.qpos[ball_root.qpos + i] = random.uniform(-far, far);
    start.qpos[ball_root.qpos + 2] = 2;
    for (int i = 0; i < 2; ++i) start.qvel[ball_root.qvel + i] = 5 * random.randn();
  };
  episodes(r, reset, [=](const Sim& s) {
    const auto across = [&](int site) { return norm((s.site_xpos(site) - s.xpos(ball)).head<2>().eval()); };
    const Margin arena{s[geom_size][3 * floor] * std::sqrt(2.0), Sigmoid::linear, 0};
    const double reach =
        tolerance(across(workspace), {0, s[site_size][3 * workspace] + s[geom_size][3 * ball_geom]}, arena);
    const double fetch = tolerance(across(target), {0, s[site_size][3 * target]}, arena);
    return upright_reward(s, torso) * (reach * (0.5 + 0.5 * fetch));
  });
}
