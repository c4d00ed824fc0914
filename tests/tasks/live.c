// Live parameters, which the caller writes while rows run, and numbers that rows keep over resets.
#include <math.h>

#include "mjenv/task.h"
#include "support.h"

enum { SPEED, GAINS, LEVEL = 4, STEPS, GOALS, X, WIDTH };  // in an observation
enum { ROWS = 9, NU = 1, LIMIT = 5 };

static const char model[] =
    "<mujoco><option timestep='0.01'/><worldbody><geom name='floor' type='plane' size='5 5 .1'/>"
    "<body name='cart' pos='0 0 1'><joint name='slide' type='slide' axis='1 0 0'/><geom type='box' size='.1 .1 .1'/>"
    "</body><body pos='1 0 .099'><freejoint/><geom size='.1'/></body></worldbody>"
    "<actuator><motor joint='slide' gear='10' ctrllimited='true' ctrlrange='-1 1'/></actuator></mujoco>";

static const double gains[] = {1, 2, 3};
static mjenv_task_option options[] = {
    {.struct_size = sizeof(mjenv_task_option),
     .kind = MJENV_KIND_REALS,
     .name = "speed",
     .doc = "the commanded speed, m/s",
     .value = 0.5,
     .low = -2,
     .high = 2,
     .live = 1},
    {.struct_size = sizeof(mjenv_task_option),
     .kind = MJENV_KIND_REALS,
     .name = "gains",
     .doc = "of the reward",
     .values = gains,
     .count = 3,
     .live = 1},
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_REALS, .name = "fixed"},
};
static const mjenv_task_field field = {
    .struct_size = sizeof field, .role = MJENV_ROLE_OBSERVATION, .name = "all", .ndim = 1, .shape = {WIDTH}};

static struct {
  const char* parameter;
  int64_t first, count;
} bad_build;

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  (void)user;
  *self = NULL;
  const int64_t speed = mjenv_build_parameter(builder, "speed"), of_gains = mjenv_build_parameter(builder, "gains");
  assert_true(builder->failed || (speed == 0 && of_gains == 1));
  assert_true(builder->failed || builder->sim->parameters[3] == 3);
  mjenv_build_carry_bounds(builder, 0, 1, 0, 50);
  mjenv_build_keep(builder, 0, 1);
  mjenv_build_keep(builder, 2, 1);
  if (bad_build.parameter) mjenv_build_parameter(builder, bad_build.parameter);
  if (bad_build.count != 0) mjenv_build_keep(builder, bad_build.first, bad_build.count);
  return 0;
}

static int32_t reset(const void* self, mjenv_start* start) {
  (void)self;
  start->carried[0] += 1;
  start->carried[2] += start->parameters[3];
  start->qpos[0] = start->parameters[0] + 0 * mjenv_random_uniform(start->random, 0, 1);
  return start->parameters[0] == -1 ? mjenv_task_fail(start->api, "no such speed") : 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* observation) {
  (void)self;
  memcpy(observation, sim->parameters, 4 * sizeof *observation);
  memcpy(observation + 4, sim->carried, 3 * sizeof *observation);
  observation[X] = sim->qpos[0];
  return 0;
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self;
  outcome->carried[1] += 1;
  outcome->carried[2] += sim->parameters[2];
  outcome->reward = sim->parameters[0] * sim->parameters[1];
  return 0;
}

static mjenv_task task_of(const char* id) {
  mjenv_task task = MJENV_TASK_INIT;
  task.id = id;
  task.model_text = model;
  task.time_limit = LIMIT;
  task.carry_count = 3;
  task.options = options;
  task.option_count = COUNT(options);
  task.fields = &field;
  task.field_count = 1;
  task.build = build;
  task.reset = reset;
  task.observe = observe;
  task.step = step;
  return task;
}

// ---- Environments ----

static double obs[ROWS][WIDTH], final_obs[ROWS][WIDTH], reward[ROWS];
static const double still[ROWS * NU];

static mjenv_batch batch(void) {
  mjenv_batch out = MJENV_BATCH_INIT;
  out.rows = ROWS;
  out.obs_count = WIDTH;
  out.obs = obs;
  out.final_obs = final_obs;
  out.reward = reward;
  return out;
}

static mjenv_env* env_with(const char* id, const char* autoreset, int64_t threads, int64_t lanes) {
  mjenv_options* own = options_of_id(id);
  assert_ok(mjenv_options_set_string(own, "autoreset_mode", autoreset));
  assert_ok(mjenv_options_set_integer(own, "num_threads", threads));
  set_lanes(own, lanes);
  mjenv_env* env = env_of_options(own, ROWS);
  seed_rows(env, 1);
  return env;
}

static void do_reset(mjenv_env* env) {
  const mjenv_batch out = batch();
  assert_ok(mjenv_reset(env, NULL, &out));
}

