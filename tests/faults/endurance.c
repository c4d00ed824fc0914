// Again and again: what a process holds does not grow.
//   test_endurance [long]    long: 100,000 environments, ten million steps
#include <dirent.h>
#include <dlfcn.h>
#include <malloc.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "golden.h"

enum { SCATTER = 1024 /* KB, of the allocator's own */ };

static int64_t environments = 600, steps = 200000;

static double seconds(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static int count_entries(const char* folder) {
  DIR* directory = opendir(folder);
  assert_non_null(directory);
  int count = 0;
  while (readdir(directory)) ++count;
  closedir(directory);
  return count;
}

static long resident_kilobytes(void) {
  long pages = 0, resident = 0;
  FILE* file = fopen("/proc/self/statm", "r");
  assert_non_null(file);
  assert_int_equal(fscanf(file, "%ld %ld", &pages, &resident), 2);
  fclose(file);
  return resident * (sysconf(_SC_PAGESIZE) / 1024);
}

struct held {
  long kilobytes, heap;  // resident; bytes in blocks that are not freed
  int threads, files;
};

static struct held held(void) {
  malloc_trim(0);  // what is free but kept at hand is not held
  const struct mallinfo2 heap = mallinfo2();
  return (struct held){resident_kilobytes(), (long)(heap.uordblks + heap.hblkhd), count_entries("/proc/self/task"),
                       count_entries("/proc/self/fd")};
}

// kilobytes: by which what is resident scatters; heap: bytes that may have been added.
static void assert_held(const char* after, struct held before, long kilobytes, long heap) {
  const struct held now = held();
  print_message("%s: %ld KB resident, %ld bytes of heap; before %ld KB, %ld bytes\n", after, now.kilobytes, now.heap,
                before.kilobytes, before.heap);
  assert_int_equal(now.threads, before.threads);
  assert_int_equal(now.files, before.files);
  if (now.heap > before.heap + heap) fail_msg("%ld bytes more of heap after %s", now.heap - before.heap, after);
  if (now.kilobytes > before.kilobytes + kilobytes)
    fail_msg("%ld KB more resident after %s", now.kilobytes - before.kilobytes, after);
}

// ---- Environments ----

static void create_and_destroy(int64_t i) {
  static const char* const ids[] = {"Reacher-v5", "InvertedPendulum-v4", "Hopper-v5", "Swimmer-v4", "Ant-v5"};
  static unsigned char image[1 << 14];
  const char* id = ids[i % (int64_t)COUNT(ids)];
  const int64_t rows = 1 + i % 3;
  mjenv_options* options = options_of_id(id);
  if (i % 7 == 0) assert_ok(mjenv_options_set_integer(options, "num_threads", 2));
  mjenv_env* env = env_of_options(options, rows);
  int64_t size = 0;
  assert_ok(mjenv_reset(env, NULL, NULL));
  if (i % 11 == 0) assert_ok(mjenv_snapshot(env, 0, image, sizeof image, &size));
  // Under way when it is destroyed.
  const float action[3 * 8] = {0};
  const size_t count = (size_t)(rows * action_count(env));
  if (i % 5 == 0) assert_ok(mjenv_send(env, NULL, 0, action, count, MJENV_DTYPE_FLOAT32));
  mjenv_destroy(env);
}

static void test_environments(void** state) {
  (void)state;
  const double start = seconds();
  const int64_t warm_up = 150;
  for (int64_t i = 0; i < warm_up; ++i) create_and_destroy(i);
  const struct held before = held();
  for (int64_t i = 0; i < environments; ++i) create_and_destroy(i);
  print_message("%" PRId64 " environments in %.0f s\n", environments, seconds() - start);
  assert_held("environments", before, SCATTER, 0);
}

// Bad input, whose messages are allocated.
static void test_errors(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  struct held before = {0};
  for (int64_t i = -1000; i < steps / 10; ++i) {
    double values[4];
    int64_t count;
    mjenv_options* options = NULL;
    if (i == 0) before = held();
    assert_int_equal(mjenv_step(env, NULL, values, 3, MJENV_DTYPE_FLOAT64, NULL), MJENV_E_NOT_RESET);
    assert_int_equal(mjenv_read(env, 0, "nothing", values, 4, &count), MJENV_E_NAME);
    assert_int_equal(mjenv_options_create("nothing", &options), MJENV_E_NAME);
    assert_int_equal(mjenv_restore(env, 0, values, sizeof values), MJENV_E_SNAPSHOT);
  }
  assert_held("errors", before, SCATTER, 0);
  mjenv_destroy(env);
}

// ---- Steps ----

static void play(mjenv_env* env, struct outputs* out, int64_t count, size_t actions) {
  float action[64];
  uint8_t ended[8];
  for (int64_t step = 0; step < count; ++step) {
    assert_ok(mjenv_sample_actions(env, action, actions));
    assert_ok(mjenv_step(env, NULL, action, actions, MJENV_DTYPE_FLOAT32, &out->batch));
    bool any = false;
    for (int64_t row = 0; row < out->rows; ++row) any |= ended[row] = out->terminated[row] || out->truncated[row];
    if (any) assert_ok(mjenv_reset(env, ended, NULL));
  }
}

static void test_steps(void** state) {
  (void)state;
  enum { ROWS = 4, ROUNDS = 10 };
  static const char* const ids[] = {"Reacher-v5", "InvertedDoublePendulum-v5", "HalfCheetah-v4", "Hopper-v5"};
  mjenv_env* envs[COUNT(ids)];
  struct outputs* outs[COUNT(ids)];
  size_t actions[COUNT(ids)];
  for (size_t i = 0; i < COUNT(ids); ++i) {
    mjenv_options* options = options_of_id(ids[i]);
    if (i == 1) assert_ok(mjenv_options_set_integer(options, "num_threads", 2));
    envs[i] = env_of_options(options, ROWS);
    outs[i] = outputs_of(envs[i]);
    actions[i] = (size_t)(ROWS * action_count(envs[i]));
    assert_ok(mjenv_reset(envs[i], NULL, NULL));
    play(envs[i], outs[i], 2000, actions[i]);
  }
  const double start = seconds();
  const struct held before = held();
  const int64_t part = steps / (ROUNDS * ROWS * (int64_t)COUNT(ids));
  for (int round = 0; round < ROUNDS; ++round)
    for (size_t i = 0; i < COUNT(ids); ++i) play(envs[i], outs[i], part, actions[i]);
  print_message("%" PRId64 " steps in %.0f s\n", part * ROUNDS * ROWS * (int64_t)COUNT(ids), seconds() - start);
  assert_held("steps", before, SCATTER, 0);
  for (size_t i = 0; i < COUNT(ids); ++i) {
    outputs_free(outs[i]);
    mjenv_destroy(envs[i]);
  }
}

// ---- Loading the library ----

#define FIND(library, function)                          \
  do {                                                   \
    void* found_ = dlsym((library), "mjenv_" #function); \
    assert_non_null(found_);                             \
    memcpy(&function, &found_, sizeof function);         \
  } while (0)

// A copy of its own, so that it is unloaded in truth; some threads, more handles than the first table holds, an error.
static void load_and_unload(const char* copy) {
  enum { MANY = 200 };
  mjenv_status (*options_create)(const char*, mjenv_options**);
  mjenv_status (*options_set_integer)(mjenv_options*, const char*, int64_t);
  mjenv_status (*create)(const mjenv_options*, int64_t, mjenv_env**);
  mjenv_status (*reset)(mjenv_env*, const uint8_t*, const mjenv_batch*);
  void (*options_destroy)(mjenv_options*);
  void (*destroy)(mjenv_env*);
  void* library = dlopen(copy, RTLD_NOW | RTLD_LOCAL);
  if (!library) fail_msg("%s", dlerror());
  FIND(library, options_create);
  FIND(library, options_set_integer);
  FIND(library, options_destroy);
  FIND(library, create);
  FIND(library, reset);
  FIND(library, destroy);
  mjenv_options* options[MANY];
  mjenv_env* env = NULL;
  for (int i = 0; i < MANY; ++i) assert_int_equal(options_create("Reacher-v5", &options[i]), MJENV_OK);
  assert_int_equal(options_set_integer(options[0], "num_threads", 3), MJENV_OK);
  assert_int_equal(options_set_integer(options[0], "nothing", 3), MJENV_E_NAME);
  assert_int_equal(create(options[0], 6, &env), MJENV_OK);
  assert_int_equal(reset(env, NULL, NULL), MJENV_OK);
  destroy(env);
  for (int i = 0; i < MANY; ++i) options_destroy(options[i]);
  assert_int_equal(dlclose(library), 0);
  assert_null(dlopen(copy, RTLD_NOW | RTLD_NOLOAD));
}

static void test_loading(void** state) {
  (void)state;
  enum { WARM_UP = 20, TIMES = 100 };
  struct held before = {0};
  for (int i = -WARM_UP; i < TIMES; ++i) {
    if (i == 0) before = held();
    load_and_unload(LIBRARY_COPY);
  }
  // The loader keeps some notes of each time; where it maps the library and what of that it reads varies.
  assert_held("loading", before, 32 * 1024, TIMES * 200);
}

int main(int argc, char** argv) {
  // Each thread's cache of freed blocks counts as in use, and glibc reads this when the program starts.
  if (!getenv("GLIBC_TUNABLES")) {
    setenv("GLIBC_TUNABLES", "glibc.malloc.tcache_count=0", 1);
    execv("/proc/self/exe", argv);
  }
  if (argc > 1 && strcmp(argv[1], "long") == 0) {
    environments = 100000;
    steps = 10000000;
  }
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_loading), cmocka_unit_test(test_environments),
                                     cmocka_unit_test(test_errors), cmocka_unit_test(test_steps)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
