// The forces of fluids.
#include "lanes/harness.hpp"

namespace mjenv::core::lanes_tests {
namespace {

// Fluids that act on bodies as on boxes and as on ellipsoids, with and without density, viscosity and wind
TEST(test_fluids) {
  failures.clear();
  for (const char* option :
       {"", "<option density='0'/>", "<option viscosity='0'/>", "<option density='0' viscosity='0'/>",
        "<option density='-5'/>", "<option viscosity='-0.3'/>", "<option wind='0 0 0' integrator='RK4'/>",
        "<option><flag passive='disable'/></option>"}) {
    const auto model = Model::parse("fluids.xml", in_front_of_body(option, odd_model("fluids.xml")));
    const std::string found = compare(model, kFewRows);
    if (!found.empty()) failures += option + (": " + found) + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// In a fluid, MuJoCo passes over a body with next to no mass, also where the body is heavy in the other rows.
TEST(test_light_bodies) {
  const auto model = Model::parse("fluids.xml", odd_model("fluids.xml"));
  const ErrorTrap trap;
  for (int body = 1; body < model->get()->nbody; ++body) {
    if (model->get()->body_parentid[body] == 0) continue;  // without its mass, none may be left for some dofs
    int row = 0;
    const auto masses = [&](const OwnArray& array, Noise& /*noise*/) {
      std::vector<double> values(array.original.count());
      array.original.read(values.data());
      if (row++ % 2 == 1) values[static_cast<std::size_t>(body)] = 1e-16;
      return values;
    };
    assert_string_equal(compare_own(model, "body_mass", masses).c_str(), "");
  }
}

// mjMINVAL (1e-15) is the least mass of a body over which MuJoCo does not pass.
TEST(test_least_mass) {
  const auto model = Model::parse("least mass", R"(<mujoco><option density='5' viscosity='2'/><worldbody>
    <body><joint axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/><body pos='0.1 0.2 0.3'>
    <inertial pos='0.1 0.3 0.7' mass='1e-15' diaginertia='1e-17 1e-17 1e-17'/></body></body></worldbody></mujoco>)");
  assert_true(model->get()->body_mass[2] == mjMINVAL);
  assert_string_equal(compare(model, kFewRows).c_str(), "");
}

// Lanes know which fluid model acts on a geom of the shared model, and leave the rows to MuJoCo in which it is another one. They
// need it for passive forces, or, if MuJoCo's functions compute these, for the derivatives of mj_implicit.
TEST(test_other_fluid_models) {
  for (const char* integrator : {"Euler", "implicit"})
    for (const char* jacobian : {"dense", "sparse"}) {
      const bool knows_fluids = std::strcmp(integrator, "implicit") == 0 || std::strcmp(jacobian, "dense") == 0;
      const auto option = std::string("<option integrator='") + integrator + "' jacobian='" + jacobian + "'/>";
      const auto model = Model::parse("lanes.xml", in_front_of_body(option, odd_model("lanes.xml")));
      assert_string_equal(compare_own(model, "geom_fluid", in_odd_rows(0.5), knows_fluids ? kOddRows : 0).c_str(), "");
    }
}

// A fluid that acts on the only geom of the model as on an ellipsoid
TEST(test_lone_ellipsoid) {
  const auto model = Model::parse("ellipsoid", R"(<mujoco><option density='1000' viscosity='0.1'/><worldbody><body>
    <freejoint/><geom type='ellipsoid' size='0.1 0.2 0.3' fluidshape='ellipsoid'/></body></worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
