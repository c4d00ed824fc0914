// Bad input: each is refused with a status and a message, touches no output, and leaves the handle as good as before.
#include <math.h>
#include <pthread.h>

#include "golden.h"

#define RECORDING "trajectories/Hopper-v5.golden"

// An environment that follows a recording, before it was seeded.
struct bench {
  struct golden* golden;
  mjenv_env* env;
  struct outputs* out;
  int64_t nu;
};

static struct bench* bench_of(const char* recording, int64_t rows) {
  struct bench* bench = allocate(sizeof *bench);
  bench->golden = golden_read(recording);
  bench->env = golden_create(bench->golden, rows);
  bench->out = outputs_of(bench->env);
  bench->nu = action_count(bench->env);
  return bench;
}

static int set_up(void** state) {
  *state = bench_of(RECORDING, 1);
  return 0;
}

static int set_up_rows(void** state) {
  *state = bench_of(RECORDING, 3);
  return 0;
}

static int tear_down(void** state) {
  struct bench* bench = *state;
  outputs_free(bench->out);
  mjenv_destroy(bench->env);
  golden_free(bench->golden);
  free(bench);
  return 0;
}

// Nothing was written since the last time, and a recording still plays.
static void assert_unharmed(struct bench* bench) {
  assert_true(outputs_untouched(bench->out));
  char why[512];
  if (rows_of(bench->env) == 1 &&
      !golden_replay(bench->golden, bench->env, 0, golden_steps(bench->golden), why, sizeof why))
    fail_msg("%s", why);
}

static void start(struct bench* bench) {
  seed_rows(bench->env, 1);
  assert_ok(mjenv_reset(bench->env, NULL, NULL));
}

// ---- Null pointers ----

static void test_null_options(void** state) {
  (void)state;
  mjenv_options *options = options_of_id("Ant-v5"), *created = NULL;
  mjenv_option option = MJENV_OPTION_INIT;
  mjenv_spec spec = MJENV_SPEC_INIT;
  const double real = 1;
  double values[2];
  int64_t integer = 0;
  int64_t count = 0;
  const char* text = NULL;
  const mjenv_status wanted = MJENV_E_ARGUMENT;
  assert_refused(wanted, mjenv_spec_of(NULL, &spec), "id is NULL");
  assert_refused(wanted, mjenv_spec_of("Ant-v5", NULL), "spec is NULL");
  assert_refused(wanted, mjenv_options_create(NULL, &created), "id is NULL");
  assert_refused(wanted, mjenv_options_create("Ant-v5", NULL), "options is NULL");
  assert_int_equal(mjenv_options_count(NULL), 0);
  assert_string_equal(mjenv_last_error(), "options is NULL");
  assert_refused(wanted, mjenv_options_at(NULL, 0, &option), "options is NULL");
  assert_refused(wanted, mjenv_options_at(options, 0, NULL), "option is NULL");
  assert_refused(wanted, mjenv_options_set_integer(NULL, "strict", 1), "options is NULL");
  assert_refused(wanted, mjenv_options_set_integer(options, NULL, 1), "name is NULL");
  assert_refused(wanted, mjenv_options_set_reals(NULL, "healthy_reward", &real, 1), "options is NULL");
  assert_refused(wanted, mjenv_options_set_reals(options, NULL, &real, 1), "name is NULL");
  assert_refused(wanted, mjenv_options_set_reals(options, "healthy_reward", NULL, 1), "values is NULL");
  assert_refused(wanted, mjenv_options_set_string(NULL, "norm", "auto"), "options is NULL");
  assert_refused(wanted, mjenv_options_set_string(options, NULL, "auto"), "name is NULL");
  assert_refused(wanted, mjenv_options_set_string(options, "norm", NULL), "value is NULL");
  assert_refused(wanted, mjenv_options_get_integer(NULL, "strict", &integer), "options is NULL");
  assert_refused(wanted, mjenv_options_get_integer(options, NULL, &integer), "name is NULL");
  assert_refused(wanted, mjenv_options_get_integer(options, "strict", NULL), "value is NULL");
  assert_refused(wanted, mjenv_options_get_reals(NULL, "healthy_z_range", values, 2, &count), "options is NULL");
  assert_refused(wanted, mjenv_options_get_reals(options, NULL, values, 2, &count), "name is NULL");
  assert_refused(wanted, mjenv_options_get_reals(options, "healthy_z_range", NULL, 2, &count), "NULL");
  assert_refused(wanted, mjenv_options_get_reals(options, "healthy_z_range", values, 2, NULL), "NULL");
  assert_refused(wanted, mjenv_options_get_string(NULL, "norm", &text), "options is NULL");
  assert_refused(wanted, mjenv_options_get_string(options, NULL, &text), "name is NULL");
  assert_refused(wanted, mjenv_options_get_string(options, "norm", NULL), "value is NULL");
  assert_true(!created && !text && count == 0 && integer == 0);
  mjenv_options_destroy(options);
  mjenv_options_destroy(NULL);
}

