/* A libmjenv opened by its path, so that one program can try several builds. */
#pragma once

#include <dlfcn.h>
#include <mjenv/mjenv.h>
#include <mjenv/task.h>
#include <stdio.h>
#include <stdlib.h>

#define MJENV_FUNCTIONS(X) \
  X(mjenv_version)         \
  X(mjenv_last_error)      \
  X(mjenv_id_count)        \
  X(mjenv_id_at)           \
  X(mjenv_options_create)  \
  X(mjenv_options_destroy) \
  X(mjenv_create)          \
  X(mjenv_destroy)         \
  X(mjenv_space_of)        \
  X(mjenv_field_count)     \
  X(mjenv_field_at)        \
  X(mjenv_seed)            \
  X(mjenv_reset)           \
  X(mjenv_step)            \
  X(mjenv_seed_actions)    \
  X(mjenv_sample_actions)  \
  X(mjenv_load_tasks)      \
  X(mjenv_read)

struct library {
#define X(name) __typeof__(name)* name;
  MJENV_FUNCTIONS(X)
#undef X
};

static inline struct library library_open(const char* path) {
  struct library library;
  void* handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!handle) {
    fprintf(stderr, "%s\n", dlerror());
    exit(1);
  }
#define X(name) *(void**)&library.name = dlsym(handle, #name);
  MJENV_FUNCTIONS(X)
#undef X
  return library;
}

static inline void check(const struct library* library, mjenv_status status) {
  if (status == MJENV_OK) return;
  fprintf(stderr, "%s\n", library->mjenv_last_error());
  exit(1);
}

/* One row of an id at its default options, seeded, with arrays for what it takes and gives. */
struct episode {
  mjenv_env* env;
  mjenv_batch out;
  int64_t action_count;
  float* action;
  double reward;
  uint8_t terminated, truncated;
};

static inline int64_t info_count(const struct library* library, const mjenv_env* env, mjenv_role role) {
  int64_t total = 0;
  for (int64_t i = 0; i < library->mjenv_field_count(env, role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    check(library, library->mjenv_field_at(env, role, i, &field));
    total += field.count;
  }
  return total;
}

static inline int64_t space_count(const struct library* library, const mjenv_env* env, mjenv_role role) {
  mjenv_space space = MJENV_SPACE_INIT;
  check(library, library->mjenv_space_of(env, role, &space));
  return space.count;
}

static inline void episode_open(struct episode* e, const struct library* library, const char* id, uint64_t seed) {
  mjenv_options* options;
  check(library, library->mjenv_options_create(id, &options));
  check(library, library->mjenv_create(options, 1, &e->env));
  library->mjenv_options_destroy(options);
  e->action_count = space_count(library, e->env, MJENV_ROLE_ACTION);
  e->action = calloc((size_t)e->action_count, sizeof *e->action);
  e->out = (mjenv_batch){.struct_size = sizeof e->out,
                         .obs_dtype = MJENV_DTYPE_FLOAT64,
                         .rows = 1,
                         .obs_count = space_count(library, e->env, MJENV_ROLE_OBSERVATION),
                         .info_count = info_count(library, e->env, MJENV_ROLE_INFO),
                         .reset_info_count = info_count(library, e->env, MJENV_ROLE_RESET_INFO),
                         .reward = &e->reward,
                         .terminated = &e->terminated,
                         .truncated = &e->truncated};
  e->out.obs = calloc((size_t)e->out.obs_count, sizeof(double));
  e->out.info = calloc((size_t)e->out.info_count, sizeof(double));
  e->out.reset_info = calloc((size_t)e->out.reset_info_count, sizeof(double));
  check(library, library->mjenv_seed(e->env, NULL, &seed, 1));
  check(library, library->mjenv_seed_actions(e->env, seed));
}

static inline void episode_reset(struct episode* e, const struct library* library) {
  check(library, library->mjenv_reset(e->env, NULL, &e->out));
}

/* Steps under a sampled action; returns whether the episode ended. */
static inline int episode_step(struct episode* e, const struct library* library) {
  const size_t count = (size_t)e->action_count;
  check(library, library->mjenv_sample_actions(e->env, e->action, count));
  check(library, library->mjenv_step(e->env, NULL, e->action, count, MJENV_DTYPE_FLOAT32, &e->out));
  return e->terminated || e->truncated;
}

static inline void episode_close(struct episode* e, const struct library* library) {
  library->mjenv_destroy(e->env);
  free(e->action);
  free(e->out.obs);
  free(e->out.info);
  free(e->out.reset_info);
}
