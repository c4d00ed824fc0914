// Two threads in one environment, and two environments in two threads.
#include <pthread.h>
#include <sched.h>
#include <time.h>

#include "golden.h"

enum { ROWS = 8, WANTED = 5, PATIENCE = 30 /* s */ };

// ---- One environment ----

struct shared {
  mjenv_env* env;
  int stop;
  size_t nu;
  int bad;  // a status that may not be
  int done, busy;
};

static int64_t seconds_since(const struct timespec* start) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec - start->tv_sec;
}

static void* step_without_end(void* argument) {
  struct shared* s = argument;
  const size_t count = ROWS * s->nu;
  double* action = calloc(count, sizeof *action);
  while (!__atomic_load_n(&s->stop, __ATOMIC_ACQUIRE)) {
    const mjenv_status status = mjenv_step(s->env, NULL, action, count, MJENV_DTYPE_FLOAT64, NULL);
    if (status == MJENV_OK) ++s->done;
    if (status != MJENV_OK && status != MJENV_E_BUSY) s->bad = status;
  }
  free(action);
  return NULL;
}

// Each function that enters an environment, while another thread is in it.
static mjenv_status call(int which, mjenv_env* env, struct outputs* out, double* values, size_t nu) {
  static const uint8_t no_row[ROWS];
  static const uint64_t seeds[ROWS], words[4] = {1, 2, 3, 4};
  static const double actions[ROWS * 32];  // not values, which holds an image's bytes after a snapshot
  const double numbers[64] = {0, 0, 1, 1};
  uint64_t stream[4];
  int64_t count;
  const char* text;
  switch (which) {
    case 0: return mjenv_step(env, NULL, actions, ROWS * nu, MJENV_DTYPE_FLOAT64, &out->batch);
    case 1: return mjenv_reset(env, no_row, &out->batch);
    case 2: return mjenv_read(env, 3, "xpos", values, 1000, &count);
    case 3: return mjenv_observe(env, &out->batch);
    case 4: return mjenv_snapshot(env, 0, values, 1000 * sizeof *values, &count);
    case 5: return mjenv_seed(env, no_row, seeds, ROWS);
    case 6: return mjenv_info_of(env, &(mjenv_info)MJENV_INFO_INIT);
    case 7: return mjenv_seed_actions(env, 1);
    case 8: return mjenv_get_stream(env, 0, stream, 4);
    case 9: return mjenv_set_stream(env, 0, words, 4);
    case 10: return mjenv_simulate(env, 0, numbers, nu, 1);
    case 11: return mjenv_randomization(env, &text);
    default: return mjenv_set_state(env, 1, numbers, 24, numbers, 23);
  }
}
enum { CALLS = 13 };

static void test_one_environment(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("HumanoidStandup-v5");
  assert_ok(mjenv_options_set_integer(options, "max_episode_steps", 0));
  struct shared s = {.env = env_of_options(options, ROWS)};
  s.nu = (size_t)action_count(s.env);
  struct outputs* out = outputs_of(s.env);
  double* values = allocate(ROWS * 32 * sizeof *values);
  memset(values, 0, ROWS * 32 * sizeof *values);
  seed_rows(s.env, 1);
  assert_ok(mjenv_reset(s.env, NULL, NULL));
  pthread_t thread;
  assert_int_equal(pthread_create(&thread, NULL, step_without_end, &s), 0);
  struct timespec start;
  clock_gettime(CLOCK_MONOTONIC, &start);
  int busy[CALLS] = {0};
  bool fine = true, enough = false;
  while (fine && !enough && seconds_since(&start) < PATIENCE) {
    enough = true;
    for (int which = 0; which < CALLS; ++which) {
      if (busy[which] >= WANTED) continue;
      enough = false;
      const mjenv_status status = call(which, s.env, out, values, s.nu);
      if (status == MJENV_E_BUSY) {
        ++busy[which];
        fine = fine && outputs_untouched(out) && strstr(mjenv_last_error(), "another thread");
      } else {
        fine = fine && status == MJENV_OK;
        outputs_soil(out);
      }
    }
  }
  __atomic_store_n(&s.stop, 1, __ATOMIC_RELEASE);
  pthread_join(thread, NULL);
  if (!fine) print_error("the last message: %s\n", mjenv_last_error());
  assert_true(fine);
  assert_true(enough);
  assert_int_equal(s.bad, 0);
  assert_true(s.done > 0);
  // As good as new.
  assert_ok(mjenv_reset(s.env, NULL, &out->batch));
  memset(values, 0, ROWS * 32 * sizeof *values);
  assert_ok(mjenv_step(s.env, NULL, values, ROWS * s.nu, MJENV_DTYPE_FLOAT64, &out->batch));
  free(values);
  outputs_free(out);
  mjenv_destroy(s.env);
}

