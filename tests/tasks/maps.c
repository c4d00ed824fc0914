// Maps between the action and the simulation, and own arrays that a step writes: what is refused, and that a row whose map or
// step fails stays as it was. tests/live/test_tasks.py compares their results with MuJoCo's.
#include <math.h>

#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 5, ACTIONS = 3, SEEN = 6 };

static const char model[] =
    "<mujoco><option timestep='0.01'/><worldbody><geom name='marker' pos='0 0 2' size='.1' contype='0' "
    "conaffinity='0'/>"
    "<body name='ball' pos='0 0 1'><joint name='z' type='slide' axis='0 0 1'/><geom name='ball' size='.1'/></body>"
    "</worldbody><actuator><motor joint='z' gear='30'/></actuator></mujoco>";

static const mjenv_task_option options[] = {
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_STRING, .name = "build", .text = "good"},
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_STRING, .name = "fails", .text = "never"},
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_REALS, .name = "row", .live = 1},
};
static const mjenv_task_field fields[] = {
    {.struct_size = sizeof(mjenv_task_field),
     .role = MJENV_ROLE_OBSERVATION,
     .name = "seen",
     .ndim = 1,
     .shape = {SEEN}},
};

struct self {
  int32_t force, place, places;
  char fails[16];
};
static bool breaks;  // the task then fails as the option says, in row 2

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  (void)user;
  const char* how = mjenv_build_text(builder, "build");
  const double low[ACTIONS] = {-1, -2, -INFINITY}, high[ACTIONS] = {1, 2, 0.1}, bad[ACTIONS] = {0, NAN, 0};
  if (strcmp(how, "none") == 0)
    mjenv_build_action(builder, 0, low, high);
  else if (strcmp(how, "many") == 0)
    mjenv_build_action(builder, INT64_MAX, NULL, NULL);
  else if (strcmp(how, "reversed") == 0)
    mjenv_build_action(builder, ACTIONS, high, low);
  else if (strcmp(how, "nan") == 0)
    mjenv_build_action(builder, ACTIONS, low, bad);
  else if (strcmp(how, "unbounded") == 0)
    mjenv_build_action(builder, ACTIONS, NULL, NULL);
  else
    mjenv_build_action(builder, ACTIONS, low, high);
  mjenv_build_current(builder);
  mjenv_build_carry_bounds(builder, 1, 1, -1, 1);
  struct self* s = allocate(sizeof *s);
  *self = s;
  s->force = mjenv_build_own(builder, "qfrc_applied");
  s->place = mjenv_build_own(builder, "geom_pos");
  s->places = mjenv_build_array(builder, "geom_pos", NULL);
  snprintf(s->fails, sizeof s->fails, "%s", mjenv_build_text(builder, "fails"));
  return 0;
}

static void destroy(void* self) { free(self); }

static bool fails(const void* self, const double* carried, const char* how) {
  return breaks && carried[0] == 2 && strcmp(((const struct self*)self)->fails, how) == 0;
}

static int32_t reset(const void* self, mjenv_start* start) {
  const struct self* s = self;
  start->carried[0] = start->parameters[0];
  return start->own[s->force] ? mjenv_task_fail(start->api, "a reset writes no forces") : 0;
}

static int32_t before_step(const void* self, const mjenv_sim* sim, mjenv_control* control) {
  const struct self* s = self;
  if (sim->action_count != ACTIONS || control->substep != 0 || control->own[s->place])
    return mjenv_task_fail(sim->api, "before_step was called otherwise");
  control->carried[1] = 0.5 * sim->action[0];
  control->ctrl[0] = sim->action[0] + mjenv_random_uniform(control->random, 0, 1e-3);
  if (fails(self, control->carried, "map")) return mjenv_task_fail(sim->api, "no map");
  if (fails(self, control->carried, "ctrl")) control->ctrl[0] = NAN;
  if (fails(self, control->carried, "carried")) control->carried[1] = 2;
  if (fails(self, control->carried, "draw")) mjenv_random_uniform(control->random, 1, 0);
  return 0;
}