static void test_null_env(void** state) {
  struct bench* b = *state;
  mjenv_env* none = NULL;
  mjenv_space space = MJENV_SPACE_INIT;
  mjenv_field field = MJENV_FIELD_INIT;
  mjenv_info info = MJENV_INFO_INIT;
  mjenv_options* other = NULL;
  uint64_t words[4] = {0, 0, 1, 0};
  double drawn;
  const double numbers[64] = {0};
  float samples[64];
  double values[64];
  const char* name = NULL;
  int64_t index = -1, rows[1] = {77};
  int64_t count = 0;
  const mjenv_status wanted = MJENV_E_ARGUMENT;
  assert_refused(wanted, mjenv_create(NULL, 1, &none), "options is NULL");
  assert_refused(wanted, mjenv_create(mjenv_options_of(b->env), 1, NULL), "env is NULL");
  assert_refused(wanted, mjenv_info_of(NULL, &info), "env is NULL");
  assert_refused(wanted, mjenv_info_of(b->env, NULL), "info is NULL");
  // Functions that return no status leave the reason, too.
  assert_refused(MJENV_E_NAME, mjenv_options_create("no such id", &other), "no such id");
  assert_null(mjenv_lane_stages_of(NULL));
  assert_null(mjenv_options_of(NULL));
  assert_string_equal(mjenv_last_error(), "env is NULL");
  assert_refused(MJENV_E_NAME, mjenv_options_create("no such id", &other), "no such id");
  assert_int_equal(mjenv_field_count(NULL, MJENV_ROLE_INFO), 0);
  assert_string_equal(mjenv_last_error(), "env is NULL");
  assert_refused(wanted, mjenv_space_of(NULL, MJENV_ROLE_ACTION, &space), "env is NULL");
  assert_refused(wanted, mjenv_space_of(b->env, MJENV_ROLE_ACTION, NULL), "space is NULL");
  assert_refused(wanted, mjenv_field_at(NULL, MJENV_ROLE_INFO, 0, &field), "env is NULL");
  assert_refused(wanted, mjenv_field_at(b->env, MJENV_ROLE_INFO, 0, NULL), "field is NULL");
  assert_refused(wanted, mjenv_seed(NULL, NULL, words, 1), "env is NULL");
  assert_refused(wanted, mjenv_seed(b->env, NULL, NULL, 1), "seeds is NULL");
  assert_refused(wanted, mjenv_seed_row(NULL, 0, words, 1), "env is NULL");
  assert_refused(wanted, mjenv_seed_row(b->env, 0, NULL, 1), "words is NULL");
  assert_refused(wanted, mjenv_reset(NULL, NULL, &b->out->batch), "env is NULL");
  assert_refused(wanted, mjenv_step(NULL, NULL, numbers, 3, MJENV_DTYPE_FLOAT64, &b->out->batch), "env is NULL");
  assert_refused(wanted, mjenv_step(b->env, NULL, NULL, 3, MJENV_DTYPE_FLOAT64, &b->out->batch), "action is NULL");
  assert_refused(wanted, mjenv_begin(NULL, NULL, NULL, 0, NULL, 0, NULL), "env is NULL");
  assert_refused(wanted, mjenv_act(NULL, NULL, numbers, 3, MJENV_DTYPE_FLOAT64, values), "env is NULL");
  assert_refused(wanted, mjenv_act(b->env, NULL, NULL, 3, MJENV_DTYPE_FLOAT64, values), "action is NULL");
  assert_refused(wanted, mjenv_act(b->env, NULL, numbers, 3, MJENV_DTYPE_FLOAT64, NULL), "seen is NULL");
  assert_refused(wanted, mjenv_advance(NULL, NULL, numbers, 3, MJENV_DTYPE_FLOAT64, NULL, 0, NULL), "env is NULL");
  assert_refused(wanted, mjenv_advance(b->env, NULL, NULL, 3, MJENV_DTYPE_FLOAT64, NULL, 0, NULL), "action is NULL");
  assert_refused(wanted, mjenv_finish(NULL, NULL, NULL, NULL), "env is NULL");
  assert_refused(wanted, mjenv_send(NULL, NULL, 0, numbers, 3, MJENV_DTYPE_FLOAT64), "env is NULL");
  assert_refused(wanted, mjenv_send(b->env, NULL, 0, NULL, 3, MJENV_DTYPE_FLOAT64), "action is NULL");
  assert_refused(wanted, mjenv_recv(NULL, 1, -1, rows, 1, &count, &b->out->batch), "env is NULL");
  assert_refused(wanted, mjenv_recv(b->env, 1, -1, NULL, 1, &count, &b->out->batch), "rows is NULL");
  assert_refused(wanted, mjenv_recv(b->env, 1, -1, rows, 1, NULL, &b->out->batch), "count is NULL");
  assert_refused(wanted, mjenv_rollout(NULL, numbers, 3, MJENV_DTYPE_FLOAT64, 1, &b->out->batch), "env is NULL");
  assert_refused(wanted, mjenv_rollout(b->env, NULL, 3, MJENV_DTYPE_FLOAT64, 1, &b->out->batch), "action is NULL");
  assert_refused(wanted, mjenv_copy_row(NULL, NULL, 0), "env is NULL");
  assert_refused(wanted, mjenv_get_stream(NULL, 0, words, 4), "env is NULL");
  assert_refused(wanted, mjenv_get_stream(b->env, 0, NULL, 4), "words is NULL");
  assert_refused(wanted, mjenv_draw(NULL, 1, 0, 0, 1, &drawn, 1), "words is NULL");
  assert_refused(wanted, mjenv_draw(words, 1, 0, 0, 1, NULL, 1), "values is NULL");
  assert_refused(wanted, mjenv_set_stream(NULL, 0, words, 4), "env is NULL");
  assert_refused(wanted, mjenv_set_stream(b->env, 0, NULL, 4), "words is NULL");
  assert_refused(wanted, mjenv_seed_actions(NULL, 1), "env is NULL");
  assert_refused(wanted, mjenv_sample_actions(NULL, samples, 3), "env is NULL");
  assert_refused(wanted, mjenv_sample_actions(b->env, NULL, 3), "action is NULL");
  assert_refused(wanted, mjenv_read(NULL, 0, "qpos", values, 64, &count), "env is NULL");
  assert_refused(wanted, mjenv_read(b->env, 0, NULL, values, 64, &count), "array is NULL");
  assert_refused(wanted, mjenv_read(b->env, 0, "qpos", NULL, 64, &count), "NULL");
  assert_refused(wanted, mjenv_read(b->env, 0, "qpos", values, 64, NULL), "NULL");
  assert_refused(wanted, mjenv_object_count(NULL, "body", &index), "env is NULL");
  assert_refused(wanted, mjenv_object_count(b->env, NULL, &index), "type is NULL");
  assert_refused(wanted, mjenv_object_count(b->env, "body", NULL), "count is NULL");
  assert_refused(wanted, mjenv_object_index(NULL, "body", "torso", &index), "env is NULL");
  assert_refused(wanted, mjenv_object_index(b->env, NULL, "torso", &index), "type is NULL");
  assert_refused(wanted, mjenv_object_index(b->env, "body", NULL, &index), "name is NULL");
  assert_refused(wanted, mjenv_object_index(b->env, "body", "torso", NULL), "index is NULL");
  assert_refused(wanted, mjenv_object_name(NULL, "body", 0, &name), "env is NULL");
  assert_refused(wanted, mjenv_object_name(b->env, NULL, 0, &name), "type is NULL");
  assert_refused(wanted, mjenv_object_name(b->env, "body", 0, NULL), "name is NULL");
  assert_refused(wanted, mjenv_set_state(NULL, 0, numbers, 6, numbers, 6), "env is NULL");
  assert_refused(wanted, mjenv_set_state(b->env, 0, NULL, 6, numbers, 6), "qpos is NULL");
  assert_refused(wanted, mjenv_set_state(b->env, 0, numbers, 6, NULL, 6), "qvel is NULL");
  assert_refused(wanted, mjenv_simulate(NULL, 0, numbers, 3, 1), "env is NULL");
  assert_refused(wanted, mjenv_simulate(b->env, 0, NULL, 3, 1), "ctrl is NULL");
  assert_refused(wanted, mjenv_observe(NULL, &b->out->batch), "env is NULL");
  assert_refused(wanted, mjenv_observe(b->env, NULL), "out is NULL");
  assert_refused(wanted, mjenv_observe_row(b->env, 0, NULL), "out is NULL");
  assert_refused(wanted, mjenv_snapshot(NULL, 0, values, sizeof values, &count), "env is NULL");
  assert_refused(wanted, mjenv_snapshot(b->env, 0, NULL, 8, &count), "NULL");
  assert_refused(wanted, mjenv_snapshot(b->env, 0, values, sizeof values, NULL), "NULL");
  assert_refused(wanted, mjenv_restore(NULL, 0, values, 8), "env is NULL");
  assert_refused(wanted, mjenv_restore(b->env, 0, NULL, 8), "image is NULL");
  assert_true(!none && !name && index == -1 && count == 0 && rows[0] == 77);
  mjenv_destroy(NULL);
  assert_unharmed(b);
}

