// Handles that are no longer, or never were: each function refuses them, and nothing crashes.
#define _GNU_SOURCE  // syscall
#include <pthread.h>
#include <sched.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "golden.h"

#define RECORDING "trajectories/Hopper-v5.golden"

static const uint8_t mask[8] = {1};

// ---- Every function ----

static void refuse_env(mjenv_env* env) {
  const mjenv_status wanted = MJENV_E_ARGUMENT;
  const char* why = "env is no live handle";
  mjenv_space space = MJENV_SPACE_INIT;
  mjenv_field field = MJENV_FIELD_INIT;
  mjenv_batch batch = {.struct_size = sizeof batch, .rows = 1};
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  mjenv_renderer* renderer = NULL;
  uint64_t words[4] = {1, 2, 3, 4};
  const double numbers[64] = {0};
  double values[64];
  float samples[8];
  const char* name = NULL;
  int64_t number = 0;
  int64_t count = 0;
  mjenv_info info = MJENV_INFO_INIT;
  assert_refused(wanted, mjenv_info_of(env, &info), why);
  assert_null(mjenv_options_of(env));
  assert_null(mjenv_lane_stages_of(env));
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_INFO), 0);
  assert_refused(wanted, mjenv_space_of(env, MJENV_ROLE_ACTION, &space), why);
  assert_refused(wanted, mjenv_field_at(env, MJENV_ROLE_INFO, 0, &field), why);
  assert_refused(wanted, mjenv_seed(env, NULL, words, 1), why);
  assert_refused(wanted, mjenv_seed_row(env, 0, words, 1), why);
  assert_refused(wanted, mjenv_reset_data(env, NULL), why);
  assert_refused(wanted, mjenv_set_constants_row(env, 0), why);
  assert_refused(wanted, mjenv_write_row(env, 0, "qpos", numbers, 6), why);
  assert_refused(wanted, mjenv_set_constants(env, NULL), why);
  assert_refused(wanted, mjenv_write(env, NULL, "qpos", numbers, 6), why);
  assert_refused(wanted, mjenv_reset(env, NULL, &batch), why);
  assert_refused(wanted, mjenv_step(env, NULL, numbers, 3, MJENV_DTYPE_FLOAT64, &batch), why);
  assert_refused(wanted, mjenv_send(env, NULL, 0, numbers, 3, MJENV_DTYPE_FLOAT64), why);
  assert_refused(wanted, mjenv_recv(env, 1, -1, &number, 1, &count, &batch), why);
  assert_refused(wanted, mjenv_rollout(env, numbers, 3, MJENV_DTYPE_FLOAT64, 1, &batch), why);
  assert_refused(wanted, mjenv_get_stream(env, 0, words, 4), why);
  assert_refused(wanted, mjenv_set_stream(env, 0, words, 4), why);
  assert_refused(wanted, mjenv_seed_actions(env, 1), why);
  assert_refused(wanted, mjenv_sample_actions(env, samples, 3), why);
  assert_refused(wanted, mjenv_read(env, 0, "qpos", values, COUNT(values), &count), why);
  assert_refused(wanted, mjenv_mirror(env, 0, "qpos", values, sizeof values), why);
  assert_refused(wanted, mjenv_object_count(env, "body", &number), why);
  assert_refused(wanted, mjenv_object_index(env, "body", "torso", &number), why);
  assert_refused(wanted, mjenv_object_name(env, "body", 0, &name), why);
  assert_refused(wanted, mjenv_set_state(env, 0, numbers, 6, numbers, 6), why);
  assert_refused(wanted, mjenv_simulate(env, 0, numbers, 3, 1), why);
  assert_refused(wanted, mjenv_observe(env, &batch), why);
  assert_refused(wanted, mjenv_observe_row(env, 0, &batch), why);
  assert_refused(wanted, mjenv_copy_row(env, mask, 0), why);
  assert_refused(wanted, mjenv_snapshot(env, 0, values, sizeof values, &count), why);
  assert_refused(wanted, mjenv_restore(env, 0, values, sizeof values), why);
  assert_refused(wanted, mjenv_render_defaults(env, &settings), why);
  assert_refused(wanted, mjenv_renderer_create(env, NULL, &renderer), why);
  assert_true(!name && !renderer && !space.low && !field.name && count == 0 && number == 0);
  mjenv_destroy(env);
}

