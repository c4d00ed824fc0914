// The joint forces of a force and a torque on a body, which a fluid exerts on each body in each step. MuJoCo multiplies by
// a Jacobian that has a column for every degree of freedom; here, only those that move the body are visited. The results
// are the same.
#include "engine/engine_support.h"

#include <math.h>
#include <mujoco/mujoco.h>

// mju_mulMatTVec for one column of the Jacobian.
static mjtNum project(const mjtNum column[3], const mjtNum vec[3]) {
  mjtNum sum = 0;
  for (int k = 0; k < 3; ++k)
    if (vec[k] != 0) sum += column[k] * vec[k];
  return sum;
}

// engine_core_smooth.c calls this function in place of mj_applyFT.
void mjenv_applyFT(const mjModel* m, mjData* d, const mjtNum force[3], const mjtNum torque[3], const mjtNum point[3],
                   int body, mjtNum* qfrc_target) {
  // A zero of the Jacobian times such a number is not 0.
  for (int k = 0; k < 3; ++k)
    if (!isfinite(force[k]) || !isfinite(torque[k])) {
      mj_applyFT(m, d, force, torque, point, body, qfrc_target);
      return;
    }
  // MuJoCo adds +0 where the Jacobian has only zeros, which turns -0 into +0.
  for (int i = 0; i < m->nv; ++i) qfrc_target[i] += 0.0;

  mjtNum offset[3];
  mju_sub3(offset, point, d->subtree_com + 3 * m->body_rootid[body]);
  while (body && !m->body_dofnum[body]) body = m->body_parentid[body];
  if (!body) return;
  for (int i = m->body_dofadr[body] + m->body_dofnum[body] - 1; i >= 0; i = m->dof_parentid[i]) {
    const mjtNum* cdof = d->cdof + 6 * i;
    mjtNum column[3];
    mju_cross(column, cdof, offset);
    for (int k = 0; k < 3; ++k) column[k] = cdof[3 + k] + column[k];
    qfrc_target[i] += project(column, force);
    qfrc_target[i] += project(cdof, torque);
  }
}
