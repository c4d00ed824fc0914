// The threads of an environment: how many there are, asleep when idle, left behind by a fork, gone with the handle or
// with the process; and rows that MuJoCo fails in, or finds diverged, while others go on.
#define _GNU_SOURCE
#include <dirent.h>
#include <math.h>
#include <sched.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "support.h"

enum { ROWS = 8, NU = 6, PATIENCE = 60 /* s */ };

static const float action[ROWS * NU] = {0.5f, -0.5f, 0.25f};

static mjenv_env* env_with_threads(const char* id, int64_t rows, int64_t threads) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  return env_of_options(options, rows);
}

static mjenv_env* cheetahs(int64_t threads) {
  mjenv_env* env = env_with_threads("HalfCheetah-v5", ROWS, threads);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  return env;
}

// ---- How many there are ----

static int threads_of_process(void) {
  DIR* tasks = opendir("/proc/self/task");
  assert_non_null(tasks);
  int count = 0;
  for (struct dirent* entry = readdir(tasks); entry; entry = readdir(tasks)) count += entry->d_name[0] != '.';
  closedir(tasks);
  return count;
}

static int threads_made(int64_t rows, int64_t asked) {
  const int before = threads_of_process();
  mjenv_env* env = env_with_threads("Reacher-v5", rows, asked);
  const int made = threads_of_process() - before;
  mjenv_destroy(env);
  // The system lists a thread for a moment after it was joined.
  for (int i = 0; i < 1000 && threads_of_process() != before; ++i) nanosleep(&(struct timespec){0, 1000000}, NULL);
  assert_int_equal(threads_of_process(), before);
  return made;
}

// The caller's thread is one of them; a row needs no second.
static void test_count(void** state) {
  (void)state;
  mjenv_destroy(env_with_threads("Reacher-v5", 2, 2));  // a sanitizer adds a thread of its own to the first
  assert_int_equal(threads_made(8, 1), 0);
  assert_int_equal(threads_made(8, 3), 2);
  assert_int_equal(threads_made(2, 8), 1);
  assert_int_equal(threads_made(1, 8), 0);
}

static void test_affinity(void** state) {
  (void)state;
  cpu_set_t all, one;
  assert_int_equal(sched_getaffinity(0, sizeof all, &all), 0);
  int first = 0;
  while (!CPU_ISSET(first, &all)) ++first;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  assert_int_equal(sched_setaffinity(0, sizeof one, &one), 0);
  const int made = threads_made(64, 0);
  assert_int_equal(sched_setaffinity(0, sizeof all, &all), 0);
  assert_int_equal(made, 0);
  // A quota may grant less than all of them.
  assert_in_range(threads_made(64, 0), 0, CPU_COUNT(&all) - 1);
}

// ---- Idle ----

static double cpu_seconds(void) {
  struct timespec time;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static double cpu_seconds_idle(void) {
  const struct timespec a_while = {.tv_nsec = 20 * 1000 * 1000}, idle = {.tv_nsec = 500 * 1000 * 1000};
  nanosleep(&a_while, NULL);  // they spin for a moment
  const double before = cpu_seconds();
  nanosleep(&idle, NULL);
  return cpu_seconds() - before;
}

// 7 threads that spun would take half a second of each CPU.
static void test_idle(void** state) {
  (void)state;
  mjenv_env* env = cheetahs(8);
  assert_true(cpu_seconds_idle() < 0.01);
  assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, NULL));
  assert_true(cpu_seconds_idle() < 0.01);
  // Sent, stepped, not yet received.
  assert_ok(mjenv_send(env, NULL, 0, action, COUNT(action), MJENV_DTYPE_FLOAT32));
  assert_true(cpu_seconds_idle() < 0.01);
  mjenv_destroy(env);
}

// ---- Fork ----