static int32_t before_substep(const void* self, const mjenv_sim* sim, mjenv_control* control) {
  const struct self* s = self;
  control->own[s->force][0] = sim->action[1] * (1 + control->substep);
  if (control->substep == 1 && fails(self, control->carried, "force")) control->own[s->force][0] = INFINITY;
  if (control->substep == 2 && fails(self, control->carried, "late")) return mjenv_task_fail(sim->api, "too late");
  return 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  const struct self* s = self;
  to[0] = sim->qpos[0];
  to[1] = sim->qvel[0];
  to[2] = sim->ctrl[0];
  memcpy(to + 3, sim->carried, 2 * sizeof *to);
  to[5] = ((const double*)sim->arrays[s->places])[0];
  return 0;
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)sim;
  const struct self* s = self;
  outcome->own[s->place][0] += 1;
  if (fails(self, outcome->carried, "place")) outcome->own[s->place][1] = NAN;
  if (fails(self, outcome->carried, "kick")) outcome->qvel[0] = NAN;
  return 0;
}

static const mjenv_task mapped = {.struct_size = sizeof(mjenv_task),
                                  .id = "tests/Mapped-v0",
                                  .model_text = model,
                                  .frame_skip = 3,
                                  .carry_count = 2,
                                  .options = options,
                                  .option_count = COUNT(options),
                                  .fields = fields,
                                  .field_count = COUNT(fields),
                                  .build = build,
                                  .destroy = destroy,
                                  .reset = reset,
                                  .observe = observe,
                                  .step = step,
                                  .before_step = before_step,
                                  .before_substep = before_substep};

static mjenv_env* env_with(const char* how, int64_t lanes) {
  mjenv_options* chosen = options_of_id(mapped.id);
  assert_ok(mjenv_options_set_string(chosen, "fails", how));
  set_lanes(chosen, lanes);
  mjenv_env* env = env_of_options(chosen, ROWS);
  seed_rows(env, 1);
  const double rows[ROWS] = {0, 1, 2, 3, 4};
  assert_ok(mjenv_write(env, NULL, "parameters.row", rows, ROWS));
  breaks = false;
  assert_ok(mjenv_reset(env, NULL, NULL));
  return env;
}

static mjenv_status step_all(mjenv_env* env, struct outputs* out) {
  double action[ROWS * ACTIONS];
  for (int i = 0; i < ROWS * ACTIONS; ++i) action[i] = 0.03 * i - 0.2;
  return mjenv_step(env, NULL, action, ROWS * ACTIONS, MJENV_DTYPE_FLOAT64, &out->batch);
}

static void refused(const char* how, mjenv_status status, const char* word) {
  mjenv_options* chosen = options_of_id(mapped.id);
  assert_ok(mjenv_options_set_string(chosen, "build", how));
  mjenv_env* env = NULL;
  assert_refused(status, mjenv_create(chosen, 1, &env), "Mapped-v0", word);
  mjenv_options_destroy(chosen);
}

static void test_action_space(void** state) {
  (void)state;
  refused("none", MJENV_E_VALUE, "the count is 0");
  refused("many", MJENV_E_VALUE, "the count is 9223372036854775807");
  refused("reversed", MJENV_E_VALUE, "bounds of number 0 are 1 and -1");
  refused("nan", MJENV_E_VALUE, "bounds of number 1");
  mjenv_task other = mapped;
  other.id = "tests/Unmapped-v0";
  other.before_step = NULL;
  assert_ok(mjenv_register_task(&other));
  mjenv_options* chosen = options_of_id(other.id);
  mjenv_env* env = NULL;
  assert_refused(MJENV_E_TASK, mjenv_create(chosen, 1, &env), "Unmapped-v0", "needs the callback before_step");
  mjenv_options_destroy(chosen);

  env = env_with("never", -1);
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_ACTION, &space));
  assert_int_equal(space.count, ACTIONS);
  assert_true(space.low[1] == -2 && space.low[2] == -INFINITY && space.high[2] == (double)0.1f);
  mjenv_field field = MJENV_FIELD_INIT;
  assert_ok(mjenv_field_at(env, MJENV_ROLE_ACTION, 2, &field));
  assert_string_equal(field.name, "action[2]");
  const double action[ROWS] = {0};
  assert_refused(MJENV_E_SIZE, mjenv_step(env, NULL, action, ROWS, MJENV_DTYPE_FLOAT64, NULL), "5", "15");
  float drawn[ROWS * ACTIONS];
  assert_refused(MJENV_E_MODEL, mjenv_sample_actions(env, drawn, ROWS * ACTIONS), "action 2", "infinite");
  mjenv_destroy(env);
}

