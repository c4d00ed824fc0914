// What the Lanes of every version have.
#pragma once

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core::lanes {

struct LanesBase {
  const mjModel_* model;
  bool has_own_frames;      // rows have values of MJENV_LANES_OWN_FRAMES of their own
  bool has_forces;          // some number of qfrc_applied or xfrc_applied is not 0
  unsigned left_to_mujoco;  // lanes, as bits, in which a number or a case occurred that only MuJoCo's own code computes
  unsigned unlike;  // lanes, as bits, whose rows have own numbers of mjModel with which only MuJoCo's own code computes
};

}  // namespace mjenv::core::lanes
