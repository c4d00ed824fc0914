/* One environment stepped from C, by worker.py's commands: single LIBRARY. */
#include <stdint.h>
#include <string.h>
#include <time.h>

#include "library.h"

enum { WARM_UP = 30, ACTIONS = 16384 };

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

struct single {
  struct episode episode;
  float* actions; /* drawn beforehand */
  long next;
};

static void step(struct single* s, const struct library* library) {
  struct episode* e = &s->episode;
  const float* action = s->actions + s->next * e->action_count;
  s->next = (s->next + 1) % ACTIONS;
  check(library, library->mjenv_step(e->env, action, (size_t)e->action_count, MJENV_FLOAT32, &e->out));
  if (e->terminated || e->truncated) episode_reset(e, library);
}

static void single_open(struct single* s, const struct library* library, const char* id, uint64_t seed) {
  episode_open(&s->episode, library, id, seed);
  const size_t count = (size_t)s->episode.action_count;
  s->actions = malloc(ACTIONS * count * sizeof *s->actions);
  for (size_t i = 0; i < ACTIONS; ++i)
    check(library, library->mjenv_sample_actions(s->episode.env, s->actions + i * count, count));
  s->next = 0;
  episode_reset(&s->episode, library);
  for (int i = 0; i < WARM_UP; ++i) step(s, library);
}

static void single_close(struct single* s, const struct library* library) {
  episode_close(&s->episode, library);
  free(s->actions);
}

static void run(struct single* s, const struct library* library, double seconds) {
  const double start = now();
  long steps = 0;
  double taken;
  do {
    for (int i = 0; i < 8; ++i) step(s, library);
    steps += 8;
    taken = now() - start;
  } while (taken < seconds);
  printf("%ld %.9f\n", steps, taken);
}

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: single LIBRARY\n");
    return 2;
  }
  const struct library library = library_open(argv[1]);
  struct single single;
  char line[256], id[64];
  unsigned long seed;
  double seconds;
  while (fgets(line, sizeof line, stdin)) {
    if (strncmp(line, "about", 5) == 0) {
      printf("mjenv %s, C\n", library.mjenv_version());
    } else if (sscanf(line, "open %63s 1 1 %lu", id, &seed) == 2) {
      single_open(&single, &library, id, seed);
      printf("ok\n");
    } else if (sscanf(line, "run %lf", &seconds) == 1) {
      run(&single, &library, seconds);
    } else if (strncmp(line, "close", 5) == 0) {
      single_close(&single, &library);
      printf("ok\n");
    } else {
      fprintf(stderr, "single: unknown command: %s", line);
      return 2;
    }
    fflush(stdout);
  }
}
