// What mj_fwdActuation computes for one actuator without states whose gain and bias are constant or affine, for several
// rows at once. It is the same in every version.
#pragma once

#include "engine/lanes/frame/spatial.hpp"

namespace mjenv::core::lanes {
namespace {

class SimpleActuation {
 public:
  SimpleActuation(const Lanes& d, int id)
      : length_(vectors(d.actuator_length)[id]),
        velocity_(vectors(d.actuator_velocity)[id]),
        ctrl_(vectors(d.ctrl)[id]),
        m_(*d.model),
        d_(d),
        gainprm_(vectors(d.actuator_gainprm) + mjNGAIN * id),
        biasprm_(vectors(d.actuator_biasprm) + mjNBIAS * id),
        id_(id) {
    if (!(m_.opt.disableflags & mjDSBL_CLAMPCTRL)) ctrl_ = clip_if(d.actuator_ctrllimited, d.actuator_ctrlrange, ctrl_);
  }

  V ctrl() const { return ctrl_; }
  V force() const { return force(gain(), ctrl_, bias()); }

 protected:
  const V length_, velocity_;
  V ctrl_;
  const mjModel& m_;
  const Lanes& d_;
  const V *const gainprm_, *const biasprm_;
  const int id_;

  V force(V gain, V input, V bias) const {
    return clip_if(d_.actuator_forcelimited, d_.actuator_forcerange, gain * input + bias);
  }

  // Without a type that MuJoCo knows, it would call mjcb_act_gain, which the obstacle `callbacks` in stages.cpp excludes.
  V gain() const {
    switch (m_.actuator_gaintype[id_]) {
      case mjGAIN_FIXED: return gainprm_[0];
      case mjGAIN_AFFINE: return affine(gainprm_);
      default: return splat(1);
    }
  }

  V bias() const { return m_.actuator_biastype[id_] == mjBIAS_AFFINE ? affine(biasprm_) : V{}; }

 private:
  V affine(const V* prm) const { return prm[0] + prm[1] * length_ + prm[2] * velocity_; }

  // Clips x in the lanes in which the flag `limited` is set.
  V clip_if(const double* limited, const double* range, V x) const {
    const Mask is_limited = vectors(limited)[id_] != V{};
    return any(is_limited) ? (is_limited ? clip(x, vectors(range) + 2 * id_) : x) : x;
  }
};

}  // namespace
}  // namespace mjenv::core::lanes
