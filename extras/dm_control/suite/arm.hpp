// What manipulator and stacker have in common: the arm, its observations, and the poses of bodies in its plane.
#pragma once

#include "randomize.hpp"

namespace suite {

class Arm {
 public:
  explicit Arm(Robot& r)
      : joints_{r.joint("arm_root"), r.joint("arm_shoulder"), r.joint("arm_elbow"), r.joint("arm_wrist"),
                r.joint("finger"),   r.joint("fingertip"),    r.joint("thumb"),     r.joint("thumbtip")},
        touch_{r.sensor("palm_touch"), r.sensor("finger_touch"), r.sensor("thumb_touch"), r.sensor("fingertip_touch"),
               r.sensor("thumbtip_touch")},
        hand_(r.body("hand")),
        randomizer_(r),
        norm_(r.norm()) {}

  // x and z of a body, and its turn around y: the first and the third number of its quaternion.
  static Vector4d pose(const Sim& s, int body) {
    return {s.xpos(body)[0], s.xpos(body)[2], s.xquat(body)[0], s.xquat(body)[2]};
  }
  double distance(const Sim& s, int site, int other) const {
    return norm_((s.site_xpos(site) - s.site_xpos(other)).eval());
  }

  void observe(Robot& r, bool fully_observable) const {
    r.observe("arm_pos", [joints = joints_](const Sim& s) {
      Eigen::Matrix<double, 16, 1> sines_and_cosines;
      for (std::size_t i = 0; i < joints.size(); ++i)
        sines_and_cosines.segment<2>(2 * static_cast<Eigen::Index>(i)) << std::sin(s.qpos(joints[i])),
            std::cos(s.qpos(joints[i]));
      return sines_and_cosines;
    });
    r.observe("arm_vel", [joints = joints_](const Sim& s) {
      Eigen::Matrix<double, 8, 1> velocities;
      for (std::size_t i = 0; i < joints.size(); ++i) velocities[static_cast<Eigen::Index>(i)] = s.qvel(joints[i]);
      return velocities;
    });
    r.observe("touch", [touch = touch_](const Sim& s) { return log1p(s, touch); });
    if (fully_observable) r.observe("hand_pos", [hand = hand_](const Sim& s) { return pose(s, hand); });
  }

  void randomize(Start& start, RandomState& random) const {
    for (const Joint& joint : joints_) randomizer_.randomize(start, random, joint.index);
    start.qpos[joints_[4].qpos] = start.qpos[joints_[6].qpos];  // the finger as the thumb
  }

 private:
  std::array<Joint, 8> joints_;
  std::array<Sensor, 5> touch_;
  int hand_;
  Randomizer randomizer_;
  np::Norm norm_;
};

inline bool fully_observable(Robot& r) {
  return r.flag("fully_observable", true, "observe also the hand, the objects and the target, not the sensors alone");
}

}  // namespace suite