// Runs body in a child that must end by itself.
static void in_child(bool (*body)(mjenv_env* env), mjenv_env* env) {
  fflush(NULL);
  const pid_t child = fork();
  assert_true(child >= 0);
  if (child == 0) {
    alarm(PATIENCE);
    _exit(body(env) ? 0 : 1);
  }
  int status = 0;
  assert_int_equal(waitpid(child, &status, 0), child);
  if (WIFSIGNALED(status)) fail_msg("the child was ended by signal %d", WTERMSIG(status));
  assert_int_equal(WEXITSTATUS(status), 0);
}

static bool told_of_fork(mjenv_status status) { return status == MJENV_E_FORKED; }

static bool use_what_was_left(mjenv_env* env) {
  const size_t count = COUNT(action);
  int64_t rows[ROWS];
  int64_t received;
  bool fine = told_of_fork(mjenv_step(env, NULL, action, count, MJENV_DTYPE_FLOAT32, NULL));
  fine = fine && told_of_fork(mjenv_reset(env, NULL, NULL));
  fine = fine && told_of_fork(mjenv_rollout(env, action, count, MJENV_DTYPE_FLOAT32, 1, NULL));
  struct outputs* out = outputs_of(env);
  const size_t numbers = (size_t)(ROWS * out->obs_count);
  for (size_t i = 0; i < numbers; ++i) out->obs[i] = 0.5;
  fine = fine && told_of_fork(mjenv_observe(env, &out->batch));
  for (size_t i = 0; i < numbers; ++i) fine = fine && out->obs[i] == 0.5;  // a call that fails writes nothing
  outputs_free(out);
  fine = fine && told_of_fork(mjenv_send(env, NULL, 0, action, count, MJENV_DTYPE_FLOAT32));
  fine = fine && told_of_fork(mjenv_recv(env, 1, -1, rows, ROWS, &received, NULL));
  mjenv_destroy(env);
#ifndef NO_THREADS_AFTER_FORK
  mjenv_env* own = cheetahs(3);
  fine = fine && mjenv_step(own, NULL, action, count, MJENV_DTYPE_FLOAT32, NULL) == MJENV_OK;
  mjenv_destroy(own);
#endif
  return fine;
}

static void test_fork(void** state) {
  (void)state;
  mjenv_env* env = cheetahs(3);
  in_child(use_what_was_left, env);
  assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, NULL));
  mjenv_destroy(env);
}

static void test_fork_under_way(void** state) {
  (void)state;
  mjenv_env* env = cheetahs(3);
  int64_t rows[ROWS];
  int64_t count;
  assert_ok(mjenv_send(env, NULL, 0, action, COUNT(action), MJENV_DTYPE_FLOAT32));
  in_child(use_what_was_left, env);
  assert_ok(mjenv_recv(env, ROWS, -1, rows, ROWS, &count, NULL));
  assert_int_equal(count, ROWS);
  mjenv_destroy(env);
}

static struct outputs* wanted;

// Without threads of its own a handle survives: same bits in both processes.
static bool step_alike(mjenv_env* env) {
  struct outputs* out = outputs_of(env);
  const bool fine = mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &out->batch) == MJENV_OK &&
                    memcmp(out->obs, wanted->obs, (size_t)(ROWS * out->obs_count) * sizeof *out->obs) == 0;
  outputs_free(out);
  mjenv_destroy(env);
  return fine;
}

static void test_fork_of_one_thread(void** state) {
  (void)state;
  mjenv_env *env = cheetahs(1), *twin = cheetahs(1);
  wanted = outputs_of(twin);
  assert_ok(mjenv_step(twin, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &wanted->batch));
  in_child(step_alike, env);
  assert_true(step_alike(env));
  outputs_free(wanted);
  mjenv_destroy(twin);
}

// ---- The end ----

static void test_destroy_under_way(void** state) {
  (void)state;
  for (int64_t threads = 1; threads <= 4; ++threads) {
    for (int i = 0; i < 20; ++i) {
      mjenv_env* env = cheetahs(threads);
      struct outputs* out = outputs_of(env);
      int64_t rows[ROWS];
      int64_t count;
      assert_ok(mjenv_send(env, NULL, 0, action, COUNT(action), MJENV_DTYPE_FLOAT32));
      if (i % 2) assert_ok(mjenv_recv(env, 1, -1, rows, ROWS, &count, &out->batch));
      mjenv_destroy(env);
      outputs_free(out);  // nobody writes there any more
    }
  }
}

