// Own arrays of float32 numbers, which the task in terrain.cpp writes: in lanes and threads, and in images in mid-episode.
// tests/live/test_tasks.py compares such a task with MuJoCo's own calls, tests/pictures its pictures. And forces that a step
// writes.
#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 9, ACTIONS = 2, FIELD = 30 };

static mjenv_env* terrain(int64_t lanes, int64_t threads) {
  mjenv_options* options = options_of_id("tests/Terrain-v0");
  set_lanes(options, lanes);
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

static int64_t image_size(mjenv_env* env, int64_t row) {
  int64_t size = 0;
  assert_ok(mjenv_snapshot(env, row, NULL, 0, &size));
  return size;
}

// The image of a row holds those of its own arrays that were written.
static void test_unwritten_arrays(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("tests/Terrain-v0", 3);
  const double colours[] = {1, 0, 0, 1, 0, 1, 0, 1};
  const int64_t unwritten = image_size(env, 0), heights = FIELD * sizeof(float);
  assert_ok(write_row(env, 1, "geom_rgba", colours, COUNT(colours)));
  assert_ok(mjenv_reset(env, (const uint8_t[]){0, 0, 1}, NULL));
  assert_int_equal(image_size(env, 0), unwritten);
  const int64_t painted = image_size(env, 1) - unwritten;
  assert_true(painted >= (int64_t)(COUNT(colours) * sizeof(float)));
  assert_true(image_size(env, 2) - unwritten >= painted + heights);
  mjenv_destroy(env);
}

// ---- Forces that a step writes ----

enum { BODY = 1, FORCES = 12 };
static const char model[] =
    "<mujoco><option timestep='0.01'/><worldbody><geom type='plane' size='5 5 .1'/><body name='ball' pos='0 0 .5'>"
    "<freejoint/><geom size='.1'/></body></worldbody></mujoco>";
static const mjenv_task_field fields[] = {
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_OBSERVATION, .name = "qpos", .ndim = 1, .shape = {7}},
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_OBSERVATION, .name = "qvel", .ndim = 1, .shape = {6}},
};
static bool fails;  // whether the step of row 2 fails after it has written

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  (void)user;
  *self = NULL;
  return mjenv_build_own(builder, "xfrc_applied");  // it is the first own array, whose index is 0
}

static int32_t reset(const void* self, mjenv_start* start) {
  (void)self;
  start->qvel[0] = start->carried[0] = mjenv_random_uniform(start->random, -1, 1);
  return 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  (void)self;
  memcpy(to, sim->qpos, 7 * sizeof *to);
  memcpy(to + 7, sim->qvel, 6 * sizeof *to);
  return 0;
}

// The force on the ball in the next step.
static double gust(double start, double time) { return 20 * start + 100 * time; }

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self;
  outcome->own[0][6 * BODY] = gust(outcome->carried[0], *sim->time);
  if (fails && *sim->time > 0.1) return mjenv_task_fail(sim->api, "too windy");
  return 0;
}

static const mjenv_task gusty = {.struct_size = sizeof(mjenv_task),
                                 .id = "tests/Gusty-v0",
                                 .model_text = model,
                                 .frame_skip = 2,
                                 .carry_count = 1,
                                 .fields = fields,
                                 .field_count = COUNT(fields),
                                 .build = build,
                                 .reset = reset,
                                 .observe = observe,
                                 .step = step};

static mjenv_env* windy(int64_t lanes) {
  mjenv_options* options = options_of_id("tests/Gusty-v0");
  set_lanes(options, lanes);
  mjenv_env* env = env_of_options(options, ROWS);
  seed_rows(env, 1);
  fails = false;
  assert_ok(mjenv_reset(env, NULL, NULL));
  return env;
}

// They act in the next step, as if the caller had written them before it, and a reset ends them.
static void test_forces_of_steps(void** state) {
  (void)state;
  for (int64_t lanes = AUTO_LANES; lanes <= 0; ++lanes) {
    mjenv_env* env = windy(lanes);
    mjenv_options* options = options_of_id("Model-v0");
    assert_ok(mjenv_options_set_string(options, "xml_string", model));
    assert_ok(mjenv_options_set_integer(options, "frame_skip", 2));
    mjenv_env* plain = env_of_options(options, ROWS);
    assert_ok(mjenv_reset(plain, NULL, NULL));
    struct outputs *out = outputs_of(env), *want = outputs_of(plain);
    for (int episode = 0; episode < 2; ++episode) {
      double start[ROWS], forces[ROWS * FORCES] = {0};
      assert_ok(mjenv_reset(env, NULL, &out->batch));
      assert_ok(mjenv_reset(plain, NULL, NULL));
      for (int row = 0; row < ROWS; ++row) {
        const double* seen = out->obs + 13 * row;
        start[row] = seen[7];
        assert_ok(mjenv_set_state(plain, row, seen, 7, seen + 7, 6));
      }
      for (int i = 1; i <= 30; ++i) {
        assert_ok(mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, &out->batch));
        assert_ok(mjenv_write(plain, NULL, "xfrc_applied", forces, ROWS * FORCES));
        assert_ok(mjenv_step(plain, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, &want->batch));
        assert_same_bits("qpos and qvel", out->obs, want->obs, ROWS * 13);
        for (int row = 0; row < ROWS; ++row) {
          int64_t count = 0;
          double* time = read_array(env, row, "time", &count);
          forces[FORCES * row + 6 * BODY] = gust(start[row], *time);
          free(time);
        }
      }
    }
    outputs_free(out);
    outputs_free(want);
    mjenv_destroy(env);
    mjenv_destroy(plain);
  }
}

// A step that fails leaves the forces of its row as they were.
static void test_forces_of_failing_steps(void** state) {
  (void)state;
  mjenv_env* env = windy(-1);
  struct outputs* out = outputs_of(env);
  for (int i = 0; i < 8; ++i) assert_ok(mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, &out->batch));
  int64_t size = 0, size_after = 0;
  unsigned char* before = image_of(env, MJENV_ALL_ROWS, &size);
  fails = true;
  assert_refused(MJENV_E_TASK, mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, &out->batch), "too windy");
  unsigned char* after = image_of(env, MJENV_ALL_ROWS, &size_after);
  assert_int_equal(size, size_after);
  assert_memory_equal(before, after, size);
  free(before);
  free(after);
  outputs_free(out);
  mjenv_destroy(env);
}

static int setup(void** state) {
  (void)state;
  assert_ok(mjenv_register_task(&gusty));
  assert_ok(mjenv_load_tasks(PLUGINS "/libterrain" PLUGIN_SUFFIX));
  return 0;
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_lanes_and_threads),       cmocka_unit_test(test_images),
      cmocka_unit_test(test_unwritten_arrays),        cmocka_unit_test(test_forces_of_steps),
      cmocka_unit_test(test_forces_of_failing_steps),
  };
  return cmocka_run_group_tests(tests, setup, NULL);
}
