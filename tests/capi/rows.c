// Many rows in one environment are as many environments of one row, whatever is read in between.
#include "golden.h"

enum { ROWS = 5, STEPS = 60 };

// A fixed sequence of small numbers, to mix rows, masks and arrays.
static uint32_t mixed(uint32_t below) {
  static uint64_t state = 1;
  state = state * 6364136223846793005u + 1442695040888963407u;
  return (uint32_t)(state >> 33) % below;
}

struct pair {
  mjenv_env *many, *single[ROWS];
  struct outputs *out, *single_out[ROWS];
  size_t nu;
};

// The id, then the threads that step many rows.
static struct pair* pair_of(const char* text) {
  struct pair* p = allocate(sizeof *p);
  char id[64];
  int threads = 0;
  assert_int_equal(sscanf(text, "%63s with %d", id, &threads), 2);
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  p->many = env_of_options(options, ROWS);
  p->out = outputs_of(p->many);
  p->nu = (size_t)action_count(p->many);
  assert_true(rows_of(p->many) == ROWS);
  for (int row = 0; row < ROWS; ++row) {
    p->single[row] = env_of_id(id, 1);
    p->single_out[row] = outputs_of(p->single[row]);
  }
  return p;
}

static void pair_free(struct pair* p) {
  for (int row = 0; row < ROWS; ++row) {
    outputs_free(p->single_out[row]);
    mjenv_destroy(p->single[row]);
  }
  outputs_free(p->out);
  mjenv_destroy(p->many);
  free(p);
}

static void assert_same_row(const struct pair* p, mjenv_role role, int row) {
  const size_t count = outputs_row_count(p->out);
  double *got = allocate(count * sizeof *got), *want = allocate(count * sizeof *want);
  outputs_row(p->many, p->out, role, row, got);
  outputs_row(p->single[row], p->single_out[row], role, 0, want);
  char what[32];
  snprintf(what, sizeof what, "row %d, output", row);
  assert_same_bits(what, got, want, count);
  free(got);
  free(want);
}

// MuJoCo's own scratch has leftovers.
static bool is_scratch(const char* name) {
  static const char* const scratch[] = {"efc_AR", "qH", "qDeriv", "qLU"};
  for (size_t i = 0; i < COUNT(scratch); ++i)
    if (strncmp(name, scratch[i], strlen(scratch[i])) == 0) return true;
  return false;
}

static void assert_same_array(const struct pair* p, const mjenv_field* field, int row) {
  const char* name = field->name;
  int64_t got_count, want_count;
  double *got = read_array(p->many, row, name, &got_count), *want = read_array(p->single[row], 0, name, &want_count);
  assert_int_equal(got_count, want_count);
  const size_t count = is_scratch(name) ? 0 : want_count;
  char what[64];
  snprintf(what, sizeof what, "row %d, %s", row, name);
  assert_same_bits(what, got, want, count);
  free(got);
  free(want);
}

static void seed_some(struct pair* p, const uint8_t* mask) {
  uint64_t seeds[ROWS];
  for (int row = 0; row < ROWS; ++row) {
    seeds[row] = ((uint64_t)mixed(1000) << 40) + mixed(1000);
    if (!mask || mask[row]) assert_ok(mjenv_seed(p->single[row], NULL, &seeds[row], 1));
  }
  assert_ok(mjenv_seed(p->many, mask, seeds, ROWS));
}

// Rows outside the mask keep the pattern.
static void reset_some(struct pair* p, const uint8_t* mask) {
  outputs_soil(p->out);
  struct outputs* soiled = outputs_of(p->many);
  assert_ok(mjenv_reset(p->many, mask, &p->out->batch));
  for (int row = 0; row < ROWS; ++row) {
    if (!mask || mask[row]) {
      assert_ok(mjenv_reset(p->single[row], NULL, &p->single_out[row]->batch));
      assert_same_row(p, MJENV_ROLE_RESET_INFO, row);
      continue;
    }
    assert_memory_equal(p->out->obs + row * p->out->obs_count, soiled->obs, (size_t)p->out->obs_count * sizeof(double));
    assert_memory_equal(p->out->reward + row, soiled->reward, sizeof(double));
    assert_int_equal(p->out->terminated[row], soiled->terminated[row]);
    assert_int_equal(p->out->truncated[row], soiled->truncated[row]);
    assert_int_equal(p->out->status[row], soiled->status[row]);
  }
  outputs_free(soiled);
}