// The row that fails keeps state, carried numbers, own arrays and stream; the others are stepped.
static void failing(const char* how, mjenv_status status, const char* word) {
  for (int64_t lanes = AUTO_LANES; lanes <= 0; ++lanes) {
    mjenv_env *env = env_with(how, lanes), *good = env_with("never", lanes);
    struct outputs *out = outputs_of(env), *want = outputs_of(good);
    for (int i = 0; i < 3; ++i) {
      assert_ok(step_all(env, out));
      assert_ok(step_all(good, want));
    }
    int64_t size = 0, size_after = 0;
    void* before = image_of(env, 2, &size);
    breaks = true;
    assert_refused(status, step_all(env, out), "row 2", word);
    breaks = false;
    void* after = image_of(env, 2, &size_after);
    assert_int_equal(size, size_after);
    assert_memory_equal(before, after, size);
    assert_ok(step_all(good, want));
    for (int row = 0; row < ROWS; ++row)
      if (row != 2) assert_same_bits(how, out->obs + row * SEEN, want->obs + row * SEEN, SEEN);
    const uint8_t last[ROWS] = {0, 0, 1};  // the row catches up
    double action[ROWS * ACTIONS];
    for (int i = 0; i < ROWS * ACTIONS; ++i) action[i] = 0.03 * i - 0.2;
    assert_ok(mjenv_step(env, last, action, ROWS * ACTIONS, MJENV_DTYPE_FLOAT64, &out->batch));
    assert_same_bits(how, out->obs + 2 * SEEN, want->obs + 2 * SEEN, SEEN);
    free(before);
    free(after);
    outputs_free(out);
    outputs_free(want);
    mjenv_destroy(env);
    mjenv_destroy(good);
  }
}

static void test_failures(void** state) {
  (void)state;
  failing("map", MJENV_E_TASK, "before_step: no map");
  failing("ctrl", MJENV_E_TASK, "before_step: ctrl[0] is");
  failing("carried", MJENV_E_TASK, "before_step: carried[1] is 2");
  failing("draw", MJENV_E_TASK, "uniform: high is below low");
  failing("force", MJENV_E_VALUE, "qfrc_applied");
  failing("late", MJENV_E_TASK, "before_substep: too late");
  failing("place", MJENV_E_VALUE, "geom_pos");
  failing("kick", MJENV_E_TASK, "step: qvel[0] is nan");
}

// A map that divides by zero does so at once; with strict 0, MuJoCo finds the bad number.
static void test_not_strict(void** state) {
  (void)state;
  mjenv_options* chosen = options_of_id(mapped.id);
  assert_ok(mjenv_options_set_string(chosen, "fails", "ctrl"));
  assert_ok(mjenv_options_set_integer(chosen, "strict", 0));
  mjenv_env* env = env_of_options(chosen, ROWS);
  seed_rows(env, 1);
  const double rows[ROWS] = {0, 1, 2, 3, 4};
  assert_ok(mjenv_write(env, NULL, "parameters.row", rows, ROWS));
  assert_ok(mjenv_reset(env, NULL, NULL));
  struct outputs* out = outputs_of(env);
  breaks = true;
  assert_ok(step_all(env, out));
  breaks = false;
  outputs_free(out);
  mjenv_destroy(env);
}

// ---- mjenv_control_forward ----

// The ball lies on a wall and is pushed, so that the solver's result depends on where it begins.
static const char pushed_model[] =
    "<mujoco><option timestep='0.01'/><worldbody><geom type='plane' size='9 9 .1'/>"
    "<body pos='0 0 .09'><joint name='x' type='slide' axis='1 0 0'/><joint name='z' type='slide' axis='0 0 1'/>"
    "<joint name='turn' type='hinge' axis='0 1 0'/><geom type='capsule' size='.1 .1' euler='0 90 0'/></body>"
    "</worldbody><actuator><motor joint='x' gear='30'/></actuator></mujoco>";
