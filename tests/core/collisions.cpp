// Lanes find the contacts of two geoms that MuJoCo's functions find, bit for bit, and reject no pair of geoms that touch.
#include "engine/mujoco.hpp"  // before cmocka's macro fail

#include <algorithm>
#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <utility>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#define MJENV_LANES_WIDTH 2
#include "engine/lanes/frame/version_code.hpp"
#include "engine/lanes/mujoco2/model_tables.hpp"
#include "engine/model.hpp"
#include "engine/work.hpp"
#include "noise.hpp"
#include "run.hpp"

// MuJoCo's, which its headers do not declare.
extern "C" void mju_makeFrame(mjtNum frame[9]);

namespace mjenv::core {
namespace {

constexpr int kRounds = 2000, kWidth = lanes::kWidth;

using Pose = std::pair<std::array<double, 3>, std::array<double, 9>>;

// Half of the places and orientations are such that edges, faces and middles coincide or touch exactly.
Pose random_pose(Noise& noise, double spread) {
  Pose pose;
  for (double& x : pose.first)
    x = noise.below(2) ? spread * noise() : 0.05 * (static_cast<double>(noise.below(9)) - 4) * spread / 0.2;
  std::array<double, 4> quat{1, 0, 0, 0};
  const auto kind = noise.below(4);
  if (kind == 0)
    for (double& x : quat) x = noise();
  else if (kind == 1)
    quat[1 + noise.below(3)] = noise.below(2) ? 1 : 1e-9 * noise();
  else if (kind == 2)
    quat = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  mju_normalize4(quat.data());
  mju_quat2Mat(pose.second.data(), quat.data());
  return pose;
}

// The height fields of the text have no heights. Most of their points become low, so that few cells decide whether a geom
// touches. The model's memory is not constant.
std::shared_ptr<const Model> with_hills(std::shared_ptr<const Model> model) {
  Noise noise;
  auto* const heights = const_cast<float*>(model->get()->hfield_data);
  for (int i = 0; i < model->get()->nhfielddata; ++i)
    heights[i] = static_cast<float>(noise.below(4) ? 0 : 0.5 + 0.5 * noise());
  return model;
}

class Scene {
 public:
  Scene(const std::string& text, double slack)
      : slack_(slack),
        model_(with_hills(Model::parse("collisions", text))),
        m_(*model_->get()),
        work_(model_),
        tables_(*model_) {
    const auto numbers = [](int count) { return std::vector<lanes::V>(static_cast<std::size_t>(count)); };
    for (const int count : {3 * m_.ngeom, 9 * m_.ngeom, lanes::Contacts::kCapacity, 3 * lanes::Contacts::kCapacity,
                            9 * lanes::Contacts::kCapacity, 3 * m_.ngeom})
      memory_.push_back(numbers(count));
    d_.model = &m_;
    d_.geom_xpos = numbers_of(0);
    d_.geom_xmat = numbers_of(1);
    d_.boxes = tables_.boxes.data();
    c_.rows = (1U << kWidth) - 1;
    c_.collide = [](void*, int, unsigned) { return -1; };  // lanes do not find these contacts
    c_.dist = numbers_of(2);
    c_.pos = numbers_of(3);
    c_.frame = numbers_of(4);
    d_.geom_size = numbers_of(5);
    for (int i = 0; i < 3 * m_.ngeom; ++i) std::fill_n(d_.geom_size + i * kWidth, kWidth, m_.geom_size[i]);
    heights_.fill(m_.hfield_data);
    may_touch_.resize(tables_.pairs.size());
    assert_true(tables_.knows_pairs);
  }

  void place(int lane, int geom, const Pose& pose) {
    for (int k = 0; k < 3; ++k) d_.geom_xpos[(3 * geom + k) * kWidth + lane] = pose.first[k];
    for (int k = 0; k < 9; ++k) d_.geom_xmat[(9 * geom + k) * kWidth + lane] = pose.second[k];
  }