static void test_null_means_absent(void** state) {
  struct bench* b = *state;
  start(b);
  const double action[3] = {0};
  mjenv_batch bare = MJENV_BATCH_INIT;
  bare.rows = 1;
  assert_ok(mjenv_reset(b->env, NULL, &bare));
  assert_ok(mjenv_step(b->env, NULL, action, 3, MJENV_DTYPE_FLOAT64, &bare));
  assert_ok(mjenv_step(b->env, NULL, action, 3, MJENV_DTYPE_FLOAT64, NULL));
  assert_ok(mjenv_observe(b->env, &bare));
  assert_unharmed(b);
}

// ---- Sizes and enumerators ----

static void test_struct_size(void** state) {
  struct bench* b = *state;
  start(b);
  const uint32_t sizes[] = {0, 4, 15};
  const double action[3] = {0};
  for (size_t i = 0; i < COUNT(sizes); ++i) {
    mjenv_spec spec = {.struct_size = sizes[i]};
    mjenv_option option = {.struct_size = sizes[i]};
    mjenv_space space = {.struct_size = sizes[i]};
    mjenv_field field = {.struct_size = sizes[i]};
    mjenv_batch batch = b->out->batch;
    batch.struct_size = sizes[i];
    const mjenv_status wanted = MJENV_E_ARGUMENT;
    assert_refused(wanted, mjenv_spec_of("Ant-v5", &spec), "spec->struct_size", "sizeof");
    assert_refused(wanted, mjenv_options_at(mjenv_options_of(b->env), 0, &option), "option->struct_size");
    assert_refused(wanted, mjenv_space_of(b->env, MJENV_ROLE_ACTION, &space), "space->struct_size");
    assert_refused(wanted, mjenv_field_at(b->env, MJENV_ROLE_INFO, 0, &field), "field->struct_size");
    assert_refused(wanted, mjenv_reset(b->env, NULL, &batch), "out->struct_size");
    assert_refused(wanted, mjenv_step(b->env, NULL, action, 3, MJENV_DTYPE_FLOAT64, &batch), "out->struct_size");
    assert_refused(wanted, mjenv_observe(b->env, &batch), "out->struct_size");
    assert_true(!spec.id && !option.name && !space.low && !field.name);
  }
  assert_unharmed(b);
}

