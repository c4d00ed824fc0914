// A step and a reset allocate nothing: malloc and its like are replaced by counting ones, for the library, too.
#define _GNU_SOURCE
#include <dlfcn.h>

#include "golden.h"
#include "mjenv/task.h"

// ---- Counting ----

// The C library's own, under the names by which they can be called when the usual ones are replaced.
void* __libc_malloc(size_t size);
void* __libc_calloc(int64_t count, size_t size);
void* __libc_realloc(void* memory, size_t size);
void* __libc_memalign(size_t alignment, size_t size);

// Calls from the C library are its qsort's, which MuJoCo sorts contacts with: nothing else of it that we call allocates
// during a step. All others are ours (C++ allocates through libstdc++).
static struct {
  bool on;
  size_t ours, qsort, bytes;
} counted;

static bool in_c_library(const void* address) {
  static const void* base;
  Dl_info info;
  if (!base) base = dladdr(dlsym(RTLD_DEFAULT, "qsort"), &info) ? info.dli_fbase : NULL;
  return dladdr(address, &info) && info.dli_fbase == base;
}

static void count(size_t bytes, const void* caller) {
  if (!__atomic_load_n(&counted.on, __ATOMIC_ACQUIRE)) return;
  __atomic_add_fetch(in_c_library(caller) ? &counted.qsort : &counted.ours, 1, __ATOMIC_RELAXED);
  __atomic_add_fetch(&counted.bytes, bytes, __ATOMIC_RELAXED);
}

void* malloc(size_t size) {
  count(size, __builtin_return_address(0));
  return __libc_malloc(size);
}

void* calloc(size_t number, size_t size) {
  count(number * size, __builtin_return_address(0));
  return __libc_calloc(number, size);
}

void* realloc(void* memory, size_t size) {
  count(size, __builtin_return_address(0));
  return __libc_realloc(memory, size);
}

void* memalign(size_t alignment, size_t size) {
  count(size, __builtin_return_address(0));
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(size_t alignment, size_t size) {
  count(size, __builtin_return_address(0));
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** memory, size_t alignment, size_t size) {
  count(size, __builtin_return_address(0));
  *memory = __libc_memalign(alignment, size);
  return *memory ? 0 : 12;
}

static void start_counting(void) {
  in_c_library(NULL);
  counted.ours = counted.qsort = counted.bytes = 0;
  __atomic_store_n(&counted.on, true, __ATOMIC_RELEASE);
}

static void stop_counting(void) { __atomic_store_n(&counted.on, false, __ATOMIC_RELEASE); }

// ---- Tests ----

// Robots whose geoms cannot touch: MuJoCo has nothing to sort.
static bool has_contacts(const char* id) {
  static const char* const without[] = {"Inverted", "Reacher", "Swimmer"};
  for (size_t i = 0; i < COUNT(without); ++i)
    if (strncmp(id, without[i], strlen(without[i])) == 0) return false;
  return true;
}

static void assert_allocates_nothing(const char* id, mjenv_options* options) {
  enum { ROWS = 2, STEPS = 300 };
  mjenv_env* env = env_of_options(options, ROWS);
  struct outputs* out = outputs_of(env);
  const size_t nu = (size_t)action_count(env);
  float* action = allocate(ROWS * nu * sizeof *action);
  uint8_t ended[ROWS];
  mjenv_status status = MJENV_OK;
  seed_rows(env, 5);
  start_counting();
  for (int step = 0; status == MJENV_OK && step < STEPS; ++step) {
    for (int row = 0; row < ROWS; ++row) ended[row] = step == 0 || out->terminated[row] || out->truncated[row];
    status = mjenv_reset(env, ended, &out->batch);
    if (status == MJENV_OK) status = mjenv_sample_actions(env, action, ROWS * nu);
    if (status == MJENV_OK) status = mjenv_step(env, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT32, &out->batch);
  }
  stop_counting();
  assert_ok(status);
  assert_int_equal(counted.ours, 0);
  if (!has_contacts(id)) assert_int_equal(counted.qsort, 0);
  if (counted.qsort > 0) print_message("%s: %zu allocations by the C library's qsort\n", id, counted.qsort);
  free(action);
  outputs_free(out);
  mjenv_destroy(env);
}

static void test_step_and_reset(void** state) { assert_allocates_nothing(*state, options_of_id(*state)); }

// Nor do they with a history and with rescaled actions.
static void test_wrapped(void** state) {
  (void)state;
  static const double range[] = {-1, 1};
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_integer(options, "history", 3));
  assert_ok(mjenv_options_set_integer(options, "time_aware", 1));
  assert_ok(mjenv_options_set_reals(options, "rescale_actions", range, 2));
  assert_allocates_nothing("Hopper-v5", options);
}