static void step_all(struct pair* p, bool narrow) {
  double wide[ROWS * 32];
  float samples[ROWS * 32];
  for (size_t i = 0; i < ROWS * p->nu; ++i) wide[i] = samples[i] = (float)mixed(2001) / 1000 - 1;
  const mjenv_dtype dtype = narrow ? MJENV_DTYPE_FLOAT32 : MJENV_DTYPE_FLOAT64;
  assert_ok(mjenv_step(p->many, NULL, narrow ? (const void*)samples : wide, ROWS * p->nu, dtype, &p->out->batch));
  for (int row = 0; row < ROWS; ++row) {
    const void* action = narrow ? (const void*)(samples + row * p->nu) : wide + row * p->nu;
    assert_ok(mjenv_step(p->single[row], NULL, action, p->nu, dtype, &p->single_out[row]->batch));
    assert_same_row(p, MJENV_ROLE_INFO, row);
  }
}

static mjenv_field data_field(const struct pair* p, int64_t index) {
  mjenv_field field = MJENV_FIELD_INIT;
  assert_ok(mjenv_field_at(p->many, MJENV_ROLE_DATA, index, &field));
  return field;
}

static int64_t data_index(const struct pair* p, const char* name) {
  int64_t index = 0;
  while (strcmp(data_field(p, index).name, name) != 0) ++index;
  return index;
}

static void test_rows(void** state) {
  struct pair* p = pair_of(*state);
  seed_some(p, NULL);
  reset_some(p, NULL);
  const int64_t arrays = mjenv_field_count(p->many, MJENV_ROLE_DATA);
  const mjenv_field xpos = data_field(p, data_index(p, "xpos")), cfrc_ext = data_field(p, data_index(p, "cfrc_ext"));
  for (int step = 0; step < STEPS; ++step) {
    step_all(p, step % 2);
    uint8_t ended[ROWS], any = 0;
    for (int row = 0; row < ROWS; ++row)
      any |= ended[row] = p->out->terminated[row] || p->out->truncated[row] || mixed(20) == 0;
    for (int read = 0; read < 3; ++read) {
      const mjenv_field any_field = data_field(p, mixed((uint32_t)arrays));
      assert_same_array(p, &any_field, (int)mixed(ROWS));
      assert_same_array(p, &xpos, (int)mixed(ROWS));
      assert_same_array(p, &cfrc_ext, (int)mixed(ROWS));
    }
    if (step % 16 == 7) seed_some(p, ended);
    if (any) reset_some(p, ended);
  }
  pair_free(p);
}

// After a step and after a reset, each array of each row, in an order that leaves no row in the work space for long.
static void test_every_array(void** state) {
  struct pair* p = pair_of(*state);
  seed_some(p, NULL);
  reset_some(p, NULL);
  for (int step = 0; step < 3; ++step) step_all(p, true);
  const uint8_t mask[ROWS] = {0, 0, 1, 0, 0};
  reset_some(p, mask);
  for (int64_t i = 0; i < mjenv_field_count(p->many, MJENV_ROLE_DATA); ++i) {
    const mjenv_field field = data_field(p, i);
    for (int row = 0; row < ROWS; ++row) assert_same_array(p, &field, row * 2 % ROWS);
  }
  pair_free(p);
}

// A pendulum with a tendon around a ball and another over sites, and a stop.
static const char wrapping[] =
    "<mujoco><option JACOBIAN/><worldbody><site name='top' pos='0 0 1.3'/>"
    "<geom name='ball' size='.2' pos='0 .05 1'/>"
    "<body pos='0 0 1'><joint name='hinge' axis='0 1 0' limited='true' range='-90 90' frictionloss='.1'/>"
    "<geom type='capsule' fromto='0 0 -.2 0 0 -.9' size='.05' contype='0'/><site name='tip' pos='0 0 -1'/>"
    "<body pos='0 0 -1'><joint name='slide' type='slide' limited='true' range='-.1 .1'/><geom size='.1' "
    "contype='0'/></body>"
    "</body></worldbody><tendon><spatial><site site='top'/><geom geom='ball'/><site site='tip'/></spatial>"
    "<spatial><site site='top'/><site site='tip'/></spatial>"
    "<fixed><joint joint='hinge' coef='1'/></fixed></tendon></mujoco>";