static void test_batch_sizes(void** state) {
  struct bench* b = *state;
  start(b);
  const double action[9] = {0};
  const int64_t count = rows_of(b->env) * b->nu;
  const int64_t wrong[] = {0, -1, 1000000, INT64_MAX, INT64_MIN};
  for (size_t i = 0; i < COUNT(wrong); ++i) {
    mjenv_batch rows = b->out->batch, obs = b->out->batch, info = b->out->batch, reset_info = b->out->batch;
    rows.rows = obs.obs_count = info.info_count = reset_info.reset_info_count = wrong[i];
    assert_refused(MJENV_E_SIZE, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &rows), "rows");
    assert_refused(MJENV_E_SIZE, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &obs), "obs_count", "11");
    assert_refused(MJENV_E_SIZE, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &info), "info_count",
                   "6");
    assert_refused(MJENV_E_SIZE, mjenv_reset(b->env, NULL, &rows), "rows");
    assert_refused(MJENV_E_SIZE, mjenv_reset(b->env, NULL, &obs), "obs_count");
    assert_refused(MJENV_E_SIZE, mjenv_reset(b->env, NULL, &info), "info_count", "6");
    assert_refused(MJENV_E_SIZE, mjenv_reset(b->env, NULL, &reset_info), "reset_info_count", "2");
    assert_refused(MJENV_E_SIZE, mjenv_observe(b->env, &rows), "rows");
    assert_refused(MJENV_E_SIZE, mjenv_observe(b->env, &obs), "obs_count");
    assert_refused(MJENV_E_SIZE, mjenv_observe_row(b->env, 0, &obs), "obs_count");
  }
  mjenv_batch dtype = b->out->batch;
  const mjenv_dtype no_floats[] = {0,
                                   MJENV_DTYPE_INT64,
                                   MJENV_DTYPE_INT32,
                                   MJENV_DTYPE_UINT8,
                                   MJENV_DTYPE_ACTION,
                                   MJENV_DTYPE_NATIVE_FLOAT,
                                   MJENV_DTYPE_NATIVE_INT,
                                   9,
                                   -1};
  for (size_t i = 0; i < COUNT(no_floats); ++i) {
    dtype.obs_dtype = no_floats[i];
    assert_refused(MJENV_E_ARGUMENT, mjenv_reset(b->env, NULL, &dtype), "obs_dtype is", "MJENV_DTYPE_FLOAT64");
    assert_refused(MJENV_E_ARGUMENT, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &dtype), "obs_dtype");
    assert_refused(MJENV_E_ARGUMENT, mjenv_step(b->env, NULL, action, count, no_floats[i], &b->out->batch), "dtype is");
    assert_refused(MJENV_E_ARGUMENT, mjenv_send(b->env, NULL, 0, action, count, no_floats[i]), "dtype is");
    assert_refused(MJENV_E_ARGUMENT, mjenv_rollout(b->env, action, count, no_floats[i], 1, &b->out->batch), "dtype is");
  }
  mjenv_batch final_alone = b->out->batch;
  final_alone.final_info = final_alone.info;
  final_alone.info = NULL;
  assert_refused(MJENV_E_ARGUMENT, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &final_alone),
                 "final_info", "info is NULL");
  assert_unharmed(b);
}

static void test_action_sizes(void** state) {
  struct bench* b = *state;
  start(b);
  const double action[9] = {0};
  const int64_t count = rows_of(b->env) * b->nu;
  const int64_t wrong[] = {0, count - 1, count + 1, -1, INT64_MIN, INT64_MAX};
  float samples[9] = {7};
  for (size_t i = 0; i < COUNT(wrong); ++i) {
    assert_refused(MJENV_E_SIZE, mjenv_step(b->env, NULL, action, wrong[i], MJENV_DTYPE_FLOAT64, &b->out->batch),
                   "count");
    assert_refused(MJENV_E_SIZE, mjenv_step(b->env, NULL, action, wrong[i], MJENV_DTYPE_FLOAT32, &b->out->batch),
                   "count");
    assert_refused(MJENV_E_SIZE, mjenv_sample_actions(b->env, samples, wrong[i]), "count");
  }
  assert_true(samples[0] == 7);
  assert_unharmed(b);
}

static void test_roles_and_indices(void** state) {
  struct bench* b = *state;
  mjenv_space space = MJENV_SPACE_INIT;
  mjenv_field field = MJENV_FIELD_INIT;
  assert_refused(MJENV_E_ARGUMENT, mjenv_space_of(b->env, MJENV_ROLE_INFO, &space), "MJENV_ROLE_OBSERVATION",
                 "MJENV_ROLE_ACTION");
  assert_refused(MJENV_E_ARGUMENT, mjenv_space_of(b->env, (mjenv_role)0, &space), "MJENV_ROLE_OBSERVATION");
  assert_refused(MJENV_E_ARGUMENT, mjenv_field_at(b->env, (mjenv_role)99, 0, &field), "99");
  assert_int_equal(mjenv_field_count(b->env, (mjenv_role)99), 0);
  assert_refused(MJENV_E_VALUE, mjenv_field_at(b->env, MJENV_ROLE_INFO, -1, &field), "-1", "0..5");
  assert_refused(MJENV_E_VALUE, mjenv_field_at(b->env, MJENV_ROLE_INFO, 6, &field), "6", "0..5");
  assert_refused(MJENV_E_VALUE, mjenv_field_at(b->env, MJENV_ROLE_RESET_INFO, INT64_MAX, &field), "0..1");
  assert_true(!space.low && !field.name);
  assert_unharmed(b);
}

// A negative count is refused as such, wherever one is given.
static void test_negative_counts(void** state) {
  struct bench* b = *state;
  start(b);
  const int64_t negative[] = {-1, INT64_MIN};
  mjenv_options* options = options_of_id("Ant-v5");
  double values[64] = {0};
  float samples[64] = {0};
  uint64_t words[6] = {0, 0, 1, 0, 0, 0};
  int64_t rows[8] = {0}, count = 77;
  char text[8];
  const mjenv_status wanted = MJENV_E_SIZE;
  for (size_t i = 0; i < COUNT(negative); ++i) {
    const int64_t n = negative[i];
    assert_refused(wanted, mjenv_error_of(b->env, text, n, &count), "count of text");
    assert_refused(wanted, mjenv_options_set_reals(options, "healthy_z_range", values, n), "count of values");
    assert_refused(wanted, mjenv_options_get_reals(options, "healthy_z_range", values, n, &count), "less than 0");
    assert_refused(wanted, mjenv_get_stream(b->env, 0, words, n), "not 4 or 6");
    assert_refused(wanted, mjenv_set_stream(b->env, 0, words, n), "not 4 or 6");
    assert_refused(wanted, mjenv_sample_actions(b->env, samples, n), "count of action");
    assert_refused(wanted, mjenv_step(b->env, NULL, values, n, MJENV_DTYPE_FLOAT64, NULL), "count of action");
    assert_refused(wanted, mjenv_rollout(b->env, values, n, MJENV_DTYPE_FLOAT64, 1, NULL), "count of action");
    assert_refused(wanted, mjenv_send(b->env, rows, n, values, 0, MJENV_DTYPE_FLOAT64), "row_count");
    assert_refused(wanted, mjenv_send(b->env, rows, 1, values, n, MJENV_DTYPE_FLOAT64), "count of action");
    assert_refused(wanted, mjenv_read(b->env, 0, "qpos", values, n, &count), "less than 0");
    assert_refused(wanted, mjenv_write(b->env, NULL, "qpos", values, n), "count of values");
    assert_refused(wanted, mjenv_write_row(b->env, 0, "qpos", values, n), "count of values");
    assert_refused(wanted, mjenv_set_state(b->env, 0, values, n, values, 6), "count of qpos");
    assert_refused(wanted, mjenv_set_state(b->env, 0, values, 6, values, n), "count of qvel");
    assert_refused(wanted, mjenv_simulate(b->env, 0, values, n, 1), "count of ctrl");
    assert_refused(wanted, mjenv_snapshot(b->env, 0, values, n, &count), "less than 0");
    assert_refused(wanted, mjenv_restore(b->env, 0, values, n), "count of image");
  }
  assert_ok(mjenv_send(b->env, NULL, 0, values, b->nu * rows_of(b->env), MJENV_DTYPE_FLOAT64));
  for (size_t i = 0; i < COUNT(negative); ++i) {
    assert_refused(wanted, mjenv_recv(b->env, negative[i], -1, rows, 8, &count, NULL), "least");
    assert_refused(wanted, mjenv_recv(b->env, 1, -1, rows, negative[i], &count, NULL), "capacity");
  }
  assert_int_equal(count, 77);
  assert_ok(mjenv_recv(b->env, 1, -1, rows, 8, &count, NULL));
  mjenv_options_destroy(options);
}

