/* Compares builds of the library: steps per second of CPU time of the first, and how many times as fast the others are.
 * Usage: builds [-s SECONDS] [-r ROUNDS] [-i ID]... LIBRARY LIBRARY...
 * Every build does the same work (the same seeds, the same sampled actions, resets included) in a process of its own;
 * the builds take turns, and a figure is the median over the rounds. */
#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "library.h"

enum { MAX_BUILDS = 8, MAX_IDS = 32, MAX_ROUNDS = 1000 };

struct work {
  int id;
  long steps;
};

struct build {
  int work, seconds; /* pipes to and from its process */
};

static const char* ids[MAX_IDS] = {"Ant-v5",
                                   "HalfCheetah-v5",
                                   "Hopper-v5",
                                   "Humanoid-v5",
                                   "HumanoidStandup-v5",
                                   "InvertedDoublePendulum-v5",
                                   "InvertedPendulum-v5",
                                   "Pusher-v5",
                                   "Reacher-v5",
                                   "Swimmer-v5",
                                   "Walker2d-v5"};
static int id_count = 11;

/* CPU time, which other programs on the machine disturb least. */
static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double run(const struct library* library, struct episode* e, long steps) {
  const uint64_t seed = 42;
  check(library, library->mjenv_seed(e->env, &seed, NULL));
  check(library, library->mjenv_seed_actions(e->env, seed));
  const double start = now();
  int ended = 1;
  for (long t = 0; t < steps; ++t) {
    if (ended) episode_reset(e, library);
    ended = episode_step(e, library);
  }
  return now() - start;
}

static void serve(const char* path, int work_pipe, int seconds_pipe) {
  const struct library library = library_open(path);
  struct episode episodes[MAX_IDS];
  for (int i = 0; i < id_count; ++i) episode_open(&episodes[i], &library, ids[i], 42);
  struct work work;
  while (read(work_pipe, &work, sizeof work) == sizeof work) {
    const double seconds = run(&library, &episodes[work.id], work.steps);
    if (write(seconds_pipe, &seconds, sizeof seconds) != sizeof seconds) break;
  }
  for (int i = 0; i < id_count; ++i) episode_close(&episodes[i], &library);
}

static struct build start(const char* path) {
  int work[2], seconds[2];
  if (pipe(work) || pipe(seconds)) exit(1);
  if (fork() == 0) {
    close(work[1]);
    close(seconds[0]);
    serve(path, work[0], seconds[1]);
    exit(0);
  }
  close(work[0]);
  close(seconds[1]);
  return (struct build){work[1], seconds[0]};
}

static double measure(struct build build, struct work work) {
  double seconds;
  if (write(build.work, &work, sizeof work) != sizeof work || read(build.seconds, &seconds, sizeof seconds) <= 0)
    exit(1);
  return seconds;
}

/* How many steps the build does in about the given time. */
static long steps_in(struct build build, int id, double seconds) {
  long steps = 32;
  double taken;
  while ((taken = measure(build, (struct work){id, steps})) < 0.02) steps *= 2;
  return (long)((double)steps * seconds / taken) + 1;
}

static int ascending(const void* a, const void* b) {
  const double x = *(const double*)a, y = *(const double*)b;
  return (x > y) - (x < y);
}

static double median(double* values, int count) {
  qsort(values, (size_t)count, sizeof *values, ascending);
  return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

int main(int argc, char** argv) {
  double seconds = 0.1;
  int rounds = 15, named = 0, option;
  while ((option = getopt(argc, argv, "s:r:i:")) != -1) {
    if (option == 's') seconds = atof(optarg);
    if (option == 'r') rounds = atoi(optarg);
    if (option == 'i' && named < MAX_IDS) ids[named++] = optarg;
  }
  if (named) id_count = named;
  const int build_count = argc - optind;
  if (build_count < 2 || build_count > MAX_BUILDS || rounds < 1 || rounds > MAX_ROUNDS || seconds <= 0) {
    fprintf(stderr, "usage: builds [-s SECONDS] [-r ROUNDS] [-i ID]... LIBRARY LIBRARY...\n");
    return 2;
  }
  struct build builds[MAX_BUILDS];
  for (int b = 0; b < build_count; ++b) builds[b] = start(argv[optind + b]);

  static double taken[MAX_ROUNDS], ratios[MAX_BUILDS][MAX_ROUNDS];
  double logs[MAX_BUILDS] = {0};
  printf("%-26s %10s", "", "steps/s");
  for (int b = 1; b < build_count; ++b) printf("  [%d]/[0]", b);
  printf("\n");
  for (int id = 0; id < id_count; ++id) {
    const struct work work = {id, steps_in(builds[0], id, seconds)};
    for (int r = 0; r < rounds; ++r) {
      taken[r] = measure(builds[0], work);
      for (int b = 1; b < build_count; ++b) ratios[b][r] = taken[r] / measure(builds[b], work);
    }
    printf("%-26s %10.0f", ids[id], (double)work.steps / median(taken, rounds));
    for (int b = 1; b < build_count; ++b) {
      const double ratio = median(ratios[b], rounds);
      logs[b] += log(ratio);
      printf("  %7.3f", ratio);
    }
    printf("\n");
    fflush(stdout);
  }
  printf("%-26s %10s", "geometric mean", "");
  for (int b = 1; b < build_count; ++b) printf("  %7.3f", exp(logs[b] / id_count));
  printf("\n");
  return 0;
}