static void refuse_options(mjenv_options* options) {
  const mjenv_status wanted = MJENV_E_ARGUMENT;
  const char* why = "options is no live handle";
  mjenv_option option = MJENV_OPTION_INIT;
  mjenv_env* env = NULL;
  double values[2] = {1, 2};
  const char* text = NULL;
  int64_t number = 0;
  int64_t count = 0;
  assert_int_equal(mjenv_options_count(options), 0);
  assert_refused(wanted, mjenv_options_at(options, 0, &option), why);
  assert_refused(wanted, mjenv_options_set_integer(options, "strict", 1), why);
  assert_refused(wanted, mjenv_options_set_reals(options, "healthy_reward", values, 1), why);
  assert_refused(wanted, mjenv_options_set_string(options, "norm", "auto"), why);
  assert_refused(wanted, mjenv_options_get_integer(options, "strict", &number), why);
  assert_refused(wanted, mjenv_options_get_reals(options, "healthy_reward", values, 2, &count), why);
  assert_refused(wanted, mjenv_options_get_string(options, "norm", &text), why);
  assert_refused(wanted, mjenv_create(options, 1, &env), why);
  assert_true(!env && !text && !option.name && count == 0 && number == 0);
  mjenv_options_destroy(options);
}

static void refuse_renderer(mjenv_renderer* renderer) {
  uint8_t rgb[3];
  assert_refused(MJENV_E_ARGUMENT, mjenv_render(renderer, 0, rgb, 3, NULL, 0), "renderer is no live handle");
  assert_null(mjenv_renderer_gl(renderer));
  mjenv_renderer_destroy(renderer);
}

// ---- Tests ----

static void test_destroyed(void** state) {
  (void)state;
  struct golden* golden = golden_read(RECORDING);
  mjenv_env* other = golden_create(golden, 1);
  mjenv_env* env = golden_create(golden, 1);
  mjenv_options* options = options_of_id("Hopper-v5");
  const mjenv_options* borrowed = mjenv_options_of(env);
  assert_non_null(borrowed);
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  for (int i = 0; i < 3; ++i) {
    refuse_env(env);
    refuse_options(options);
    refuse_options((mjenv_options*)(uintptr_t)borrowed);
  }
  golden_assert_plays(golden, other);
  mjenv_destroy(other);
  golden_free(golden);
}

static void test_never_created(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  mjenv_options* options = options_of_id("Hopper-v5");
  unsigned char memory[256] = {0};
  void* block = malloc(64);
  const uintptr_t freed = (uintptr_t)block;
  free(block);
  const uintptr_t wrong[] = {1,
                             64,
                             (uintptr_t)memory,
                             freed,
                             (uintptr_t)test_never_created,
                             UINTPTR_MAX,
                             UINTPTR_MAX - 63,
                             (uintptr_t)1 << 46,
                             (uintptr_t)env + 1,
                             (uintptr_t)env + 8,
                             (uintptr_t)env - 1};
  for (size_t i = 0; i < COUNT(wrong); ++i) {
    refuse_env((mjenv_env*)wrong[i]);
    refuse_options((mjenv_options*)wrong[i]);
    refuse_renderer((mjenv_renderer*)wrong[i]);
  }
  // One kind of handle in the place of another, and the neighbours of a live one.
  refuse_env((mjenv_env*)options);
  refuse_options((mjenv_options*)env);
  refuse_renderer((mjenv_renderer*)env);
  for (intptr_t slot = -200; slot <= 200; ++slot)
    if (slot != 0) assert_int_equal(rows_of((mjenv_env*)((uintptr_t)env + (uintptr_t)(64 * slot))), 0);
  assert_int_equal(rows_of(env), 1);
  mjenv_options_destroy(options);
  mjenv_destroy(env);
}

// A destroyed handle is not soon another's.
static void test_not_reused_at_once(void** state) {
  (void)state;
  enum { LATER = 60 };
  mjenv_options* first = options_of_id("Hopper-v5");
  mjenv_options_destroy(first);
  for (int i = 0; i < LATER; ++i) {
    mjenv_options* later = options_of_id("Ant-v5");
    assert_true(later != first);
    assert_int_equal(mjenv_options_count(first), 0);
    mjenv_options_destroy(later);
  }
}

