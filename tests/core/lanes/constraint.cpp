// Which constraints are made, and where they stand.
#include "lanes/harness.hpp"

#include <algorithm>

namespace mjenv::core::lanes_tests {
namespace {

// Each row reaches as many limits as lanes have room for. But the rows reach different ones, together too many.
TEST(test_many_limits) {
  std::string bodies;
  for (int i = 0; i < 60; ++i)
    bodies += "<body><joint type='slide' limited='true' range='-0.01 0.01'/><geom size='0.1' conaffinity='0'/></body>";
  const auto model =
      Model::parse("limits", "<mujoco><option jacobian='dense'/><worldbody>" + bodies + "</worldbody></mujoco>");
  assert_string_equal(compare(model, 16 * share).c_str(), "");
}

// Steps rows with values of their own of an array, which are `number` in odd rows, and in the others at one place or at
// none. Odd rows are left to MuJoCo.
void step_beside_left_rows(const std::shared_ptr<const Model>& model, const std::string& array, double number,
                           bool are_others_without) {
  OwnArrays own(*model);
  own.add(array);
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  const auto states = states_with(*model, 1, 2e10);
  std::vector<std::vector<double>> blocks;
  Group group(model, width);
  const auto begin = [&](Work& work, std::size_t row) {
    work.use(own, reinterpret_cast<std::byte*>(blocks[row].data()));
    work.load(states[row].data());
  };
  for (std::size_t row = 0; row < states.size(); ++row) {
    std::vector<double> values(own.list().front().original.count(), row % 2 == 1 ? number : 0.0);
    if (!are_others_without) values[row] = number;
    blocks.emplace_back(own.block_bytes() / sizeof(double) + 1);
    own.list().front().write(values.data(), reinterpret_cast<std::byte*>(blocks.back().data()));
    begin(*group.works[row], row);
  }
  const ErrorTrap trap;
  const std::uint32_t done = stepper->step(group.some.data(), width, 1, group.before.data());
  assert_int_equal(done, ((1U << width) - 1) & ~kOddRows);
  Work plain(model);
  std::vector<double> last(StateLayout(*model).size);
  for (std::size_t row = 0; row < states.size(); row += 2) {
    begin(plain, row);
    plain.step(1, last.data());
    assert_string_equal(difference(*group.works[row], plain).c_str(), "");
  }
}

// Rows that are left to MuJoCo have more friction and equalities of their own than lanes have room for. These are
// neither written nor read.
TEST(test_constraints_of_left_rows) {
  std::string bodies, connects;
  for (int i = 0; i < 200; ++i)
    bodies += "<body><joint type='slide' frictionloss='0.1'/><geom size='0.1' contype='0'/></body>";
  step_beside_left_rows(Model::parse("friction", "<mujoco><option solver='PGS' jacobian='dense'/><worldbody>" + bodies +
                                                     "</worldbody></mujoco>"),
                        "dof_frictionloss", 0.1, false);
  for (int i = 0; i < 1000; ++i) connects += "<connect body1='b' anchor='0 0 0' active='false'/>";
  step_beside_left_rows(
      Model::parse("equalities", R"(<mujoco><size njmax='50'/><option cone='elliptic'/><worldbody>
    <body name='b'><joint type='slide'/><geom size='0.1'/><site name='s'/></body></worldbody><equality>)" +
                                     connects + "</equality><sensor><force site='s'/></sensor></mujoco>"),
      "eq_active", 1, true);
}

// After a step with contacts, a step without any. MuJoCo's functions make the constraints of both.
TEST(test_step_without_constraints) {
  const auto model = Model::parse("ball", R"(<mujoco><worldbody><geom type='plane' size='1 1 1'/><body pos='0 0 0.09'>
    <joint type='slide' damping='1'/><geom size='0.1'/></body></worldbody></mujoco>)");
  const int width = lanes::widths().back();
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
  std::vector<std::vector<double>> states = states_with(*model, 1, 0);
  for (const double height : {0, 1}) {
    for (auto& state : states) state[1] = height;
    assert_int_equal(step_rows(model, *stepper, states, "qM") + 1, 1U << width);
  }
}

// Each of 20 spheres touches the floor in some rows and the ceiling in others. In lanes, the constraints of these
// contacts have more places than a row can have constraints. In rows with values of their own, spheres also touch each
// other, and there are too few places.
TEST(test_many_places) {
  std::string bodies;
  for (int i = 0; i < 20; ++i) bodies += "<body><joint type='slide'/><geom size='0.1' conaffinity='0'/></body>";
  const auto model = Model::parse("places",
                                  "<mujoco><option cone='elliptic' jacobian='dense'/><worldbody>"
                                  "<geom type='plane' size='1 1 1' pos='0 0 -0.1'/>"
                                  "<geom type='plane' size='1 1 1' pos='0 0 0.1' euler='180 0 0'/>" +
                                      bodies + "</worldbody></mujoco>");
  assert_string_equal(compare(model, 16 * share).c_str(), "");

  counted = lanes::code_of(lanes::widths().back());
  lanes::Code code = *counted;
  code.makeConstraint = count_making;
  const auto stepper = lanes::make_stepper(*model, code);
  Group group(model, code.width);
  Work plain(model);
  Noise noise;
  Counts counts;
  made_of_contacts = 0;
  const std::string found =
      compare(*model, *stepper, group.works, plain, OwnArrays(*model), Kind::tame, 1, noise, counts);
  assert_string_equal(found.c_str(), "");
  assert_int_equal(counts.constraints, 60 * counts.rows);
  assert_int_equal(made_of_contacts, 1);
}

// Lanes make the constraints of every step, also after more contacts in all steps than one step may have. In a step
// without contacts, noslip does not solve those of the step before again.
TEST(test_made_again) {
  for (const char* solver : {"Newton", "PGS"}) {
    const auto model =
        Model::parse("ball", std::string("<mujoco><size nconmax='1'/><option noslip_iterations='2' solver='") + solver +
                                 R"('/><worldbody><geom type='plane' size='1 1 1'/>
      <body pos='0 0 0.09'><freejoint/><geom size='0.1'/></body></worldbody></mujoco>)");
    const StateLayout layout(*model);
    const int width = lanes::widths().back();
    counted = lanes::code_of(width);
    lanes::Code code = *counted;
    code.makeConstraint = count_making;
    const auto stepper = lanes::make_stepper(*model, code);
    Group group(model, width);
    Work plain(model);
    made_of_contacts = 0;
    for (int step = 1; step <= 6; ++step) {
      Noise noise;
      const auto load = [&](Work& work, int row) {
        std::vector<double> state = random_state(*model->get(), layout, Kind::at_rest, noise);
        const bool touches = step < 5 || (step == 5 && row % 2 == 0);
        if (!touches) layout.qpos(state.data())[2] += 1;
        work.load(state.data());
      };
      for (int row = 0; row < width; ++row) load(*group.some[static_cast<std::size_t>(row)], row);
      assert_int_equal(stepper->step(group.some.data(), width, 1, group.before.data()) + 1, 1U << width);
      assert_int_equal(made_of_contacts, std::min(step, 5));
      for (int row = 0; row < width; ++row) {
        std::vector<double> last(layout.size);
        load(plain, row);
        plain.step(1, last.data());
        Work& work = *group.some[static_cast<std::size_t>(row)];
        assert_string_equal(difference(work, plain).c_str(), "");
        assert_int_equal(work.constraint_count(), plain.constraint_count());
      }
    }
  }
}

// MuJoCo makes the constraints of all rows if a row has numbers of its own of which MuJoCo warns.
TEST(test_own_solref) {
  const auto model = Model::parse("equalities.xml", odd_model("equalities.xml"));
  const ErrorTrap trap;
  int row = 0;
  const auto mixed = [&](const OwnArray& array, Noise& /*noise*/) {
    std::vector<double> values(array.original.count());
    array.original.read(values.data());
    if (row++ % 2 == 1) values[0] = -values[0];
    return values;
  };
  for (const char* array : {"eq_solref", "dof_solref"})
    assert_string_equal(compare_own(model, array, mixed, 0, 2).c_str(), "");
}

// Contacts without friction beside those with elliptic cones. From step to step other bodies touch the floor.
TEST(test_mixed_cones) {
  std::string bodies;
  for (const char* dim : {"3", "1", "4", "1", "3"})
    bodies += "<body pos='" + std::to_string(bodies.size()) +
              " 0 0.15'><freejoint/><geom type='capsule' size='0.1 0.1' " + "condim='" + dim + "'/></body>";
  for (const char* option : {"solver='Newton'", "solver='CG'", "solver='Newton' jacobian='sparse'"}) {
    const auto model = Model::parse("cones", std::string("<mujoco><option cone='elliptic' ") + option +
                                                 "/><default><geom conaffinity='0'/></default><worldbody>"
                                                 "<geom type='plane' size='9 9 1' conaffinity='1' condim='1'/>" +
                                                 bodies + "</worldbody></mujoco>");
    const std::string found = compare(model, kFewRows);
    if (!found.empty()) fail_msg("%s: %s", option, found.c_str());
    assert_true(made_of_contacts > 0);
  }
}

// In the first step a contact with an elliptic cone has the place that one without friction has in the second step.
TEST(test_exchanged_contacts) {
  std::string bodies;
  for (const char* dim : {"3", "1", "3"})
    bodies += "<body pos='" + std::to_string(bodies.size()) + " 0 0.099'><joint type='slide' axis='1 0 0'/>" +
              "<joint type='slide'/><geom size='0.1' condim='" + dim + "'/></body>";
  const auto model = Model::parse("exchanged",
                                  "<mujoco><option cone='elliptic'/><default><geom conaffinity='0'/>"
                                  "</default><worldbody><geom type='plane' size='9 9 1' conaffinity='1' "
                                  "condim='1'/>" +
                                      bodies + "</worldbody></mujoco>");
  const auto slide = [](std::size_t /*row*/, const RowState& state) { state.qvel[0] = state.qvel[4] = 1; };
  const auto lift = [&](std::size_t row, const RowState& state) {
    slide(row, state);
    state.qpos[1] = 1;
  };
  assert_int_equal(step_from(model, {slide, lift}) + 1, 1U << lanes::widths().back());
}

// MuJoCo sets the stiffness of friction to 0, also where solref and solimp give an infinite one.
TEST(test_stiff_friction) {
  const auto model = Model::parse("friction", R"(<mujoco><worldbody><body><joint frictionloss='1'
    solreffriction='-1e305 -1' solimpfriction='0.0001 0.0001 0.001'/><geom size='0.1' pos='0.2 0 0'/></body>
    </worldbody></mujoco>)");
  assert_string_equal(compare_own(model, "body_mass", other_values, 0, 2).c_str(), "");
  assert_true(made > 0);
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