static void test_rows_of_create(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Reacher-v5");
  mjenv_env* env = NULL;
  assert_refused(MJENV_E_VALUE, mjenv_create(options, 0, &env), "rows", "0");
  assert_refused(MJENV_E_VALUE, mjenv_create(options, -1, &env), "rows", "-1");
  assert_refused(MJENV_E_VALUE, mjenv_create(options, INT64_MIN, &env), "rows");
  const int64_t huge[] = {INT64_MAX, INT64_MAX / 2, INT64_MAX / 1024, (int64_t)1 << 50};
  for (size_t i = 0; i < COUNT(huge); ++i) assert_refused(MJENV_E_MEMORY, mjenv_create(options, huge[i], &env), "rows");
  assert_null(env);
  assert_ok(mjenv_create(options, 1, &env));
  mjenv_destroy(env);
  mjenv_options_destroy(options);
}

static void test_rows(void** state) {
  struct bench* b = *state;
  start(b);
  const int64_t wrong[] = {-1, 3, INT64_MIN, INT64_MAX};
  const double numbers[6] = {0};
  uint64_t words[4] = {0, 0, 1, 0};
  double values[64];
  unsigned char image[4096];
  int64_t count = 77;
  for (size_t i = 0; i < COUNT(wrong); ++i) {
    const int64_t row = wrong[i];
    assert_refused(MJENV_E_VALUE, mjenv_copy_row(b->env, NULL, row), "row", "0..2");
    assert_refused(MJENV_E_VALUE, mjenv_simulate(b->env, row, numbers, 3, 1), "row", "0..2");
    if (row == -1) continue;  // names all rows there
    assert_refused(MJENV_E_VALUE, mjenv_observe_row(b->env, row, &b->out->batch), "row", "0..2");
    assert_refused(MJENV_E_VALUE, mjenv_get_stream(b->env, row, words, 4), "row");
    assert_refused(MJENV_E_VALUE, mjenv_set_stream(b->env, row, words, 4), "row");
    assert_refused(MJENV_E_VALUE, mjenv_read(b->env, row, "qpos", values, 64, &count), "row", "0..2");
    assert_refused(MJENV_E_VALUE, mjenv_set_state(b->env, row, numbers, 6, numbers, 6), "row", "0..2");
    assert_refused(MJENV_E_VALUE, mjenv_snapshot(b->env, row, image, sizeof image, &count), "row", "0..2");
    assert_refused(MJENV_E_VALUE, mjenv_restore(b->env, row, image, sizeof image), "row", "0..2");
  }
  assert_true(count == 77 && words[2] == 1);
  assert_true(outputs_untouched(b->out));
}

static void test_other_sizes(void** state) {
  struct bench* b = *state;
  const double numbers[9] = {0};
  uint64_t words[5] = {0};
  const int64_t too_few[] = {0, -1, INT64_MIN};
  for (size_t i = 0; i < COUNT(too_few); ++i)
    assert_refused(MJENV_E_SIZE, mjenv_seed(b->env, NULL, words, too_few[i]), "the count of the seeds' words is");
  assert_refused(MJENV_E_SIZE, mjenv_seed_row(b->env, 0, words, 0), "the count of the seeds' words is 0");
  assert_refused(MJENV_E_NOT_RESET, mjenv_get_stream(b->env, 0, words, 4), "seed");
  start(b);
  assert_refused(MJENV_E_SIZE, mjenv_get_stream(b->env, 0, words, 3), "4");
  assert_refused(MJENV_E_SIZE, mjenv_get_stream(b->env, 0, words, 5), "4");
  assert_refused(MJENV_E_SIZE, mjenv_set_stream(b->env, 0, words, 3), "4");
  assert_refused(MJENV_E_VALUE, mjenv_set_stream(b->env, 0, words, 4), "increment");
  assert_refused(MJENV_E_SIZE, mjenv_set_state(b->env, 0, numbers, 5, numbers, 6), "nq", "6");
  assert_refused(MJENV_E_SIZE, mjenv_set_state(b->env, 0, numbers, 7, numbers, 6), "nq", "6");
  assert_refused(MJENV_E_SIZE, mjenv_set_state(b->env, 0, numbers, 6, numbers, 0), "nv", "6");
  assert_refused(MJENV_E_SIZE, mjenv_simulate(b->env, 0, numbers, 2, 1), "3");
  assert_refused(MJENV_E_VALUE, mjenv_simulate(b->env, 0, numbers, 3, 0), "frames");
  assert_refused(MJENV_E_VALUE, mjenv_simulate(b->env, 0, numbers, 3, -1), "frames");
  double values[6] = {7};
  int64_t count = 77;
  assert_refused(MJENV_E_SIZE, mjenv_read(b->env, 0, "qpos", values, 5, &count), "5", "6");
  assert_true(values[0] == 7 && count == 77);
  assert_unharmed(b);
}

