// The integrator implicit in lanes: the derivatives of forces by velocities, the LU factorization, and the steps are MuJoCo's,
// bit for bit.
#include "engine/mujoco.hpp"  // before cmocka's macro fail
#include "error.hpp"

#include <algorithm>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

// Functions of MuJoCo that mujoco.h does not list
extern "C" {
void mju_factorLUSparse(mjtNum* LU, int n, int* scratch, const int* rownnz, const int* rowadr, const int* colind);
void mju_solveLUSparse(mjtNum* res, const mjtNum* LU, const mjtNum* vec, int n, const int* rownnz, const int* rowadr,
                       const int* colind);
}

#define MJENV_LANES_WIDTH 2
#include "engine/lanes/frame/stages.hpp"
#include "engine/lanes/frame/stepper.hpp"
#include "engine/lanes/frame/version_code.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/model.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

constexpr int kRows = 8, kWidth = lanes::kWidth;

std::string with_option(const std::string& option, std::string text) {
  return text.insert(text.find("<worldbody>"), "<option integrator='implicit'/>" + option);
}

// Joints of all types, several of them on one body, on branches with fixed bodies between them.
const std::string kTree = R"(<mujoco><option timestep='0.004'/><worldbody>
  <body pos='0 0 1'><joint type='free' damping='0.1'/><geom size='.1'/>
    <body pos='.2 0 0'><joint axis='0 1 0'/><joint type='slide' axis='1 0 1' damping='2'/><geom size='.1' pos='.1 0 0'/>
      <body pos='0 .2 0'><geom size='.05'/>
        <body pos='.1 .1 0'><joint type='ball' damping='0.3'/><geom type='box' size='.05 .1 .02'/></body></body>
      <body pos='0 -.2 0'><joint axis='1 0 0'/><joint axis='0 0 1'/><geom size='.07' pos='0 0 .1'/></body></body>
    <body pos='-.2 0 0'><joint name='leg' axis='1 1 0'/><geom type='capsule' size='.03 .1'/></body></body>
  <body pos='2 0 1'><joint type='slide' axis='0 1 0'/><joint type='ball'/><geom size='.1' pos='0 .1 0'/></body>
  <body pos='3 0 1'><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 1 0'/><geom size='.1'/></body>
  </worldbody>)";

// Muscles whose lengths and speeds reach all parts of their curves, also those of strange parameters; actuators whose gain
// depends on the velocity, with controls beyond their range.
const std::string kMuscles = R"(<mujoco><option timestep='0.002'/><worldbody>
  <body pos='0 0 1'><joint name='a' axis='0 1 0'/><geom size='.1' pos='.1 0 0'/>
    <body pos='.2 0 0'><joint name='b' axis='0 1 0'/><joint name='c' type='ball'/><geom size='.1' pos='.1 0 0'/>
    </body></body></worldbody>
  <tendon><fixed name='t' damping='-.2'><joint joint='a' coef='1'/><joint joint='b' coef='-.5'/></fixed></tendon>
  <actuator>
    <general joint='a' gaintype='affine' gainprm='1 0 2' ctrllimited='true' ctrlrange='-.2 .2'/>
    <general tendon='t' gaintype='affine' gainprm='1 .5 -1' biastype='affine' biasprm='0 -1 -.5'/>
    <general joint='c' gear='1 .5 0' gaintype='affine' gainprm='0 0 .3'/>
    <general joint='b' dyntype='filter' dynprm='.1' gaintype='affine' gainprm='1 0 .4'/>
    <muscle joint='a' lengthrange='0 .3'/><muscle joint='b' lengthrange='-.5 .5' force='20' vmax='8'/>
    <muscle tendon='t' lengthrange='0 .3' lmin='.8' lmax='1.2' fvmax='1.05'/>
    <muscle joint='c' gear='0 0 1' lengthrange='-1 1' scale='300'/>
  </actuator></mujoco>)";

// A muscle without force; and one whose length at rest is exactly the least at which it pulls
const std::string kOddMuscles = R"(<mujoco><worldbody>
  <body pos='0 0 1'><joint name='a' axis='0 1 0'/><geom size='.1' pos='.1 0 0'/></body></worldbody>
  <actuator><muscle joint='a' lengthrange='-1 1' force='0'/>
  <muscle joint='a' lengthrange='0 1' range='.75 1.05' lmin='.75'/></actuator></mujoco>)";