  // has_own_heights: whether lanes compare with the heights of each row, and not with the bounding boxes of the fields
  void compare(bool has_own_heights) {
    d_.heights = has_own_heights ? heights_.data() : nullptr;
    reject(false);
    const std::vector<unsigned char> spheres = may_touch_;
    reject(true);
    for (std::size_t i = 0; i < tables_.pairs.size(); ++i) {
      const lanes::ContactPair& pair = tables_.contact_pairs[i];
      std::array<std::vector<mjContact>, kWidth> expected;
      for (int lane = 0; lane < kWidth; ++lane) {
        const bool is_near = spheres[i] >> lane & 1;  // else MuJoCo asks no function
        if (is_near) expected[lane] = contacts_of(lane, pair);
        const bool is_apart = is_near && expected[lane].empty() && tables_.pairs[i].box_pair >= 0;
        const bool is_rejected = !(may_touch_[i] >> lane & 1);
        const bool is_ground = is_apart && has_own_heights && m_.geom_type[pair.geom1] == mjGEOM_HFIELD;
        (is_ground ? counts_.grounds : counts_.boxes) += is_apart;
        (is_ground ? counts_.rejected_grounds : counts_.rejected) += is_near && is_rejected;
        if (is_near && is_box(pair.geom1) && is_box(pair.geom2) && contacts_of(lane, pair, slack_).empty()) {
          ++counts_.true_boxes;
          counts_.rejected_boxes += is_rejected;
        }
        if (!is_rejected) continue;
        if (!expected[lane].empty()) fail_msg("geoms %d and %d touch, but lanes reject them", pair.geom1, pair.geom2);
      }
      if (pair.shapes != lanes::Shapes::others) compare_contacts(i, expected);
    }
  }

  struct Counts {
    int true_boxes = 0,
        rejected_boxes = 0;     // boxes that are apart by more than the slack; how many of them are rejected
    int parallel_capsules = 0;  // with two contacts
    int grounds = 0,
        rejected_grounds = 0;     // pairs of which one is a height field with own heights
    int boxes = 0, rejected = 0;  // the other pairs whose spheres touch without contacts; how many the boxes reject
    std::map<lanes::Shapes, int> found;
  };
  const Counts& counts() const { return counts_; }
  const mjModel& model() const { return m_; }

 private:
  const double slack_;
  std::shared_ptr<const Model> model_;
  const mjModel& m_;
  Work work_;
  lanes::ModelTables tables_;
  std::vector<std::vector<lanes::V>> memory_;
  lanes::Lanes d_{};
  lanes::Contacts c_{};
  std::vector<unsigned char> may_touch_;
  std::array<const float*, kWidth> heights_{};
  Counts counts_;

  double* numbers_of(std::size_t index) { return reinterpret_cast<double*>(memory_[index].data()); }

  void reject(bool with_boxes) {
    std::vector<lanes::GeomPair> pairs = tables_.pairs;
    for (lanes::GeomPair& pair : pairs)
      if (!with_boxes) pair.box_pair = -1;
    d_.pairs = pairs.data();
    d_.pair_count = static_cast<int>(pairs.size());
    d_.box_pairs = tables_.box_pairs.data();
    d_.may_touch = may_touch_.data();
    lanes::reject(d_);
  }

  // The number of a pair, as MuJoCo mixes margins and gaps of its geoms.
  static double most(const mjtNum* numbers, const lanes::ContactPair& pair) {
    return std::max(numbers[pair.geom1], numbers[pair.geom2]);
  }

  bool is_box(int geom) const { return m_.geom_type[geom] == mjGEOM_BOX; }

  // slack: by how much farther than their margin the geoms may be apart
  std::vector<mjContact> contacts_of(int lane, const lanes::ContactPair& pair, double slack = 0) {
    mjData& d = *work_.data();
    for (const int geom : {pair.geom1, pair.geom2}) {
      for (int i = 3 * geom; i < 3 * geom + 3; ++i) d.geom_xpos[i] = d_.geom_xpos[i * kWidth + lane];
      for (int i = 9 * geom; i < 9 * geom + 9; ++i) d.geom_xmat[i] = d_.geom_xmat[i * kWidth + lane];
    }
    std::vector<mjContact> found(mjMAXCONPAIR);
    const int count = mjCOLLISIONFUNC[m_.geom_type[pair.geom1]][m_.geom_type[pair.geom2]](
        &m_, &d, found.data(), pair.geom1, pair.geom2, most(m_.geom_margin, pair) + slack);
    found.resize(static_cast<std::size_t>(count));
    return found;
  }