static void do_step(mjenv_env* env) {
  const mjenv_batch out = batch();
  assert_ok(mjenv_step(env, NULL, still, ROWS * NU, MJENV_DTYPE_FLOAT64, &out));
}

static void do_observe(mjenv_env* env) {
  const mjenv_batch out = batch();
  assert_ok(mjenv_observe(env, &out));
}

static void assert_parameter(mjenv_env* env, int64_t row, const char* name, const double* want, int64_t count) {
  int64_t got = 0;
  double* values = read_array(env, row, name, &got);
  assert_int_equal(got, count);
  assert_same_bits(name, values, want, (size_t)count);
  free(values);
}

// ---- Tests ----

static void test_fields(void** state) {
  mjenv_env* env = env_with(*state, "disabled", 1, 0);
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_PARAMETERS), 2);
  const char* const names[] = {"parameters.speed", "parameters.gains"};
  const char* const docs[] = {"the commanded speed, m/s", "of the reward"};
  for (int64_t i = 0; i < 2; ++i) {
    mjenv_field found = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(env, MJENV_ROLE_PARAMETERS, i, &found));
    assert_string_equal(found.name, names[i]);
    assert_string_equal(found.doc, docs[i]);
    assert_int_equal(found.ndim, i);
    assert_int_equal(found.count, i == 0 ? 1 : 3);
    assert_int_equal(found.offset, i);
    assert_int_equal(found.dtype, MJENV_DTYPE_FLOAT64);
  }
  mjenv_destroy(env);
  env = env_of_id("Hopper-v5", 1);
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_PARAMETERS), 0);
  const double one = 1;
  assert_refused(MJENV_E_NAME, mjenv_write(env, NULL, "parameters.speed", &one, 1), "Hopper-v5 has no live parameter",
                 "there are none");
  mjenv_destroy(env);
}

// What the caller writes, callbacks see from their next call on, and it stays after resets.
static void test_writes(void** state) {
  mjenv_env* env = env_with(*state, "disabled", 1, 0);
  const double half = 0.5, fast = 1.5;
  assert_parameter(env, 3, "parameters.speed", &half, 1);
  assert_parameter(env, 3, "parameters.gains", gains, 3);
  do_reset(env);
  assert_true(obs[4][SPEED] == 0.5 && obs[4][GAINS + 2] == 3 && obs[4][X] == 0.5);

  const uint8_t odd[ROWS] = {0, 1, 0, 1, 0, 1, 0, 1, 0};
  assert_ok(mjenv_write(env, odd, "parameters.speed", &fast, 1));
  double each[ROWS][3];
  for (int row = 0; row < ROWS; ++row)
    for (int i = 0; i < 3; ++i) each[row][i] = 10 * row + i;
  assert_ok(mjenv_write(env, NULL, "parameters.gains", each[0], ROWS * 3));
  do_observe(env);
  for (int row = 0; row < ROWS; ++row) {
    assert_true(obs[row][SPEED] == (odd[row] ? 1.5 : 0.5));
    assert_same_bits("gains", obs[row] + GAINS, each[row], 3);
    assert_parameter(env, row, "parameters.gains", each[row], 3);
    assert_true(obs[row][X] == 0.5);
  }
  do_step(env);
  for (int row = 0; row < ROWS; ++row) assert_true(reward[row] == (odd[row] ? 1.5 : 0.5) * each[row][0]);
  do_reset(env);
  for (int row = 0; row < ROWS; ++row) {
    assert_true(obs[row][X] == (odd[row] ? 1.5 : 0.5));
    assert_same_bits("gains", obs[row] + GAINS, each[row], 3);
  }
  mjenv_destroy(env);
}

static void test_refused(void** state) {
  mjenv_env* env = env_with(*state, "disabled", 1, 0);
  do_reset(env);
  double each[ROWS] = {0, 1, 2, 2.5, 0, 0, 0, 0, 0};
  assert_refused(MJENV_E_VALUE, mjenv_write(env, NULL, "parameters.speed", each, ROWS), "row 3", "parameters.speed",
                 "2.5", "[-2, 2]");
  each[3] = NAN;
  assert_refused(MJENV_E_VALUE, mjenv_write(env, NULL, "parameters.speed", each, ROWS), "row 3", "nan");
  const uint8_t others[ROWS] = {1, 1, 1, 0, 1, 1, 1, 1, 1};
  assert_refused(MJENV_E_SIZE, mjenv_write(env, NULL, "parameters.speed", each, 2), "parameters.speed", "not 1", "9");
  assert_refused(MJENV_E_NAME, mjenv_write(env, NULL, "parameters.sped", each, 1), "parameters.sped",
                 "parameters.speed", "parameters.gains");
  assert_refused(MJENV_E_NAME, mjenv_write(env, NULL, "parameters.fixed", each, 1), "parameters.fixed");
  double value = 0;
  int64_t count = 0;
  assert_refused(MJENV_E_NAME, mjenv_read(env, 0, "parameters.", &value, 1, &count), "there are parameters.speed");
  const double half = 0.5;
  for (int64_t row = 0; row < ROWS; ++row) assert_parameter(env, row, "parameters.speed", &half, 1);
  assert_ok(mjenv_write(env, others, "parameters.speed", each, ROWS));  // what the mask leaves out is not read
  assert_ok(mjenv_send(env, NULL, 0, still, ROWS * NU, MJENV_DTYPE_FLOAT64));
  assert_refused(MJENV_E_PENDING, mjenv_write(env, NULL, "parameters.speed", &half, 1), "under way");
  mjenv_destroy(env);
}

