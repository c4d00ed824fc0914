// What keeps the engine from printing, exiting and running for ever.
#include <ccd/ccd.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>

#include "libqhull_r.h"
#include "support.h"

// engine_setconst.c calls it for mj_step1. It simulates muscles until some time has passed, but where the simulation
// diverges, MuJoCo begins it anew, at time 0, and so on for ever.
void mjenv_step1(const mjModel* model, mjData* data) {
  mj_step1(model, data);
  if (data->warning[mjWARN_BADQPOS].number || data->warning[mjWARN_BADQVEL].number ||
      data->warning[mjWARN_BADQACC].number)
    mju_error("the simulation that finds the range of the actuators' lengths is unstable");
}

// libccd's search for a portal can go round in circles, on shapes of very unlike sizes. So its calls are counted:
// engine_collision_convex.c calls mjenv_penetration for ccdMPRPenetration, and mpr.c mjenv_support for __ccdSupport.
struct counted {
  ccd_t ccd;
  unsigned long calls;
};

int mjenv_penetration(const void* a, const void* b, const ccd_t* ccd, ccd_real_t* depth, ccd_vec3_t* dir,
                      ccd_vec3_t* pos) {
  struct counted counted = {*ccd, 0};
  return ccdMPRPenetration(a, b, &counted.ccd, depth, dir, pos);
}

void mjenv_support(const void* a, const void* b, const ccd_vec3_t* dir, const ccd_t* ccd, ccd_support_t* found) {
  struct counted* counted = (struct counted*)ccd;
  if (++counted->calls > 1000 + 4 * ccd->max_iterations) mju_error("the search for a contact does not end");
  __ccdSupport(a, b, dir, ccd, found);
}

// The rest replaces qhull's usermem_r.c and userprintf_r.c.
void* qh_malloc(size_t size) { return malloc(size); }

void qh_free(void* memory) { free(memory); }

// MuJoCo's error handler does not return.
void qh_exit(int code) {
  (void)code;
  mju_error("qhull failed");
  abort();
}

void qh_fprintf_stderr(int code, const char* format, ...) {
  (void)code;
  (void)format;
}

void qh_fprintf(qhT* qh, FILE* file, int code, const char* format, ...) {
  (void)qh;
  (void)file;
  (void)code;
  (void)format;
}
