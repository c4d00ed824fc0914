// What the Lanes of every version of MuJoCo have.
#pragma once

// NOLINTNEXTLINE(bugprone-reserved-identifier): MuJoCo's name
struct mjModel_;

namespace mjenv::core::lanes {

// ARRAY(name in mjModel, count, limit): numbers that rows may have of their own. limit: kModerate if lanes multiply
// the numbers even where MuJoCo skips a product with 0, so they must be finite and at most mjMAXVAL also in a model
// that all rows share; kUnlimited if they may be infinite there, because lanes compute with them as MuJoCo does.
enum Limit { kUnlimited, kModerate };

// Such numbers, of which the lanes hold those of all rows or, if no row has its own, none (has_own_frames).
#define MJENV_LANES_OWN_FRAMES(ARRAY)       \
  ARRAY(body_pos, 3 * m.nbody, kModerate)   \
  ARRAY(body_quat, 4 * m.nbody, kModerate)  \
  ARRAY(body_iquat, 4 * m.nbody, kModerate) \
  ARRAY(jnt_pos, 3 * m.njnt, kModerate)     \
  ARRAY(jnt_axis, 3 * m.njnt, kModerate)    \
  ARRAY(qpos0, m.nq, kModerate)             \
  ARRAY(geom_pos, 3 * m.ngeom, kModerate)   \
  ARRAY(geom_quat, 4 * m.ngeom, kModerate)  \
  ARRAY(site_pos, 3 * m.nsite, kModerate)   \
  ARRAY(site_quat, 4 * m.nsite, kModerate)

struct LanesBase {
  const mjModel_* model;
  bool has_own_frames;      // rows have values of MJENV_LANES_OWN_FRAMES of their own
  bool has_forces;          // some number of qfrc_applied or xfrc_applied is not 0
  unsigned left_to_mujoco;  // lanes, as bits, in which a number or a case occurred that only MuJoCo's own code computes
  unsigned unlike;  // lanes, as bits, whose rows have own numbers of mjModel with which only MuJoCo's own code computes
};

}  // namespace mjenv::core::lanes
