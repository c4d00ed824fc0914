// Bodies, tendons and actuators, and the integrators.
#include "lanes/harness.hpp"

#include <algorithm>

namespace mjenv::core::lanes_tests {
namespace {

// The range of a ball is the greater of two numbers, of which XML can only set the second.
TEST(test_range_of_ball) {
  const auto model = Model::parse("contacts.xml", with("type=\"ball\"", "type=\"ball\" limited=\"true\" range=\"0 10\"",
                                                       odd_model("contacts.xml")));
  const mjModel& m = *model->get();
  const int* const ball = std::find(m.jnt_type, m.jnt_type + m.njnt, mjJNT_BALL);
  m.jnt_range[2 * (ball - m.jnt_type)] = 0.5;  // the model's memory is not constant
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// Tendons that wrap around a sphere and a cylinder, at a site beside the geom, and inside of it, where they have no
// length; and behind a pulley. One of the side sites is the first site.
TEST(test_wraps) {
  const auto model = Model::parse("wraps", R"(<mujoco><default><geom contype='0' conaffinity='0'/></default><worldbody>
    <site name='in_ball'/><site name='start' pos='-0.3 0 0.3'/>
    <geom name='ball' type='sphere' size='0.1'/><site name='above' pos='0 0 0.3'/>
    <geom name='drum' type='cylinder' size='0.08 0.5' euler='90 0 0' pos='0 0 -0.5'/>
    <site name='in_drum' pos='0.02 0 -0.5'/><site name='below' pos='0 0 -0.9'/>
    <body pos='0.3 0 0.3'><joint type='slide' axis='0 0 1'/><joint axis='0 1 0'/><geom size='0.05'/>
    <site name='end' pos='0.1 0 -0.1'/></body></worldbody>
    <tendon>
    <spatial stiffness='1'><site site='start'/><geom geom='ball' sidesite='in_ball'/><site site='end'/></spatial>
    <spatial damping='1'><site site='start'/><geom geom='ball' sidesite='above'/><site site='end'/></spatial>
    <spatial stiffness='1'><site site='start'/><geom geom='drum' sidesite='in_drum'/><site site='end'/></spatial>
    <spatial damping='1'><site site='start'/><geom geom='drum' sidesite='below'/><site site='end'/></spatial>
    <spatial stiffness='2'><site site='start'/><site site='end'/><pulley divisor='2'/>
    <site site='start'/><geom geom='drum' sidesite='below'/><site site='end'/></spatial>
    </tendon></mujoco>)");
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// A damped tendon that touches a ball in some rows alone. Only there does its sparse Jacobian have elements for the
// ball's joint.
TEST(test_sparse_wraps) {
  const auto model = Model::parse("sparse wraps", R"(<mujoco><option jacobian='sparse' integrator='implicit'/>
    <default><geom contype='0' conaffinity='0'/></default><worldbody><site name='start' pos='-0.3 0 0.1'/>
    <body><joint type='slide' axis='0 0 1'/><geom name='ball' size='0.1'/></body>
    <body pos='0.3 0 0.1'><joint type='slide' axis='0 0 1'/><joint axis='0 1 0'/><geom size='0.05'/>
    <site name='end' pos='0.1 0 -0.1'/></body></worldbody>
    <tendon><spatial damping='1'><site site='start'/><geom geom='ball'/><site site='end'/></spatial></tendon>
    </mujoco>)");
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// MuJoCo makes no constraint of a tendon that no dof moves, but one of an equality of this tendon with another one.
TEST(test_still_tendons) {
  const auto model = Model::parse("tendons", R"(<mujoco><worldbody>
    <body><joint name='a' axis='0 1 0'/><geom size='0.1' pos='0.2 0 0' conaffinity='0'/></body></worldbody>
    <tendon><fixed name='still'><joint joint='a' coef='0'/></fixed>
    <fixed name='moved'><joint joint='a' coef='2'/></fixed></tendon>
    <equality><tendon tendon1='still' tendon2='moved' polycoef='0.1 0.5 0 0 0'/></equality></mujoco>)");
  assert_string_equal(compare(model, kFewRows).c_str(), "");
  assert_true(made > 0);
}

// Actuators with different ranges of force, and with states, of which RK4 keeps the derivatives of each stage
TEST(test_many_actuators) {
  std::string bodies, actuators;
  for (int i = 1; i <= 4; ++i) {
    const std::string name = "'j" + std::to_string(i) + "'", most = "0." + std::to_string(i);
    bodies += "<body><joint name=" + name + "/><geom size='0.1' pos='0.2 0 0' contype='0'/></body>";
    actuators += "<general joint=" + name + " dyntype='integrator' forcelimited='true' forcerange='-" + most + " " +
                 most + "'/>";
  }
  const auto model = Model::parse("actuators", "<mujoco><option integrator='RK4'/><worldbody>" + bodies +
                                                   "</worldbody><actuator>" + actuators + "</actuator></mujoco>");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
}

// The stages of RK4 add accelerations that are negative zeros to zeros.
TEST(test_tiny_accelerations) {
  std::string bodies, actuators;
  for (int i = 0; i < 4; ++i) {
    const std::string name = "j" + std::to_string(i);
    bodies +=
        "<body><joint name='" + name + "' type='slide'/><inertial pos='0 0 0' mass='100' diaginertia='1 1 1'/></body>";
    actuators += "<motor joint='" + name + "'/>";
  }
  const auto model = Model::parse("tiny", "<mujoco><option integrator='RK4' gravity='0 0 0'/><worldbody>" + bodies +
                                              "</worldbody><actuator>" + actuators + "</actuator></mujoco>");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 1, Kind::tiny).c_str(), "");
}

// Without coefficients, the Jacobian of a tendon is 0, so MuJoCo makes none of its constraints. Lanes leave these rows to
// MuJoCo, because another number of constraints changes the order in which its solvers add.
TEST(test_tendons_without_coefficients) {
  const std::pair<const char*, const char*> kinds[] = {
      {"frictionloss='2'", ""},
      {"limited='true' range='5 9'", ""},
      {"", "<equality><tendon tendon1='t' polycoef='1 0 0 0 0'/></equality>"}};
  std::string bodies;
  for (const char* name : {"a", "b", "c", "d", "e", "f"})
    bodies += std::string("<body><joint frictionloss='0.5' pos='0.1 0 0.2' axis='1 0.3 ") + (name[0] % 2 ? "0" : "1") +
              "' name='" + name + "'/><geom size='0.1' pos='0.3 0 0' conaffinity='0'/></body>";
  for (const auto& [attributes, equality] : kinds)
    for (const char* solver : {"PGS", "Newton"}) {
      const auto model =
          Model::parse("tendon", std::string("<mujoco><option solver='") + solver + "'/><worldbody>" + bodies +
                                     "</worldbody><tendon><fixed name='t' " + attributes +
                                     "><joint joint='a' coef='1'/><joint joint='b' coef='-0.5'/></fixed></tendon>" +
                                     equality + "</mujoco>");
      assert_string_equal(compare_own(model, "wrap_prm", in_odd_rows(0), kOddRows, 2).c_str(), "");
    }
}

// Zeros that are negative only in a row's own positions of joints. They matter at an anchor that is -0 in the world, which
// takes a free body at -0 and no rotation.
TEST(test_own_negative_zeros) {
  const auto model = Model::parse("zeros", R"(<mujoco><worldbody><body pos='-0 0 0'><freejoint/><geom size='0.1'/>
    <body pos='-0 -1 -1'><joint axis='1 1 1'/><geom size='0.1'/></body></body></worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "jnt_pos", in_odd_rows(-0.0), 0, 1, Kind::at_rest).c_str(), "");
}

// Muscles whose length is exactly where one part of their curve of forces ends and the next begins: at lmin, in the middle
// between lmin and 1, at 1, in the middle between 1 and lmax, and at lmax, which may be next to 1, or below 1 in a row.
TEST(test_muscle_lengths) {
  std::string bodies, muscles;
  for (const auto& [length, most] : {std::pair{"0.5", "1.5"},
                                     {"0.75", "1.5"},
                                     {"1", "1.5"},
                                     {"1.25", "1.5"},
                                     {"1.5", "1.5"},
                                     {"1.0000000000000004", "1.0000000000000009"}}) {
    const std::string name = "j" + std::to_string(bodies.size());
    bodies += "<body><joint type='slide' name='" + name + "' ref='" + length + "'/><geom size='0.1'/></body>";
    muscles += "<muscle joint='" + name + "' lengthrange='0 1' range='0 1' lmin='0.5' lmax='" + most + "' force='9'/>";
  }
  const auto model = Model::parse(
      "muscles", "<mujoco><option integrator='implicit'/><default><geom contype='0'/></default><worldbody>" + bodies +
                     "</worldbody><actuator>" + muscles + "</actuator></mujoco>");
  int row = 0;
  const auto shorter = [&](const OwnArray& array, Noise& /*noise*/) {
    std::vector<double> values(array.original.count());
    array.original.read(values.data());
    if (row++ % 2 == 1)
      for (std::size_t i = 5; i < values.size(); i += mjNGAIN) values[i] = 0.9;  // lmax
    return values;
  };
  assert_string_equal(compare_own(model, "actuator_gainprm", shorter, 0, 1, Kind::at_rest).c_str(), "");
}

// Models whose only actuator acts on a ball or on a free joint
TEST(test_lone_actuators) {
  for (const char* joints : {"<joint axis='0 1 0'/><geom size='0.1' pos='0.1 0 0'/><body pos='0.3 0 0'>"
                             "<joint name='j' type='ball'/><geom size='0.1' pos='0 0.1 0'/></body>",
                             "<freejoint name='j'/><geom size='0.1' pos='0 0.1 0'/>"}) {
    const auto model = Model::parse(
        "actuator", std::string("<mujoco><default><geom contype='0'/></default><worldbody>") + "<body>" + joints +
                        "</body></worldbody><actuator>" + "<motor joint='j' gear='1 2 3 4 5 6'/></actuator></mujoco>");
    assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
  }
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
