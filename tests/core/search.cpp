// The search for contacts of cmake/engine/collision.c finds the same contacts as MuJoCo's mj_collision, bit for bit.
#include "engine/mujoco.hpp"  // before cmocka's macro fail

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "engine/model.hpp"
#include "engine/pairs.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "run.hpp"

namespace mjenv::core {
namespace {

constexpr int kRounds = 3000;
constexpr int kWarned = 1;  // MuJoCo prints only the first warning

std::string geom(Noise& noise, bool has_mesh) {
  static constexpr std::array<const char*, 6> kShapes{"size='.1'",
                                                      "type='capsule' size='.05 .1'",
                                                      "type='box' size='.1 .05 .08'",
                                                      "type='ellipsoid' size='.1 .05 .08'",
                                                      "size='.1'",
                                                      "type='cylinder' size='.08 .06'"};
  std::string text = "<geom ";
  text += has_mesh && noise.below(6) == 0 ? "type='mesh' mesh='wedge'" : kShapes[noise.below(kShapes.size())];
  if (noise.below(3) == 0) text += " pos='.1 0 .05'";
  if (noise.below(4) == 0) text += " margin='.02'";
  const auto kind = noise.below(9);
  if (kind < 2) text += kind ? " contype='2' conaffinity='1'" : " contype='0' conaffinity='0'";
  return text + "/>";
}

std::string body(Noise& noise, int index) {
  std::string text = "<body name='b" + std::to_string(index) + "'>";
  if (noise.below(8) > 0) text += "<freejoint/>";
  for (std::uint64_t i = 0; i < 1 + noise.below(3); ++i) text += geom(noise, true);
  if (noise.below(2)) text += "<body pos='.2 0 0'><joint axis='0 1 0'/>" + geom(noise, false) + "</body>";
  return text + "</body>";
}

// option: attributes of the element option. floor: a geom of the world, or of another body that does not move.
std::string scene(Noise& noise, int bodies, const std::string& option, const std::string& floor) {
  std::string text = "<mujoco><size nconmax='30'/><option " + option +
                     "/><asset><hfield name='hills' nrow='8' ncol='8' size='2 2 .1 .1'/>"
                     "<mesh name='wedge' vertex='0 0 0  .2 0 0  0 .2 0  0 0 .2'/></asset><worldbody>" +
                     floor;
  for (int i = 0; i < bodies; ++i) text += body(noise, i);
  text += "</worldbody><contact>";
  if (bodies > 2) text += "<exclude body1='b0' body2='b2'/><exclude body1='b1' body2='b2'/>";
  return text + "</contact></mujoco>";
}

// In half of the states, the bounding spheres of two geoms overlap by 1e-13 to 1e-5 m, along any direction.
void place(const mjModel& m, mjData& d, Noise& noise, int round) {
  const double spread = round % 3 == 0 ? 0.15 : 0.4, shift = round % 5 == 0 ? 1e4 : round % 5 == 1 ? 1 : 0;
  std::array<double, 3> shifts{};
  for (double& x : shifts) x = shift * noise();
  for (int joint = 0; joint < m.njnt; ++joint) {
    double* const qpos = d.qpos + m.jnt_qposadr[joint];
    if (m.jnt_type[joint] != mjJNT_FREE) {
      *qpos = noise();
      continue;
    }
    for (int k = 0; k < 3; ++k) qpos[k] = shifts[k] + spread * noise();
    for (int k = 3; k < 7; ++k) qpos[k] = noise.below(3) ? noise() : k == 3;
    mju_normalize4(qpos + 3);
  }
  mj_kinematics(&m, &d);
  const int body = 1 + static_cast<int>(noise.below(static_cast<std::uint64_t>(m.nbody - 1)));
  const int joint = m.body_jntadr[body];
  if (round % 2 == 0 || joint < 0 || m.jnt_type[joint] != mjJNT_FREE) return;
  const int geom1 = m.body_geomadr[body];
  const int geom2 = static_cast<int>(noise.below(static_cast<std::uint64_t>(m.ngeom)));
  std::array<double, 3> way{noise(), noise.below(2) ? noise() : 0, noise.below(2) ? noise() : 0};
  mju_normalize3(way.data());
  const double reach = m.geom_rbound[geom1] + m.geom_rbound[geom2] +
                       std::max(m.geom_margin[geom1], m.geom_margin[geom2]) - std::pow(10, -9 + 4 * noise());
  for (int k = 0; k < 3; ++k)
    d.qpos[m.jnt_qposadr[joint] + k] += d.geom_xpos[3 * geom2 + k] + reach * way[k] - d.geom_xpos[3 * geom1 + k];
  mj_kinematics(&m, &d);
}

struct Found {
  std::vector<double> numbers;
  int warnings = 0;
};

Found contacts(const mjData& d) {
  Found found{{}, d.warning[mjWARN_CONTACTFULL].number};
  for (int i = 0; i < d.ncon; ++i) {
    const mjContact& c = d.contact[i];
    found.numbers.insert(found.numbers.end(),
                         {double(c.geom1), double(c.geom2), double(c.dim), c.dist, c.includemargin});
    for (const auto& [numbers, count] :
         {std::pair{c.pos, 3}, {c.frame, 9}, {c.friction, 5}, {c.solref, 2}, {c.solimp, 5}})
      found.numbers.insert(found.numbers.end(), numbers, numbers + count);
  }
  return found;
}

// Returns MuJoCo's warnings.
int expect_same_contacts(const mjModel& m, mjData& d, int round) {
  d.warning[mjWARN_CONTACTFULL].number = kWarned;
  mj_collision(&m, &d);
  const Found expected = contacts(d);
  d.warning[mjWARN_CONTACTFULL].number = kWarned;
  mjenv_collision(&m, &d);
  const Found got = contacts(d);
  const std::size_t bytes = expected.numbers.size() * sizeof(double);
  if (got.numbers.size() != expected.numbers.size() || got.warnings != expected.warnings ||
      std::memcmp(got.numbers.data(), expected.numbers.data(), bytes) != 0)
    fail_msg("%d bodies, round %d: the search finds %d numbers of contacts, not %d, or others",
             static_cast<int>(m.nbody), round, static_cast<int>(got.numbers.size()),
             static_cast<int>(expected.numbers.size()));
  return expected.warnings;
}

// MuJoCo's search sorts two spheres on a line parallel to x along this line, in float32, and so misses some that touch.
void test_missed_contacts(void** /*state*/) {
  const auto model = Model::parse("spheres",
                                  "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body>"
                                  "<body><freejoint/><geom size='.2'/></body></worldbody></mujoco>");
  const mjModel& m = *model->get();
  Work work(model);
  mjData& d = *work.data();
  Noise noise;
  int found = 0, missed = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::array<double, 3> way{noise.below(2) ? 1.0 : -1.0, 0, 0};
    const double spread = std::pow(10, 4 * noise()), overlap = std::pow(10, -7 + 6 * noise());
    for (int k = 0; k < 3; ++k) {
      d.qpos[k] = spread * noise();
      d.qpos[7 + k] = d.qpos[k] + (0.3 - overlap) * way[k];
    }
    mj_kinematics(&m, &d);
    expect_same_contacts(m, d, round);
    found += d.ncon;
    missed += d.ncon == 0 && mju_dist3(d.geom_xpos, d.geom_xpos + 3) < 0.3;
  }
  std::printf("%d contacts; MuJoCo misses %d\n", found, missed);
  assert_true(found > 100 && missed > 100);
}

void test_search(void** /*state*/) {
  const std::string plane = "<geom type='plane' size='1 1 1' pos='0 0 -.3'/>";
  const std::string hills = "<geom type='hfield' hfield='hills' pos='0 0 -.3'/><geom size='.3'/>";
  Noise noise;
  int found = 0, full = 0, listed = 0;
  for (const auto& [bodies, option, floor] : {std::tuple{5, "", plane},
                                              {8, "", hills},
                                              {3, "collision='dynamic'", std::string()},
                                              {6, "", "<body>" + plane + "</body>"},
                                              {30, "", plane},
                                              {70, "", plane},
                                              {4, "collision='predefined'", plane},
                                              {4, "cone='elliptic'", plane}}) {
    const auto model = Model::parse("search", scene(noise, bodies, option, floor));
    const mjModel& m = *model->get();
    Work work(model);
    mjData& d = *work.data();
    mjModel view = m;  // with the pairs listed, if they can be
    std::optional<Pairs> pairs = searched_pairs(m);
    if (pairs) set_pairs(view, *pairs);
    for (int round = 0; round < kRounds * 8 / (8 + bodies); ++round) {
      place(m, d, noise, round);
      expect_same_contacts(view, d, round);
      listed += view.npair > 0 ? d.ncon : 0;
      full += expect_same_contacts(m, d, round) > kWarned;
      found += d.ncon;
    }
  }
  std::printf("%d contacts; the buffer was full in %d states\n", found, full);
  assert_true(found > 20000 && full > 100 && listed > 10000);
}

}  // namespace
}  // namespace mjenv::core

int run_search() {
  const CMUnitTest tests[] = {cmocka_unit_test(mjenv::core::test_search),
                              cmocka_unit_test(mjenv::core::test_missed_contacts)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
