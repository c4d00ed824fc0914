// How the suite's episodes begin.
#pragma once

#include "suite.hpp"

namespace suite {

// A quaternion from random.rand(4), or from random.randn(4).
template <typename Draw>
Vector4d random_quaternion(const np::Norm& norm, const Draw& draw) {
  Vector4d quaternion;
  for (double& x : quaternion) x = draw();
  return normalized(norm, quaternion);
}

// Draws positions of joints: those with limits within them, other hinges anywhere, and the orientation of a free joint.
class Randomizer {
 public:
  explicit Randomizer(Robot& r)
      : type_(r.array<std::int32_t>("jnt_type")),
        address_(r.array<std::int32_t>("jnt_qposadr")),
        limited_(r.array<std::uint8_t>("jnt_limited")),
        range_(r.array("jnt_range")),
        norm_(r.norm()) {}

  void randomize_limited_and_rotational_joints(Start& start, RandomState& random) const {
    for (Eigen::Index joint = 0; joint < type_.count; ++joint) randomize(start, random, joint);
  }
  void randomize(Start& start, RandomState& random, Eigen::Index joint) const {
    double* at = start.qpos.data() + start[address_][joint];
    if (start[limited_][joint] != 0) {
      *at = random.uniform(start[range_][2 * joint], start[range_][2 * joint + 1]);
    } else if (start[type_][joint] == kHinge) {
      *at = random.uniform(-kPi, kPi);
    } else if (start[type_][joint] == kFree) {
      Eigen::Map<Vector4d>(at + 3) = random_quaternion(norm_, [&] { return random.rand(); });
    }
  }

 private:
  static constexpr int kFree = 0, kHinge = 3;  // mjtJoint
  Shared<std::int32_t> type_, address_;
  Shared<std::uint8_t> limited_;
  Shared<double> range_;
  np::Norm norm_;
};

// Calls draw until nothing touches. dm_control tries for ever where no count is given.
template <typename Draw>
void draw_without_contacts(Start& start, const Draw& draw, int attempts = 100000) {
  for (int i = 0; i < attempts; ++i) {
    draw();
    start.forward();
    if (start.contact_count() == 0) return;
  }
  throw std::runtime_error("Could not find a collision-free state after " + std::to_string(attempts) + " attempts");
}

}  // namespace suite
