/* Plays three seeded episodes of each id with a library that it loads at run time by dlopen.
 *
 *   episodes LIBRARY NORM ID...
 *
 * Prints ID, steps, return, steps per second and a checksum over every bit of every output, separated by tabs. */
#define _POSIX_C_SOURCE 200809L
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "mjenv/mjenv.h"

enum { EPISODES = 3, SEED = 42 };

/* The functions that this program uses; each pointer has the type that mjenv.h declares. */
#define FUNCTIONS(X)          \
  X(mjenv_abi_version)        \
  X(mjenv_last_error)         \
  X(mjenv_options_create)     \
  X(mjenv_options_set_string) \
  X(mjenv_options_destroy)    \
  X(mjenv_create)             \
  X(mjenv_destroy)            \
  X(mjenv_space_of)           \
  X(mjenv_field_count)        \
  X(mjenv_field_at)           \
  X(mjenv_seed)               \
  X(mjenv_seed_actions)       \
  X(mjenv_sample_actions)     \
  X(mjenv_reset)              \
  X(mjenv_step)

#define X(name) static __typeof__(name)* p_##name;
FUNCTIONS(X)
#undef X

static void load(const char* path) {
  void* library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) {
    fprintf(stderr, "%s\n", dlerror());
    exit(1);
  }
#define X(name) *(void**)&p_##name = dlsym(library, #name);
  FUNCTIONS(X)
#undef X
  if (!p_mjenv_abi_version || p_mjenv_abi_version() != MJENV_ABI_VERSION) {
    fprintf(stderr, "%s does not have the ABI of mjenv.h\n", path);
    exit(1);
  }
}

static void check(mjenv_status status) {
  if (status == MJENV_OK) return;
  fprintf(stderr, "%s\n", p_mjenv_last_error());
  exit(1);
}

static void* allocate(size_t count, size_t size) {
  void* memory = calloc(count ? count : 1, size);
  if (!memory) exit(1);
  return memory;
}

static int64_t count_of(const mjenv_env* env, mjenv_role role) {
  int64_t total = 0;
  for (int64_t i = 0; i < p_mjenv_field_count(env, role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    check(p_mjenv_field_at(env, role, i, &field));
    total += field.count;
  }
  return total;
}

static uint64_t mix(uint64_t hash, const double* values, int64_t count) {
  for (int64_t i = 0; i < count; ++i) {
    uint64_t word;
    memcpy(&word, &values[i], sizeof word);
    hash = (hash ^ word) * 0x100000001b3u;
  }
  return hash;
}

static uint64_t mix_flag(uint64_t hash, uint8_t flag) { return (hash ^ flag) * 0x100000001b3u; }

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void play(const char* id, const char* norm) {
  mjenv_options* options;
  mjenv_env* env;
  check(p_mjenv_options_create(id, &options));
  check(p_mjenv_options_set_string(options, "norm", norm));
  check(p_mjenv_create(options, 1, &env));
  p_mjenv_options_destroy(options);

  mjenv_space observations = MJENV_SPACE_INIT, actions = MJENV_SPACE_INIT;
  check(p_mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &observations));
  check(p_mjenv_space_of(env, MJENV_ROLE_ACTION, &actions));
  const int64_t info_count = count_of(env, MJENV_ROLE_INFO), reset_info_count = count_of(env, MJENV_ROLE_RESET_INFO);
  double* obs = allocate((size_t)observations.count, sizeof *obs);
  double* info = allocate((size_t)info_count, sizeof *info);
  double* reset_info = allocate((size_t)reset_info_count, sizeof *reset_info);
  float* action = allocate((size_t)actions.count, sizeof *action);
  double reward, total = 0;
  uint8_t terminated, truncated;
  mjenv_batch out = MJENV_BATCH_INIT;
  out.rows = 1;
  out.obs_count = observations.count;
  out.info_count = info_count;
  out.reset_info_count = reset_info_count;
  out.obs = obs;
  out.reward = &reward;
  out.terminated = &terminated;
  out.truncated = &truncated;
  out.info = info;
  out.reset_info = reset_info;

  const uint64_t seed = SEED;
  uint64_t hash = 0xcbf29ce484222325u;
  long steps = 0;
  const double start = now();
  check(p_mjenv_seed(env, NULL, &seed, 1));
  check(p_mjenv_seed_actions(env, seed));
  for (int episode = 0; episode < EPISODES; ++episode) {
    check(p_mjenv_reset(env, NULL, &out));
    hash = mix(mix(hash, obs, observations.count), reset_info, reset_info_count);
    do {
      check(p_mjenv_sample_actions(env, action, actions.count));
      check(p_mjenv_step(env, NULL, action, actions.count, MJENV_DTYPE_FLOAT32, &out));
      hash = mix(mix(hash, obs, observations.count), &reward, 1);
      hash = mix(mix_flag(mix_flag(hash, terminated), truncated), info, info_count);
      total += reward;
      ++steps;
    } while (!terminated && !truncated);
  }
  printf("%s\t%ld\t%a\t%.0f\t%016llx\n", id, steps, total, (double)steps / (now() - start), (unsigned long long)hash);
  fflush(stdout);
  p_mjenv_destroy(env);
  free(obs);
  free(info);
  free(reset_info);
  free(action);
}

int main(int argc, char** argv) {
  if (argc < 4) {
    fprintf(stderr, "usage: %s LIBRARY plain|fused ID...\n", argv[0]);
    return 2;
  }
  load(argv[1]);
  for (int i = 3; i < argc; ++i) play(argv[i], argv[2]);
  return 0;
}
