// Functions of MuJoCo 2.2.2 that mujoco.h does not list. Lanes can call them, because MuJoCo is compiled in.
#pragma once

#include <mujoco/mujoco.h>

extern "C" {
void mj_makeMSparse(const mjModel* m, mjData* d, int* rownnz, int* rowadr, int* colind);
mjtNum mju_wrap(mjtNum* wpnt, const mjtNum* x0, const mjtNum* x1, const mjtNum* xpos, const mjtNum* xmat,
                const mjtNum* size, int type, const mjtNum* side);
int mju_QCQP2(mjtNum* res, const mjtNum* Ain, const mjtNum* bin, const mjtNum* d, mjtNum r);
int mju_QCQP3(mjtNum* res, const mjtNum* Ain, const mjtNum* bin, const mjtNum* d, mjtNum r);
int mju_QCQP(mjtNum* res, const mjtNum* Ain, const mjtNum* bin, const mjtNum* d, mjtNum r, int n);
void mju_mulMatVecSparse(mjtNum* res, const mjtNum* mat, const mjtNum* vec, int nr, const int* rownnz,
                         const int* rowadr, const int* colind, const int* rowsuper);
}
