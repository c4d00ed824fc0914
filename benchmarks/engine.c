/* Compares the speed of engines: plays the same episodes on builds of mjenv and of MuJoCo 2.2.2.
 * Usage: engine [-s SECONDS] [-r ROUNDS] [-i ID]... [-m MODELS] LIBRARY LIBRARY...
 *   LIBRARY is a libmjenv.so or a libmujoco.so. On mjenv, a step is mjenv_step with observation, reward, ends and info.
 *   On MuJoCo, an episode begins with mj_resetData and mj_forward, and a step is frame_skip times mj_step and then
 *   mj_rnePostConstraint, on the unchanged model and without observation, reward or info. At least one LIBRARY is a
 *   libmjenv.so; the first of them records the episodes (seed 42, sampled actions) that all libraries play.
 *   MODELS is the folder of the MJCF files (assets). -i names an id and can be repeated (default: v5 of the 11 robots).
 * Prints steps per second of CPU time of the first library, and how many times as fast the others are: medians over
 * rounds in which the libraries take turns, each in its own process. Fails if the libraries reach different states.
 * Then prints, for each libmjenv.so, the milliseconds from dlopen to the end of the first step (Ant-v5). */
#include <math.h>
#include <mujoco/mujoco.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "../tests/engines/library.h"

enum { MAX_LIBRARIES = 8, MAX_IDS = 32, MAX_ROUNDS = 1000, TAPE_STEPS = 1000, MAX_ACTIONS = 32, MAX_STATE = 64 };

struct robot {
  const char *id, *model;
  int frame_skip;
};

static const struct robot known[] = {
    {"Ant", "ant", 5},
    {"HalfCheetah", "half_cheetah", 5},
    {"Hopper", "hopper", 4},
    {"Humanoid", "humanoid", 5},
    {"HumanoidStandup", "humanoidstandup", 5},
    {"InvertedDoublePendulum", "inverted_double_pendulum", 5},
    {"InvertedPendulum", "inverted_pendulum", 2},
    {"Pusher", "pusher_v5", 5},
    {"Reacher", "reacher", 2},
    {"Swimmer", "swimmer", 4},
    {"Walker2d", "walker2d_v5", 4},
};

/* The recorded episodes, which all processes share. */
struct tape {
  int starts[TAPE_STEPS]; /* an episode begins here, from the state of that number */
  double states[TAPE_STEPS + 1][MAX_STATE];
  float actions[TAPE_STEPS][MAX_ACTIONS];
  double end[MAX_STATE]; /* qpos, qvel after the last step */
  int nq, nv, nu;
};

struct work {
  int id, repeats;
};

struct player {
  const char* path;
  int work, seconds; /* pipes to and from its process */
};

static const char* ids[MAX_IDS];
static int id_count;
static const char* models = "assets";
static struct tape* tapes;

static void die(const char* what, const char* which) {
  fprintf(stderr, "engine: %s: %s\n", which, what);
  exit(1);
}