// Nor do they where the islands of constraints differ from step to step: balls reach the floor, and touch each other.
#define BALL(x, z)                                                                          \
  "<body pos='" x " 0 " z                                                                   \
  "'><joint type='slide' axis='0 0 1'/><joint type='slide' axis='1 0 0'/><geom size='.1'/>" \
  "</body>"

static void test_islands(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Model-v0");
  assert_ok(mjenv_options_set_string(options, "xml_string",
                                     "<mujoco><worldbody><geom type='plane' size='9 9 1'/>" BALL("0", ".2")
                                         BALL(".15", ".3") BALL(".3", ".25") "</worldbody></mujoco>"));
  assert_allocates_nothing("Model-v0", options);
}

// Nor do they where rows have values of their own, once these have been stepped and reset.
static void test_own_values(void** state) {
  (void)state;
  enum { ROWS = 3, STEPS = 100 };
  static const char* const arrays[] = {"body_mass", "geom_friction", "opt.timestep", "xfrc_applied"};
  mjenv_env* env = env_of_id("Ant-v5", ROWS);
  struct outputs* out = outputs_of(env);
  const size_t nu = (size_t)action_count(env);
  float* action = allocate(ROWS * nu * sizeof *action);
  memset(action, 0, ROWS * nu * sizeof *action);
  seed_rows(env, 5);
  assert_ok(mjenv_reset(env, NULL, &out->batch));
  for (size_t i = 0; i < COUNT(arrays); ++i) {
    int64_t count;
    double* values = read_array(env, 1, arrays[i], &count);
    for (int64_t k = 0; k < count; ++k) values[k] *= 1.01;
    assert_ok(write_row(env, 1, arrays[i], values, count));
    free(values);
  }
  assert_ok(set_constants(env, 1));
  assert_ok(mjenv_step(env, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT32, &out->batch));
  assert_ok(mjenv_reset(env, NULL, &out->batch));
  mjenv_status status = MJENV_OK;
  start_counting();
  for (int step = 0; status == MJENV_OK && step < STEPS; ++step) {
    if (step % 20 == 0) status = mjenv_reset(env, NULL, &out->batch);
    if (status == MJENV_OK) status = mjenv_step(env, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT32, &out->batch);
  }
  stop_counting();
  assert_ok(status);
  assert_int_equal(counted.ours, 0);
  free(action);
  outputs_free(out);
  mjenv_destroy(env);
}

// Once there is room for all rows, sending and receiving one of them allocates nothing.
static void test_send_and_recv(void** state) {
  (void)state;
  enum { ROWS = 10000 };
  mjenv_env* env = env_of_id("Reacher-v5", ROWS);
  const float action[2] = {0};
  int64_t row = 7;
  int64_t count = 0;
  assert_ok(mjenv_reset(env, NULL, NULL));
  mjenv_status status = mjenv_send(env, &row, 1, action, 2, MJENV_DTYPE_FLOAT32);
  if (status == MJENV_OK) status = mjenv_recv(env, 1, -1, &row, 1, &count, NULL);
  start_counting();
  for (int64_t i = 0; status == MJENV_OK && i < 100; ++i) {
    row = 99 * i;
    status = mjenv_send(env, &row, 1, action, 2, MJENV_DTYPE_FLOAT32);
    if (status == MJENV_OK) status = mjenv_recv(env, 1, -1, &row, 1, &count, NULL);
  }
  stop_counting();
  assert_ok(status);
  assert_int_equal(counted.ours, 0);
  mjenv_destroy(env);
}