// Rows keep some of the numbers that they carry: the level counts resets, the goals count steps, too.
static void test_kept(void** state) {
  const char* const modes[] = {"next_step", "same_step"};
  for (size_t mode = 0; mode < 2; ++mode)
    for (int64_t threads = 1; threads <= 2; ++threads)
      for (int64_t lanes = AUTO_LANES; lanes <= 0; ++lanes) {
        mjenv_env* env = env_with(*state, modes[mode], threads, lanes);
        do_reset(env);
        double level = 1, goals = 3, steps = 0;
        for (int t = 0; t < 4 * LIMIT; ++t) {
          do_step(env);
          const bool ended = steps == LIMIT, was_reset = mode == 0 ? ended : steps + 1 == LIMIT;
          if (mode == 1 || !ended) goals += 2, ++steps;
          if (mode == 1 && was_reset)
            for (int row = 0; row < ROWS; ++row)
              assert_true(final_obs[row][LEVEL] == level && final_obs[row][GOALS] == goals &&
                          final_obs[row][STEPS] == LIMIT);
          if (was_reset) ++level, goals += 3, steps = 0;
          for (int row = 0; row < ROWS; ++row)
            assert_true(obs[row][LEVEL] == level && obs[row][GOALS] == goals && obs[row][STEPS] == steps);
        }
        assert_true(level > 3);
        mjenv_destroy(env);
      }
}

// A reset that fails leaves what the row has kept.
static void test_failed_reset(void** state) {
  mjenv_env* env = env_with(*state, "disabled", 1, 0);
  do_reset(env);
  const double bad = -1, good = 1;
  const uint8_t one[ROWS] = {0, 0, 1, 0, 0, 0, 0, 0, 0};
  assert_ok(mjenv_write(env, one, "parameters.speed", &bad, 1));
  const mjenv_batch out = batch();
  assert_refused(MJENV_E_TASK, mjenv_reset(env, one, &out), "row 2", "reset", "no such speed");
  do_observe(env);
  assert_true(obs[2][LEVEL] == 1 && obs[2][GOALS] == 3 && obs[2][SPEED] == -1);
  assert_ok(mjenv_write(env, one, "parameters.speed", &good, 1));
  do_reset(env);
  assert_true(obs[2][LEVEL] == 2 && obs[2][GOALS] == 6 && obs[2][X] == 1);
  // The level has an upper bound.
  for (int i = 2; i < 50; ++i) do_reset(env);
  assert_refused(MJENV_E_TASK, mjenv_reset(env, one, &out), "row 2", "reset", "carried[0] is 51", "0 to 50");
  mjenv_destroy(env);
}

static void test_images(void** state) {
  mjenv_env *env = env_with(*state, "next_step", 1, -1), *other = env_with(*state, "next_step", 2, 0);
  double speeds[ROWS];
  for (int row = 0; row < ROWS; ++row) speeds[row] = row / 8.0;
  assert_ok(mjenv_write(env, NULL, "parameters.speed", speeds, ROWS));
  do_reset(env);
  for (int t = 0; t < LIMIT + 3; ++t) do_step(env);
  int64_t size = 0;
  unsigned char* image = image_of(env, MJENV_ALL_ROWS, &size);
  assert_ok(mjenv_restore(other, MJENV_ALL_ROWS, image, size));
  double want[ROWS][WIDTH], rewards[ROWS];
  for (int t = 0; t < 2 * LIMIT; ++t) {
    do_step(env);
    memcpy(want, obs, sizeof obs);
    memcpy(rewards, reward, sizeof reward);
    do_step(other);
    assert_same_bits("observation", obs[0], want[0], sizeof obs / sizeof(double));
    assert_same_bits("reward", reward, rewards, ROWS);
    assert_true(obs[3][SPEED] == 3 / 8.0);
  }
  free(image);
  const uint8_t last[ROWS] = {0, 0, 0, 0, 0, 0, 0, 0, 1};
  assert_ok(mjenv_copy_row(env, last, 3));
  do_observe(env);
  assert_same_bits("copy", obs[8], obs[3], WIDTH);

  // A stranger's image: a speed out of its bounds, and a kept number out of its.
  assert_ok(mjenv_snapshot(env, 0, NULL, 0, &size));
  image = allocate((size_t)size);
  const char* const parts[] = {"parameters", "carried"};
  const double bad[] = {2.5, 51}, good[] = {-2, 50};
  for (size_t i = 0; i < 2; ++i) {
    assert_ok(mjenv_snapshot(env, 0, image, size, &size));
    size_t bytes = 0;
    unsigned char* part = image_part(image, parts[i], &bytes);
    memcpy(part, &bad[i], sizeof bad[i]);
    image_seal(image, (size_t)size);
    assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, image, size), "damaged");
    memcpy(part, &good[i], sizeof good[i]);
    image_seal(image, (size_t)size);
    assert_ok(mjenv_restore(env, 0, image, size));
  }
  free(image);
  mjenv_destroy(env);
  mjenv_destroy(other);
}