// Elements that a row's state does not fill are 0, whichever row was computed in the same memory before.
static void test_unfilled(void** state) {
  char xml[sizeof wrapping + 32], *end = xml;
  const char* mark = strstr(wrapping, "JACOBIAN");
  end += sprintf(end, "%.*s", (int)(mark - wrapping), wrapping);
  sprintf(end, "jacobian='%s' solver='PGS'%s", (const char*)*state, mark + strlen("JACOBIAN"));
  mjenv_options* options = options_of_id("Model-v0");
  assert_ok(mjenv_options_set_string(options, "xml_string", xml));
  mjenv_env* env = env_of_options(options, 2);
  assert_ok(mjenv_reset(env, NULL, NULL));
  // The first row has both limits, and the tendon around the ball. The second has neither.
  static const double bent[2] = {1.6, 0.2}, straight[2] = {0, 0}, at_rest[2] = {0, 0};
  assert_ok(mjenv_set_state(env, 0, bent, 2, at_rest, 2));
  assert_ok(mjenv_set_state(env, 1, straight, 2, at_rest, 2));
  int shorter = 0;
  for (int64_t i = 0; i < mjenv_field_count(env, MJENV_ROLE_DATA); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(env, MJENV_ROLE_DATA, i, &field));
    const bool has_tail = strncmp(field.name, "wrap_", 5) == 0 || strncmp(field.name, "efc_", 4) == 0 ||
                          strncmp(field.name, "ten_J", 5) == 0;
    if (!has_tail) continue;
    int64_t count = 0;
    free(read_array(env, 0, field.name, &count));
    double *first = read_array(env, 1, field.name, &count), *other = read_array(env, 0, field.name, &count);
    double* again = read_array(env, 1, field.name, &count);
    assert_same_bits(field.name, again, first, count);
    // A row of its own, which never had another state, holds the same.
    mjenv_options* own = options_of_id("Model-v0");
    assert_ok(mjenv_options_set_string(own, "xml_string", xml));
    mjenv_env* alone = env_of_options(own, 1);
    assert_ok(mjenv_reset(alone, NULL, NULL));
    assert_ok(mjenv_set_state(alone, 0, straight, 2, at_rest, 2));
    double* want = read_array(alone, 0, field.name, &count);
    assert_same_bits(field.name, first, want, count);
    size_t filled = 0, fewer = 0;
    for (int64_t k = 0; k < count; ++k) filled += other[k] != 0, fewer += want[k] != 0;
    shorter += fewer < filled;
    free(first), free(other), free(again), free(want);
    mjenv_destroy(alone);
  }
  // Of these arrays, MuJoCo 4.0 has the constraints' in its arena, where they cannot be read.
  assert_true(shorter >= (MUJOCO[0] == '4' ? 1 : 6));
  mjenv_destroy(env);
}

static void test_observe(void** state) {
  struct pair* p = pair_of(*state);
  seed_some(p, NULL);
  reset_some(p, NULL);
  for (int step = 0; step < 5; ++step) step_all(p, false);
  const size_t count = (size_t)(ROWS * p->out->obs_count);
  double* seen = allocate(count * sizeof *seen);
  float* narrow = allocate(count * sizeof *narrow);
  mjenv_batch batch = {.struct_size = sizeof batch,
                       .obs_dtype = MJENV_DTYPE_FLOAT64,
                       .rows = ROWS,
                       .obs_count = p->out->obs_count,
                       .obs = seen};
  assert_ok(mjenv_observe(p->many, &batch));
  assert_same_bits("observation", seen, p->out->obs, count);
  batch.obs = narrow;
  batch.obs_dtype = MJENV_DTYPE_FLOAT32;
  assert_ok(mjenv_observe(p->many, &batch));
  for (size_t i = 0; i < count; ++i) assert_true(narrow[i] == (float)seen[i]);
  const size_t width = (size_t)p->out->obs_count;
  for (int64_t row = ROWS - 1; row >= 0; --row) {  // one by one; the others' elements stay
    for (size_t i = 0; i < count; ++i) narrow[i] = -7;
    assert_ok(mjenv_observe_row(p->many, row, &batch));
    for (size_t i = 0; i < count; ++i) assert_true(narrow[i] == (i / width == (size_t)row ? (float)seen[i] : -7));
  }
  free(seen);
  free(narrow);
  pair_free(p);
}

