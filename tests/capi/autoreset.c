// Automatic resets, beside recordings of Gymnasium's SyncVectorEnv in its three modes.
#include "golden.h"

enum { ROWS = 3, PATTERN = 0xa5 };

struct vector {
  struct golden* golden;
  mjenv_env* env;
  bool split;  // steps are sent and received
  mjenv_batch batch;
  size_t obs_count, info_count, reset_info_count;
  double *obs, *info, *reset_info, *final_obs, *final_info, reward[ROWS];
  uint8_t terminated[ROWS], truncated[ROWS], was_reset[ROWS];
  bool ended[ROWS];  // by the step before
};

static struct vector* vector_of(const char* path, int64_t threads, bool split) {
  struct vector* v = allocate(sizeof *v);
  *v = (struct vector){.golden = golden_read(path), .split = split};
  v->golden->parts = ROWS;
  struct golden_option* option = &v->golden->options[v->golden->option_count++];
  *option = (struct golden_option){.name = "num_threads", .kind = "integer", .integer = threads};
  v->env = golden_create(v->golden, ROWS);
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(v->env, MJENV_ROLE_OBSERVATION, &space));
  v->obs_count = (size_t)space.count;
  v->info_count = (size_t)role_count(v->env, MJENV_ROLE_INFO);
  v->reset_info_count = (size_t)role_count(v->env, MJENV_ROLE_RESET_INFO);
  v->obs = allocate(ROWS * v->obs_count * sizeof(double));
  v->info = allocate(ROWS * v->info_count * sizeof(double));
  v->reset_info = allocate(ROWS * v->reset_info_count * sizeof(double));
  v->final_obs = allocate(ROWS * v->obs_count * sizeof(double));
  v->final_info = allocate(ROWS * v->info_count * sizeof(double));
  v->batch = (mjenv_batch){.struct_size = sizeof v->batch,
                           .obs_dtype = MJENV_DTYPE_FLOAT64,
                           .rows = ROWS,
                           .obs_count = (int64_t)v->obs_count,
                           .info_count = (int64_t)v->info_count,
                           .reset_info_count = (int64_t)v->reset_info_count,
                           .obs = v->obs,
                           .reward = v->reward,
                           .terminated = v->terminated,
                           .truncated = v->truncated,
                           .info = v->info,
                           .was_reset = v->was_reset,
                           .reset_info = v->reset_info,
                           .final_obs = v->final_obs,
                           .final_info = v->final_info};
  return v;
}

static void vector_free(struct vector* v) {
  mjenv_destroy(v->env);
  golden_free(v->golden);
  free(v->obs);
  free(v->info);
  free(v->reset_info);
  free(v->final_obs);
  free(v->final_info);
  free(v);
}

// Element `at` of line `line` of a recorded array, of any width.
static void recorded(const struct vector* v, const char* name, const char* dtype, size_t line, size_t at, size_t count,
                     void* to) {
  const struct golden_array* array = golden_array(v->golden, name, dtype);
  const size_t width = (size_t)(dtype[1] - '0');
  assert_true(line < array->rows && at + count <= array->columns);
  memcpy(to, (const char*)array->data + (line * array->columns + at) * width, count * width);
}

static uint8_t recorded_flag(const struct vector* v, const char* name, size_t line, size_t at) {
  uint8_t flag;
  recorded(v, name, "u1", line, at, 1, &flag);
  return flag;
}

static void assert_recorded(const struct vector* v, const char* name, size_t line, int64_t row, const double* got,
                            size_t count) {
  char why[256];
  if (!golden_same(v->golden, name, line * ROWS + (size_t)row, got, count, why, sizeof why))
    fail_msg("row %d at %zu: %s", (int)row, line, why);
}

// The numbers of a row under a key of the infos that Gymnasium would return; NULL when the row has no such key.
static const double* info_under(const struct vector* v, mjenv_role role, const double* info, int row, const char* key) {
  for (int64_t i = 0; i < mjenv_field_count(v->env, role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(v->env, role, i, &field));
    if (strcmp(field.name, key) == 0) return info + field.offset * ROWS + row * field.count;
  }
  return NULL;
}

