/* Steps environments from C on request: steps LIBRARY [HORIZON]. Reads commands from stdin and writes answers to stdout.
 * about -> what runs here | open ID ENVS THREADS SEED -> ok | run SECONDS -> env steps and seconds taken | close -> ok
 * The actions are drawn before measuring. The program resets a single environment; many environments reset
 * themselves. With HORIZON it plans: it rolls out that many steps in all rows, each time from the same state. */
#include <dlfcn.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#include "library.h"

enum { WARM_UP = 30, ACTIONS = 16384, AT_LEAST = 64 };

struct work {
  mjenv_env* env;
  mjenv_batch out;
  float* actions;
  size_t count; /* of one step's actions */
  long steps, next;
  long horizon; /* 0: no rollouts */
  void* image;  /* the state from which a rollout starts */
  int64_t image_size;
  mjenv_batch plan; /* what a rollout writes */
};

static mjenv_status (*set_integer)(mjenv_options*, const char*, int64_t);
static mjenv_status (*set_string)(mjenv_options*, const char*, const char*);

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static mjenv_status (*snapshot)(mjenv_env*, int64_t, void*, int64_t, int64_t*);
static mjenv_status (*restore)(mjenv_env*, int64_t, const void*, int64_t);
static mjenv_status (*rollout)(mjenv_env*, const void*, int64_t, mjenv_dtype, int64_t, const mjenv_batch*);

static void work_roll_out(struct work* w, const struct library* library) {
  check(library, restore(w->env, MJENV_ALL_ROWS, w->image, w->image_size));
  w->next = (w->next + 1) % (w->steps - w->horizon + 1);
  check(library, rollout(w->env, w->actions + (size_t)w->next * w->count, w->count * (size_t)w->horizon,
                         MJENV_DTYPE_FLOAT32, w->horizon, &w->plan));
}

static void step(struct work* w, const struct library* library) {
  if (w->horizon > 0) {
    work_roll_out(w, library);
    return;
  }
  const float* action = w->actions + (size_t)w->next * w->count;
  w->next = (w->next + 1) % w->steps;
  check(library, library->mjenv_step(w->env, NULL, action, w->count, MJENV_DTYPE_FLOAT32, &w->out));
  if (w->out.rows == 1 && (*w->out.terminated || *w->out.truncated))
    check(library, library->mjenv_reset(w->env, NULL, &w->out));
}

static void work_open(struct work* w, const struct library* library, const char* id, int64_t rows, long threads,
                      uint64_t seed) {
  mjenv_options* options;
  check(library, library->mjenv_options_create(id, &options));
  check(library, set_integer(options, "num_threads", threads));
  if (rows > 1) check(library, set_string(options, "autoreset_mode", "next_step"));
  check(library, library->mjenv_create(options, rows, &w->env));
  library->mjenv_options_destroy(options);

  const size_t n = (size_t)rows;
  w->out = (mjenv_batch)MJENV_BATCH_INIT;
  w->out.rows = rows;
  w->out.obs_count = space_count(library, w->env, MJENV_ROLE_OBSERVATION);
  w->out.info_count = info_count(library, w->env, MJENV_ROLE_INFO);
  w->out.reset_info_count = info_count(library, w->env, MJENV_ROLE_RESET_INFO);
  w->out.obs = calloc(n * (size_t)w->out.obs_count, sizeof(double));
  w->out.reward = calloc(n, sizeof(double));
  w->out.terminated = calloc(n, 1);
  w->out.truncated = calloc(n, 1);
  w->out.info = calloc(n * (size_t)w->out.info_count + 1, sizeof(double));
  w->out.reset_info = calloc(n * (size_t)w->out.reset_info_count + 1, sizeof(double));

  w->count = n * (size_t)space_count(library, w->env, MJENV_ROLE_ACTION);
  w->steps = ACTIONS / rows > AT_LEAST ? ACTIONS / rows : AT_LEAST;
  w->next = 0;
  w->actions = malloc((size_t)w->steps * w->count * sizeof *w->actions);
  check(library, library->mjenv_seed_actions(w->env, seed));
  for (long i = 0; i < w->steps; ++i)
    check(library, library->mjenv_sample_actions(w->env, w->actions + (size_t)i * w->count, w->count));

  uint64_t* seeds = malloc(n * sizeof *seeds);
  for (size_t i = 0; i < n; ++i) seeds[i] = seed + i;
  check(library, library->mjenv_seed(w->env, NULL, seeds, (int64_t)n));
  free(seeds);
  check(library, library->mjenv_reset(w->env, NULL, &w->out));
  if (w->horizon > 0) {
    check(library, snapshot(w->env, MJENV_ALL_ROWS, NULL, 0, &w->image_size));
    w->image = malloc((size_t)w->image_size);
    check(library, snapshot(w->env, MJENV_ALL_ROWS, w->image, w->image_size, &w->image_size));
    w->plan = (mjenv_batch)MJENV_BATCH_INIT;
    w->plan.rows = rows * w->horizon;
    w->plan.reward = calloc(n * (size_t)w->horizon, sizeof(double));
  }
  for (int i = 0; i < WARM_UP; ++i) step(w, library);
}

static void work_close(struct work* w, const struct library* library) {
  library->mjenv_destroy(w->env);
  free(w->actions), free(w->out.obs), free(w->out.reward), free(w->out.terminated), free(w->out.truncated);
  free(w->out.info), free(w->out.reset_info), free(w->image), free(w->plan.reward);
}

static void run(struct work* w, const struct library* library, double seconds) {
  const int at_once = w->out.rows < 8 ? 8 : 1; /* between two looks at the clock */
  const double start = now();
  long steps = 0;
  double taken;
  do {
    for (int i = 0; i < at_once; ++i) step(w, library);
    steps += at_once;
    taken = now() - start;
  } while (taken < seconds);
  printf("%ld %.9f\n", steps * (long)w->out.rows * (w->horizon > 0 ? w->horizon : 1), taken);
}

int main(int argc, char** argv) {
  if (argc != 2 && argc != 3) {
    fprintf(stderr, "usage: steps LIBRARY [HORIZON]\n");
    return 2;
  }
  const struct library library = library_open(argv[1]);
  void* handle = dlopen(argv[1], RTLD_NOW);
  *(void**)&set_integer = dlsym(handle, "mjenv_options_set_integer");
  *(void**)&set_string = dlsym(handle, "mjenv_options_set_string");
  *(void**)&snapshot = dlsym(handle, "mjenv_snapshot");
  *(void**)&restore = dlsym(handle, "mjenv_restore");
  *(void**)&rollout = dlsym(handle, "mjenv_rollout");
  struct work work = {.horizon = argc > 2 ? atol(argv[2]) : 0};
  char line[256], id[64];
  long rows, threads;
  unsigned long seed;
  double seconds;
  while (fgets(line, sizeof line, stdin)) {
    if (strncmp(line, "about", 5) == 0) {
      printf("mjenv %s, C\n", library.mjenv_version());
    } else if (sscanf(line, "open %63s %ld %ld %lu", id, &rows, &threads, &seed) == 4) {
      work_open(&work, &library, id, rows, threads, seed);
      printf("ok\n");
    } else if (sscanf(line, "run %lf", &seconds) == 1) {
      run(&work, &library, seconds);
    } else if (strncmp(line, "close", 5) == 0) {
      work_close(&work, &library);
      printf("ok\n");
    } else {
      fprintf(stderr, "steps: unknown command: %s", line);
      return 2;
    }
    fflush(stdout);
  }
}
