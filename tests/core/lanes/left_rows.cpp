// Values that rows have of their own, and rows that are left to MuJoCo.
#include "lanes/harness.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace mjenv::core::lanes_tests {
namespace {

// Rows stay in lanes with values of their own of any array of the model.
TEST(test_own_arrays) {
  failures.clear();
  for (const char* name : {"lanes.xml", "actuators.xml", "equalities.xml", "sensing.xml", "shapes.xml", "fluids.xml"}) {
    const auto model = Model::parse(name, odd_model(name));
    const ErrorTrap trap;
    for (const Array& array : writable_arrays(*model)) {
      if (!is_read(array.name) || array.count() == 0) continue;
      const std::string found = compare_own(model, array.name);
      if (!found.empty()) failures += std::string(name) + ", " + array.name + ": " + found + "\n";
    }
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Arrays of numbers that lanes compute with, so that they may not be above MuJoCo's limit
const char* const kLimited[] = {"qpos0",
                                "qpos_spring",
                                "body_pos",
                                "body_quat",
                                "body_ipos",
                                "body_iquat",
                                "body_mass",
                                "body_inertia",
                                "jnt_pos",
                                "jnt_axis",
                                "jnt_stiffness",
                                "dof_armature",
                                "dof_M0",
                                "geom_pos",
                                "geom_quat",
                                "site_pos",
                                "site_quat",
                                "tendon_stiffness",
                                "tendon_damping",
                                "wrap_prm",
                                "actuator_gear",
                                "actuator_gainprm",
                                "tendon_lengthspring",
                                "actuator_ctrlrange",
                                "opt.timestep",
                                "actuator_biasprm",
                                "opt.gravity",
                                "opt.wind",
                                "opt.density",
                                "opt.viscosity"};

// Lanes leave rows to MuJoCo whose own numbers are above MuJoCo's limit.
TEST(test_excessive_own_numbers) {
  const auto model = Model::parse("lanes.xml", odd_model("lanes.xml"));
  const ErrorTrap trap;
  failures.clear();
  int compared = 0;
  for (const Array& array : writable_arrays(*model)) {
    if (!std::any_of(std::begin(kLimited), std::end(kLimited), [&](const char* name) { return array.name == name; }))
      continue;
    const std::string found = compare_own(model, array.name, in_odd_rows(1.1e10, 1), kOddRows);
    ++compared;
    if (!found.empty()) failures += array.name + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
  assert_true(compared > 25);
}

// Lanes leave rows to MuJoCo whose inputs are not finite or above MuJoCo's limit.
TEST(test_bad_inputs) {
  const auto model = Model::parse("inputs", R"(<mujoco><worldbody><body mocap='true'><geom size='0.1'/></body>
    <body pos='2 0 0' mocap='true'><geom size='0.1'/></body>
    <body pos='1 0 0'><joint type='slide'/><geom size='0.1'/></body></worldbody></mujoco>)");
  const ErrorTrap trap;
  for (const char* name : {"qfrc_applied", "xfrc_applied", "mocap_pos"}) {
    assert_string_equal(compare_own(model, name, in_odd_rows(1e10, 1)).c_str(), "");
    for (const double number : {std::nextafter(1e10, kInfinite), -1.1e10, -kInfinite, kNaN}) {
      const std::string found = compare_own(model, name, in_odd_rows(number, 1), kOddRows);
      if (!found.empty()) fail_msg("%s, %g: %s", name, number, found.c_str());
    }
  }
}

// MuJoCo resets the simulation where a position or velocity is above its limit. In a step, damping brings a velocity back
// below the limit, and gravity brings one above it.
TEST(test_states_at_limit) {
  const auto model = Model::parse("limit", R"(<mujoco><option timestep='0.1'/><worldbody>
    <body><joint type='slide' damping='0.2'/><geom size='0.1' mass='1'/></body>
    <body pos='1 0 0'><joint type='slide'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>)");
  const ErrorTrap trap;
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  Noise noise;
  for (const bool is_current : {false, true}) {
    const auto work = [&] {
      auto one = std::make_unique<Work>(model);
      if (is_current) one->keep_current();
      return one;
    };
    std::vector<std::unique_ptr<Work>> works;
    for (int i = 0; i < width; ++i) works.push_back(work());
    Counts counts;
    for (int round = 0; round < 300; ++round) {
      const std::string found = compare(*model, *stepper, works, *work(), OwnArrays(*model), Kind::at_limit,
                                        1 + static_cast<int>(noise.below(2)), noise, counts);
      assert_string_equal(found.c_str(), "");
    }
    assert_int_equal(counts.left, 0);
  }
}

// Lanes leave rows to MuJoCo in which the state of an actuator or a mocap body's quaternion is not finite or above
// MuJoCo's limit, although MuJoCo does not check these.
TEST(test_bad_states) {
  const auto model = Model::parse("states", R"(<mujoco><worldbody><body mocap='true'><geom size='0.1'/></body>
    <body pos='2 0 0' mocap='true'><geom size='0.1'/></body>
    <body pos='1 0 0'><joint name='j' type='slide'/><geom size='0.1'/></body></worldbody><actuator>
    <general joint='j' dyntype='filter' gainprm='1e-9'/><general joint='j' dyntype='filter' gainprm='1e-9'/>
    </actuator></mujoco>)");
  const StateLayout layout(*model);
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  const std::uint32_t all = (1U << width) - 1;
  const std::size_t last_act = 1 + layout.nq + layout.nv + layout.na - 1, last_quat = layout.size - 1;
  for (const std::size_t index : {last_act, last_quat})
    for (const double number : {1e10, std::nextafter(1e10, kInfinite), -1.1e10, kInfinite, kNaN})
      assert_int_equal(step_rows(model, *stepper, states_with(*model, index, number)),
                       number == 1e10 ? all : all & ~kOddRows);
}

// Lanes leave rows to MuJoCo in which a number is above MuJoCo's limit within a step, where MuJoCo does not check it: a
// position or velocity of a stage of RK4, and an acceleration that a constraint takes away.
TEST(test_numbers_within_steps) {
  const struct {
    const char *option, *joint;
    double qpos, qvel, ctrl;
  } cases[] = {{"integrator='RK4' timestep='1'", "damping='3'", 9.9e9, 3e8, 0},
               {"integrator='RK4' timestep='1'", "stiffness='0.3'", -1e9, 9.9e9, 0},
               {"", "limited='true' range='-1 1' solimplimit='0.9999 0.9999'", 1.01, 0, 1e10}};
  for (const auto& c : cases) {
    const auto model = Model::parse("slide", std::string("<mujoco><option ") + c.option + R"(/><worldbody>
      <body><joint name='j' type='slide' axis='1 0 0' )" +
                                                 c.joint + R"(/><geom size='0.1' mass='1'/></body></worldbody>
      <actuator><motor joint='j' gear='20'/></actuator></mujoco>)");
    auto states = states_with(*model, 1, c.qpos);
    for (std::size_t i = 1; i < states.size(); i += 2) {
      states[i][2] = c.qvel;
      states[i].back() = c.ctrl;
    }
    Work plain(model);
    std::vector<double> last(StateLayout(*model).size);
    plain.load(states[1].data());
    assert_false(diverges(plain, 1, last.data()) || diverges(plain, 1, last.data()));
    const int width = lanes::widths().back();
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
    assert_int_equal(step_rows(model, *stepper, states), ((1U << width) - 1) & ~kOddRows);
  }
}

// Dampers above MuJoCo's limit for states, as those that hold the base of Gymnasium-Robotics' Fetch.
TEST(test_huge_dampers) {
  for (const std::string integrator : {"Euler", "implicit"})
    for (const std::string damping : {"1e11", "1e300"}) {
      const auto model = Model::parse(
          "dampers",
          "<mujoco><option integrator='" + integrator + "'/><worldbody><body><joint type='slide' damping='" + damping +
              "'/><joint axis='0 1 0' pos='0.1 0 0'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>");
      auto states = states_with(*model, 4, 1);
      for (std::size_t i = 0; i < states.size(); ++i) states[i][3] = static_cast<double>(i) / std::stod(damping);
      const auto stepper = lanes::make_stepper(*model, *lanes::code_of(lanes::widths().back()));
      const std::uint32_t done = step_rows(model, *stepper, states);
      assert_int_equal(done, (1U << lanes::widths().back()) - 1);
    }
}

// A callback changes the controls and forces between the frames of a step. Rows that get an invalid control are left to MuJoCo, which
// then uses none, and so are rows in which the callback fails.
TEST(test_controls_of_substeps) {
  const auto model = Model::parse("pusher", R"(<mujoco><worldbody>
    <body><joint name='a'/><geom size='0.1' pos='0.2 0 0'/></body></worldbody>
    <actuator><motor joint='a' gear='1e-3'/></actuator></mujoco>)");
  const StateLayout layout(*model);
  const ErrorTrap trap;
  constexpr int frames = 3;
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  OwnArrays own(*model);
  own.add("qfrc_applied");
  std::vector<double> no_force(own.block_bytes() / sizeof(double));
  for (const auto& [odd_control, fails] : {std::pair{1e10, false}, {1.1e10, false}, {1e10, true}}) {
    Noise noise;
    Group group(model, width);
    std::vector<std::vector<double>> states;
    const auto control = [&, odd_control = odd_control](Work& work, int row, std::int64_t frame) {
      work.data()->ctrl[0] = row % 2 == 1 && frame == 1 ? odd_control : 1e3 * row + 1e4 * static_cast<double>(frame);
      work.data()->qfrc_applied[0] = row + static_cast<double>(frame);
    };
    for (Work* const work : group.some) {
      states.push_back(random_state(*model->get(), layout, Kind::tame, noise));
      work->use(own, reinterpret_cast<std::byte*>(no_force.data()));
      work->load(states.back().data());
    }
    const lanes::Stepper::BeforeSubstep of_row = [&, fails = fails](int row, std::int64_t frame) {
      if (fails && row % 2 == 1) throw Error(MJENV_E_TASK, "it fails");
      control(*group.some[static_cast<std::size_t>(row)], row, frame);
    };
    const std::uint32_t done = stepper->step(group.some.data(), width, frames, group.before.data(), &of_row);
    const std::uint32_t all = (1U << width) - 1;
    assert_int_equal(done, fails || odd_control > 1e10 ? all & ~kOddRows : all);
    Work plain(model);
    plain.use(own, reinterpret_cast<std::byte*>(no_force.data()));
    std::vector<double> last(layout.size);
    for (std::size_t i = 0; i < states.size(); ++i) {
      if (!(done >> i & 1)) continue;
      const Work::BeforeSubstep alone = [&](std::int64_t frame) { control(plain, static_cast<int>(i), frame); };
      plain.load(states[i].data());
      plain.step(frames, last.data(), &alone);
      assert_memory_equal(last.data(), group.befores[i].data(), last.size() * sizeof(double));
      assert_string_equal(difference(*group.some[i], plain).c_str(), "");
    }
  }
}

// A task has called mj_forward before the step: lanes call it for all rows, with the controls of the call. They leave rows to
// MuJoCo whose velocities have changed since, or whose controls were invalid, and if only some rows have called it, these.
TEST(test_forward_before_a_step) {
  const auto model =
      Model::parse("runner", R"(<mujoco><option iterations='1'/><worldbody><geom type='plane' size='9 9 1'/>
    <body pos='0 0 0.09'><joint type='slide' axis='0 0 1'/><joint name='a' type='slide' axis='1 0 0'/>
    <joint axis='0 1 0'/><geom size='0.1'/></body></worldbody><actuator><motor joint='a' gear='2e-9'/></actuator></mujoco>)");
  const StateLayout layout(*model);
  const ErrorTrap trap;
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  const std::uint32_t all = (1U << width) - 1, odd = all & kOddRows;
  const struct {
    double control, push;  // of odd rows: the control of the call, and what the velocities change by after it
    std::uint32_t calling, left;
  } cases[] = {{7e9, 0, all, 0},      {-9e9, 0, 0, 0},    {1e10, 0, all, 0},
               {1.1e10, 0, all, odd}, {7e9, 1, all, odd}, {7e9, 0, odd, odd}};
  Noise noise;
  Group group(model, width);
  Work plain(model);
  std::vector<double> last(layout.size);
  for (int round = 0; round < 5; ++round)
    for (const auto& c : cases) {
      const auto begin = [&](Work& work, const double* state, bool is_odd, bool calls) {
        work.load(state);
        work.data()->ctrl[0] = is_odd ? c.control : -4e9;
        if (calls) work.forward_first();
        work.data()->qvel[1] += is_odd ? c.push : 0;
        work.data()->ctrl[0] = 2e9;
      };
      std::vector<std::vector<double>> states;
      for (std::size_t i = 0; i < group.some.size(); ++i) {
        states.push_back(random_state(*model->get(), layout, Kind::tame, noise));
        group.some[i]->defer_forward(true);
        begin(*group.some[i], states[i].data(), i % 2 == 1, c.calling >> i & 1);
      }
      const std::uint32_t done = stepper->step(group.some.data(), width, 2, group.before.data());
      assert_int_equal(done, all & ~c.left);
      for (std::size_t i = 0; i < states.size(); ++i) {
        if (!(done >> i & 1)) continue;
        begin(plain, states[i].data(), i % 2 == 1, c.calling >> i & 1);
        plain.step(2, last.data());
        assert_memory_equal(last.data(), group.befores[i].data(), last.size() * sizeof(double));
        assert_string_equal(difference(*group.some[i], plain).c_str(), "");
      }
    }
}

// Each array that lanes compute with may have numbers up to MuJoCo's limit.
TEST(test_excessive_numbers) {
  const auto model = Model::parse(
      "lanes.xml", with("<site name=\"tip\"", "<site name=\"base\"/><site name=\"tip\"", odd_model("lanes.xml")));
  for (const char* const limited : kLimited) {
    const std::string name = limited;
    const auto found = std::find_if(model->arrays().begin(), model->arrays().end(),
                                    [&](const Array& array) { return array.name == name; });
    assert_true(found != model->arrays().end());
    // The array's last number. The model's memory is not constant.
    double& number = const_cast<double*>(static_cast<const double*>(found->data))[found->count() - 1];
    const double own = number;
    for (const double value : {1e10, -1e10}) {
      number = value;
      if (name != "jnt_stiffness") assert_string_equal(lanes::obstacle(*model).c_str(), "");
    }
    for (const double value : {std::nextafter(1e10, kInfinite), -1.1e10, kInfinite, kNaN}) {
      number = value;
      assert_names(lanes::obstacle(*model), name.c_str());
    }
    number = own;
  }
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