// ---- Names ----

static void test_names(void** state) {
  struct bench* b = *state;
  double values[8];
  int64_t count = 77;
  int64_t index = 77;
  const char* name = NULL;
  assert_refused(MJENV_E_NAME, mjenv_read(b->env, 0, "q_pos", values, 8, &count),
                 "\"q_pos\"; nearest: qpos; mjenv_field_at");
  assert_refused(MJENV_E_NAME, mjenv_read(b->env, 0, "", values, 8, &count), "mjenv_field_at", "lists all");
  assert_refused(MJENV_E_NAME, mjenv_object_count(b->env, "bodies", &index), "bodies", "body", "sensor");
  assert_refused(MJENV_E_NAME, mjenv_object_index(b->env, "bodies", "torso", &index), "bodies", "body", "sensor");
  assert_refused(MJENV_E_NAME, mjenv_object_index(b->env, "body", "head", &index), "body", "head", "torso", "thigh");
  assert_refused(MJENV_E_NAME, mjenv_object_name(b->env, "links", 0, &name), "links", "joint");
  assert_refused(MJENV_E_VALUE, mjenv_object_name(b->env, "body", -1, &name), "body", "-1", "0..4");
  assert_refused(MJENV_E_VALUE, mjenv_object_name(b->env, "body", 5, &name), "body", "5", "0..4");
  assert_refused(MJENV_E_VALUE, mjenv_object_name(b->env, "tendon", 0, &name), "tendon");
  mjenv_spec spec = MJENV_SPEC_INIT;
  assert_refused(MJENV_E_NAME, mjenv_spec_of("Hopper", &spec),
                 "\"Hopper\"; nearest: Hopper-v4, Hopper-v5; mjenv_id_at lists all");
  assert_true(count == 77 && index == 77 && !name && !spec.id);
  assert_unharmed(b);
}

// ---- Numbers ----

static void test_bad_actions(void** state) {
  struct bench* b = *state;
  start(b);
  const size_t count = (size_t)(rows_of(b->env) * b->nu);
  const double bad[] = {NAN, -NAN, INFINITY, -INFINITY};
  const char* const says[] = {"nan", "nan", "inf", "-inf"};
  const size_t before = (size_t)b->nu;
  double* first = read_array(b->env, 0, "qpos", NULL);
  for (size_t i = 0; i < COUNT(bad); ++i)
    for (size_t at = 0; at < count; ++at) {
      double wide[16] = {0};
      float narrow[16] = {0};
      char row[32], element[32];
      wide[at] = bad[i];
      narrow[at] = (float)bad[i];
      snprintf(row, sizeof row, "row %zu", at / before);
      snprintf(element, sizeof element, "action[%zu]", at % before);
      assert_refused(MJENV_E_VALUE, mjenv_step(b->env, NULL, wide, count, MJENV_DTYPE_FLOAT64, &b->out->batch), row,
                     element, says[i], "strict");
      assert_refused(MJENV_E_VALUE, mjenv_step(b->env, NULL, narrow, count, MJENV_DTYPE_FLOAT32, &b->out->batch), row,
                     element, says[i]);
    }
  // No row was stepped.
  double* then = read_array(b->env, 0, "qpos", NULL);
  assert_same_bits("qpos", then, first, 6);
  free(first);
  free(then);
  assert_unharmed(b);
}

static void test_bad_states(void** state) {
  struct bench* b = *state;
  start(b);
  double qpos[6] = {0, 1.25}, qvel[6] = {0};
  qpos[4] = NAN;
  assert_refused(MJENV_E_VALUE, mjenv_set_state(b->env, 0, qpos, 6, qvel, 6), "qpos[4]", "nan");
  qpos[4] = 0;
  qvel[5] = -INFINITY;
  assert_refused(MJENV_E_VALUE, mjenv_set_state(b->env, 0, qpos, 6, qvel, 6), "qvel[5]", "-inf");
  assert_unharmed(b);
}

// MuJoCo restarts a simulation that diverged: the row says so, with the numbers of Gymnasium.
static void test_divergence(void** state) {
  struct bench* b = *state;
  start(b);
  double qpos[6] = {0, 1.25}, qvel[6] = {0};
  const double action[9] = {0};
  qvel[3] = 1e11;
  assert_ok(mjenv_set_state(b->env, 1, qpos, 6, qvel, 6));
  assert_ok(mjenv_step(b->env, NULL, action, 9, MJENV_DTYPE_FLOAT64, &b->out->batch));
  const int32_t want[] = {MJENV_OK, MJENV_DIVERGED, MJENV_OK};
  for (int row = 0; row < 3; ++row) assert_int_equal(b->out->status[row], want[row]);
  for (int64_t i = 0; i < b->out->obs_count; ++i) assert_true(fabs(b->out->obs[b->out->obs_count + i]) < 10);
  outputs_soil(b->out);
  const uint8_t mask[] = {0, 1, 0};
  assert_ok(mjenv_reset(b->env, mask, &b->out->batch));
  assert_int_equal(b->out->status[1], MJENV_OK);
}

// ---- Order of calls ----

static void test_step_before_reset(void** state) {
  struct bench* b = *state;
  const double action[9] = {0};
  const size_t count = (size_t)(rows_of(b->env) * b->nu);
  assert_refused(MJENV_E_NOT_RESET, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &b->out->batch),
                 "row 0", "reset");
  seed_rows(b->env, 1);
  assert_refused(MJENV_E_NOT_RESET, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &b->out->batch),
                 "row 0", "reset");
  if (rows_of(b->env) == 3) {
    const uint8_t mask[] = {1, 0, 1};
    assert_ok(mjenv_reset(b->env, mask, NULL));
    assert_refused(MJENV_E_NOT_RESET, mjenv_step(b->env, NULL, action, count, MJENV_DTYPE_FLOAT64, &b->out->batch),
                   "row 1", "reset");
  }
  assert_unharmed(b);
}