// The recorded fields of a table of infos: those that the row has, with their numbers, and no others. A null info:
// none.
static void assert_infos(const struct vector* v, const char* table, bool of_reset, size_t line, int row,
                         mjenv_role role, const double* info) {
  const struct golden_field* fields = of_reset ? v->golden->reset_info : v->golden->info;
  const size_t count = of_reset ? v->golden->reset_info_count : v->golden->info_count;
  size_t width = 0, offset = 0;
  for (size_t f = 0; f < count; ++f) width += (size_t)fields[f].count;
  char mask[64];
  snprintf(mask, sizeof mask, "%s_mask", table);
  for (size_t f = 0; f < count; ++f) {
    const size_t size = (size_t)fields[f].count;
    const double* got = info ? info_under(v, role, info, row, fields[f].name) : NULL;
    assert_int_equal(recorded_flag(v, mask, line, (size_t)row * count + f), got != NULL);
    if (got) {
      double want[128];
      assert_true(size <= COUNT(want));
      recorded(v, table, "f8", line, (size_t)row * width + offset, size, want);
      assert_same_bits(fields[f].name, got, want, size);
    }
    offset += size;
  }
}

static void assert_all(const double* values, size_t count, double wanted) {
  for (size_t i = 0; i < count; ++i) assert_same_bits("value", values + i, &wanted, 1);
}

static void assert_soiled(const void* memory, size_t size) {
  for (size_t i = 0; i < size; ++i) assert_int_equal(((const unsigned char*)memory)[i], PATTERN);
}

static void replay_reset(struct vector* v, size_t reset) {
  uint8_t mask[ROWS], seeded[ROWS];
  int64_t seeds[ROWS];
  uint64_t given[ROWS];
  recorded(v, "reset_mask", "u1", reset, 0, ROWS, mask);
  recorded(v, "reset_seed", "i8", reset, 0, ROWS, seeds);
  for (int row = 0; row < ROWS; ++row) {
    seeded[row] = seeds[row] >= 0;
    given[row] = (uint64_t)seeds[row];
  }
  assert_ok(mjenv_seed(v->env, seeded, given, ROWS));
  memset(v->was_reset, PATTERN, sizeof v->was_reset);
  assert_ok(mjenv_reset(v->env, mask, &v->batch));
  for (int row = 0; row < ROWS; ++row) {
    assert_int_equal(v->was_reset[row], mask[row] ? 1 : PATTERN);
    assert_infos(v, "reset_reset_info", true, reset, row, MJENV_ROLE_RESET_INFO, mask[row] ? v->reset_info : NULL);
    if (!mask[row]) continue;
    v->ended[row] = false;
    assert_recorded(v, "reset_obs", reset, (size_t)row, v->obs + (size_t)row * v->obs_count, v->obs_count);
  }
}

static void play(struct vector* v, size_t step) {
  float action[ROWS * 32];
  const size_t count = golden_array(v->golden, "action", "f4")->columns;
  recorded(v, "action", "f4", step, 0, count, action);
  memset(v->final_obs, PATTERN, ROWS * v->obs_count * sizeof(double));
  if (!v->split) {
    assert_ok(mjenv_step(v->env, NULL, action, count, MJENV_DTYPE_FLOAT32, &v->batch));
    return;
  }
  int64_t rows[ROWS];
  int64_t done = 0;
  assert_ok(mjenv_send(v->env, NULL, 0, action, count, MJENV_DTYPE_FLOAT32));
  assert_ok(mjenv_recv(v->env, ROWS, -1, rows, ROWS, &done, &v->batch));
  assert_int_equal(done, ROWS);
}