enum { PUSHED_NV = 3 };
static const mjenv_task_field pushed_fields[] = {
    {.struct_size = sizeof(mjenv_task_field),
     .role = MJENV_ROLE_OBSERVATION,
     .name = "state",
     .ndim = 1,
     .shape = {2 * PUSHED_NV}},
};
static const char* pushed_how = "";  // what goes wrong, or is done in another way

static double slower(double velocity) { return velocity < -0.2 ? -0.2 : velocity > 0.2 ? 0.2 : velocity; }

static int32_t build_pushed(mjenv_builder* builder, void* user, void** self) {
  (void)user, (void)self;
  if (strcmp(pushed_how, "current") == 0) mjenv_build_current(builder);
  return 0;
}

static int32_t before_pushed_step(const void* self, const mjenv_sim* sim, mjenv_control* control) {
  (void)self;
  if (strcmp(pushed_how, "current") == 0 && control->qvel) return mjenv_task_fail(sim->api, "it has velocities");
  for (int i = 0; control->qvel && i < PUSHED_NV; ++i) control->qvel[i] = slower(control->qvel[i]);
  if (strcmp(pushed_how, "infinite") == 0) control->qvel[1] = INFINITY;
  if (strcmp(pushed_how, "some") != 0 || sim->action[0] > 0) mjenv_control_forward(control);
  if (strcmp(pushed_how, "changed") == 0) control->qvel[0] += 0.1 * sim->action[0];
  control->ctrl[0] = sim->action[0];
  return 0;
}

static int32_t before_pushed_substep(const void* self, const mjenv_sim* sim, mjenv_control* control) {
  (void)self;
  if (control->qvel) return mjenv_task_fail(sim->api, "it has velocities");
  if (strcmp(pushed_how, "late") == 0) mjenv_control_forward(control);
  return 0;
}

static int32_t observe_pushed(const void* self, const mjenv_sim* sim, double* to) {
  (void)self;
  memcpy(to, sim->qpos, PUSHED_NV * sizeof *to);
  memcpy(to + PUSHED_NV, sim->qvel, PUSHED_NV * sizeof *to);
  return 0;
}

static int32_t reset_nothing(const void* self, mjenv_start* start) {
  (void)self, (void)start;
  return 0;
}

static int32_t step_pushed(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self, (void)sim, (void)outcome;
  return 0;
}

static const mjenv_task pushed = {.struct_size = sizeof(mjenv_task),
                                  .id = "tests/Pushed-v0",
                                  .model_text = pushed_model,
                                  .frame_skip = 2,
                                  .fields = pushed_fields,
                                  .field_count = COUNT(pushed_fields),
                                  .build = build_pushed,
                                  .reset = reset_nothing,
                                  .observe = observe_pushed,
                                  .step = step_pushed,
                                  .before_step = before_pushed_step,
                                  .before_substep = before_pushed_substep};