static void test_many(void** state) {
  (void)state;
  enum { MANY = 3000 };
  static mjenv_options* all[MANY];
  for (int i = 0; i < MANY; ++i) {
    all[i] = options_of_id("Reacher-v5");
    assert_ok(mjenv_options_set_integer(all[i], "max_episode_steps", i));
  }
  for (int i = 0; i < MANY; ++i) {
    int64_t value = -1;
    assert_ok(mjenv_options_get_integer(all[i], "max_episode_steps", &value));
    assert_int_equal(value, i);
  }
  for (int i = 0; i < MANY; i += 2) mjenv_options_destroy(all[i]);
  for (int i = 0; i < MANY; ++i) assert_int_equal(mjenv_options_count(all[i]) > 0, i % 2);
  for (int i = 1; i < MANY; i += 2) mjenv_options_destroy(all[i]);
}

// The options of an environment can be read and built from, but not changed or destroyed.
static void test_borrowed_options(void** state) {
  (void)state;
  mjenv_env *env = env_of_id("Hopper-v5", 1), *twin = NULL;
  mjenv_options* borrowed = (mjenv_options*)(uintptr_t)mjenv_options_of(env);
  int64_t strict = -1;
  mjenv_options_destroy(borrowed);
  assert_refused(MJENV_E_ARGUMENT, mjenv_options_set_integer(borrowed, "strict", 0), "belong to an environment");
  assert_ok(mjenv_options_get_integer(borrowed, "strict", &strict));
  assert_int_equal(strict, 1);
  assert_ok(mjenv_create(borrowed, 1, &twin));
  mjenv_destroy(env);
  refuse_options(borrowed);
  assert_int_equal(rows_of(twin), 1);
  mjenv_destroy(twin);
}

// ---- Threads ----

struct user {
  mjenv_env* env;
  mjenv_options* options;
  int started;
  int refused;
  mjenv_status other;  // that may not be
};

static void note(struct user* user, mjenv_status status) {
  if (status == MJENV_E_ARGUMENT)
    __atomic_store_n(&user->refused, 1, __ATOMIC_RELEASE);
  else if (status != MJENV_OK && status != MJENV_E_BUSY)
    user->other = status;
}

static void* step_until_refused(void* argument) {
  struct user* user = argument;
  const double action[64] = {0};
  while (!user->refused) {
    note(user, mjenv_step(user->env, NULL, action, 4 * 3, MJENV_DTYPE_FLOAT64, NULL));
    __atomic_add_fetch(&user->started, 1, __ATOMIC_RELEASE);
  }
  return NULL;
}

static void* look_until_refused(void* argument) {
  struct user* user = argument;
  mjenv_space space = MJENV_SPACE_INIT;
  mjenv_field field = MJENV_FIELD_INIT;
  while (!user->refused) {
    note(user, mjenv_space_of(user->env, MJENV_ROLE_OBSERVATION, &space));
    note(user, mjenv_field_at(user->env, MJENV_ROLE_DATA, 3, &field));
    __atomic_add_fetch(&user->started, 1, __ATOMIC_RELEASE);
  }
  return NULL;
}

// Destroying waits for the call that is inside; the next is refused.
static void test_destroyed_in_use(void** state) {
  (void)state;
  enum { TIMES = 60, THREADS = 3 };
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  for (int i = 0; i < TIMES; ++i) {
    assert_ok(mjenv_options_set_integer(options, "num_threads", 1 + i % 2));
    mjenv_env* env = NULL;
    assert_ok(mjenv_create(options, 4, &env));
    assert_ok(mjenv_reset(env, NULL, NULL));
    struct user users[THREADS];
    pthread_t threads[THREADS];
    for (int t = 0; t < THREADS; ++t) {
      users[t] = (struct user){.env = env};
      assert_int_equal(pthread_create(&threads[t], NULL, t == 0 ? look_until_refused : step_until_refused, &users[t]),
                       0);
    }
    for (int t = 0; t < THREADS; ++t)
      while (!__atomic_load_n(&users[t].started, __ATOMIC_ACQUIRE)) sched_yield();
    mjenv_destroy(env);
    assert_int_equal(rows_of(env), 0);
    for (int t = 0; t < THREADS; ++t) {
      pthread_join(threads[t], NULL);
      assert_int_equal(users[t].other, MJENV_OK);
    }
  }
  mjenv_options_destroy(options);
}