static void replay_step(struct vector* v, size_t step, const char* mode) {
  play(v, step);
  for (int row = 0; row < ROWS; ++row) {
    const size_t r = (size_t)row;
    const bool ended = v->terminated[row] || v->truncated[row], same_step = strcmp(mode, "same_step") == 0;
    const bool was_reset = same_step ? ended : strcmp(mode, "next_step") == 0 && v->ended[row];
    assert_int_equal(v->terminated[row], recorded_flag(v, "terminated", step, r));
    assert_int_equal(v->truncated[row], recorded_flag(v, "truncated", step, r));
    assert_int_equal(v->was_reset[row], was_reset);
    assert_recorded(v, "obs", step, r, v->obs + r * v->obs_count, v->obs_count);
    assert_recorded(v, "reward", step, r, v->reward + r, 1);
    const mjenv_role role = was_reset ? MJENV_ROLE_RESET_INFO : MJENV_ROLE_INFO;
    const double* info = was_reset ? v->reset_info : v->info;
    assert_infos(v, "info", false, step, row, role, info);
    assert_infos(v, "reset_info", true, step, row, role, info);
    for (size_t f = 0; was_reset && f < v->golden->info_count; ++f)
      assert_all(info_under(v, MJENV_ROLE_INFO, v->info, row, v->golden->info[f].name),
                 (size_t)v->golden->info[f].count, 0);
    const bool final = same_step && ended;
    assert_int_equal(recorded_flag(v, "final_obs_mask", step, r), final);
    if (final)
      assert_recorded(v, "final_obs", step, r, v->final_obs + r * v->obs_count, v->obs_count);
    else
      assert_soiled(v->final_obs + r * v->obs_count, v->obs_count * sizeof(double));
    assert_infos(v, "final_info", false, step, row, MJENV_ROLE_INFO, final ? v->final_info : NULL);
    v->ended[row] = ended;
  }
}

static void replay(const char* path, int64_t threads, bool split) {
  struct vector* v = vector_of(path, threads, split);
  const char* mode = NULL;
  for (size_t i = 0; i < v->golden->option_count; ++i)
    if (strcmp(v->golden->options[i].name, "autoreset_mode") == 0) mode = v->golden->options[i].text;
  assert_non_null(mode);
  const size_t resets = golden_array(v->golden, "reset_at", "i8")->rows;
  size_t reset = 0;
  for (size_t step = 0; step < golden_steps(v->golden); ++step) {
    int64_t at = -1;
    if (reset < resets) recorded(v, "reset_at", "i8", reset, 0, 1, &at);
    if (at == (int64_t)step) replay_reset(v, reset++);
    replay_step(v, step, mode);
  }
  assert_int_equal(reset, resets);
  vector_free(v);
}

// An episode that ended in a rollout is reset by the next step, which is then no last step: it has no final
// observation.
static void test_reset_after_rollout(void** state) {
  (void)state;
  enum { STEPS = 3 };
  mjenv_options* options = options_of_id("HalfCheetah-v5");
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", "same_step"));
  assert_ok(mjenv_options_set_integer(options, "max_episode_steps", STEPS));
  mjenv_env* env = env_of_options(options, 1);
  static const double action[STEPS * 6] = {0.1};
  double obs[17], final_obs[17];
  uint8_t was_reset = 0;
  mjenv_batch batch = {.struct_size = sizeof batch,
                       .obs_dtype = MJENV_DTYPE_FLOAT64,
                       .rows = 1,
                       .obs_count = 17,
                       .obs = obs,
                       .final_obs = final_obs};
  batch.was_reset = &was_reset;
  for (int split = 0; split < 2; ++split) {
    assert_ok(mjenv_reset(env, NULL, NULL));
    assert_ok(mjenv_rollout(env, action, STEPS * 6, MJENV_DTYPE_FLOAT64, STEPS, NULL));
    memset(final_obs, PATTERN, sizeof final_obs);
    if (split) {
      int64_t row;
      int64_t count;
      assert_ok(mjenv_send(env, NULL, 0, action, 6, MJENV_DTYPE_FLOAT64));
      assert_ok(mjenv_recv(env, 1, -1, &row, 1, &count, &batch));
    } else {
      assert_ok(mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, &batch));
    }
    assert_int_equal(was_reset, 1);
    assert_soiled(final_obs, sizeof final_obs);
  }
  mjenv_destroy(env);
}

static void test_recording(void** state) {
  replay(*state, 1, false);
  replay(*state, 2, false);
  replay(*state, 2, true);
}

int main(void) {
  char** paths = golden_list("vector");
  size_t count = 0;
  while (paths[count]) ++count;
  struct CMUnitTest tests[count + 1];
  for (size_t i = 0; i < count; ++i)
    tests[i] = (struct CMUnitTest){strrchr(paths[i], '/') + 1, test_recording, NULL, NULL, paths[i]};
  tests[count] = (struct CMUnitTest)cmocka_unit_test(test_reset_after_rollout);
  const int failed = cmocka_run_group_tests(tests, NULL, NULL);
  golden_free_list(paths);
  return failed;
}