  void compare_contacts(std::size_t index, const std::array<std::vector<mjContact>, kWidth>& expected) {
    d_.pairs = &tables_.pairs[index];
    d_.pair_count = 1;
    d_.may_touch = &may_touch_[index];
    c_.pairs = &tables_.contact_pairs[index];
    for (int& count : c_.constraints) count = 0;
    assert_true(lanes::collision(d_, c_));
    const auto name = std::to_string(c_.pairs->geom1) + " and " + std::to_string(c_.pairs->geom2);
    for (int lane = 0; lane < kWidth; ++lane) {
      std::size_t next = 0;
      std::vector<mjContact> included;  // a contact at its margin makes no constraint
      for (const mjContact& con : expected[lane])
        if (con.dist < most(m_.geom_margin, *c_.pairs) - most(m_.geom_gap, *c_.pairs)) included.push_back(con);
      counts_.parallel_capsules += c_.pairs->shapes == lanes::Shapes::capsule_capsule && included.size() == 2;
      const bool is_near = may_touch_[index] >> lane & 1;
      for (int i = 0; i < c_.contact_count; ++i) {
        if (!(c_.contacts[i].rows >> lane & 1)) continue;
        if (next == included.size()) fail_msg("lanes find too many contacts of geoms %s", name.c_str());
        check(included[next++], i, lane, name);
        ++counts_.found[c_.pairs->shapes];
      }
      if (is_near && next != included.size()) fail_msg("lanes find too few contacts of geoms %s", name.c_str());
    }
  }

