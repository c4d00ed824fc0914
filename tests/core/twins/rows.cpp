// Whole steps of rows of all kinds leave the bits of mj_step.
#include "twins/harness.hpp"

#include <cmath>
#include <cstring>
#include <tuple>

namespace mjenv::core::twins {
namespace {

TEST(test_steps) {
  int rows = 0, left = 0;
  for (const Named& named : models())
    for (const int width : lanes::widths())
      for (const Reading& reading : {Reading{"qM", false, 3},
                                     {"qpos", false, 3},
                                     {"qpos", false, 0},
                                     {"qpos", true, 2},
                                     {"cfrc_ext", true, 1},
                                     {"qpos", false, 2, "geom_friction"},
                                     {"qpos", false, 0, "geom_friction"},
                                     {"qpos", false, 1, "body_quat"},
                                     {"qpos", false, 2, "mocap_quat"},
                                     {"qpos", false, 1, "mocap_pos"}})
        if (!reading.own || OwnArray::of(*named.second, reading.own).bytes > 0)
          compare_steps(named, *lanes::code_of(width), reading, rows, left);
  assert_true(left < rows / 10);
}

// Rows whose own values lanes do not compute with are left to MuJoCo; others are not.
TEST(test_rows_left) {
  std::string fast = kForces;
  fast.insert(fast.find("density"), "integrator='implicitfast' ")
      .replace(fast.find("density='900' viscosity='0.3'"), 29, "");
  const std::string of_tendon = limits(""), of_fast_tendon = limits("integrator='implicitfast'");
  std::string of_spring = of_tendon;
  of_spring.insert(of_spring.find("<fixed") + 6, " stiffness='9' damping='2'");
  const struct {
    std::string text;
    const char* array;
    bool are_left;
  } cases[] = {{kForces, "jnt_stiffness", true},
               {fast, "opt.density", true},
               {fast, "opt.viscosity", true},
               {kForces, "jnt_stiffnesspoly", true},
               {kForces, "dof_dampingpoly", true},
               {of_tendon, "tendon_armature", true},
               {of_tendon, "tendon_stiffnesspoly", true},
               {of_tendon, "tendon_dampingpoly", true},
               {of_fast_tendon, "tendon_damping", true},
               {of_spring, "tendon_stiffness", false},
               {of_spring, "tendon_damping", false},
               {of_spring, "tendon_lengthspring", false},
               {listed(limits("solver='PGS' iterations='90'")), "opt.iterations", false},
               {fast, "dof_damping", false}};
  for (const auto& c : cases) {
    const Named named(c.array, Model::parse("forces", c.text));
    int rows = 0, left = 0;
    for (const int width : lanes::widths())
      compare_steps(named, *lanes::code_of(width), {"qpos", false, 1, c.array, nullptr, nullptr, false, true}, rows,
                    left);
    if (c.are_left ? left == 0 : left >= rows / 10) fail_msg("%s: %d of %d rows left", c.array, left, rows);
  }
}

// Rows with forces, numbers of contacts and friction of their own, and rows with bad numbers, which MuJoCo resets.
TEST(test_odd_rows) {
  int rows = 0, left = 0;
  for (const Named& named : models()) {
    if (named.first.find(".xml") != std::string::npos && named.first != "hopper.xml" && named.first != "ant.xml")
      continue;
    for (const int width : lanes::widths()) {
      const lanes::Code& code = *lanes::code_of(width);
      for (const char* own : {"qfrc_applied", "xfrc_applied", "dof_frictionloss", "dof_solref", "geom_solimp",
                              "geom_margin", "geom_size", "jnt_range", "jnt_axis", "jnt_pos", "geom_quat", "site_quat"})
        compare_steps(named, code, {"qpos", false, 2, own}, rows, left);
      for (const char* bad : {"qpos", "qvel", "act", "ctrl", "qacc_warmstart"})
        compare_steps(named, code, {"qpos", false, 2, nullptr, bad}, rows, left);
      compare_steps(named, code, {"qpos", false, 3, nullptr, nullptr, nullptr, true}, rows, left);
    }
  }
  const Named forces("forces", Model::parse("forces", kForces));
  std::string text = kForces;
  const Named still("forces", Model::parse("forces", without(text, "density='900' viscosity='0.3'", " ")));
  text.insert(text.find("<default>"), "<option><flag actuation='disable'/></option>");
  const Named passive("forces", Model::parse("forces", text)), odd("odd", Model::parse("odd", kOdd)),
      deep("limits", Model::parse("limits", listed(limits("")))), tendons("tendons", Model::parse("tendons", kTendons));
  const auto apart = [](const std::string& flag) {
    return Named("apart",
                 Model::parse("apart", "<mujoco><default><geom size='0.5' " + flag + R"(='0'/></default><worldbody>
      <body><joint type='slide'/><geom/></body><body pos='0.5 0 0'><joint type='slide'/><geom/></body></worldbody></mujoco>)"));
  };
  const Named held("held", Model::parse("held", R"(<mujoco><option solver='PGS'/><worldbody><body name='a'>
      <joint range='50 60'/><geom size='0.1' pos='0.3 0 0'/></body></worldbody><equality>
      <connect body1='a' anchor='0 0 0'/></equality></mujoco>)"));
  const Named untyped = apart("contype"), unaffected = apart("conaffinity");  // geoms that touch in some rows alone
  for (const int width : lanes::widths()) {
    const lanes::Code& code = *lanes::code_of(width);
    compare_steps(forces, code, {"energy", false, 1, "opt.enableflags"}, rows, left);
    compare_steps(passive, code, {"qpos", false, 1, "opt.disableflags"}, rows, left);
    for (const char* own : {"opt.density", "opt.viscosity"})
      compare_steps(still, code, {"qpos", false, 1, own}, rows, left);
    compare_steps(odd, code, {"qM", false, 1, "site_sameframe"}, rows, left);
    for (const char* own : {"wrap_prm", "tendon_stiffness", "tendon_damping", "tendon_lengthspring"})
      compare_steps(tendons, code, {"qpos", false, 2, own}, rows, left);
    // Some of the rows that lanes leave to MuJoCo are the only ones with a constraint that lanes do not solve.
    compare_steps(held, code, {"qpos", false, 2, "eq_active", "qpos"}, rows, left);
    compare_steps(untyped, code, {"qpos", false, 2, "geom_contype"}, rows, left);
    compare_steps(unaffected, code, {"qpos", false, 2, "geom_conaffinity"}, rows, left);
    for (const char* own : {"geom_sameframe", "geom_margin"})
      compare_steps(deep, code, {"qM", false, 1, own}, rows, left);
  }
  assert_true(left > 0);
}

// Lanes leave rows in which a number is above MuJoCo's limit within a step: a position or velocity of a stage of RK4, an
// acceleration that a constraint takes away, and one that a constraint causes, for which MuJoCo resets the simulation.
TEST(test_numbers_within_steps) {
  const struct {
    const char *option, *joint;
    double qpos, qvel, ctrl;
  } cases[] = {{"integrator='RK4' timestep='1'", "damping='3'", 9.9e9, 3e8, 0},
               {"integrator='RK4' timestep='1'", "stiffness='0.3'", -1e9, 9.9e9, 0},
               {"", "range='-1 1' solimplimit='0.9999 0.9999'", 1.01, 0, 1e10},
               {"", "range='-1 1' solreflimit='-1e14 -1'", 1.01, 0, 0}};
  for (const auto& c : cases) {
    const auto model = Model::parse("slide", std::string("<mujoco><option ") + c.option + R"(/><worldbody>
      <body><joint name='j' type='slide' axis='1 0 0' )" +
                                                 c.joint + R"(/><geom size='0.1' mass='1'/></body></worldbody>
      <actuator><motor joint='j' gear='20'/></actuator></mujoco>)");
    const std::uint32_t done = step_rows(model, [&](std::size_t row, mjData& d) {
      if (row % 2 == 1) d.qpos[0] = c.qpos, d.qvel[0] = c.qvel, d.ctrl[0] = c.ctrl;
    });
    assert_int_equal(done, ((1U << lanes::widths().back()) - 1) & 0x55);
  }
}

// Lanes leave rows in which the derivatives of implicitfast take away all inertia, because MuJoCo warns of it.
TEST(test_lost_inertia) {
  const auto model = Model::parse("lost", R"(<mujoco><option integrator='implicitfast' timestep='0.125'/><worldbody>
    <body><joint name='j' type='slide'/><geom size='0.1' mass='1'/></body></worldbody>
    <actuator><general joint='j' gaintype='affine' gainprm='0 0 1'/></actuator></mujoco>)");
  const double lost[] = {8, 9, 1e5};
  const std::uint32_t done = step_rows(
      model, [&](std::size_t row, mjData& d) { d.qvel[0] = 1, d.ctrl[0] = row % 2 ? lost[row / 2 % 3] : 7.875; });
  assert_int_equal(done, ((1U << lanes::widths().back()) - 1) & 0x55);
}

// States around the greatest numbers that MuJoCo allows: it resets rows with greater ones, also if they would be smaller
// after the step.
TEST(test_states_at_limit) {
  const auto model = Model::parse("limit", R"(<mujoco><option timestep='0.1'/><worldbody>
    <body><joint type='slide' damping='0.2'/><geom size='0.1' mass='1'/></body>
    <body pos='1 0 0'><joint type='slide'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>)");
  Noise noise;
  const double values[] = {0, 9e9, 9.99e9, 1e10, std::nextafter(1e10, 2e10), 1.001e10, 1.01e10};
  const auto any = [&] { return (noise.below(2) ? 1 : -1) * values[noise.below(std::size(values))]; };
  int done = 0;
  for (int round = 0; round < 100; ++round)
    done += __builtin_popcount(step_rows(model, [&](std::size_t /*row*/, mjData& d) {
      for (int i = 0; i < 2; ++i) d.qpos[i] = any(), d.qvel[i] = any();
    }));
  assert_true(done > 20);
}

// Equalities of all kinds, which are active in some rows, or have numbers of their own there.
TEST(test_equalities) {
  std::string text = without(without(kRobot, "<body name='d'", "</body>"), " euler='0 40 0", "'");
  text.insert(text.find("</equality>"), R"(<joint joint1='c' polycoef='0.1 0 0 0 0'/><weld site1='tip' site2='tail'/>
    <connect body1='hand' body2='arm' anchor='0.1 0.1 0'/><tendon tendon1='s' polycoef='0.1 0 0 0 0'/>
    <tendon tendon1='t' tendon2='s' polycoef='0.1 0.5 0.2 0.1 0.3'/>)");
  text.insert(text.find("<equality>"),
              R"(<tendon><fixed name='s'><joint joint='a' coef='1'/><joint joint='c' coef='-2'/>
    </fixed><fixed name='t'><joint joint='b' coef='0.5'/></fixed></tendon>)");
  int rows = 0, left = 0;
  for (const std::string& one : {text, without(text, "cone='", "' ")}) {
    const Named named("equalities", Model::parse("equalities", one));
    for (const int width : lanes::widths()) {
      const lanes::Code& code = *lanes::code_of(width);
      for (const char* own : {"eq_active", "eq_data", "eq_solref", "eq_solimp", "tendon_length0", "body_invweight0",
                              "dof_invweight0", "tendon_invweight0", "qpos0", "site_quat"})
        compare_steps(named, code, {"qpos", false, 2, own}, rows, left);
    }
  }
  assert_true(left < rows / 10);
  // A hinge moves no point of its axis, so MuJoCo makes no constraint.
  const auto still = Model::parse("still", R"(<mujoco><worldbody><body name='a'><joint axis='0 0 1'/><geom size='0.1'/>
    </body></worldbody><equality><connect body1='a' anchor='0 0 0.3'/></equality></mujoco>)");
  assert_int_equal(step_rows(still, [](std::size_t /*row*/, mjData& d) { d.qvel[0] = 1; }), 0);
}

// Dampers above MuJoCo's limit for states, as those that hold the base of Gymnasium-Robotics' Fetch.
TEST(test_huge_dampers) {
  for (const std::string integrator : {"Euler", "implicitfast"})
    for (const std::string damping : {"1e11", "1e300"}) {
      const auto model = Model::parse(
          "dampers",
          "<mujoco><option integrator='" + integrator + "'/><worldbody><body><joint type='slide' damping='" + damping +
              "'/><joint axis='0 1 0' pos='0.1 0 0'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>");
      const std::uint32_t done = step_rows(model, [&](std::size_t row, mjData& d) {
        d.qvel[0] = static_cast<double>(row) / std::stod(damping);
        d.qvel[1] = static_cast<double>(row);
      });
      assert_int_equal(done, (1U << lanes::widths().back()) - 1);
    }
}

// Geoms that overlap by little. MuJoCo misses some of these contacts, because it compares boxes with rounded numbers.
TEST(test_small_overlaps) {
  const std::string plane = "<geom type='plane' size='9 9 1' ", two = "<geom pos='0 0 0.4' size='0.01'/></body>";
  const struct {
    std::string world, more;
    double at;  // the position in which the geoms begin to touch
    int digits;
  } cases[] = {{plane + "pos='0 0 0.3'/>", two, 0.3 + 0.07, 9},
               {plane + "pos='0 0 0.15'/><geom pos='0 0 9'/>", "</body>", 0.15 + 0.07, 9},
               {"<geom type='box' size='1 1 0.3' pos='0 0 0.35'/>", two, 0.35 + 0.3 + 0.07, 17},
               {"<body pos='0 0 100'><joint type='slide' axis='0 0 1'/><geom/></body>", "</body>", 100.14, 17}};
  for (const auto& c : cases) {
    const auto model = Model::parse("small overlaps", "<mujoco><default><geom size='0.07'/></default><worldbody>" +
                                                          c.world + "<body><joint type='slide' axis='0 0 1'/><geom/>" +
                                                          c.more + "</worldbody></mujoco>");
    Noise noise;
    Original original(*model);
    int missed = 0;
    for (int round = 0; round < 40; ++round)
      step_rows(model, [&](std::size_t /*row*/, mjData& d) {
        const double overlap = std::pow(10, -5 - (c.digits - 5) * std::abs(noise()));
        d.qpos[model->get()->nq - 1] = c.at - overlap;
        original.load(d);
        original.step();
        missed += original.contacts() == 0;
      });
    if (missed == 0) fail_msg("%s: nothing is missed", c.world.c_str());
  }
}

// Lanes leave rows whose Jacobians, stiffnesses or costs are so large that products with them may overflow.
TEST(test_huge_numbers) {
  for (const auto& [option, geom, mass] : {std::tuple{"impratio='1e152'", "friction='1e76'", "1"},
                                           {"impratio='1e90'", "", "1"},
                                           {"cone='elliptic' impratio='1e90'", "", "1"},
                                           {"", "solref='-1e200 -1'", "1"},
                                           {"solver='PGS' impratio='1e300'", "friction='1e76'", "1e4"},
                                           {"solver='PGS'", "friction='1e60'", "1"},
                                           {"solver='PGS' impratio='1e250'", "friction='1e70'", "1e-12"}}) {
    const auto model = Model::parse(
        "huge", std::string("<mujoco><option ") + option +
                    "/><worldbody><geom type='plane' size='9 9 1' solmix='0'/><body pos='0 0 0.09'><joint type='slide' "
                    "axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom size='0.1' mass='" +
                    mass + "' " + geom + "/></body></worldbody></mujoco>");
    if (step_rows(model, [](std::size_t /*row*/, mjData& d) { d.qvel[1] = 1; }) != 0)
      fail_msg("%s %s: rows are not left", option, geom);
  }
}

// Where MuJoCo's memory is too small for the contacts or constraints of some rows, it fails or finds fewer of them, so lanes
// leave these rows to it.
TEST(test_little_memory) {
  int rows = 0, left = 0;
  const std::string far = "<default><geom gap='3'/></default>";  // contacts without constraints
  for (const int size : {8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 36, 40, 44, 48, 52, 56, 60}) {
    const std::string memory = "<size memory='" + std::to_string(size) + "K'/>";
    std::string apart = kApart, held = hedgehog("", 8, memory);
    held.replace(held.find("<body "), 6, "<body name='b' ")
        .insert(held.find("</mujoco>"), "<equality><weld body1='b'/></equality>");
    for (const std::string& text :
         {held, hedgehog("", 24, memory), hedgehog("solver='PGS'", 24, memory), hedgehog("", 24, memory + far),
          hedgehog("", 3, memory + far), apart.insert(8, memory)}) {
      const Named named(text.substr(0, 80), Model::parse("memory", text));
      for (const int width : lanes::widths())
        for (const char* array : {"qpos", "warnings"})
          compare_steps(named, *lanes::code_of(width), {array, false, 1}, rows, left);
    }
  }
  assert_true(left > 0);
  for (const std::string size : {"<size nconmax='2'/>", "<size njmax='9'/>"}) {
    const Named named(size, Model::parse("size", hedgehog("", 24, size)));
    for (const int width : lanes::widths())
      for (const char* array : {"qpos", "warnings"})
        compare_steps(named, *lanes::code_of(width), {array, false, 1}, rows, left);
  }
}

}  // namespace
}  // namespace mjenv::core::twins
