// Own arrays of float32 numbers, which the task in terrain.cpp writes: in lanes and threads, in images in mid-episode, and in
// pictures. tests/live/test_tasks.py compares such a task with MuJoCo's own calls.
#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 9, ACTIONS = 2, FIELD = 30 };

static mjenv_env* terrain(int64_t lanes, int64_t threads) {
  mjenv_options* options = options_of_id("tests/Terrain-v0");
  assert_ok(mjenv_options_set_integer(options, "lanes", lanes));
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", "next_step"));
  mjenv_env* env = env_of_options(options, ROWS);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  return env;
}

static void step_all(mjenv_env* env, struct outputs* out, int step) {
  double action[ROWS * ACTIONS];
  for (int i = 0; i < ROWS * ACTIONS; ++i) action[i] = (7 * step + 3 * i) % 11 / 5.0 - 1;
  assert_ok(mjenv_step(env, NULL, action, ROWS * ACTIONS, MJENV_DTYPE_FLOAT64, &out->batch));
}

// Two episodes, with the automatic reset between them.
static void test_lanes_and_threads(void** state) {
  (void)state;
  mjenv_env* envs[] = {terrain(0, 1), terrain(-1, 1), terrain(-1, 2)};
  const size_t width = (size_t)role_count(envs[0], MJENV_ROLE_OBSERVATION);
  struct outputs* out[COUNT(envs)];
  for (size_t i = 0; i < COUNT(envs); ++i) out[i] = outputs_of(envs[i]);
  for (int step = 0; step < 40; ++step)
    for (size_t i = 0; i < COUNT(envs); ++i) {
      step_all(envs[i], out[i], step);
      assert_same_bits("observations", out[i]->obs, out[0]->obs, ROWS * width);
    }
  double different = 0;
  for (int64_t row = 1; row < ROWS; ++row) {
    int64_t count = 0;
    double *first = read_array(envs[0], 0, "hfield_data", &count),
           *other = read_array(envs[0], row, "hfield_data", &count);
    assert_int_equal(count, FIELD);
    for (int i = 0; i < FIELD; ++i) different += first[i] != other[i];
    free(first);
    free(other);
  }
  assert_true(different > 0);
  for (size_t i = 0; i < COUNT(envs); ++i) {
    outputs_free(out[i]);
    mjenv_destroy(envs[i]);
  }
}

static void test_images(void** state) {
  (void)state;
  mjenv_env *env = terrain(-1, 1), *other = terrain(-1, 1);
  const size_t width = (size_t)role_count(env, MJENV_ROLE_OBSERVATION);
  struct outputs *out = outputs_of(env), *again = outputs_of(other);
  for (int step = 0; step < 7; ++step) step_all(env, out, step);
  int64_t size = 0;
  unsigned char* image = image_of(env, MJENV_ALL_ROWS, &size);
  assert_ok(mjenv_restore(other, MJENV_ALL_ROWS, image, size));
  const uint8_t last[ROWS] = {[ROWS - 1] = 1};
  assert_ok(mjenv_copy_row(env, last, 2));
  assert_ok(mjenv_copy_row(other, last, 2));
  assert_same_image(env, ROWS - 1, other, 2);
  for (int step = 7; step < 40; ++step) {
    step_all(env, out, step);
    step_all(other, again, step);
    assert_same_bits("observations", again->obs, out->obs, ROWS * width);
  }
  free(image);
  outputs_free(out);
  outputs_free(again);
  mjenv_destroy(env);
  mjenv_destroy(other);
}

static int setup(void** state) {
  (void)state;
  assert_ok(mjenv_load_tasks(PLUGINS "/libterrain" PLUGIN_SUFFIX));
  return 0;
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_lanes_and_threads),
      cmocka_unit_test(test_images),
  };
  return cmocka_run_group_tests(tests, setup, NULL);
}