static void assert_same_arrays(const struct pair* p) {
  static const char* const arrays[] = {"time", "qpos",     "qacc_warmstart", "xpos",         "geom_xmat",
                                       "ncon", "cfrc_ext", "body_mass",      "opt.timestep", "actuator_force"};
  for (size_t i = 0; i < COUNT(arrays); ++i) {
    int64_t count = 0, each = 0;
    double* all = read_array(p->many, MJENV_ALL_ROWS, arrays[i], &count);
    for (int row = 0; row < ROWS; ++row) {
      double* one = read_array(p->single[row], 0, arrays[i], &each);
      assert_same_bits(arrays[i], all + row * each, one, (size_t)each);
      free(one);
    }
    assert_int_equal(count, ROWS * each);
    free(all);
  }
}

// Arrays, states and mj_resetData of all rows in one call are those of each row.
static void test_all_rows_at_once(void** state) {
  struct pair* p = pair_of(*state);
  seed_some(p, NULL);
  reset_some(p, NULL);
  for (int round = 0; round < 3; ++round) {
    for (int step = 0; step < 4; ++step) step_all(p, false);
    assert_same_arrays(p);
    int64_t nq = 0, nv = 0;
    double* qpos = read_array(p->many, MJENV_ALL_ROWS, "qpos", &nq);
    double* qvel = read_array(p->many, MJENV_ALL_ROWS, "qvel", &nv);
    qpos[1] += 0.25;
    assert_refused(MJENV_E_SIZE, mjenv_set_state(p->many, MJENV_ALL_ROWS, qpos, nq / ROWS, qvel, nv), "nq");
    assert_ok(mjenv_set_state(p->many, MJENV_ALL_ROWS, qpos, nq, qvel, nv));
    for (int row = 0; row < ROWS; ++row)
      assert_ok(
          mjenv_set_state(p->single[row], 0, qpos + row * (nq / ROWS), nq / ROWS, qvel + row * (nv / ROWS), nv / ROWS));
    assert_same_arrays(p);
    const uint8_t mask[ROWS] = {0, 1, 0, 1};
    if (round == 1) {
      assert_ok(mjenv_reset_data(p->many, mask));
      for (int row = 0; row < ROWS; ++row)
        if (mask[row] != 0) assert_ok(mjenv_reset_data(p->single[row], NULL));
      assert_same_arrays(p);
    }
    free(qpos);
    free(qvel);
  }
  pair_free(p);
}

// Each output alone is the same as all together.
static void test_single_outputs(void** state) {
  struct pair* p = pair_of(*state);
  struct outputs* alone = outputs_of(p->many);
  for (int kept = 0; kept < 6; ++kept) {
    seed_some(p, NULL);
    reset_some(p, NULL);
    step_all(p, true);
    int64_t size = 0;
    double* image = NULL;
    for (int row = 0; row < ROWS; ++row) {
      assert_ok(mjenv_snapshot(p->single[row], 0, NULL, 0, &size));
      image = allocate(size);
      assert_ok(mjenv_snapshot(p->single[row], 0, image, size, &size));
      assert_ok(mjenv_restore(p->many, row, image, size));
      free(image);
    }
    const double action[ROWS * 32] = {0.25, -0.5};
    mjenv_batch batch = alone->batch;
    if (kept != 0) batch.obs = NULL;
    if (kept != 1) batch.reward = NULL;
    if (kept != 2) batch.terminated = NULL;
    if (kept != 3) batch.truncated = NULL;
    if (kept != 4) batch.info = NULL;
    if (kept != 5) batch.status = NULL;
    outputs_soil(alone);
    assert_ok(mjenv_step(p->many, NULL, action, ROWS * p->nu, MJENV_DTYPE_FLOAT64, &batch));
    for (int row = 0; row < ROWS; ++row) {
      const struct outputs* want = p->single_out[row];
      assert_ok(mjenv_step(p->single[row], NULL, action + row * p->nu, p->nu, MJENV_DTYPE_FLOAT64, &want->batch));
      if (kept == 0) assert_same_bits("obs", alone->obs + row * want->obs_count, want->obs, (size_t)want->obs_count);
      if (kept == 1) assert_same_bits("reward", alone->reward + row, want->reward, 1);
      if (kept == 2) assert_int_equal(alone->terminated[row], *want->terminated);
      if (kept == 3) assert_int_equal(alone->truncated[row], *want->truncated);
      if (kept == 5) assert_int_equal(alone->status[row], *want->status);
    }
    for (int64_t i = 0; kept == 4 && i < mjenv_field_count(p->many, MJENV_ROLE_INFO); ++i) {
      mjenv_field field = MJENV_FIELD_INIT;
      assert_ok(mjenv_field_at(p->many, MJENV_ROLE_INFO, i, &field));
      for (int row = 0; row < ROWS; ++row)
        assert_same_bits(field.name, alone->info + field.offset * ROWS + row * field.count,
                         p->single_out[row]->info + field.offset, (size_t)field.count);
    }
  }
  outputs_free(alone);
  pair_free(p);
}