// Nor do steps with noise, delays and pushes allocate anything.
#define PERTURBATION                                                                                     \
  "\"noise\": {\"action\": 0.1, \"observation\": 0.1}, \"delay\": {\"action\": 2, \"observation\": 2}, " \
  "\"push\": {\"body\": 1, \"every\": [1, 2], \"force\": [[-1, 1], [0, 0], [0, 0]]}"

static void test_perturbed_steps(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 2);
  const double action[6] = {0};
  struct outputs* out = outputs_of(env);
  assert_ok(mjenv_randomize(env, "{" PERTURBATION "}"));
  assert_ok(mjenv_reset(env, NULL, &out->batch));
  mjenv_status status = mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, &out->batch);
  start_counting();
  for (int step = 0; status == MJENV_OK && step < 5; ++step) {
    status = mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, &out->batch);
    if (status == MJENV_OK && step == 3) status = mjenv_reset(env, NULL, &out->batch);
  }
  stop_counting();
  assert_ok(status);
  assert_int_equal(counted.ours, 0);
  outputs_free(out);
  mjenv_destroy(env);
}

// Nor do steps and resets whose outputs the caller computes.
static void test_halves(void** state) {
  (void)state;
  enum { ROWS = 4 };
  const mjenv_task_field field = {.struct_size = sizeof field, .role = MJENV_ROLE_OBSERVATION, .name = "seen"};
  mjenv_task task = MJENV_TASK_INIT;
  task.id = "Halves-v0", task.model = "hopper.xml", task.fields = &field, task.field_count = 1;
  task.physics_only = 1, task.carry_count = 1;
  assert_ok(mjenv_register_task(&task));
  mjenv_options* options = options_of_id(task.id);
  assert_ok(mjenv_options_set_integer(options, "history", 3));
  mjenv_env* env = env_of_options(options, ROWS);
  struct outputs* out = outputs_of(env);
  const double action[3 * ROWS] = {0};
  double seen[3 * ROWS];
  assert_ok(mjenv_randomize(env, "{\"noise\": {\"action\": 0.1, \"observation\": 0.1}}"));
  const mjenv_batch given = {.struct_size = sizeof given, .rows = ROWS, .reward = seen};
  mjenv_status status = MJENV_OK;
  start_counting();
  for (int step = 0; status == MJENV_OK && step < 9; ++step) {
    if (step % 3 == 0) status = mjenv_begin(env, NULL, NULL, 0, NULL, 0, &out->batch);
    if (status == MJENV_OK) status = mjenv_finish(env, NULL, &given, &out->batch);
    if (status == MJENV_OK) status = mjenv_act(env, NULL, action, 3 * ROWS, MJENV_DTYPE_FLOAT64, seen);
    if (status == MJENV_OK)
      status = mjenv_advance(env, NULL, action, 3 * ROWS, MJENV_DTYPE_FLOAT64, NULL, 0, &out->batch);
    if (status == MJENV_OK) status = mjenv_finish(env, NULL, &given, &out->batch);
  }
  stop_counting();
  assert_ok(status);
  assert_int_equal(counted.ours, 0);
  outputs_free(out);
  mjenv_destroy(env);
}

