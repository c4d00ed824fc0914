// Keeps the engine from printing, exiting, running for ever and using the host's random numbers.
#include <ccd/ccd.h>
#include <mujoco/mujoco.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "qhull_ra.h"
#include "support.h"

// engine_setconst.c, which simulates muscles up to a certain time, calls this function in place of mj_step1. If the
// simulation diverges, MuJoCo restarts it at time 0, so it would never end.
void mjenv_step1(const mjModel* model, mjData* data) {
  mj_step1(model, data);
  if (data->warning[mjWARN_BADQPOS].number || data->warning[mjWARN_BADQVEL].number ||
      data->warning[mjWARN_BADQACC].number)
    mju_error("the simulation that finds the range of the actuators' lengths is unstable");
}

// libccd's search for a portal may never end if the sizes of two shapes are very different. So its calls are counted:
// engine_collision_convex.c calls mjenv_penetration in place of ccdMPRPenetration, and mpr.c calls mjenv_support in
// place of __ccdSupport.
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

// Computing convex hulls can take hours. The time in which MuJoCo connects a hull's vertices grows with the square of
// their number. And whenever qhull adds a vertex, qhull visits all vertices of the facets that change, which can be most
// vertices of the hull. So both are counted, over all meshes of a model. user_mesh.cc calls mjenv_vertexneighbors in
// place of qh_vertexneighbors, before it connects the vertices. libqhull_r.c calls mjenv_resetlists in place of
// qh_resetlists, after each new vertex.
static _Thread_local double hull_work, hull_limit;

void mjenv_limit_hulls(double limit) {
  hull_work = 0;
  hull_limit = limit;
}

int mjenv_hulls_exceeded(void) { return hull_work > hull_limit; }

static void work_on_hull(qhT* qh, double work) {
  hull_work += work;
  if (mjenv_hulls_exceeded()) qh_errexit(qh, qh_ERRinput, NULL, NULL);  // MuJoCo frees its memory
}

void mjenv_vertexneighbors(qhT* qh) {
  work_on_hull(qh, (double)qh->num_vertices * qh->num_vertices);
  qh_vertexneighbors(qh);
}

void mjenv_resetlists(qhT* qh, boolT stats, boolT resetVisible) {
  const double times_as_slow = 100;
  int changed = 0;
  for (const vertexT* vertex = qh->newvertex_list; vertex && vertex->next; vertex = vertex->next) ++changed;
  work_on_hull(qh, times_as_slow * changed);
  qh_resetlists(qh, stats, resetVisible);
}

// glibc's rand() with a state for each thread. MuJoCo seeds it before it compiles a model, so the random dots of
// textures are always the same. Each number is the sum of the third and the thirty-first before it.
enum { FIRST = 31, STEP = 3, DROPPED = 310 };
static _Thread_local uint32_t numbers[FIRST];  // the last ones, the oldest at `oldest`
static _Thread_local int oldest;

int mjenv_rand(void) {
  const uint32_t next = numbers[oldest] += numbers[(oldest + FIRST - STEP) % FIRST];
  oldest = (oldest + 1) % FIRST;
  return (int)(next >> 1);
}

void mjenv_srand(unsigned seed) {
  const int64_t prime = 2147483647;
  int64_t number = seed == 0 ? 1 : (int32_t)seed;
  for (int i = 0; i < FIRST; ++i) {
    numbers[i] = (uint32_t)number;
    number = number * 16807 % prime;
    if (number < 0) number += prime;
  }
  oldest = STEP;
  for (int i = 0; i < DROPPED; ++i) mjenv_rand();
}

// In load.cc.
void* mjenv_malloc(size_t size);
void mjenv_free(void* block);

// The functions below replace qhull's usermem_r.c and userprintf_r.c.
void* qh_malloc(size_t size) { return mjenv_malloc(size > 0 ? size : 1); }

void qh_free(void* memory) { mjenv_free(memory); }

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