static void* destroy(void* env) {
  mjenv_destroy(env);
  return NULL;
}

// A thread that destroys an environment, and which thread of the system it is.
struct destroyer {
  mjenv_env* env;
  pid_t thread;
};

static void* destroy_by_name(void* argument) {
  struct destroyer* destroyer = argument;
  __atomic_store_n(&destroyer->thread, (pid_t)syscall(SYS_gettid), __ATOMIC_RELEASE);
  mjenv_destroy(destroyer->env);
  return NULL;
}

// Whether the system says that a thread of this process sleeps.
static bool sleeps(pid_t thread) {
  char path[64], text[512] = "";
  snprintf(path, sizeof path, "/proc/self/task/%d/stat", (int)thread);
  FILE* file = fopen(path, "r");
  if (!file) return false;
  const bool read = fgets(text, sizeof text, file) != NULL;
  fclose(file);
  const char* name_end = strrchr(text, ')');
  return read && name_end && name_end[1] == ' ' && name_end[2] == 'S';
}

static void* roll_out(void* argument) {
  struct user* user = argument;
  enum { STEPS = 3000 };
  double* actions = calloc((size_t)STEPS * 17, sizeof *actions);
  __atomic_store_n(&user->started, 1, __ATOMIC_RELEASE);
  note(user, mjenv_rollout(user->env, actions, (size_t)STEPS * 17, MJENV_DTYPE_FLOAT64, STEPS, NULL));
  __atomic_store_n(&user->started, 2, __ATOMIC_RELEASE);
  free(actions);
  return NULL;
}

// While a long call is inside, destroy sleeps until it has returned: it does not spin.
static void test_destroy_sleeps(void** state) {
  (void)state;
  for (bool slept = false; !slept;) {  // again if the thread that destroys began after the rollout had ended
    struct user user = {.env = env_of_id("Humanoid-v5", 1)};
    assert_ok(mjenv_reset(user.env, NULL, NULL));
    struct destroyer destroyer = {.env = user.env};
    pthread_t rolling, destroying;
    assert_int_equal(pthread_create(&rolling, NULL, roll_out, &user), 0);
    while (__atomic_load_n(&user.started, __ATOMIC_ACQUIRE) == 0) sched_yield();
    int64_t count;
    double time = 0;
    while (mjenv_read(user.env, 0, "time", &time, 1, &count) == MJENV_OK &&
           __atomic_load_n(&user.started, __ATOMIC_ACQUIRE) == 1)  // until the rollout is inside
      sched_yield();
    assert_int_equal(pthread_create(&destroying, NULL, destroy_by_name, &destroyer), 0);
    while (__atomic_load_n(&destroyer.thread, __ATOMIC_ACQUIRE) == 0) sched_yield();
    while (rows_of(user.env) != 0) sched_yield();  // until the handle is dead
    bool was_inside = false;
    while (!slept && __atomic_load_n(&user.started, __ATOMIC_ACQUIRE) == 1) {
      was_inside = true;
      slept = sleeps(destroyer.thread);
      sched_yield();
    }
    pthread_join(rolling, NULL);
    pthread_join(destroying, NULL);
    assert_int_equal(user.other, MJENV_OK);
    assert_true(slept || !was_inside);
  }
}

static void test_destroyed_by_several(void** state) {
  (void)state;
  enum { TIMES = 60, THREADS = 4 };
  for (int i = 0; i < TIMES; ++i) {
    mjenv_env* env = env_of_id("InvertedPendulum-v5", 1);
    pthread_t threads[THREADS];
    for (int t = 0; t < THREADS; ++t) assert_int_equal(pthread_create(&threads[t], NULL, destroy, env), 0);
    for (int t = 0; t < THREADS; ++t) pthread_join(threads[t], NULL);
    refuse_env(env);
  }
}

static void* set_until_stopped(void* argument) {
  struct user* user = argument;
  while (!__atomic_load_n(&user->refused, __ATOMIC_ACQUIRE)) {
    const mjenv_status status =
        mjenv_options_set_string(user->options, "xml_file", "a text that needs some memory of its own");
    if (status != MJENV_OK && status != MJENV_E_BUSY) user->other = status;
    if (status == MJENV_OK) __atomic_add_fetch(&user->started, 1, __ATOMIC_RELEASE);
  }
  return NULL;
}

