// A force and a torque on a body give the same joint forces as in MuJoCo's mj_applyFT, bit for bit.
#include "engine/mujoco.hpp"  // before cmocka's macro fail

#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "engine/assets.hpp"
#include "engine/model.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

constexpr int kRounds = 200;

// Finite numbers, in a quarter of the cases with zeros and tiny numbers, in a few with one that is not finite.
std::array<double, 6> random_force(Noise& noise) {
  std::array<double, 6> force;
  const bool is_odd = noise.below(4) == 0;
  for (double& x : force) x = is_odd ? noise.odd() : 100 * noise();
  if (noise.below(20) == 0)
    force[noise.below(6)] = noise.below(2) ? std::numeric_limits<double>::infinity() : std::nan("");
  return force;
}

// Returns how many elements of qfrc have changed.
int compare(const std::shared_ptr<const Model>& model) {
  const mjModel& m = *model->get();
  Work work(model);
  mjData& d = *work.data();
  Noise noise;
  int moved = 0;
  const auto nv = static_cast<std::size_t>(m.nv);
  for (int round = 0; round < kRounds; ++round) {
    for (int i = 0; i < m.nq; ++i) d.qpos[i] = m.qpos0[i] + noise();
    mj_kinematics(&m, &d);
    mj_comPos(&m, &d);
    for (int body = 0; body < m.nbody; ++body) {
      const std::array<double, 6> force = random_force(noise);
      const std::array<double, 3> point{noise(), noise(), noise()};
      std::vector<double> before(nv);
      for (double& x : before) x = noise.below(3) == 0 ? noise.odd() : noise();
      std::vector<double> want = before, got = before;
      mj_applyFT(&m, &d, force.data(), force.data() + 3, point.data(), body, want.data());
      mjenv_applyFT(&m, &d, force.data(), force.data() + 3, point.data(), body, got.data());
      if (std::memcmp(want.data(), got.data(), nv * sizeof(double)) != 0)
        fail_msg("%s, round %d, body %d", model->label().c_str(), round, body);
      for (std::size_t i = 0; i < nv; ++i) moved += want[i] != before[i];
    }
  }
  return moved;
}

void test_built_in(void** /*state*/) {
  int moved = 0;
  for (std::size_t i = 0; i < asset_count; ++i) moved += compare(Model::open(assets[i].name));
  assert_true(moved > 100000);
}

// Bodies of all kinds: with balls, free joints, without joints, and of the world.
void test_odd(void** /*state*/) {
  for (const char* name : {"swimmers.xml", "fluids.xml", "sensors.xml", "sparse.xml", "mocap.xml", "tethered_pair.xml"})
    assert_true(compare(Model::parse(name, odd_model(name))) > 1000);
}

}  // namespace
}  // namespace mjenv::core

int run_forces() {
  const CMUnitTest tests[] = {cmocka_unit_test(mjenv::core::test_built_in), cmocka_unit_test(mjenv::core::test_odd)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