// Nor do resets that draw values and compute constants, or steps after them, in lanes and one by one, whatever resets.
static void test_randomised(void** state) {
  const char* autoreset = *state;
  enum { ROWS = 4, STEPS = 40 };
#define MASS       \
  "{" PERTURBATION \
  ", \"randomize\": {\"body_mass\": {\"kind\": \"scale\", \"low\": 0.9, \"high\": 1.1, \"set_constants\": true}"
#define NORMAL(array, std) \
  ", \"" array "\": {\"kind\": \"scale\", \"distribution\": \"normal\", \"mean\": 1, \"std\": " std "}"
  static const char* const documents[] = {
      MASS "}}",
      MASS NORMAL("geom_friction", "0.02") "}}",
      MASS NORMAL("geom_friction", "0.02") NORMAL("body_quat", "0.01") "}}",
      MASS NORMAL("geom_friction", "0.02") NORMAL("body_quat", "0.01") ", \"jnt_limited\": {\"choices\": [0, 1]}}}",
  };
  const double action[3 * ROWS] = {0};
  for (int together = 0; together < 2; ++together) {
    for (size_t count = 0; count < COUNT(documents); ++count) {  // with few arrays of their own, lanes can compute them
      mjenv_options* options = options_of_id("Hopper-v5");
      assert_ok(mjenv_options_set_string(options, "autoreset_mode", autoreset));
      assert_ok(mjenv_options_set_integer(options, "max_episode_steps", 3));
      if (!together) assert_ok(mjenv_options_set_integer(options, "lanes", 0));
      mjenv_env* env = env_of_options(options, ROWS);
      struct outputs* out = outputs_of(env);
      seed_rows(env, 5);
      assert_ok(mjenv_reset(env, NULL, &out->batch));
      assert_ok(set_constants(env, 1));
      assert_ok(mjenv_randomize(env, documents[count]));
      mjenv_status status = MJENV_OK;
      start_counting();  // from the first reset on
      status = mjenv_reset(env, NULL, &out->batch);
      for (int step = 0; status == MJENV_OK && step < STEPS; ++step) {
        if (strcmp(autoreset, "disabled") == 0 && step % 3 == 0) status = mjenv_reset(env, NULL, &out->batch);
        if (status == MJENV_OK) status = mjenv_step(env, NULL, action, 3 * ROWS, MJENV_DTYPE_FLOAT64, &out->batch);
      }
      stop_counting();
      assert_ok(status);
      assert_int_equal(counted.ours, 0);

      // After mjenv_set_constants, an image, a copied row and other arrays.
      int64_t size;
      uint8_t to[ROWS] = {0, 0, 0, 1}, ended[ROWS];
      const double timestep[] = {0.002};
      void* image = image_of(env, 0, &size);
      assert_ok(set_constants(env, 1));
      assert_ok(mjenv_restore(env, 2, image, size));
      assert_ok(mjenv_copy_row(env, to, 1));
      assert_ok(write_row(env, 0, "opt.timestep", timestep, 1));
      free(image);
      start_counting();
      for (int step = 0; status == MJENV_OK && step < STEPS; ++step) {
        for (int row = 0; row < ROWS; ++row) ended[row] = out->terminated[row] || out->truncated[row];
        if (strcmp(autoreset, "disabled") == 0) status = mjenv_reset(env, ended, &out->batch);
        if (status == MJENV_OK) status = mjenv_step(env, NULL, action, 3 * ROWS, MJENV_DTYPE_FLOAT64, &out->batch);
      }
      stop_counting();
      assert_ok(status);
      assert_int_equal(counted.ours, 0);
      outputs_free(out);
      mjenv_destroy(env);
    }
  }
}

