// Signals and cancellation arrive at any time: no call ends early, no bit changes.
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/time.h>
#include <time.h>

#include "golden.h"

enum { EVERY = 100 /* us */ };

static volatile sig_atomic_t arrived;

static void count(int number) {
  (void)number;
  ++arrived;
}

static void storm(bool on, int flags) {
  struct sigaction action = {.sa_flags = flags};
  action.sa_handler = count;
  sigemptyset(&action.sa_mask);
  assert_int_equal(sigaction(SIGALRM, &action, NULL), 0);
  const struct itimerval timer = {{0, on ? EVERY : 0}, {0, on ? EVERY : 0}};
  assert_int_equal(setitimer(ITIMER_REAL, &timer, NULL), 0);
}

// All rows of a threaded environment, sent and received, against the same rows of one stepped by the caller.
static void send_and_receive(void) {
  enum { ROWS = 6, STEPS = 60, NU = 8 };
  mjenv_options* options = options_of_id("Ant-v5");
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  mjenv_env *one = NULL, *threaded = NULL;
  assert_ok(mjenv_create(options, ROWS, &one));
  assert_ok(mjenv_options_set_integer(options, "num_threads", 3));
  assert_ok(mjenv_create(options, ROWS, &threaded));
  mjenv_options_destroy(options);
  struct outputs *want = outputs_of(one), *got = outputs_of(threaded);
  float action[ROWS * NU];
  seed_rows(one, 3);
  seed_rows(threaded, 3);
  assert_ok(mjenv_reset(one, NULL, NULL));
  assert_ok(mjenv_reset(threaded, NULL, NULL));
  for (int step = 0; step < STEPS; ++step) {
    int64_t rows[ROWS];
    int64_t count_ = 0, done = 0;
    assert_ok(mjenv_sample_actions(one, action, ROWS * NU));
    assert_ok(mjenv_step(one, NULL, action, ROWS * NU, MJENV_DTYPE_FLOAT32, &want->batch));
    assert_ok(mjenv_send(threaded, NULL, 0, action, ROWS * NU, MJENV_DTYPE_FLOAT32));
    for (; done < ROWS; done += count_) {
      assert_ok(mjenv_recv(threaded, ROWS - done, -1, rows, ROWS, &count_, &got->batch));
      assert_int_equal(count_, ROWS - done);
    }
    assert_same_bits("obs", got->obs, want->obs, (size_t)(ROWS * want->obs_count));
    assert_same_bits("reward", got->reward, want->reward, ROWS);
  }
  outputs_free(want);
  outputs_free(got);
  mjenv_destroy(one);
  mjenv_destroy(threaded);
}

static void under_a_storm(int flags) {
  enum { WANTED = 500, SECONDS = 60 };
  struct timespec start, now;
  clock_gettime(CLOCK_MONOTONIC, &start);
  arrived = 0;
  storm(true, flags);
  do {
    golden_assert_file_plays("trajectories/Humanoid-v5.golden");
    golden_assert_file_plays("trajectories/Reacher-v4.golden");
    send_and_receive();
    clock_gettime(CLOCK_MONOTONIC, &now);
  } while (arrived < WANTED && now.tv_sec - start.tv_sec < SECONDS);
  storm(false, flags);
  assert_true(arrived >= WANTED);
}

static void test_interrupting(void** state) {
  (void)state;
  under_a_storm(0);
}

static void test_restarting(void** state) {
  (void)state;
  under_a_storm(SA_RESTART);
}

// The library's threads take no signals: all reach the caller's.
static pthread_t caller;
static volatile sig_atomic_t elsewhere;

static void note_thread(int number) {
  (void)number;
  ++arrived;
  if (!pthread_equal(pthread_self(), caller)) ++elsewhere;
}

static void test_caller_takes_signals(void** state) {
  (void)state;
  struct sigaction action = {.sa_flags = 0};
  caller = pthread_self();
  arrived = elsewhere = 0;
  storm(true, 0);
  action.sa_handler = note_thread;
  sigaction(SIGALRM, &action, NULL);
  send_and_receive();
  storm(false, 0);
  assert_int_equal(elsewhere, 0);
}

// ---- Cancellation ----

struct stepper {
  mjenv_env* env;
  int steps;
  mjenv_status other;
};

static void* step_without_end(void* argument) {
  struct stepper* stepper = argument;
  const double action[12] = {0};
  for (;;) {
    const mjenv_status status = mjenv_step(stepper->env, NULL, action, 12, MJENV_DTYPE_FLOAT64, NULL);
    if (status != MJENV_OK) stepper->other = status;
    __atomic_add_fetch(&stepper->steps, 1, __ATOMIC_RELEASE);
    pthread_testcancel();
  }
  return NULL;
}

static void test_cancelled(void** state) {
  (void)state;
  enum { TIMES = 40 };
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  for (int i = 0; i < TIMES; ++i) {
    assert_ok(mjenv_options_set_integer(options, "num_threads", 1 + i % 3));
    struct stepper stepper = {NULL, 0, MJENV_OK};
    assert_ok(mjenv_create(options, 4, &stepper.env));
    assert_ok(mjenv_reset(stepper.env, NULL, NULL));
    pthread_t thread;
    assert_int_equal(pthread_create(&thread, NULL, step_without_end, &stepper), 0);
    while (__atomic_load_n(&stepper.steps, __ATOMIC_ACQUIRE) < 3) sched_yield();
    void* result = NULL;
    assert_int_equal(pthread_cancel(thread), 0);
    assert_int_equal(pthread_join(thread, &result), 0);
    assert_ptr_equal(result, PTHREAD_CANCELED);
    assert_int_equal(stepper.other, MJENV_OK);
    // Nobody is inside any more.
    const double action[12] = {0};
    assert_ok(mjenv_step(stepper.env, NULL, action, 12, MJENV_DTYPE_FLOAT64, NULL));
    mjenv_destroy(stepper.env);
  }
  mjenv_options_destroy(options);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_interrupting),
      cmocka_unit_test(test_restarting),
      cmocka_unit_test(test_caller_takes_signals),
      cmocka_unit_test(test_cancelled),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
