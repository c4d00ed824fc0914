// What is true of lanes whatever they compute: which models and how many rows they take, and their memory.
#include "lanes/harness.hpp"

#include <algorithm>

// Sanitizers have allocators of their own, whose memory mallinfo2 does not count.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#if __GLIBC_PREREQ(2, 33)
#define COUNTS_MEMORY
#include <malloc.h>
#endif
#endif

#include "engine/assets.hpp"

namespace mjenv::core::lanes_tests {
namespace {

TEST(test_obstacles) {
  const auto obstacle = [](const std::string& option, const std::string& rest,
                           const char* joint = "<joint name='j'/>") {
    return lanes::obstacle(*Model::parse(
        "obstacle", "<mujoco>" + option + "<worldbody><site name='s'/><body name='b'>" + joint +
                        "<geom name='g' size='0.1'/><site name='t'/></body></worldbody>" + rest + "</mujoco>"));
  };
  const char* const ball = "<joint name='j' type='ball'/>";
  assert_string_equal(obstacle("", "").c_str(), "");
  assert_string_equal(obstacle("", "", ball).c_str(), "");
  assert_names(obstacle("", "", ""), "no joints");
  assert_names(obstacle("<option><flag fwdinv='enable'/></option>", ""), "enableflags");
  assert_names(obstacle("<option><flag sensornoise='enable'/></option>", ""), "enableflags");
}

// The process's callbacks of MuJoCo change what its functions compute.
TEST(test_callbacks) {
  const auto model = Model::open("hopper.xml");
  const auto assert_is_obstacle = [&](auto& callback, auto function) {
    callback = function;
    const std::string found = lanes::obstacle(*model);
    callback = nullptr;
    assert_names(found, "callbacks");
  };
  const auto act = [](const mjModel*, const mjData*, int) -> mjtNum { return 0; };
  assert_is_obstacle(mjcb_passive, [](const mjModel*, mjData*) {});
  assert_is_obstacle(mjcb_control, [](const mjModel*, mjData*) {});
  assert_is_obstacle(mjcb_contactfilter, [](const mjModel*, mjData*, int, int) { return 0; });
  assert_is_obstacle(mjcb_sensor, [](const mjModel*, mjData*, int) {});
  assert_is_obstacle(mjcb_time, []() -> mjtNum { return 0; });
  assert_is_obstacle(mjcb_act_dyn, act);
  assert_is_obstacle(mjcb_act_gain, act);
  assert_is_obstacle(mjcb_act_bias, act);
  assert_string_equal(lanes::obstacle(*model).c_str(), "");
}

// As many lanes as a thread has rows, at most as many as asked for; none for a model with obstacles.
TEST(test_best_width) {
  const auto model = Model::open("hopper.xml");
  const std::vector<int> widths = lanes::widths();
  const auto has = [&](int width) { return std::count(widths.begin(), widths.end(), width) > 0; };
  const int four = has(4) ? 4 : 2, eight = has(8) ? 8 : four;
  assert_int_equal(lanes::best_width(*model, 1, 8), 0);
  assert_int_equal(lanes::best_width(*model, 2, 8), 2);
  assert_int_equal(lanes::best_width(*model, 3, 8), 2);
  assert_int_equal(lanes::best_width(*model, 4, 8), four);
  assert_int_equal(lanes::best_width(*model, 64, 4), four);
  assert_int_equal(lanes::best_width(*model, 64, 8), eight);
  assert_int_equal(
      lanes::best_width(*Model::parse("sensors.xml", in_front_of_body("<option><flag sensornoise='enable'/></option>",
                                                                      odd_model("sensors.xml"))),
                        64, 8),
      0);
}

// Steppers have memory only for what the model needs. For the integrator implicit: the two triangles of qDeriv and of
// qLU, two vectors of six numbers and a 6 x 6 matrix for each body, and a Jacobian. For sensors: their results and
// cutoffs, three arrays of velocities and the mass of each subtree, and the sizes of sites. For sensors of cameras: the
// cameras' poses. Because of the fluid, MuJoCo places geoms also without sensors.
TEST(test_needed_memory) {
  const int width = lanes::widths().front();
  const auto numbers = [&](const char* option, const char* sensor) {
    const auto model = Model::parse("needs", std::string("<mujoco>") + option +
                                                 R"(<worldbody><body name='a'><joint/><joint axis='0 1 0'/>
        <geom size='0.1' pos='0.2 0 0' fluidshape='ellipsoid'/>
        <camera name='eye'/><camera/><site/><site/><site/><body><joint axis='1 0 0'/>
        <joint/><geom size='0.1' pos='0.2 0 0'/></body></body></worldbody><sensor>)" +
                                                 sensor + "</sensor></mujoco>");
    return std::pair{model, static_cast<int>(lanes::stepper_bytes(*model, width) / sizeof(double)) / width};
  };
  const auto [model, fewest] = numbers("", "");
  const mjModel& m = *model->get();
  assert_int_equal(numbers("<option integrator='implicit'/>", "").second - fewest,
                   4 * m.nM + (6 + 6 + 36) * m.nbody + 6 * m.nv);
  const int sensing = numbers("", "<framepos objtype='body' objname='a'/>").second;
  assert_int_equal(sensing - fewest, 3 + 1 + (6 + 3 + 3 + 1) * m.nbody + 3 * m.nsite);
  assert_int_equal(numbers("", "<framepos objtype='camera' objname='eye'/>").second - sensing, (3 + 9 + 4) * m.ncam);
}

#ifdef COUNTS_MEMORY
std::size_t allocated_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

// What an environment counts before it is created is at least a quarter of what its steppers then allocate.
TEST(test_memory) {
  for (std::size_t i = 0; i < asset_count; ++i) {
    const auto model = Model::open(assets[i].name);
    for (const int width : lanes::widths()) {
      const std::size_t counted_bytes = lanes::stepper_bytes(*model, width), before = allocated_bytes();
      auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
      const std::size_t taken = allocated_bytes() - before;
      if (counted_bytes > taken || 4 * counted_bytes < taken)
        fail_msg("%s, %d lanes: %zu of %zu bytes", assets[i].name, width, counted_bytes, taken);
      stepper.reset();
      // glibc counts the small blocks that a thread keeps for later as allocated.
      if (const std::size_t after = allocated_bytes(); after > before + counted_bytes / 2)
        fail_msg("%s, %d lanes: %zu bytes are not freed", assets[i].name, width, after - before);
    }
  }
}

// A step allocates no memory, also the first one with a contact of a pair that MuJoCo searches for.
TEST(test_no_allocation) {
  const auto model = Model::parse("spheres", R"(<mujoco><worldbody><body><joint type='slide'/><geom size='0.1'/></body>
    <body pos='0.15 0 0'><joint type='slide' axis='1 0 0'/><geom size='0.1'/></body></worldbody></mujoco>)");
  assert_null(model->pairs());
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  Noise noise;
  const std::vector<double> state = random_state(*model->get(), StateLayout(*model), Kind::at_rest, noise);
  Group group(model, width);
  for (Work* const work : group.some) work->load(state.data());
  const std::size_t before = allocated_bytes();
  assert_int_equal(stepper->step(group.some.data(), width, 1, group.before.data()) + 1, 1U << width);
  assert_int_equal(allocated_bytes(), before);
}
#endif

}  // namespace
}  // namespace mjenv::core::lanes_tests