#ifndef NO_THREADS_AFTER_FORK
static bool leave_under_way(mjenv_env* none) {
  (void)none;
  enum { MANY = 256 };
  static const float still[MANY * 17];
  mjenv_env* env = env_with_threads("Humanoid-v5", MANY, 4);
  if (mjenv_reset(env, NULL, NULL) != MJENV_OK) return false;
  if (mjenv_send(env, NULL, 0, still, COUNT(still), MJENV_DTYPE_FLOAT32) != MJENV_OK) return false;
  exit(0);
}

static void test_exit_under_way(void** state) {
  (void)state;
  for (int i = 0; i < 3; ++i) in_child(leave_under_way, NULL);
}
#endif

// ---- Rows that fail ----

// A box that slides and turns above a floor, in a MuJoCo whose stack is too small for contacts: one in ROWS falls.
// MuJoCo 4.0 has contacts and stack in one block of memory.
enum { FALLING = 5 };
#define BOX(size)                                                                                                   \
  "<mujoco><size " size                                                                                             \
  "/><option timestep='0.01'/><worldbody><geom type='plane' size='9 9 1'/><body pos='0 0 3'>"                       \
  "<joint name='x' type='slide' axis='1 0 0'/><joint type='slide' axis='0 0 1'/><joint type='hinge' axis='0 1 0'/>" \
  "<geom type='box' size='.3 .3 .3'/></body></worldbody><actuator><motor joint='x'/></actuator></mujoco>"

static mjenv_env* boxes(int64_t threads, bool falling) {
  const bool on_mujoco_4 = MUJOCO[0] == '4';
  mjenv_options* options = options_of_id("HalfCheetah-v5");
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  assert_ok(mjenv_options_set_string(options, "xml_string", on_mujoco_4 ? BOX("memory='5400'") : BOX("nstack='120'")));
  mjenv_env* env = env_of_options(options, ROWS);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  const double qpos[3] = {0, -2.6, 0}, qvel[3] = {0, -10, 0};
  if (falling) assert_ok(mjenv_set_state(env, FALLING, qpos, 3, qvel, 3));
  return env;
}

// status: of the row that fell.
static void assert_others(const struct outputs* got, const struct outputs* want, mjenv_status status) {
  for (int row = 0; row < ROWS; ++row) {
    assert_int_equal(got->status[row], row == FALLING ? status : MJENV_OK);
    if (row == FALLING) continue;
    assert_same_bits("obs", got->obs + row * got->obs_count, want->obs + row * want->obs_count, (size_t)got->obs_count);
    assert_same_bits("reward", got->reward + row, want->reward + row, 1);
  }
}

static void test_failing_row(void** state) {
  (void)state;
  for (int64_t threads = 1; threads <= 3; ++threads) {
    mjenv_env *env = boxes(threads, true), *whole = boxes(threads, false);
    struct outputs *out = outputs_of(env), *want = outputs_of(whole);
    double* before = read_array(env, FALLING, "qpos", NULL);
    assert_refused(MJENV_E_PHYSICS, mjenv_step(env, NULL, action, ROWS, MJENV_DTYPE_FLOAT32, &out->batch), "row 5",
                   "MuJoCo");
    assert_ok(mjenv_step(whole, NULL, action, ROWS, MJENV_DTYPE_FLOAT32, &want->batch));
    assert_others(out, want, MJENV_E_PHYSICS);
    double* after = read_array(env, FALLING, "qpos", NULL);
    assert_same_bits("qpos", after, before, 3);
    free(before);
    free(after);

    int64_t rows[ROWS];
    int64_t count = 0;
    outputs_soil(out);
    assert_ok(mjenv_send(env, NULL, 0, action, ROWS, MJENV_DTYPE_FLOAT32));
    assert_refused(MJENV_E_PHYSICS, mjenv_recv(env, ROWS, -1, rows, ROWS, &count, &out->batch), "row 5", "MuJoCo");
    assert_int_equal(count, ROWS);
    assert_ok(mjenv_step(whole, NULL, action, ROWS, MJENV_DTYPE_FLOAT32, &want->batch));
    assert_others(out, want, MJENV_E_PHYSICS);

    outputs_soil(out);
    assert_refused(MJENV_E_PHYSICS, mjenv_rollout(env, action, ROWS, MJENV_DTYPE_FLOAT32, 1, &out->batch), "row 5",
                   "MuJoCo");
    assert_ok(mjenv_step(whole, NULL, action, ROWS, MJENV_DTYPE_FLOAT32, &want->batch));
    assert_others(out, want, MJENV_E_PHYSICS);

    // A reset puts it right.
    assert_ok(mjenv_reset(env, NULL, NULL));
    assert_ok(mjenv_step(env, NULL, action, ROWS, MJENV_DTYPE_FLOAT32, &out->batch));
    outputs_free(out);
    outputs_free(want);
    mjenv_destroy(env);
    mjenv_destroy(whole);
  }
}