static void test_refused_tasks(void** state) {
  (void)state;
  mjenv_task task = task_of("BadLive-v0");
  const mjenv_kind kinds[] = {MJENV_KIND_FLAG, MJENV_KIND_INTEGER, MJENV_KIND_STRING, MJENV_KIND_STRING_OR_INT};
  for (size_t i = 0; i < COUNT(kinds); ++i) {
    mjenv_task_option option = MJENV_TASK_OPTION_INIT;
    option.kind = kinds[i];
    option.name = "live";
    option.live = 1;
    task.options = &option;
    task.option_count = 1;
    assert_refused(MJENV_E_TYPE, mjenv_register_task(&task), "BadLive-v0", "option \"live\"", "real numbers");
  }
  task = task_of("BadLive-v0");
  assert_ok(mjenv_register_task(&task));
  mjenv_env* env = NULL;
  mjenv_options* own = options_of_id("BadLive-v0");
  bad_build.parameter = "fixed";
  assert_refused(MJENV_E_TYPE, mjenv_create(own, 1, &env), "BadLive-v0", "build", "\"fixed\" is no live parameter");
  bad_build.parameter = "strict";
  assert_refused(MJENV_E_TYPE, mjenv_create(own, 1, &env), "strict");
  bad_build.parameter = "nothing";
  assert_refused(MJENV_E_NAME, mjenv_create(own, 1, &env), "nothing");
  bad_build.parameter = NULL;
  const int64_t ranges[][2] = {{0, 4}, {3, 1}, {-1, 1}, {0, -1}, {INT64_MAX, 1}, {1, INT64_MAX}};
  for (size_t i = 0; i < COUNT(ranges); ++i) {
    bad_build.first = ranges[i][0];
    bad_build.count = ranges[i][1];
    assert_refused(i < 2 ? MJENV_E_TASK : MJENV_E_VALUE, mjenv_create(own, 1, &env), "BadLive-v0", "keep");
  }
  bad_build.count = 0;
  const double speed = 1.25;
  assert_ok(mjenv_options_set_reals(own, "speed", &speed, 1));
  env = env_of_options(own, 2);
  assert_parameter(env, 1, "parameters.speed", &speed, 1);
  mjenv_destroy(env);
}

int main(void) {
  static const mjenv_task_option unused = MJENV_TASK_OPTION_INIT;
  assert_true(unused.live == 0);
  const mjenv_task task = task_of("Live-v0");
  assert_ok(mjenv_register_task(&task));
  assert_ok(mjenv_load_tasks(PLUGINS "/liblive" PLUGIN_SUFFIX));
  static const struct {
    const char* name;
    CMUnitTestFunction run;
  } each[] = {{"fields", test_fields},
              {"writes", test_writes},
              {"refused", test_refused},
              {"kept", test_kept},
              {"failed reset", test_failed_reset},
              {"images", test_images}};
  static char* const ids[] = {"Live-v0", "CppLive-v0"};
  enum { EACH = COUNT(each), IDS = COUNT(ids) };
  struct CMUnitTest tests[EACH * IDS + 1];
  static char names[EACH * IDS][64];
  for (size_t i = 0; i < EACH * IDS; ++i) {
    snprintf(names[i], sizeof names[i], "%s of %s", each[i / IDS].name, ids[i % IDS]);
    tests[i] = (struct CMUnitTest){names[i], each[i / IDS].run, NULL, NULL, ids[i % IDS]};
  }
  tests[EACH * IDS] = (struct CMUnitTest)cmocka_unit_test(test_refused_tasks);
  return cmocka_run_group_tests(tests, NULL, NULL);
}