// Options that one thread changes and another reads: one of them is refused, and no text is torn.
static void test_options_of_two_threads(void** state) {
  (void)state;
  enum { TIMES = 20000 };
  struct user user = {.options = options_of_id("Hopper-v5")};
  pthread_t thread;
  assert_int_equal(pthread_create(&thread, NULL, set_until_stopped, &user), 0);
  int read = 0;
  for (int i = 0; i < TIMES; ++i) {
    mjenv_option option = MJENV_OPTION_INIT;
    const mjenv_status status = mjenv_options_at(user.options, 0, &option);
    assert_true(status == MJENV_OK || status == MJENV_E_BUSY);
    read += status == MJENV_OK;
    if (i % 100 == 0) sched_yield();
  }
  __atomic_store_n(&user.refused, 1, __ATOMIC_RELEASE);
  pthread_join(thread, NULL);
  assert_int_equal(user.other, MJENV_OK);
  assert_true(read > 0);
  mjenv_options_destroy(user.options);
}

// Destroyed while another thread sets them: it is waited for, and then the handle is no more.
static void test_options_destroyed_in_use(void** state) {
  (void)state;
  for (int time = 0; time < 50; ++time) {
    struct user user = {.options = options_of_id("Hopper-v5")};
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, set_until_stopped, &user), 0);
    while (__atomic_load_n(&user.started, __ATOMIC_ACQUIRE) < 100) sched_yield();
    mjenv_options_destroy(user.options);
    assert_int_equal(mjenv_options_count(user.options), 0);
    __atomic_store_n(&user.refused, 1, __ATOMIC_RELEASE);
    pthread_join(thread, NULL);
  }
}

// ---- Fork ----

// In a child, forked while another thread was inside: neither destroying nor stepping waits for that thread.
static void test_forked_in_use(void** state) {
  (void)state;
  enum { TIMES = 20, SECONDS = 20 };
  for (int i = 0; i < TIMES; ++i) {
    mjenv_options* options = options_of_id("Hopper-v5");
    assert_ok(mjenv_options_set_integer(options, "strict", 0));
    assert_ok(mjenv_options_set_integer(options, "num_threads", 1 + i % 2));
    struct user user = {.env = env_of_options(options, 4)};
    assert_ok(mjenv_reset(user.env, NULL, NULL));
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, step_until_refused, &user), 0);
    while (!__atomic_load_n(&user.started, __ATOMIC_ACQUIRE)) sched_yield();
    const pid_t child = fork();
    if (child == 0) {
      alarm(SECONDS);
      const double action[12] = {0};
      const mjenv_status status = mjenv_step(user.env, NULL, action, 12, MJENV_DTYPE_FLOAT64, NULL);
      bool fine = status == MJENV_OK || status == MJENV_E_BUSY || status == MJENV_E_FORKED;
      mjenv_destroy(user.env);
      fine = fine && rows_of(user.env) == 0;
      mjenv_options* own = NULL;
      mjenv_env* env = NULL;
      fine = fine && mjenv_options_create("Hopper-v5", &own) == MJENV_OK && mjenv_create(own, 1, &env) == MJENV_OK;
      fine = fine && mjenv_reset(env, NULL, NULL) == MJENV_OK;
      mjenv_destroy(env);
      mjenv_options_destroy(own);
      _exit(fine ? 0 : 1);
    }
    int result = 0;
    assert_int_equal(waitpid(child, &result, 0), child);
    assert_int_equal(result, 0);
    mjenv_destroy(user.env);
    pthread_join(thread, NULL);
    assert_int_equal(user.other, MJENV_OK);
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_destroyed),
      cmocka_unit_test(test_never_created),
      cmocka_unit_test(test_not_reused_at_once),
      cmocka_unit_test(test_many),
      cmocka_unit_test(test_borrowed_options),
      cmocka_unit_test(test_destroyed_in_use),
      cmocka_unit_test(test_destroyed_by_several),
      cmocka_unit_test(test_destroy_sleeps),
      cmocka_unit_test(test_options_of_two_threads),
      cmocka_unit_test(test_options_destroyed_in_use),
      cmocka_unit_test(test_forked_in_use),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