// A step equals mjenv_set_state before a step of a task without maps, as in programs for Gymnasium.
static void test_forward_before_a_step(void** state) {
  (void)state;
  mjenv_task plain = pushed;
  plain.id = "tests/Plain-v0", plain.before_step = NULL, plain.before_substep = NULL;
  assert_ok(mjenv_register_task(&plain));
  for (int64_t lanes = AUTO_LANES; lanes <= 0; ++lanes) {
    mjenv_options *chosen = options_of_id(pushed.id), *other = options_of_id(plain.id);
    set_lanes(chosen, lanes);
    mjenv_env *env = env_of_options(chosen, ROWS), *want = env_of_options(other, ROWS);
    struct outputs *out = outputs_of(env), *expected = outputs_of(want);
    assert_ok(mjenv_reset(env, NULL, &out->batch));
    assert_ok(mjenv_reset(want, NULL, &expected->batch));
    for (int k = 0; k < 60; ++k) {
      double action[ROWS], qpos[ROWS * PUSHED_NV], qvel[ROWS * PUSHED_NV];
      for (int row = 0; row < ROWS; ++row) action[row] = sin(k + row);
      for (int i = 0; i < ROWS * PUSHED_NV; ++i) {
        const double* seen = expected->obs + (size_t)(i / PUSHED_NV) * 2 * PUSHED_NV + i % PUSHED_NV;
        qpos[i] = seen[0];
        qvel[i] = slower(seen[PUSHED_NV]);
      }
      assert_ok(mjenv_set_state(want, MJENV_ALL_ROWS, qpos, ROWS * PUSHED_NV, qvel, ROWS * PUSHED_NV));
      assert_ok(mjenv_step(want, NULL, action, ROWS, MJENV_DTYPE_FLOAT64, &expected->batch));
      assert_ok(mjenv_step(env, NULL, action, ROWS, MJENV_DTYPE_FLOAT64, &out->batch));
      assert_same_bits("pushed", out->obs, expected->obs, ROWS * 2 * PUSHED_NV);
    }
    outputs_free(out);
    outputs_free(expected);
    mjenv_destroy(env);
    mjenv_destroy(want);
  }
}

// Lanes call mj_forward for all rows, with the velocities and ctrl of the call, or leave the rows to MuJoCo.
static void test_forward_in_lanes(void** state) {
  (void)state;
  for (const char** how = (const char*[]){"", "some", "changed", NULL}; *how; ++how) {
    pushed_how = *how;
    mjenv_env* envs[2];
    struct outputs* outs[2];
    for (int64_t k = 0; k < 2; ++k) {
      mjenv_options* chosen = options_of_id(pushed.id);
      set_lanes(chosen, k == 0 ? AUTO_LANES : 0);
      envs[k] = env_of_options(chosen, ROWS);
      outs[k] = outputs_of(envs[k]);
      assert_ok(mjenv_reset(envs[k], NULL, &outs[k]->batch));
    }
    for (int t = 0; t < 60; ++t) {
      double action[ROWS];
      for (int row = 0; row < ROWS; ++row) action[row] = sin(t / 7 + row);
      for (int k = 0; k < 2; ++k)
        assert_ok(mjenv_step(envs[k], NULL, action, ROWS, MJENV_DTYPE_FLOAT64, &outs[k]->batch));
      assert_same_bits(pushed_how, outs[0]->obs, outs[1]->obs, ROWS * 2 * PUSHED_NV);
      for (int row = 0; row < ROWS; ++row) {
        int64_t count;
        double *got = read_array(envs[0], row, "qacc_warmstart", &count),
               *want = read_array(envs[1], row, "qacc_warmstart", &count);
        assert_same_bits("qacc_warmstart", got, want, (size_t)count);
        free(got), free(want);
      }
    }
    for (int k = 0; k < 2; ++k) outputs_free(outs[k]), mjenv_destroy(envs[k]);
  }
  pushed_how = "";
}

static void pushed_fails(const char* how, const char* word) {
  pushed_how = how;
  mjenv_env* env = env_of_options(options_of_id(pushed.id), 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  const double action[1] = {0};
  assert_refused(MJENV_E_TASK, mjenv_step(env, NULL, action, 1, MJENV_DTYPE_FLOAT64, NULL), "Pushed-v0", word);
  mjenv_destroy(env);
  pushed_how = "";
}

static void test_forward_that_is_refused(void** state) {
  (void)state;
  pushed_fails("current", "before_step: only before_step can call mj_forward");
  pushed_fails("late", "before_substep: only before_step can call mj_forward");
  pushed_fails("infinite", "before_step: qvel[1] is inf");
}

static int setup(void** state) {
  (void)state;
  assert_ok(mjenv_register_task(&mapped));
  assert_ok(mjenv_register_task(&pushed));
  return 0;
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_action_space),     cmocka_unit_test(test_failures),
      cmocka_unit_test(test_not_strict),       cmocka_unit_test(test_forward_before_a_step),
      cmocka_unit_test(test_forward_in_lanes), cmocka_unit_test(test_forward_that_is_refused),
  };
  return cmocka_run_group_tests(tests, setup, NULL);
}