  void check(mjContact con, int i, int lane, const std::string& name) {
    mju_makeFrame(con.frame);
    const auto is_equal = [&](const double* found, const double* want, int count) {
      for (int k = 0; k < count; ++k) {
        const double number = found[(count * i + k) * kWidth + lane];
        if (std::memcmp(&number, want + k, sizeof number) != 0) return false;
      }
      return true;
    };
    if (!is_equal(c_.dist, &con.dist, 1)) fail_msg("lanes find another dist of geoms %s", name.c_str());
    if (!is_equal(c_.pos, con.pos, 3)) fail_msg("lanes find another pos of geoms %s", name.c_str());
    if (!is_equal(c_.frame, con.frame, 9)) fail_msg("lanes find another frame of geoms %s", name.c_str());
  }
};

std::string scene(double scale, const char* margin) {
  const auto number = [&](double x) { return std::to_string(scale * x) + ' '; };
  const auto geom = [&](const char* type, double x, double y, double z) {
    return std::string("<body><freejoint/><geom type='") + type + "' size='" + number(x) + number(y) + number(z) +
           "'/></body>";
  };
  std::string bodies;
  for (int i = 0; i < 2; ++i)
    bodies += geom("sphere", 0.05, 0, 0) + geom("capsule", 0.03, 0.08, 0) + geom("ellipsoid", 0.03, 0.05, 0.1) +
              geom("cylinder", 0.05, 0.05, 0) + geom("box", 0.05, 0.2, 0.1) +
              "<body><freejoint/><geom type='mesh' mesh='wedge'/></body>";
  return std::string("<mujoco><default><geom margin='") + margin + "'/></default><asset><mesh name='wedge' scale='" +
         number(1) + number(1) + number(1) +
         "' vertex='0 0 0  0.2 0 0  0 0.2 0  0 0 0.2  0.1 0.1 0'/><hfield name='coarse' nrow='3' ncol='4' size='" +
         number(0.15) + number(0.2) + number(0.1) + number(0.05) + "'/><hfield name='fine' nrow='17' ncol='13' size='" +
         number(0.5) + number(0.4) + number(0.1) + number(0.05) +
         "'/></asset><worldbody><geom type='hfield' hfield='coarse'/><geom type='plane' size='1 1 1'/>"
         "<geom type='hfield' hfield='fine'/>" +
         bodies + "</worldbody></mujoco>";
}

void test_random_poses(void** /*state*/) {
  for (const auto& [scale, margin] : {std::pair{1.0, "0"}, {1.0, "0.01"}, {0.02, "0"}}) {
    Scene made(scene(scale, margin), 0.002 * scale);
    const mjModel& m = made.model();
    Noise noise;
    for (int round = 0; round < kRounds; ++round) {
      for (int lane = 0; lane < kWidth; ++lane)
        for (int geom = 0; geom < m.ngeom; ++geom) made.place(lane, geom, random_pose(noise, 0.2 * scale));
      made.compare(round % 2 == 0);
    }
    const Scene::Counts& counts = made.counts();
    std::printf("size %g, margin %s: %d pairs are apart whose spheres touch, of which boxes reject %d\n", scale, margin,
                counts.boxes, counts.rejected);
    std::printf("%d more have heights of their own, of which %d are rejected\n", counts.grounds,
                counts.rejected_grounds);
    std::printf("%d boxes are apart, of which %d are rejected\n", counts.true_boxes, counts.rejected_boxes);
    assert_true(counts.rejected > counts.boxes * 3 / 4);
    assert_true(counts.rejected_grounds > counts.grounds / 5);
    assert_true(counts.true_boxes > 500);
    assert_true(counts.parallel_capsules > 50);
    // For nearly parallel edges, MuJoCo finds directions by numbers that are only noise.
    assert_true(counts.rejected_boxes > counts.true_boxes * 0.99);
    for (int shapes = 1; shapes <= static_cast<int>(lanes::Shapes::capsule_capsule); ++shapes) {
      const auto found = counts.found.find(static_cast<lanes::Shapes>(shapes));
      if (found == counts.found.end() || found->second < 100) fail_msg("few contacts of the shapes %d", shapes);
    }
  }
}

// So far from the origin, rounding errors are greater than what lanes allow for near it.
void test_far_poses(void** /*state*/) {
  Scene made(scene(0.3, "0"), 0);
  Noise noise;
  for (int round = 0; round < 300; ++round) {
    for (int lane = 0; lane < kWidth; ++lane)
      for (int geom = 0; geom < made.model().ngeom; ++geom) {
        Pose pose = random_pose(noise, 0.06);
        for (double& x : pose.first) x += 1e12;
        made.place(lane, geom, pose);
      }
    made.compare(false);
  }
}

// Of a box on an edge, two of the corners that touch the plane are exactly at the height of its middle.
void test_level_corners(void** /*state*/) {
  Scene made(
      "<mujoco><worldbody><geom type='plane' size='1 1 1'/>"
      "<body><freejoint/><geom type='box' size='.1 .2 .1'/></body></worldbody></mujoco>",
      0);
  const Pose ground{{}, {1, 0, 0, 0, 1, 0, 0, 0, 1}};
  const double x = std::sqrt(0.5);
  for (int lane = 0; lane < kWidth; ++lane) {
    made.place(lane, 0, ground);
    made.place(lane, 1, {{0.05, 0.01, -0.01 * (lane + 1)}, {x, 0, x, 0, 1, 0, -x, 0, x}});
  }
  made.compare(false);
  assert_int_equal(made.counts().found.at(lanes::Shapes::plane_box), 4 * kWidth);
}

// A ball that is huge beside the height field that it touches
void test_huge_ball(void** /*state*/) {
  Scene made(
      "<mujoco><asset><hfield name='field' nrow='3' ncol='3' size='.15 .2 .1 .05'/></asset><worldbody>"
      "<geom type='hfield' hfield='field'/><body><freejoint/><geom size='1000'/></body></worldbody></mujoco>",
      0);
  const mjModel& m = made.model();
  const float top = *std::max_element(m.hfield_data, m.hfield_data + m.nhfielddata);
  for (int lane = 0; lane < kWidth; ++lane) {
    made.place(lane, 0, {{}, {1, 0, 0, 0, 1, 0, 0, 0, 1}});
    made.place(lane, 1, {{0, 0, 1000 + 0.1 * top - 0.002 * (lane + 1)}, {1, 0, 0, 0, 1, 0, 0, 0, 1}});
  }
  made.compare(false);
  assert_int_equal(made.counts().boxes, 0);  // all touch
}

}  // namespace
}  // namespace mjenv::core

int run_collisions() {
  using namespace mjenv::core;
  const CMUnitTest tests[] = {cmocka_unit_test(test_random_poses), cmocka_unit_test(test_far_poses),
                              cmocka_unit_test(test_level_corners), cmocka_unit_test(test_huge_ball)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