static void test_set_state_begins(void** state) {
  struct bench* b = *state;
  const double qpos[6] = {0, 1.25}, qvel[6] = {0}, action[3] = {0};
  assert_ok(mjenv_set_state(b->env, 0, qpos, 6, qvel, 6));
  assert_ok(mjenv_step(b->env, NULL, action, 3, MJENV_DTYPE_FLOAT64, NULL));
  assert_unharmed(b);
}

// One row of three has fallen: none is stepped until it is reset.
static void test_step_after_end(void** state) {
  struct bench* b = *state;
  start(b);
  const double lying[6] = {0, 0.1, 1.5}, qvel[6] = {0}, action[9] = {0};
  assert_ok(mjenv_set_state(b->env, 1, lying, 6, qvel, 6));
  assert_ok(mjenv_step(b->env, NULL, action, 9, MJENV_DTYPE_FLOAT64, &b->out->batch));
  assert_true(!b->out->terminated[0] && b->out->terminated[1] && !b->out->terminated[2]);
  double* before = read_array(b->env, 0, "qpos", NULL);
  outputs_soil(b->out);
  assert_refused(MJENV_E_EPISODE_ENDED, mjenv_step(b->env, NULL, action, 9, MJENV_DTYPE_FLOAT64, &b->out->batch),
                 "row 1", "ended", "strict");
  double* after = read_array(b->env, 0, "qpos", NULL);
  assert_same_bits("qpos", after, before, 6);
  assert_true(outputs_untouched(b->out));
  const uint8_t mask[] = {0, 1, 0};
  assert_ok(mjenv_reset(b->env, mask, NULL));
  assert_ok(mjenv_step(b->env, NULL, action, 9, MJENV_DTYPE_FLOAT64, &b->out->batch));
  free(before);
  free(after);
}

static void test_step_after_truncation(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Swimmer-v5");
  assert_ok(mjenv_options_set_integer(options, "max_episode_steps", 2));
  mjenv_env* env = env_of_options(options, 1);
  struct outputs* out = outputs_of(env);
  const double action[2] = {0};
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, &out->batch));
  assert_true(!*out->truncated);
  assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, &out->batch));
  assert_true(*out->truncated && !*out->terminated);
  outputs_soil(out);
  assert_refused(MJENV_E_EPISODE_ENDED, mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, &out->batch), "row 0",
                 "ended");
  assert_true(outputs_untouched(out));
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, &out->batch));
  assert_true(!*out->truncated);
  outputs_free(out);
  mjenv_destroy(env);
}

static void test_no_limit(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Reacher-v5");
  assert_ok(mjenv_options_set_integer(options, "max_episode_steps", 0));
  mjenv_env* env = env_of_options(options, 1);
  struct outputs* out = outputs_of(env);
  const double action[2] = {0};
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int step = 0; step < 200; ++step) {
    assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, &out->batch));
    assert_true(!*out->truncated);
  }
  outputs_free(out);
  mjenv_destroy(env);
}

// ---- Messages ----

static void* message_of_new_thread(void* buffer) {
  snprintf(buffer, 64, "%s", mjenv_last_error());
  return NULL;
}

static void test_last_error(void** state) {
  (void)state;
  mjenv_options* none = NULL;
  assert_int_equal(mjenv_options_create("Nothing-v1", &none), MJENV_E_NAME);
  char message[512], other[64] = "?";
  snprintf(message, sizeof message, "%s", mjenv_last_error());
  pthread_t thread;
  assert_int_equal(pthread_create(&thread, NULL, message_of_new_thread, other), 0);
  pthread_join(thread, NULL);
  assert_string_equal(other, "");
  // A call that succeeds leaves the message.
  mjenv_options_destroy(options_of_id("Ant-v5"));
  assert_string_equal(mjenv_last_error(), message);
}

// The reason that a handle keeps, copied as far as it fits.
static void assert_reason(const void* handle, const char* word) {
  char text[1 << 14];
  int64_t size = 0, again = 0;
  assert_ok(mjenv_error_of(handle, NULL, 0, &size));
  assert_in_range(size, strlen(word) + 1, sizeof text);
  assert_ok(mjenv_error_of(handle, text, sizeof text, &again));
  assert_int_equal(again, size);
  assert_int_equal(strlen(text), size - 1);
  if (!strstr(text, word)) fail_msg("\"%s\" is not in \"%s\"", word, text);
  // Less room: a shorter text with its NUL, and nothing behind it.
  char part[8];
  memset(part, '#', sizeof part);
  assert_ok(mjenv_error_of(handle, part, 5, &again));
  assert_int_equal(again, size);
  assert_memory_equal(part, text, size - 1 < 4 ? size - 1 : 4);
  assert_int_equal(part[size - 1 < 4 ? size - 1 : 4], '\0');
  assert_int_equal(part[5], '#');
}

static void* fail_on_this_thread(void* env) {
  double value;
  int64_t count;
  assert_int_equal(mjenv_read(env, 0, "no_such_array", &value, 1, &count), MJENV_E_NAME);
  return NULL;
}