static double clock_seconds(clockid_t clock) {
  struct timespec t;
  clock_gettime(clock, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* CPU time, which other programs on the machine disturb least. */
static double now(void) { return clock_seconds(CLOCK_PROCESS_CPUTIME_ID); }

static int read_array(const struct library* library, mjenv_env* env, const char* name, double* to) {
  int64_t count;
  check(library, library->mjenv_read(env, 0, name, to, MAX_STATE / 2, &count));
  return (int)count;
}

static void seed(const struct library* library, struct episode* e) {
  const uint64_t number = 42;
  check(library, library->mjenv_seed(e->env, NULL, &number, 1));
  check(library, library->mjenv_seed_actions(e->env, number));
}

static void record(const struct library* library, const char* id, struct tape* tape) {
  struct episode e;
  episode_open(&e, library, id, 42);
  tape->nu = (int)e.action_count;
  int ended = 1;
  for (int t = 0; t < TAPE_STEPS; ++t) {
    tape->starts[t] = ended;
    if (ended) {
      episode_reset(&e, library);
      tape->nq = read_array(library, e.env, "qpos", tape->states[t]);
      tape->nv = read_array(library, e.env, "qvel", tape->states[t] + tape->nq);
    }
    ended = episode_step(&e, library);
    memcpy(tape->actions[t], e.action, sizeof(float) * (size_t)tape->nu);
  }
  read_array(library, e.env, "qpos", tape->end);
  read_array(library, e.env, "qvel", tape->end + tape->nq);
  episode_close(&e, library);
}

static void compare_end(const struct tape* tape, const double* qpos, const double* qvel, const char* path) {
  if (memcmp(tape->end, qpos, sizeof(double) * (size_t)tape->nq) ||
      memcmp(tape->end + tape->nq, qvel, sizeof(double) * (size_t)tape->nv))
    die("plays other states than the first libmjenv.so", path);
}

/* A process that plays the recorded episodes on an mjenv. */
static void serve_mjenv(const struct player* player, int work_pipe, int seconds_pipe) {
  const struct library library = library_open(player->path);
  struct episode episodes[MAX_IDS];
  for (int i = 0; i < id_count; ++i) episode_open(&episodes[i], &library, ids[i], 42);
  struct work work;
  while (read(work_pipe, &work, sizeof work) == sizeof work) {
    struct episode* e = &episodes[work.id];
    const struct tape* tape = &tapes[work.id];
    double seconds = 0;
    for (int repeat = 0; repeat < work.repeats; ++repeat) {
      seed(&library, e);
      const double start = now();
      for (int t = 0; t < TAPE_STEPS; ++t) {
        if (tape->starts[t]) episode_reset(e, &library);
        check(&library,
              library.mjenv_step(e->env, NULL, tape->actions[t], (size_t)tape->nu, MJENV_DTYPE_FLOAT32, &e->out));
      }
      seconds += now() - start;
    }
    double qpos[MAX_STATE], qvel[MAX_STATE];
    read_array(&library, e->env, "qpos", qpos);
    read_array(&library, e->env, "qvel", qvel);
    compare_end(tape, qpos, qvel, player->path);
    if (write(seconds_pipe, &seconds, sizeof seconds) != sizeof seconds) break;
  }
}

#define MUJOCO_FUNCTIONS(X) \
  X(mj_loadXML) X(mj_makeData) X(mj_resetData) X(mj_forward) X(mj_step) X(mj_rnePostConstraint)

/* A process that plays the recorded episodes on a bare MuJoCo. */
static void serve_mujoco(const struct player* player, void* handle, int work_pipe, int seconds_pipe) {
  struct {
#define X(name) __typeof__(name)* name;
    MUJOCO_FUNCTIONS(X)
#undef X
  } mj;
#define X(name) \
  if (!(*(void**)& mj.name = dlsym(handle, #name))) die("has no " #name, player->path);
  MUJOCO_FUNCTIONS(X)
#undef X
  struct {
    mjModel* m;
    mjData* d;
    int frame_skip;
  } bodies[MAX_IDS] = {{0}};
  struct work work;
  while (read(work_pipe, &work, sizeof work) == sizeof work) {
    const struct tape* tape = &tapes[work.id];
    for (size_t r = 0; !bodies[work.id].m && r < sizeof known / sizeof *known; ++r) {
      const size_t length = strlen(known[r].id);
      if (strncmp(ids[work.id], known[r].id, length) != 0 || ids[work.id][length] != '-') continue;
      char path[4096], error[1000];
      const int stock = strcmp(ids[work.id] + length, "-v4") == 0;
      snprintf(path, sizeof path, "%s/%.*s.xml", models,
               (int)(strlen(known[r].model) - (stock && strstr(known[r].model, "_v5") ? 3 : 0)), known[r].model);
      bodies[work.id].m = mj.mj_loadXML(path, NULL, error, sizeof error);
      if (!bodies[work.id].m) die(error, path);
      bodies[work.id].d = mj.mj_makeData(bodies[work.id].m);
      bodies[work.id].frame_skip = known[r].frame_skip;
    }
    const mjModel* m = bodies[work.id].m;
    mjData* d = bodies[work.id].d;
    if (!m) die("unknown id", ids[work.id]);
    const double start = now();
    for (int repeat = 0; repeat < work.repeats; ++repeat)
      for (int t = 0; t < TAPE_STEPS; ++t) {
        if (tape->starts[t]) {
          mj.mj_resetData(m, d);
          memcpy(d->qpos, tape->states[t], sizeof(double) * (size_t)m->nq);
          memcpy(d->qvel, tape->states[t] + m->nq, sizeof(double) * (size_t)m->nv);
          mj.mj_forward(m, d); /* as Gymnasium does; it warms the solver up */
        }
        for (int i = 0; i < m->nu; ++i) d->ctrl[i] = (double)tape->actions[t][i];
        for (int k = 0; k < bodies[work.id].frame_skip; ++k) mj.mj_step(m, d);
        mj.mj_rnePostConstraint(m, d);
      }
    const double seconds = now() - start;
    compare_end(tape, d->qpos, d->qvel, player->path);
    if (write(seconds_pipe, &seconds, sizeof seconds) != sizeof seconds) break;
  }
}

static void start(struct player* player) {
  int work[2], seconds[2];
  if (pipe(work) || pipe(seconds)) die("no pipe", player->path);
  if (fork() == 0) {
    close(work[1]);
    close(seconds[0]);
    void* handle = dlopen(player->path, RTLD_NOW | RTLD_LOCAL);
    if (!handle) die(dlerror(), player->path);
    if (dlsym(handle, "mj_step"))
      serve_mujoco(player, handle, work[0], seconds[1]);
    else
      serve_mjenv(player, work[0], seconds[1]);
    _exit(0);
  }
  close(work[0]);
  close(seconds[1]);
  player->work = work[1];
  player->seconds = seconds[0];
}

static double measure(const struct player* player, struct work work) {
  double seconds;
  if (write(player->work, &work, sizeof work) != sizeof work || read(player->seconds, &seconds, sizeof seconds) <= 0)
    exit(1);
  return seconds;
}

static int ascending(const void* a, const void* b) {
  const double x = *(const double*)a, y = *(const double*)b;
  return (x > y) - (x < y);
}

static double median(double* values, int count) {
  qsort(values, (size_t)count, sizeof *values, ascending);
  return count % 2 ? values[count / 2] : 0.5 * (values[count / 2 - 1] + values[count / 2]);
}

static int is_mjenv(const char* path) {
  void* handle = dlopen(path, RTLD_LAZY | RTLD_LOCAL);
  if (!handle) die(dlerror(), path);
  const int found = dlsym(handle, "mjenv_step") != NULL;
  dlclose(handle);
  return found;
}

/* Runs in a child, so that only the players' processes load a library. */
static void record_all(const char* path) {
  if (fork() == 0) {
    const struct library library = library_open(path);
    for (int i = 0; i < id_count; ++i) record(&library, ids[i], &tapes[i]);
    _exit(0);
  }
  int status;
  wait(&status);
  if (status) exit(1);
}

static double startup(const char* path) {
  double* milliseconds = mmap(NULL, sizeof(double), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  double values[9];
  for (int i = 0; i < 9; ++i) {
    if (fork() == 0) {
      const double begin = clock_seconds(CLOCK_MONOTONIC);
      const struct library library = library_open(path);
      struct episode e;
      episode_open(&e, &library, "Ant-v5", 42);
      episode_reset(&e, &library);
      episode_step(&e, &library);
      *milliseconds = 1e3 * (clock_seconds(CLOCK_MONOTONIC) - begin);
      _exit(0);
    }
    wait(NULL);
    values[i] = *milliseconds;
  }
  return median(values, 9);
}

static const char* cpu(void) {
  static char line[256];
  FILE* info = fopen("/proc/cpuinfo", "r");
  while (info && fgets(line, sizeof line, info))
    if (strncmp(line, "model name", 10) == 0) return strchr(line, ':') + 2;
  return "unknown CPU\n";
}

int main(int argc, char** argv) {
  double seconds = 0.1;
  int rounds = 15, option;
  while ((option = getopt(argc, argv, "s:r:i:m:")) != -1) {
    if (option == 's') seconds = atof(optarg);
    if (option == 'r') rounds = atoi(optarg);
    if (option == 'm') models = optarg;
    if (option == 'i' && id_count < MAX_IDS) ids[id_count++] = optarg;
  }
  static char defaults[MAX_IDS][64];
  for (size_t r = 0; !ids[r] && r < sizeof known / sizeof *known && id_count == (int)r; ++r) {
    snprintf(defaults[r], sizeof defaults[r], "%s-v5", known[r].id);
    ids[id_count++] = defaults[r];
  }
  const int count = argc - optind;
  struct player players[MAX_LIBRARIES];
  const char* recorder = NULL;
  for (int p = 0; p < count && p < MAX_LIBRARIES; ++p) {
    players[p].path = argv[optind + p];
    if (is_mjenv(players[p].path) && !recorder) recorder = players[p].path;
  }
  if (count < 2 || count > MAX_LIBRARIES || !recorder || rounds < 1 || rounds > MAX_ROUNDS || seconds <= 0) {
    fprintf(stderr, "usage: engine [-s SECONDS] [-r ROUNDS] [-i ID]... [-m MODELS] LIBRARY LIBRARY...\n");
    return 2;
  }
  tapes = mmap(NULL, MAX_IDS * sizeof *tapes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (tapes == MAP_FAILED) die("no memory", "tapes");
  record_all(recorder);
  for (int p = 0; p < count; ++p) start(&players[p]);

  static double taken[MAX_ROUNDS], ratios[MAX_LIBRARIES][MAX_ROUNDS];
  double logs[MAX_LIBRARIES] = {0};
  printf("%s", cpu());
  for (int p = 0; p < count; ++p) printf("[%d] %s\n", p, players[p].path);
  printf("%-26s %10s", "", "[0] steps/s");
  for (int p = 1; p < count; ++p) printf("  [%d]/[0]", p);
  printf("\n");
  for (int id = 0; id < id_count; ++id) {
    struct work work = {id, 1};
    for (int p = 0; p < count; ++p) measure(&players[p], work); /* loads the model, warms up */
    work.repeats = 1 + (int)(seconds / measure(&players[0], work));
    for (int r = 0; r < rounds; ++r) {
      taken[r] = measure(&players[0], work);
      for (int p = 1; p < count; ++p) ratios[p][r] = taken[r] / measure(&players[p], work);
    }
    printf("%-26s %10.0f ", ids[id], (double)work.repeats * TAPE_STEPS / median(taken, rounds));
    for (int p = 1; p < count; ++p) {
      const double ratio = median(ratios[p], rounds);
      logs[p] += log(ratio);
      printf("  %7.3f", ratio);
    }
    printf("\n");
    fflush(stdout);
  }
  printf("%-26s %10s ", "geometric mean", "");
  for (int p = 1; p < count; ++p) printf("  %7.3f", exp(logs[p] / id_count));
  printf("\n");
  for (int p = 0; p < count; ++p)
    if (is_mjenv(players[p].path)) printf("[%d] from dlopen to the first step: %.1f ms\n", p, startup(players[p].path));
  return 0;
}