void test_steps(void** /*state*/) {
  const std::string adhesion =
      "<actuator><adhesion body='foot' ctrlrange='0 1' gain='30'/><velocity joint='leg' kv='3'/></actuator>";
  const std::string geared = kTree + "<actuator><velocity joint='leg' kv='3' gear='2'/></actuator></mujoco>";
  const std::string fluids = odd_model("fluids.xml");
  const struct {
    const char* name;
    std::string text;
  } cases[] = {
      {"tree", with_option("", geared)},
      {"tree, sparse Jacobians", with_option("<option jacobian='sparse'/>", geared)},
      {"tree in a fluid", with_option("<option density='500' viscosity='.1'/>", geared)},
      {"tree in thick wind", with_option("<option viscosity='2' wind='1 0 .5'/>", geared)},
      {"tree without passive forces", with_option("<option><flag passive='disable'/></option>", geared)},
      {"tree without actuation", with_option("<option><flag actuation='disable'/></option>", geared)},
      {"muscles", with_option("", kMuscles)},
      {"odd muscles", with_option("", kOddMuscles)},
      {"fluids", with_option("", fluids)},
      {"fluids without wind", with_option("<option wind='0 0 0' density='0'/>", fluids)},
      {"thin fluids", with_option("<option viscosity='0' jacobian='sparse'/>", fluids)},
      {"actuators", with_option("", odd_model("actuators.xml"))},
      {"actuators, sparse Jacobians",
       with_option("<option jacobian='sparse' density='9'/>", odd_model("actuators.xml"))},
      {"adhesion", with_option("",
                               "<mujoco><worldbody><geom type='plane' size='5 5 .1'/>"
                               "<body name='foot' pos='0 0 .1'><joint type='slide'/><joint name='leg'/>"
                               "<geom size='.1' margin='.05'/></body></worldbody>" +
                                   adhesion + "</mujoco>")},
      {"slider-crank",
       with_option("",
                   "<mujoco><worldbody><site name='s' pos='0 0 1'/><body><joint axis='0 1 0'/><geom size='.1' "
                   "pos='.1 0 0'/><site name='c' pos='.2 0 0'/></body></worldbody><actuator><general cranksite='c' "
                   "slidersite='s' cranklength='1.2' gaintype='affine' gainprm='1 0 .3' biastype='affine' "
                   "biasprm='0 -2 -1'/></actuator></mujoco>")}};
  std::string failures;
  for (const auto& c : cases) {
    const auto model = Model::parse(c.name, c.text);
    const auto& stages = lanes::stages();
    const auto stage = std::find_if(stages.begin(), stages.end(),
                                    [](const lanes::Stage& one) { return one.name == std::string("integration"); });
    assert_string_equal(lanes::how(*stage, *model).c_str(), "lanes");
    const std::string found = compare_in_lanes(model, kRows);
    if (!found.empty()) failures += std::string(c.name) + ": " + found + "\n";
  }
  if (!failures.empty()) fail_msg("%s", failures.c_str());
}