// Nor do steps of rows with inputs that MuJoCo clears because their simulation diverges.
static void test_divergence(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  mjenv_env* env = env_of_options(options, 2);
  const double force[6] = {1e30}, action[6] = {0};
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(write_row(env, MJENV_ALL_ROWS, "qfrc_applied", force, 6));
  mjenv_status status = MJENV_OK;
  int diverged = 0;
  int32_t statuses[2] = {0};
  const mjenv_batch out = {.struct_size = sizeof out, .rows = 2, .status = statuses};
  start_counting();
  for (int step = 0; status == MJENV_OK && step < 5; ++step) {
    status = mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, &out);
    diverged += statuses[0] == MJENV_DIVERGED;
  }
  stop_counting();
  assert_ok(status);
  assert_true(diverged > 0);
  assert_int_equal(counted.ours, 0);
  mjenv_destroy(env);
}

// The counters see our allocations and those of the library, so that none means none.
static void test_counter_counts(void** state) {
  (void)state;
  start_counting();
  void* memory = malloc(100);
  mjenv_options* options = NULL;
  const mjenv_status status = mjenv_options_create("Ant-v5", &options);
  stop_counting();
  assert_ok(status);
  assert_true(counted.ours > 10);
  assert_true(counted.bytes > 1000);
  mjenv_options_destroy(options);
  free(memory);
}

static size_t bytes_of_create(const mjenv_options* options, int64_t rows) {
  mjenv_env* env = NULL;
  start_counting();
  const mjenv_status status = mjenv_create(options, rows, &env);
  stop_counting();
  assert_ok(status);
  mjenv_destroy(env);
  return counted.bytes;
}

// A row costs less than 2 KB and its generator, beside what the lanes take that step several rows at once.
static void test_memory_of_rows(void** state) {
  enum { GENERATOR = 32, LIMIT = 2048 + GENERATOR };
  mjenv_options* options = options_of_id(*state);
  const size_t few = bytes_of_create(options, 8), many = bytes_of_create(options, 1008);
  assert_true(many > few);
  const size_t each = (many - few) / 1000;
  if (each >= LIMIT) fail_msg("a row of %s costs %zu bytes", (const char*)*state, each);
  mjenv_options_destroy(options);
}

int main(void) {
  const int64_t ids = mjenv_id_count();
  enum { FIRST = 11 };
  struct CMUnitTest tests[FIRST + 2 * ids];
  char names[2 * ids][96];
  tests[0] = (struct CMUnitTest)cmocka_unit_test(test_counter_counts);
  tests[1] = (struct CMUnitTest)cmocka_unit_test(test_send_and_recv);
  tests[2] = (struct CMUnitTest)cmocka_unit_test(test_own_values);
  tests[3] = (struct CMUnitTest)cmocka_unit_test(test_perturbed_steps);
  tests[4] = (struct CMUnitTest){"randomised, reset by the caller", test_randomised, NULL, NULL, "disabled"};
  tests[5] = (struct CMUnitTest){"randomised, next_step", test_randomised, NULL, NULL, "next_step"};
  tests[6] = (struct CMUnitTest){"randomised, same_step", test_randomised, NULL, NULL, "same_step"};
  tests[7] = (struct CMUnitTest)cmocka_unit_test(test_divergence);
  tests[8] = (struct CMUnitTest)cmocka_unit_test(test_wrapped);
  tests[9] = (struct CMUnitTest)cmocka_unit_test(test_halves);
  tests[10] = (struct CMUnitTest)cmocka_unit_test(test_islands);
  for (int64_t i = 0; i < ids; ++i) {
    const char* id = mjenv_id_at(i);
    snprintf(names[2 * i], sizeof names[0], "step and reset of %s", id);
    snprintf(names[2 * i + 1], sizeof names[0], "memory of rows of %s", id);
    tests[FIRST + 2 * i] = (struct CMUnitTest){names[2 * i], test_step_and_reset, NULL, NULL, (void*)(uintptr_t)id};
    tests[FIRST + 1 + 2 * i] =
        (struct CMUnitTest){names[2 * i + 1], test_memory_of_rows, NULL, NULL, (void*)(uintptr_t)id};
  }
  return cmocka_run_group_tests(tests, NULL, NULL);
}