// What another thread reads in between changes nothing: the steps are the recorded ones.
struct looker {
  mjenv_env* env;
  int stop;
  int seen, busy;
};

static void* look_without_end(void* argument) {
  struct looker* looker = argument;
  double values[200];
  int64_t count;
  while (!__atomic_load_n(&looker->stop, __ATOMIC_ACQUIRE)) {
    const mjenv_status status = mjenv_read(looker->env, 0, "cfrc_ext", values, COUNT(values), &count);
    if (status == MJENV_OK) __atomic_add_fetch(&looker->seen, 1, __ATOMIC_RELAXED);
    looker->busy += status == MJENV_E_BUSY;
  }
  return NULL;
}

static void test_looked_at(void** state) {
  (void)state;
  struct golden* golden = golden_read("trajectories/HumanoidStandup-v5.golden");
  struct looker looker = {.env = golden_create(golden, 1)};
  struct outputs* out = outputs_of(looker.env);
  int64_t first_episode;
  memcpy(&first_episode, (const char*)golden_array(golden, "reset_at", "i8")->data + sizeof first_episode,
         sizeof first_episode);
  pthread_t thread;
  assert_int_equal(pthread_create(&thread, NULL, look_without_end, &looker), 0);
  const char* problem = NULL;
  struct timespec start;
  clock_gettime(CLOCK_MONOTONIC, &start);
  while (!problem && __atomic_load_n(&looker.seen, __ATOMIC_RELAXED) < WANTED && seconds_since(&start) < PATIENCE) {
    double action[64];
    char why[256];
    mjenv_dtype dtype;
    int64_t nu;
    while (mjenv_seed(looker.env, NULL, &golden->seed, 1) != MJENV_OK) continue;
    while (mjenv_reset(looker.env, NULL, NULL) != MJENV_OK) continue;
    for (size_t step = 0; step < (size_t)first_episode && !problem; ++step) {
      golden_action(golden, step, action, &dtype, &nu);
      mjenv_status status;
      while ((status = mjenv_step(looker.env, NULL, action, nu, dtype, &out->batch)) == MJENV_E_BUSY) continue;
      if (status != MJENV_OK) problem = mjenv_last_error();
      sched_yield();
      if (!golden_same(golden, "obs", step, out->obs, (size_t)out->obs_count, why, sizeof why)) problem = "other bits";
    }
  }
  __atomic_store_n(&looker.stop, 1, __ATOMIC_RELEASE);
  pthread_join(thread, NULL);
  if (problem) fail_msg("%s", problem);
  assert_true(looker.seen >= WANTED);
  outputs_free(out);
  mjenv_destroy(looker.env);
  golden_free(golden);
}

// ---- Environments of their own ----

struct player {
  const char* id;
  int times;
  bool fine;
  char why[512];
};

static void* play(void* argument) {
  struct player* player = argument;
  char path[512];
  snprintf(path, sizeof path, "trajectories/%s.options.golden", player->id);
  player->fine = true;
  for (int i = 0; player->fine && i < player->times; ++i) {
    struct golden* golden = golden_read(path);
    mjenv_env* env = golden_create(golden, 1);
    player->fine = golden_replay(golden, env, 0, golden_steps(golden), player->why, sizeof player->why);
    mjenv_destroy(env);
    golden_free(golden);
  }
  return NULL;
}

static void test_own_environments(void** state) {
  (void)state;
  struct player players[] = {
      {"Ant-v5", 4, false, ""}, {"Humanoid-v5", 4, false, ""}, {"Ant-v4", 4, false, ""}, {"Pusher-v5", 4, false, ""}};
  pthread_t threads[COUNT(players)];
  for (size_t i = 0; i < COUNT(players); ++i) assert_int_equal(pthread_create(&threads[i], NULL, play, &players[i]), 0);
  for (size_t i = 0; i < COUNT(players); ++i) pthread_join(threads[i], NULL);
  for (size_t i = 0; i < COUNT(players); ++i)
    if (!players[i].fine) fail_msg("%s", players[i].why);
}

// An environment may move from thread to thread.
static void* step_once(void* argument) {
  mjenv_env* env = argument;
  const float action[8] = {0};
  return mjenv_step(env, NULL, action, 8, MJENV_DTYPE_FLOAT32, NULL) == MJENV_OK ? env : NULL;
}

static void test_moves_between_threads(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Ant-v5", 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int i = 0; i < 20; ++i) {
    pthread_t thread;
    void* result = NULL;
    assert_int_equal(pthread_create(&thread, NULL, step_once, env), 0);
    pthread_join(thread, &result);
    assert_ptr_equal(result, env);
  }
  mjenv_destroy(env);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_one_environment),
      cmocka_unit_test(test_looked_at),
      cmocka_unit_test(test_own_environments),
      cmocka_unit_test(test_moves_between_threads),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
