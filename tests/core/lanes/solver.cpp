// Newton, CG, PGS and noslip.
#include "lanes/harness.hpp"

#include <algorithm>

#define MJENV_LANES_WIDTH 2
#include "engine/lanes/frame/version_code.hpp"
#include "engine/lanes/mujoco2/solver.hpp"

namespace mjenv::core::lanes_tests {
namespace {

// Three dense matrices of 30,000 dofs alone are more numbers than 32 bits can count.
static_assert(lanes::Solver::stack_numbers(64, 30'000, false) > 2'700'000'000);

// After each main solver, noslip finds other forces of dry friction and of both kinds of cones.
TEST(test_noslip) {
  const std::string contacts = with("name=\"x\"", "name=\"x\" frictionloss=\"0.1\"", odd_model("contacts.xml"));
  failures.clear();
  for (const char* solver : {"Newton", "PGS", "CG"})
    for (const char* cone : {"pyramidal", "elliptic"})
      for (const auto& [other, dim] : {std::pair{"noslip_iterations='3'", "1"},
                                       {"noslip_iterations='3'", "3"},
                                       {"noslip_iterations='3'", "4"},
                                       {"noslip_iterations='3'", "6"},
                                       {"noslip_iterations='20' noslip_tolerance='1e-3' impratio='5'", "3"}}) {
        const std::string option = std::string("<option solver='") + solver + "' cone='" + cone + "' " + other + "/>";
        const std::string text =
            with("<geom conaffinity", std::string("<geom condim=\"") + dim + "\" conaffinity", contacts);
        const std::string found = compare(Model::parse("contacts.xml", in_front_of_body(option, text)), kFewRows);
        if (!found.empty()) failures += option + ", condim " + dim + ": " + found + "\n";
        if (made_of_contacts == 0) failures += option + ", condim " + dim + ": no contacts made in lanes\n";
      }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// Masses and forces at which MuJoCo's solvers clamp numbers. Balls with these masses slide on the floor, which those at a
// height of 0.1 touch.
TEST(test_clamped_numbers) {
  struct Ball {
    const char *mass, *armature, *friction, *height;
  };
  const std::vector<Ball> heavy{
      {"4e9", "7e9", "0.1", "0.099"}, {"1e6", "0", "0", "0.09"}, {"4e9", "7e9", "0.1", "0.0999"}},
      touching{{"1", "0", "1", "0.09999999999999998"},
               {"0.01", "0", "1", "0.09999999999999999"},
               {"1", "0", "1", "0.0999999999"},
               {"1", "0", "1", "0.0999999999999"}};
  const auto text = [](const std::string& option, const std::vector<Ball>& balls, const std::string& more) {
    std::string bodies;
    for (std::size_t i = 0; i < balls.size(); ++i) {
      const Ball& ball = balls[i];
      bodies += "<body pos='" + std::to_string(i) + " 0 " + ball.height + "'>";
      for (const char* axis : {"1 0 0", "0 1 0", "0 0 1"})
        bodies += std::string("<joint type='slide' axis='") + axis + "' armature='" + ball.armature + "'/>";
      bodies += std::string("<geom size='0.1' mass='") + ball.mass + "' friction='" + ball.friction + "'/></body>";
    }
    return "<mujoco>" + option + "<default><geom conaffinity='0'/></default><worldbody>" +
           "<geom type='plane' size='9 9 1' conaffinity='1' friction='0'/>" + bodies + more + "</worldbody></mujoco>";
  };
  // The runner that comes second is deeper in the floor, so in the end it carries the sledge alone.
  const std::string sledge =
      "<body pos='0 5 0.099'><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='.1 .1 .1'/>"
      "<geom size='0.1' pos='-.05 0 0'/><geom size='0.1' pos='.05 0 -.01'/></body>";
  const std::string flywheel =
      "<body><joint frictionloss='5e9'/><inertial pos='2000 .001 0' mass='4e9' diaginertia='1 1 1'/></body>";
  failures.clear();
  for (const char* cone : {"pyramidal", "elliptic"})
    for (const char* solver :
         {"PGS", "PGS' noslip_iterations='3", "CG' noslip_iterations='3", "Newton' noslip_iterations='3"}) {
      const std::string option =
          std::string("<option jacobian='dense' iterations='3' cone='") + cone + "' solver='" + solver + "'";
      for (const auto& [name, model] : {std::pair{"heavy", text(option + " gravity='6 1 -9.8'/>", heavy, "")},
                                        {"flywheel", text(option + " gravity='3 0 0'/>", {}, flywheel)},
                                        {"touching", text(option + " gravity='3 0 0'/>", touching, sledge)}}) {
        // The masses are near MuJoCo's limit, so that others may be beyond it.
        const std::string found = compare(Model::parse(name, model), 16 * share, {20, 1});
        if (!found.empty()) failures += name + (", " + option) + ": " + found + "\n";
      }
    }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// mju_cholUpdate, with random signs and vectors so long that some matrices lose rank
TEST(test_rank_loss) {
  constexpr int n = 7;
  Noise noise;
  int lost = 0;
  for (int round = 0; round < 3000; ++round) {
    double want[lanes::kWidth][n * n], x[lanes::kWidth][n];
    alignas(lanes::V) double mat[n * n * lanes::kWidth], vec[n * lanes::kWidth];
    unsigned plus = 0, ranks = 0;
    for (int lane = 0; lane < lanes::kWidth; ++lane) {
      for (double& number : want[lane]) number = noise();
      for (int i = 0; i < n; ++i) want[lane][i * n + i] = 1 + noise.below(3) / 2.0;
      // A column of the matrix removes as much as its diagonal has.
      const auto column = noise.below(n);
      for (int i = 0; i < n; ++i)
        x[lane][i] = noise.below(3) ? noise() : noise.below(2) ? 0 : want[lane][i * n + column];
      for (int i = 0; i < n * n; ++i) mat[i * lanes::kWidth + lane] = want[lane][i];
      for (int i = 0; i < n; ++i) vec[i * lanes::kWidth + lane] = x[lane][i];
      const bool is_plus = noise.below(2) == 0;
      plus |= static_cast<unsigned>(is_plus) << lane;
      ranks |= static_cast<unsigned>(mju_cholUpdate(want[lane], x[lane], n, is_plus) < n) << lane;
    }
    const unsigned found = lanes::cholUpdate(lanes::vectors(mat), lanes::vectors(vec), n, lanes::mask_of(plus));
    assert_int_equal(found, ranks);
    for (int lane = 0; lane < lanes::kWidth; ++lane) {
      lost += ranks >> lane & 1;
      for (int i = 0; i < n * n; ++i)
        assert_memory_equal(&mat[i * lanes::kWidth + lane], &want[lane][i], sizeof(double));
    }
  }
  assert_in_range(lost, 1000, 5000);
}

// Rows whose Hessian loses rank are left to MuJoCo. Friction that is this strong leaves little of the inertia in Newton's
// Hessian, so taking a constraint away can lose rank.
TEST(test_rows_of_lost_rank) {
  const std::string plain = odd_model("contacts.xml"), strong = with("<option", "<option impratio=\"1e11\"", plain);
  // A share of the rows may have no Hessian that loses rank. With values of their own, more than half of the rows may lose it.
  const int rows = kFewRows * share;
  assert_string_equal(compare(Model::parse("contacts.xml", plain), rows).c_str(), "");
  const int usual = left_by_solver;
  assert_string_equal(compare(Model::parse("contacts.xml", strong), rows, {20, 1}).c_str(), "");
  assert_true(left_by_solver > usual);
}

// Rows are left to MuJoCo where its stack may be too small to solve the constraints.
TEST(test_small_stacks) {
  std::string spheres;
  for (int i = 0; i < 12; ++i) spheres += "<geom size='0.1' pos='" + std::to_string(0.1 * i - 0.6) + " 0 0'/>";
  for (int size = 200; size <= 600; size += 200) {
    const auto model =
        Model::parse("stack", "<mujoco><size nstack='" + std::to_string(size) +
                                  "'/><default><geom conaffinity='0'/></default><worldbody>"
                                  "<geom type='plane' size='9 9 1' conaffinity='1'/><body pos='0 0 0.4'><freejoint/>" +
                                  spheres + "</body></worldbody></mujoco>");
    const std::string found = compare(model, 16 * share);
    if (!found.empty()) fail_msg("%d numbers: %s", size, found.c_str());
  }
}

// Heavy friction, whose quadratic zone is so small that a line search with no tolerance uses up its evaluations
TEST(test_exhausted_line_search) {
  for (const char* solver : {"Newton", "CG"}) {
    const auto model = Model::parse("exhausted", std::string("<mujoco><option tolerance='0' iterations='20' solver='") +
                                                     solver + R"('/><default><joint frictionloss='2' axis='0 1 0'
      solimpfriction='0.9999 0.9999'/><geom size='0.05' pos='0.1 0 0' contype='0'/></default><worldbody>
      <body><joint/><geom/><body pos='0.2 0 0'><joint/><geom/><body pos='0.2 0 0'><joint/><geom/></body></body></body>
      </worldbody></mujoco>)");
    const mjModel& m = *model->get();
    std::fill_n(m.dof_invweight0, m.nv, 1e-12);  // the model's memory is not constant
    const std::string found = compare(model, 64 * share, {1, 1});
    if (!found.empty()) fail_msg("%s: %s", solver, found.c_str());
  }
}

// With a tolerance that is not a number, MuJoCo's line search ends after its first step.
TEST(test_undefined_tolerance) {
  for (const char* solver : {"Newton", "CG"}) {
    const auto model = Model::parse(
        "contacts.xml", with("<option", std::string("<option solver=\"") + solver + '"', odd_model("contacts.xml")));
    const_cast<double&>(model->get()->opt.tolerance) = kNaN;  // the model's memory is not constant
    assert_string_equal(compare(model, 16).c_str(), "");
  }
}

// Dry friction counts as sliding from the end of its quadratic zone on.
TEST(test_end_of_friction) {
  for (const int side : {-1, 1}) {
    const auto model = Model::parse("friction", "<mujoco><option iterations='0' gravity='" + std::to_string(side) +
                                                    R"( 0 0'/><worldbody><body>
      <joint type='slide' axis='1 0 0' frictionloss='0.9'/><geom size='0.1' mass='1'/></body></worldbody></mujoco>)");
    const StateLayout layout(*model);
    const int width = lanes::widths().back();
    const auto stepper = lanes::make_stepper(*model, *lanes::code_of(width));
    Work plain(model);
    plain.forward();
    assert_int_equal(plain.data()->nefc, 1);
    std::vector<double> state(layout.size);
    *layout.warmstart(state.data()) = side * plain.data()->efc_R[0] * plain.data()->efc_frictionloss[0];
    Group group(model, width);
    for (Work* const work : group.some) {
      work->expect(part_of("efc_state"));
      work->load(state.data());
    }
    assert_int_equal(stepper->step(group.some.data(), width, 1, group.before.data()) + 1, 1U << width);
    std::vector<double> last(layout.size);
    plain.load(state.data());
    plain.step(1, last.data());
    assert_int_equal(plain.data()->efc_state[0], side > 0 ? mjCNSTRSTATE_LINEARPOS : mjCNSTRSTATE_LINEARNEG);
    for (Work* const work : group.some) assert_string_equal(difference(*work, plain).c_str(), "");
  }
}

// Rows are left to MuJoCo where the cost overflows in the line search.
TEST(test_overflowing_costs) {
  const auto model = Model::parse("overflow", R"(<mujoco><option solver='CG'/><worldbody>
    <body><joint name='a'/><geom size='0.1'/></body><body pos='1 0 0'><joint name='b'/><geom size='0.1'/></body>
    </worldbody><equality><joint joint1='a' joint2='b' polycoef='0 1e70 0 0 0' active='false'/></equality></mujoco>)");
  const ErrorTrap trap;
  assert_string_equal(compare_own(model, "eq_active", in_odd_rows(1), kOddRows, 2).c_str(), "");
}

// Rows are left to MuJoCo whose Jacobians or stiffnesses are so large that products with them may overflow.
TEST(test_huge_numbers) {
  // PGS's matrix is infinite. So MuJoCo rejects the forces that the tiny acceleration gives.
  const auto infinite = Model::parse("infinite", R"(<mujoco><option solver='PGS' iterations='0' gravity='0 0 0'/>
    <worldbody><body><joint name='a' type='slide'/><geom size='0.1'/></body><body pos='1 0 0'>
    <joint name='b' type='slide'/><inertial pos='0 0 0' mass='1e-14' diaginertia='1e-14 1e-14 1e-14'/></body>
    </worldbody><equality><joint joint1='a' joint2='b' polycoef='0 1e302 0 0 0'/></equality></mujoco>)");
  const auto accelerate = [](std::size_t /*row*/, const RowState& state) { state.warmstart[0] = 1e-300; };
  assert_int_equal(step_from(infinite, {accelerate}), 0);
  for (const char* solver : {"Newton", "CG", "PGS"}) {
    const std::string option = std::string("<mujoco><option jacobian='dense' solver='") + solver + "' ";
    if (std::strcmp(solver, "PGS") != 0) {
      const auto coupled = Model::parse("coupled", option + R"(gravity='0 0 0'/><worldbody><body><joint name='a'/>
        <geom size='0.1'/></body><body pos='1 0 0'><joint/><geom size='0.1'/></body></worldbody><tendon>
        <fixed name='t'><joint joint='a' coef='1'/></fixed><fixed name='u'><joint joint='a' coef='1'/></fixed></tendon>
        <equality><tendon tendon1='t' tendon2='u' polycoef='0 1e300 0 0 0'/></equality></mujoco>)");
      assert_int_equal(step_from(coupled, {keep_state}), 0);
      const auto sparse =
          Model::parse("sparse", std::string("<mujoco><option jacobian='sparse' solver='") + solver + R"('/>
        <worldbody><body><joint name='a'/><geom size='0.1'/></body><body pos='1 0 0'><joint name='b'/>
        <geom size='0.1'/></body></worldbody><equality><joint joint1='b' joint2='a' polycoef='0 1e80 0 0 0'/></equality>
        </mujoco>)");
      assert_int_equal(step_from(sparse, {keep_state}), 0);
    }
    const auto stiff = Model::parse("stiff", option + R"(impratio='1e300'/><worldbody><geom type='plane' size='1 1 1'/>
      <body pos='0 0 0.099'><joint type='slide'/><geom size='0.1'/></body></worldbody></mujoco>)");
    const auto leave_floor = [](std::size_t /*row*/, const RowState& state) { state.qvel[0] = 1; };
    assert_int_equal(step_from(stiff, {leave_floor}), 0);
  }
}

// Accelerations that are negative zeros along a constraint. PGS and noslip leave rows to MuJoCo where b is -0. Newton's method
// changes the sign of zeros where MuJoCo does.
TEST(test_zeros_along_constraints) {
  const auto body = [](const char* attributes, const char* mass) {
    return std::string("<body><joint type='slide' ") + attributes + "/><inertial pos='0 0 0' mass='" + mass +
           "' diaginertia='1 1 1'/></body>";
  };
  for (const char* option : {"solver='PGS'", "noslip_iterations='1'"}) {
    const auto sliding = Model::parse("sliding", std::string("<mujoco><option ") + option + "/><worldbody>" +
                                                     body("name='a' axis='1 0 0' frictionloss='1'", "100") +
                                                     body("", "1") + body("", "1") + body("", "1") +
                                                     "</worldbody><actuator><motor joint='a'/></actuator></mujoco>");
    const auto move = [](std::size_t row, const RowState& state) {
      const double sign = row % 2 == 1 ? -1 : 1;
      state.qvel[0] = sign * 0.0;
      for (int i = 1; i < 4; ++i) state.qvel[i] = sign;
      state.ctrl[0] = -5e-324;
    };
    assert_int_equal(step_from(sliding, {move}), ((1U << lanes::widths().back()) - 1) & ~kOddRows);
  }

  const auto coupled =
      Model::parse("coupled", "<mujoco><worldbody>" + body("name='a' axis='1 0 0'", "1") +
                                  body("name='b' axis='1 0 0'", "1") + body("frictionloss='100'", "1") + body("", "1") +
                                  "</worldbody><equality><joint joint1='a' joint2='b' polycoef='0 1 0 0 0'/></equality>"
                                  "</mujoco>");
  const auto hold = [](std::size_t row, const RowState& state) {
    state.warmstart[0] = state.qvel[0] = row & 1 ? -0.0 : 0.0;
    state.warmstart[1] = state.qvel[1] = row & 2 ? -0.0 : 0.0;
    state.warmstart[2] = -1;
    state.warmstart[3] = -9.81;
    state.qvel[2] = -1e-3;
    state.qvel[3] = -1;
  };
  assert_int_equal(step_from(coupled, {hold}, "qM") + 1, 1U << lanes::widths().back());
}

}  // namespace
}  // namespace mjenv::core::lanes_tests
