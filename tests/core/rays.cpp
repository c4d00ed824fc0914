// Rangefinders find the same distances above height fields as MuJoCo's mj_ray, bit for bit.
#include "engine/mujoco.hpp"  // before cmocka's macro fail

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "engine/model.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

using Vector = std::array<double, 3>;

// Two fields, turned, and other geoms. In the sides of a field that has more rows than columns, MuJoCo reads heights that
// belong to the next field.
std::string scene(int rows, int columns) {
  const auto field = [](const char* name, int m, int n) {
    return std::string("<hfield name='") + name + "' nrow='" + std::to_string(m) + "' ncol='" + std::to_string(n) +
           "' size='2 1.5 0.7 0.2'/>";
  };
  return "<mujoco><asset>" + field("first", rows, columns) + field("second", 40, 40) +
         "<material name='clear' rgba='0 0 0 0'/>"
         "<mesh name='wedge' vertex='0 0 0  1 0 0  0 1 0  0 0 1'/></asset><worldbody>"
         "<geom type='hfield' hfield='first' euler='10 20 30'/><geom type='hfield' hfield='second' pos='3 0 -.2'/>"
         "<geom type='hfield' hfield='second' pos='0 0 .5' material='clear'/>"
         "<geom size='.2' pos='1 1 1'/><geom size='.3' pos='-1 0 1' rgba='1 1 1 0'/>"
         "<geom type='mesh' mesh='wedge' pos='-1 -1 .5'/>"
         "<body pos='0 0 1'><geom size='1'/><site name='eye'/></body></worldbody></mujoco>";
}

// Half of the rays go along an axis or start at a vertex, so that some only touch a triangle.
Vector random_vector(Noise& noise, double spread) {
  Vector vector;
  for (double& x : vector) x = spread * noise();
  const auto kind = noise.below(6);
  if (kind < 3) vector = {kind == 0 ? spread : 0.0, kind == 1 ? -spread : 0.0, kind == 2 ? -spread : 0.0};
  if (kind == 3) vector[noise.below(3)] = 0;
  return vector;
}

void test_rays(void** /*state*/) {
  int found = 0, fields = 0;
  for (const auto& [rows, columns] : {std::pair{30, 30}, {33, 25}, {2, 2}, {7, 60}}) {
    const auto model = Model::parse("rays", scene(rows, columns));
    mjModel& m = const_cast<mjModel&>(*model->get());  // the model's memory is not constant
    Work work(model);
    mjData& d = *work.data();
    mj_kinematics(&m, &d);
    Noise noise;
    for (int round = 0; round < 4; ++round) {
      for (int i = 0; i < m.nhfielddata; ++i) {
        const double height = 0.5 + 0.5 * noise();
        m.hfield_data[i] = static_cast<float>(round == 0 ? 0.0 : round == 1 ? std::round(4 * height) / 4 : height);
        if (round == 3 && noise.below(50) == 0) m.hfield_data[i] = noise.below(2) ? NAN : 1e30F;
      }
      for (int ray = 0; ray < 3000; ++ray) {
        Vector point = random_vector(noise, 3), direction = random_vector(noise, 1);
        if (noise.below(3) == 0) point[2] = 0.7 * std::abs(noise());
        std::array<int, 2> geoms{};
        const std::array<double, 2> distances{
            mj_ray(&m, &d, point.data(), direction.data(), nullptr, 1, 1, &geoms[0]),
            mjenv_ray(&m, &d, point.data(), direction.data(), nullptr, 1, 1, &geoms[1])};
        if (std::memcmp(&distances[0], &distances[1], sizeof(double)) != 0 || geoms[0] != geoms[1])
          fail_msg("%d x %d, ray %d of round %d: %.17g of geom %d, not %.17g of geom %d", rows, columns, ray, round,
                   distances[1], geoms[1], distances[0], geoms[0]);
        found += geoms[0] >= 0;
        fields += geoms[0] >= 0 && m.geom_type[geoms[0]] == mjGEOM_HFIELD;
      }
    }
  }
  std::printf("%d of 48000 rays meet something, %d of them a height field\n", found, fields);
  assert_true(fields > 10000);
}

}  // namespace
}  // namespace mjenv::core

int run_rays() {
  const CMUnitTest tests[] = {cmocka_unit_test(mjenv::core::test_rays)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