// Samples of many rows are one stream, row by row: as Gymnasium's action space of a vector environment draws them.
static void test_samples(void** state) {
  (void)state;
  mjenv_env *many = env_of_id("Ant-v5", 3), *single = env_of_id("Ant-v5", 1);
  float got[24], want[24];
  assert_ok(mjenv_seed_actions(many, 7));
  assert_ok(mjenv_seed_actions(single, 7));
  assert_ok(mjenv_sample_actions(many, got, 24));
  for (int row = 0; row < 3; ++row) assert_ok(mjenv_sample_actions(single, want + 8 * row, 8));
  assert_memory_equal(got, want, sizeof got);
  mjenv_destroy(many);
  mjenv_destroy(single);
}

static void test_unseeded_rows_differ(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("HalfCheetah-v5", 2);
  struct outputs* out = outputs_of(env);
  assert_ok(mjenv_reset(env, NULL, &out->batch));
  assert_memory_not_equal(out->obs, out->obs + out->obs_count, (size_t)out->obs_count * sizeof(double));
  outputs_free(out);
  mjenv_destroy(env);
}

#define OF(test, id, threads) \
  { #test " of " id " with " #threads, test, NULL, NULL, (void*)(uintptr_t)(id " with " #threads) }

int main(void) {
  const struct CMUnitTest tests[] = {
      OF(test_rows, "Ant-v5", 1),
      OF(test_rows, "Ant-v5", 3),
      OF(test_rows, "HalfCheetah-v4", 1),
      OF(test_rows, "Humanoid-v5", 2),
      OF(test_rows, "HumanoidStandup-v4", 1),
      OF(test_rows, "InvertedDoublePendulum-v5", 1),
      OF(test_rows, PUSHER, 1),
      OF(test_rows, "Reacher-v4", 1),
      OF(test_rows, "Walker2d-v5", 8),
      OF(test_every_array, "Ant-v4", 1),
      OF(test_every_array, "HalfCheetah-v5", 1),
      OF(test_every_array, "HumanoidStandup-v5", 2),
      OF(test_every_array, "Pusher-v5", 1),
      OF(test_every_array, "Swimmer-v5", 1),
      OF(test_observe, "Humanoid-v4", 1),
      OF(test_observe, "Reacher-v5", 1),
      OF(test_all_rows_at_once, "Ant-v5", 2),
      OF(test_all_rows_at_once, "HalfCheetah-v5", 1),
      OF(test_single_outputs, "Humanoid-v5", 2),
      OF(test_single_outputs, "HalfCheetah-v5", 1),
      {"test_unfilled, dense", test_unfilled, NULL, NULL, (void*)(uintptr_t) "dense"},
      {"test_unfilled, sparse", test_unfilled, NULL, NULL, (void*)(uintptr_t) "sparse"},
      cmocka_unit_test(test_samples),
      cmocka_unit_test(test_unseeded_rows_differ),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
