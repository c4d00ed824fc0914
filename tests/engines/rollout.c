/* Steps ids under sampled actions and prints a checksum over every bit that a build of the library gives: those of the
 * observations, rewards, ends and infos of each reset and step, and of the arrays of mjData and mjModel at the end.
 * Usage: rollout LIBRARY STEPS [--tasks PLUGIN] [ID...]     (all ids if none is named; with PLUGIN, those of its tasks) */
#include <string.h>

#include "library.h"

static uint64_t checksum;

static void add(uint64_t word) {
  checksum = (checksum ^ word) * 0x100000001b3;
  checksum ^= checksum >> 32;
}

static void add_reals(const double* values, int64_t count) {
  for (int64_t i = 0; i < count; ++i) {
    uint64_t word;
    memcpy(&word, &values[i], sizeof word);
    add(word);
  }
}

static void add_arrays(const struct library* library, mjenv_env* env, mjenv_role role) {
  for (int64_t i = 0; i < library->mjenv_field_count(env, role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    check(library, library->mjenv_field_at(env, role, i, &field));
    const size_t count = (size_t)field.count;
    double* values = calloc(count + 1, sizeof *values);
    int64_t length;
    check(library, library->mjenv_read(env, 0, field.name, values, count + 1, &length));
    add_reals(values, (int64_t)length);
    free(values);
  }
}

static void roll(const struct library* library, const char* id, long steps) {
  struct episode e;
  episode_open(&e, library, id, 42);
  checksum = 0xcbf29ce484222325;
  int ended = 1;
  for (long t = 0; t < steps; ++t) {
    if (ended) {
      episode_reset(&e, library);
      add_reals(e.out.obs, e.out.obs_count);
      add_reals(e.out.reset_info, e.out.reset_info_count);
    }
    ended = episode_step(&e, library);
    add_reals(e.out.obs, e.out.obs_count);
    add_reals(&e.reward, 1);
    add(e.terminated);
    add(e.truncated);
    add_reals(e.out.info, e.out.info_count);
  }
  add_arrays(library, e.env, MJENV_ROLE_DATA);
  add_arrays(library, e.env, MJENV_ROLE_MODEL);
  episode_close(&e, library);
  printf("%s %016llx\n", id, (unsigned long long)checksum);
}

int main(int argc, char** argv) {
  if (argc < 3) {
    fprintf(stderr, "usage: rollout LIBRARY STEPS [--tasks PLUGIN] [ID...]\n");
    return 2;
  }
  const struct library library = library_open(argv[1]);
  const long steps = strtol(argv[2], NULL, 10);
  int named = 3;
  int64_t first = 0;
  if (argc > 4 && strcmp(argv[3], "--tasks") == 0) {
    first = library.mjenv_id_count();
    check(&library, library.mjenv_load_tasks(argv[4]));
    named = 5;
  }
  for (int i = named; i < argc; ++i) roll(&library, argv[i], steps);
  if (argc == named)
    for (int64_t i = first; i < library.mjenv_id_count(); ++i) roll(&library, library.mjenv_id_at(i), steps);
  return 0;
}
