/* Measures what environments take, from C: create seconds|bytes LIBRARY ID ENVS THREADS
 * "seconds" prints how long the first and the second creation take. "bytes" prints the memory of one environment for
 * each thread and the memory of all, both with the work spaces of the threads. */
#include <dlfcn.h>
#include <math.h>
#include <stdint.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "library.h"

enum { AGAIN = 5, STEPS = 3 };

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double resident(void) {
  long pages = 0;
  FILE* file = fopen("/proc/self/statm", "r");
  if (!file || fscanf(file, "%*s %ld", &pages) != 1) exit(1);
  fclose(file);
  return (double)pages * (double)sysconf(_SC_PAGESIZE);
}

/* Allocates memory and writes to it, so that the system really provides it. */
static void* touched(size_t bytes) {
  void* memory = malloc(bytes);
  if (!memory) exit(1);
  memset(memory, 1, bytes);
  return memory;
}

/* Resets and steps; returns how many bytes the process has grown by, without the arrays of outputs. */
static double play(const struct library* library, mjenv_env* env, int64_t rows) {
  const size_t n = (size_t)rows, actions = n * (size_t)space_count(library, env, MJENV_ROLE_ACTION);
  mjenv_batch out = MJENV_BATCH_INIT;
  out.rows = rows;
  out.obs_count = space_count(library, env, MJENV_ROLE_OBSERVATION);
  out.info_count = info_count(library, env, MJENV_ROLE_INFO);
  const int64_t reset_info_count = info_count(library, env, MJENV_ROLE_RESET_INFO);
  float* action = touched(actions * sizeof *action);
  out.obs = touched(n * (size_t)out.obs_count * sizeof(double));
  out.info = touched(n * (size_t)out.info_count * sizeof(double));
  out.reset_info_count = reset_info_count;
  out.reset_info = touched(n * (size_t)reset_info_count * sizeof(double));
  out.reward = touched(n * sizeof(double));
  out.terminated = touched(n);
  out.truncated = touched(n);

  const double before = resident();
  check(library, library->mjenv_reset(env, NULL, &out));
  check(library, library->mjenv_seed_actions(env, 1));
  for (int i = 0; i < STEPS; ++i) {
    check(library, library->mjenv_sample_actions(env, action, actions));
    check(library, library->mjenv_step(env, NULL, action, actions, MJENV_DTYPE_FLOAT32, &out));
  }
  return resident() - before;
}

static double seconds_to_create(const struct library* library, const mjenv_options* options, int64_t rows) {
  mjenv_env* env;
  const double start = now();
  check(library, library->mjenv_create(options, rows, &env));
  const double seconds = now() - start;
  library->mjenv_destroy(env);
  return seconds;
}

static void time_creation(const struct library* library, const mjenv_options* options, int64_t rows) {
  const double first = seconds_to_create(library, options, rows);
  double again = INFINITY;
  for (int i = 0; i < AGAIN; ++i) again = fmin(again, seconds_to_create(library, options, rows));
  printf("%.6f %.6f\n", first, again);
}

/* What a created, reset and stepped environment has added to the process, the arrays that it writes left out. */
static double bytes_of(const struct library* library, const mjenv_options* options, int64_t rows) {
  mjenv_env* env;
  const double before = resident();
  check(library, library->mjenv_create(options, rows, &env));
  return resident() - before + play(library, env, rows);
}

int main(int argc, char** argv) {
  if (argc != 6) {
    fprintf(stderr, "usage: create seconds|bytes LIBRARY ID ENVS THREADS\n");
    return 2;
  }
  const struct library library = library_open(argv[2]);
  mjenv_status (*set_integer)(mjenv_options*, const char*, int64_t);
  *(void**)&set_integer = dlsym(dlopen(argv[2], RTLD_NOW), "mjenv_options_set_integer");
  mjenv_options* options;
  check(&library, library.mjenv_options_create(argv[3], &options));
  check(&library, set_integer(options, "num_threads", atol(argv[5])));
  const int64_t rows = atol(argv[4]);
  if (strcmp(argv[1], "seconds") == 0) {
    time_creation(&library, options, rows);
  } else {
    const double few = bytes_of(&library, options, atol(argv[5])); /* with what the library holds once */
    const double many = bytes_of(&library, options, rows);
    printf("%.0f %.0f\n", few, many);
  }
  library.mjenv_options_destroy(options);
}