static void test_errors_of_handles(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Hopper-v5");
  mjenv_env *env = NULL, *none = NULL, *other = env_of_id("Ant-v5", 1);
  assert_ok(mjenv_create(options, 1, &env));
  int64_t size = 0;
  assert_ok(mjenv_error_of(env, NULL, 0, &size));
  assert_int_equal(size, 1);

  // Another thread's failure is known by the handle, and not by this thread.
  assert_int_equal(mjenv_spec_of("no such id", &(mjenv_spec){.struct_size = sizeof(mjenv_spec)}), MJENV_E_NAME);
  char here[1024];
  snprintf(here, sizeof here, "%s", mjenv_last_error());
  pthread_t thread;
  assert_int_equal(pthread_create(&thread, NULL, fail_on_this_thread, env), 0);
  pthread_join(thread, NULL);
  assert_reason(env, "no_such_array");
  assert_string_equal(mjenv_last_error(), here);

  // What fails to be created leaves its reason with what it was to be made from. A success changes no reason.
  assert_int_equal(mjenv_create(options, -3, &none), MJENV_E_VALUE);
  assert_reason(options, "-3");
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_reason(env, "no_such_array");
  assert_int_equal(mjenv_step(env, NULL, NULL, 3, MJENV_DTYPE_FLOAT32, NULL), MJENV_E_ARGUMENT);
  assert_reason(env, "action");
  assert_ok(mjenv_error_of(other, NULL, 0, &size));
  assert_int_equal(size, 1);

  assert_refused(MJENV_E_ARGUMENT, mjenv_error_of(env, NULL, 8, &size), "NULL");
  assert_refused(MJENV_E_ARGUMENT, mjenv_error_of(env, NULL, 0, NULL), "NULL");
  assert_refused(MJENV_E_ARGUMENT, mjenv_error_of(NULL, NULL, 0, &size), "");
  assert_refused(MJENV_E_ARGUMENT, mjenv_error_of(&size, NULL, 0, &size), "");
  mjenv_destroy(env);
  assert_refused(MJENV_E_ARGUMENT, mjenv_error_of(env, NULL, 0, &size), "");
  mjenv_destroy(other);
  mjenv_options_destroy(options);
}

static void test_long_names(void** state) {
  (void)state;
  char* name = allocate(1 << 20);
  memset(name, 'x', (1 << 20) - 1);
  name[(1 << 20) - 1] = '\0';
  mjenv_options *options = options_of_id("Ant-v5"), *none = NULL;
  assert_refused(MJENV_E_NAME, mjenv_options_create(name, &none), "xxx");
  assert_refused(MJENV_E_NAME, mjenv_options_set_integer(options, name, 1), "xxx");
  mjenv_options_destroy(options);
  free(name);
}

static void test_status_names(void** state) {
  (void)state;
  static const struct {
    mjenv_status status;
    const char* name;
  } names[] = {{MJENV_OK, "MJENV_OK"},
               {MJENV_E_ARGUMENT, "MJENV_E_ARGUMENT"},
               {MJENV_E_NAME, "MJENV_E_NAME"},
               {MJENV_E_TYPE, "MJENV_E_TYPE"},
               {MJENV_E_VALUE, "MJENV_E_VALUE"},
               {MJENV_E_SIZE, "MJENV_E_SIZE"},
               {MJENV_E_NOT_RESET, "MJENV_E_NOT_RESET"},
               {MJENV_E_EPISODE_ENDED, "MJENV_E_EPISODE_ENDED"},
               {MJENV_E_PENDING, "MJENV_E_PENDING"},
               {MJENV_E_NOT_PENDING, "MJENV_E_NOT_PENDING"},
               {MJENV_E_FORKED, "MJENV_E_FORKED"},
               {MJENV_E_FILE, "MJENV_E_FILE"},
               {MJENV_E_BUSY, "MJENV_E_BUSY"},
               {MJENV_E_MODEL, "MJENV_E_MODEL"},
               {MJENV_E_PHYSICS, "MJENV_E_PHYSICS"},
               {MJENV_E_SNAPSHOT, "MJENV_E_SNAPSHOT"},
               {MJENV_E_MEMORY, "MJENV_E_MEMORY"},
               {MJENV_E_INTERNAL, "MJENV_E_INTERNAL"},
               {MJENV_E_RENDER, "MJENV_E_RENDER"},
               {MJENV_E_TASK, "MJENV_E_TASK"},
               {MJENV_DIVERGED, "MJENV_DIVERGED"},
               {(mjenv_status)2, "unknown status"},
               {(mjenv_status)-999, "unknown status"}};
  for (size_t i = 0; i < COUNT(names); ++i) assert_string_equal(mjenv_status_name(names[i].status), names[i].name);
}

static void test_versions(void** state) {
  (void)state;
  assert_int_equal(mjenv_abi_version(), MJENV_ABI_VERSION);
  int major, minor, patch;
  char engine[100];
  snprintf(engine, sizeof engine, "(MuJoCo " MUJOCO "%s%s%s)",
           strcmp(MJENV_MATH, "portable") == 0 ? ", portable math" : "", *MJENV_ARCH ? ", " : "", MJENV_ARCH);
  assert_int_equal(sscanf(mjenv_version(), "%d.%d.%d (MuJoCo", &major, &minor, &patch), 3);
  assert_string_equal(strchr(mjenv_version(), '('), engine);
}

#define WITH(test) cmocka_unit_test_setup_teardown(test, set_up, tear_down)
#define WITH_ROWS(test) cmocka_unit_test_setup_teardown(test, set_up_rows, tear_down)

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_null_options),
      WITH(test_null_env),
      WITH(test_null_means_absent),
      WITH(test_struct_size),
      WITH(test_batch_sizes),
      WITH(test_negative_counts),
      WITH_ROWS(test_batch_sizes),
      WITH(test_action_sizes),
      WITH_ROWS(test_action_sizes),
      WITH(test_roles_and_indices),
      cmocka_unit_test(test_rows_of_create),
      WITH_ROWS(test_rows),
      WITH(test_other_sizes),
      WITH(test_names),
      WITH(test_bad_actions),
      WITH_ROWS(test_bad_actions),
      WITH(test_bad_states),
      WITH_ROWS(test_divergence),
      WITH(test_step_before_reset),
      WITH_ROWS(test_step_before_reset),
      WITH(test_set_state_begins),
      WITH_ROWS(test_step_after_end),
      cmocka_unit_test(test_step_after_truncation),
      cmocka_unit_test(test_no_limit),
      cmocka_unit_test(test_last_error),
      cmocka_unit_test(test_errors_of_handles),
      cmocka_unit_test(test_long_names),
      cmocka_unit_test(test_status_names),
      cmocka_unit_test(test_versions),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
