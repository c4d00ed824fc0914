// Not a bit depends on the number of threads, nor on steps being sent and received.
// Usage: test_invariance [STEPS]
#include "support.h"

enum { ROWS = 64, LIMIT = 15 };

static int steps = 20;

struct way {
  int64_t threads;
  bool split;
};

// All that a step can write.
struct everything {
  mjenv_batch batch;
  unsigned char* memory;
  int64_t size;
};

static struct everything everything_of(const mjenv_env* env) {
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  const int64_t info = role_count(env, MJENV_ROLE_INFO), reset_info = role_count(env, MJENV_ROLE_RESET_INFO),
                arrays = role_count(env, MJENV_ROLE_ARRAYS);
  const size_t numbers = (size_t)(ROWS * (2 * space.count + 1 + 2 * info + reset_info + arrays));
  struct everything e = {.size = numbers * sizeof(double) + ROWS * (sizeof(int32_t) + 3)};
  e.memory = allocate(e.size);
  memset(e.memory, 0, e.size);
  double* next = (double*)e.memory;
  e.batch = (mjenv_batch){.struct_size = sizeof e.batch,
                          .obs_dtype = MJENV_DTYPE_FLOAT64,
                          .rows = ROWS,
                          .obs_count = space.count,
                          .info_count = info,
                          .reset_info_count = reset_info,
                          .arrays_count = arrays};
  e.batch.obs = next;
  e.batch.final_obs = next += ROWS * space.count;
  e.batch.reward = next += ROWS * space.count;
  e.batch.info = next += ROWS;
  e.batch.final_info = next += ROWS * info;
  e.batch.reset_info = next += ROWS * info;
  e.batch.arrays = next += ROWS * reset_info;
  e.batch.status = (int32_t*)(next += ROWS * arrays);
  e.batch.terminated = (uint8_t*)(e.batch.status + ROWS);
  e.batch.truncated = e.batch.terminated + ROWS;
  e.batch.was_reset = e.batch.truncated + ROWS;
  assert_ptr_equal(e.batch.was_reset + ROWS, e.memory + e.size);
  return e;
}

// FNV-1a.
static uint64_t hash(uint64_t h, const unsigned char* bytes, size_t count) {
  for (size_t i = 0; i < count; ++i) h = (h ^ bytes[i]) * 0x100000001b3u;
  return h;
}

static void take(mjenv_env* env, struct way way, const float* action, size_t count, const mjenv_batch* out) {
  if (!way.split) {
    assert_ok(mjenv_step(env, NULL, action, count, MJENV_DTYPE_FLOAT32, out));
    return;
  }
  int64_t rows[ROWS];
  assert_ok(mjenv_send(env, NULL, 0, action, count, MJENV_DTYPE_FLOAT32));
  for (int64_t done = 0, some; done < ROWS; done += some) assert_ok(mjenv_recv(env, 1, -1, rows, ROWS, &some, out));
}

// The hash of all outputs of all steps, and of the image of all rows at the end.
static uint64_t played(const char* id, struct way way) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", way.threads));
  assert_ok(mjenv_options_set_integer(options, "max_episode_steps", LIMIT));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", "same_step"));
  assert_ok(mjenv_options_set_string(options, "arrays", "qacc xpos"));
  mjenv_env* env = env_of_options(options, ROWS);
  struct everything out = everything_of(env);
  const size_t count = ROWS * (size_t)action_count(env);
  float* action = allocate(count * sizeof *action);
  uint64_t h = 0xcbf29ce484222325u;
  seed_rows(env, 7);
  assert_ok(mjenv_seed_actions(env, 7));
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int step = 0; step < steps; ++step) {
    assert_ok(mjenv_sample_actions(env, action, count));
    take(env, way, action, count, &out.batch);
    h = hash(h, out.memory, out.size);
  }
  int64_t size;
  unsigned char* image = image_of(env, MJENV_ALL_ROWS, &size);
  h = hash(h, image, size);
  free(image);
  free(action);
  free(out.memory);
  mjenv_destroy(env);
  return h;
}

static void test_id(void** state) {
  static const struct way ways[] = {{2, false}, {3, false}, {5, false}, {8, false}, {3, true}};
  const uint64_t want = played(*state, (struct way){1, false});
  for (size_t i = 0; i < COUNT(ways); ++i)
    if (played(*state, ways[i]) != want)
      fail_msg("%" PRId64 " threads%s give other bits than one", ways[i].threads, ways[i].split ? ", sent," : "");
}

int main(int argc, char** argv) {
  if (argc > 1) steps = atoi(argv[1]);
  if (steps < 1) return 2;
  const int64_t ids = mjenv_id_count();
  struct CMUnitTest tests[ids];
  for (int64_t i = 0; i < ids; ++i)
    tests[i] = (struct CMUnitTest){mjenv_id_at(i), test_id, NULL, NULL, (void*)(uintptr_t)mjenv_id_at(i)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