// MuJoCo's sparse LU factorization and solution of random matrices, of which some have a diagonal that is too small. Many
// elements are zeros of both signs.
void test_factorization(void** /*state*/) {
  const auto model = Model::parse("tree", with_option("", kTree + "</mujoco>"));
  const mjModel& m = *model->get();
  const lanes::ModelTables tables(*model);
  Work work(model);
  mjData& d = *work.data();
  work.forward();
  std::vector<int> rownnz(m.nv), rowadr(m.nv), colind(m.nD), scratch(m.nv);
  mj_makeMSparse(&m, &d, rownnz.data(), rowadr.data(), colind.data());
  struct alignas(lanes::V) Number {
    double lanes[kWidth];
  };
  std::vector<Number> below(m.nM), above(m.nM), x(m.nv);
  lanes::Lanes batch{};
  batch.model = &m;
  batch.ancestor_adr = tables.ancestor_adr.data();
  batch.ancestors = tables.ancestors.data();
  Noise noise;
  const ErrorTrap trap;
  int failed = 0;
  for (int round = 0; round < 2000; ++round) {
    const auto number = [&] { return noise.below(4) ? noise() : noise.odd() * 0; };
    std::vector<std::vector<double>> matrix(kWidth, std::vector<double>(m.nD)), vec(kWidth, std::vector<double>(m.nv)),
        res = vec;
    for (int lane = 0; lane < kWidth; ++lane) {
      const auto at = [&](int row, int column) -> double& {
        const int* const columns = &colind[rowadr[row]];
        return matrix[lane][rowadr[row] + (std::find(columns, columns + rownnz[row], column) - columns)];
      };
      const int small = noise.below(8) ? -1 : static_cast<int>(noise.below(m.nv));
      for (int i = 0; i < m.nv; ++i) {
        vec[lane][i] = x[i].lanes[lane] = number();
        for (int n = 0; n < tables.ancestor_adr[i + 1] - tables.ancestor_adr[i]; ++n) {
          const int adr = tables.ancestor_adr[i] + n, other = tables.ancestors[adr];
          at(i, other) = below[adr].lanes[lane] = n > 0        ? number()
                                                  : i == small ? 1e-16 * noise()
                                                               : (noise.below(2) ? 3 : -3) + noise();
          above[adr].lanes[lane] = n > 0 ? number() : 0;
          if (n > 0) at(other, i) = above[adr].lanes[lane];
        }
      }
    }
    batch.left_to_mujoco = 0;
    const lanes::TreeMatrix LU{lanes::vectors(below.data()->lanes), lanes::vectors(above.data()->lanes)};
    lanes::factorLUSparse(batch, LU);
    lanes::solveLUSparse(batch, LU, lanes::vectors(x.data()->lanes));
    for (int lane = 0; lane < kWidth; ++lane) {
      bool fails = false;
      try {
        mju_factorLUSparse(matrix[lane].data(), m.nv, scratch.data(), rownnz.data(), rowadr.data(), colind.data());
      } catch (const Error&) {
        fails = true;
      }
      assert_int_equal(batch.left_to_mujoco >> lane & 1, fails);
      failed += fails;
      if (fails) continue;
      mju_solveLUSparse(res[lane].data(), matrix[lane].data(), vec[lane].data(), m.nv, rownnz.data(), rowadr.data(),
                        colind.data());
      for (int i = 0; i < m.nv; ++i) assert_memory_equal(&x[i].lanes[lane], &res[lane][i], sizeof(double));
    }
  }
  assert_in_range(failed, 100, 1000);
}

// A row whose matrix has a diagonal of 0 is left to MuJoCo, which fails. Its neighbour is stepped.
void test_failure(void** /*state*/) {
  // With a control of 1 the actuator's force is twice the velocity, so qM - timestep * qDeriv is 1 - 0.5 * 2.
  const auto model = Model::parse("unstable", R"(<mujoco><option timestep='0.5' integrator='implicit' gravity='0 0 0'/>
    <worldbody><body><joint name='j' type='slide'/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></worldbody>
    <actuator><general joint='j' gaintype='affine' gainprm='0 0 1' biastype='affine' biasprm='0 0 1'/></actuator></mujoco>)");
  const StateLayout layout(*model);
  const ErrorTrap trap;
  Work first(model), second(model), plain(model);
  Work* works[] = {&first, &second};
  std::vector<double> state(layout.size), before(layout.size), other(layout.size);
  layout.qvel(state.data())[0] = 0.5;
  double* befores[] = {before.data(), other.data()};
  const double controls[] = {1, 0.25};
  for (int i = 0; i < 2; ++i) {
    works[i]->load(state.data());
    works[i]->act({&controls[i], MJENV_DTYPE_FLOAT64, 1});
  }
  const auto stepper = lanes::make_stepper(*model, *lanes::code_of(2));
  assert_int_equal(stepper->step(works, 2, 1, befores), 2);
  plain.load(state.data());
  plain.act({&controls[1], MJENV_DTYPE_FLOAT64, 1});
  plain.step(1, before.data());
  assert_memory_equal(second.data()->qvel, plain.data()->qvel, sizeof(double));
  assert_true(second.data()->qvel[0] != 0.5);
  plain.load(state.data());
  plain.act({&controls[0], MJENV_DTYPE_FLOAT64, 1});
  bool fails = false;
  try {
    plain.step(1, before.data());
  } catch (const Error& error) {
    fails = std::string(error.what()).find("diagonal element too small") != std::string::npos;
  }
  assert_true(fails);
}

}  // namespace
}  // namespace mjenv::core

int run_implicit() {
  using namespace mjenv::core;
  const CMUnitTest tests[] = {cmocka_unit_test(test_steps), cmocka_unit_test(test_factorization),
                              cmocka_unit_test(test_failure)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