// ---- Rows that diverge ----

struct divergence {
  const char* what;
  double qpos, qvel;  // of the first joint; MuJoCo's limit is 1e10, for accelerations too
};

// As it was set: MuJoCo restarts such a row within the step, at the model's qpos0.
static void diverge(const struct divergence* d, const char* autoreset_mode, const char* on_divergence) {
  mjenv_options* options = options_of_id("HalfCheetah-v5");
  assert_ok(mjenv_options_set_integer(options, "num_threads", 2));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", autoreset_mode));
  assert_ok(mjenv_options_set_string(options, "on_divergence", on_divergence));
  mjenv_env *env = env_of_options(options, ROWS), *whole = cheetahs(1);
  struct outputs *out = outputs_of(env), *want = outputs_of(whole);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  double qpos[9] = {d->qpos}, qvel[9] = {d->qvel, 0, 0, d->qvel};
  assert_ok(mjenv_set_state(env, FALLING, qpos, 9, qvel, 9));
  assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &out->batch));
  assert_ok(mjenv_step(whole, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &want->batch));
  assert_others(out, want, MJENV_DIVERGED);
  const bool ends = strcmp(on_divergence, "terminate") == 0, same_step = strcmp(autoreset_mode, "same_step") == 0;
  for (int row = 0; row < ROWS; ++row) {
    assert_int_equal(out->terminated[row], ends && row == FALLING);
    assert_int_equal(out->truncated[row], 0);
  }
  const mjenv_status next = mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &out->batch);
  assert_int_equal(next, ends && strcmp(autoreset_mode, "disabled") == 0 ? MJENV_E_EPISODE_ENDED : MJENV_OK);
  if (next == MJENV_OK && !(ends && same_step)) assert_int_equal(out->status[FALLING], MJENV_OK);
  outputs_free(out);
  outputs_free(want);
  mjenv_destroy(env);
  mjenv_destroy(whole);
}

static void test_divergence(void** state) {
  (void)state;
  static const struct divergence ways[] = {{"qpos", 1e11, 0}, {"qvel", 0, 1e11}, {"qacc", 0, 9e9}};
  static const char* const modes[] = {"disabled", "next_step", "same_step"};
  for (size_t i = 0; i < COUNT(ways); ++i) {
    for (size_t mode = 0; mode < COUNT(modes); ++mode) {
      diverge(&ways[i], modes[mode], "continue");
      diverge(&ways[i], modes[mode], "terminate");
    }
  }
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_count),
      cmocka_unit_test(test_affinity),
      cmocka_unit_test(test_idle),
      cmocka_unit_test(test_fork),
      cmocka_unit_test(test_fork_under_way),
      cmocka_unit_test(test_fork_of_one_thread),
      cmocka_unit_test(test_destroy_under_way),
#ifndef NO_THREADS_AFTER_FORK
      cmocka_unit_test(test_exit_under_way),
#endif
      cmocka_unit_test(test_failing_row),
      cmocka_unit_test(test_divergence),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
