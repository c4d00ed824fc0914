// Callbacks that change the floating-point environment change neither the bits of rows nor the caller's environment.
#include "floats.h"

#include <stdatomic.h>

#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 5, STEPS = 40 };

static const char model[] =
    "<mujoco><option timestep='0.01'/><worldbody><geom type='plane' size='5 5 .1'/>"
    "<body pos='0 0 .5'><freejoint/><geom type='capsule' size='.1 .2'/>"
    "<body pos='.1 0 .3'><joint name='hinge' axis='0 1 0' damping='.1'/><geom type='capsule' size='.05 "
    ".2'/></body></body>"
    "</worldbody><actuator><motor joint='hinge' gear='3'/></actuator></mujoco>";

static atomic_int calls[7];

static int32_t called(int callback, const void* self) {
  atomic_fetch_add(&calls[callback], 1);
  if (self) change_floats();
  return 0;
}

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  *self = user;
  mjenv_build_length(builder, MJENV_ROLE_OBSERVATION, "qpos", builder->sim->nq);
  return called(0, user);
}

static int32_t reset(const void* self, mjenv_start* start) {
  start->qpos[0] += mjenv_random_uniform(start->random, -0.1, 0.1);
  start->qvel[4] = mjenv_random_normal(start->random);
  return called(1, self);
}

static int32_t reset_info(const void* self, const mjenv_sim* sim, double* to) {
  to[0] = sim->qpos[0];
  return called(2, self);
}

static int32_t carry(const void* self, const mjenv_sim* sim, double* carried) {
  carried[0] = sim->qpos[0];
  return called(3, self);
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  memcpy(to, sim->qpos, (size_t)sim->nq * sizeof *to);
  return called(4, self);
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* out) {
  out->reward = sim->qpos[0] - sim->carried[0];
  return called(5, self);
}

static void destroy(void* self) { called(6, self); }

static void register_task(const char* id, void* user) {
  static const mjenv_task_field fields[] = {
      {.struct_size = sizeof(mjenv_task_field),
       .role = MJENV_ROLE_OBSERVATION,
       .name = "qpos",
       .ndim = 1,
       .shape = {-1}},
      {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_RESET_INFO, .name = "x"},
  };
  const mjenv_task task = {.struct_size = sizeof task,
                           .id = id,
                           .model_text = model,
                           .frame_skip = 2,
                           .carry_count = 1,
                           .fields = fields,
                           .field_count = COUNT(fields),
                           .user = user,
                           .build = build,
                           .destroy = destroy,
                           .reset = reset,
                           .reset_info = reset_info,
                           .carry = carry,
                           .observe = observe,
                           .step = step};
  assert_ok(mjenv_register_task(&task));
}

struct played {
  double obs[STEPS + 1][ROWS][8], reward[STEPS + 1][ROWS];
};

static void play(const char* id, int64_t threads, struct played* to) {
  const uint64_t settings = float_settings();
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  mjenv_env* env = env_of_options(options, ROWS);
  assert_true(float_settings() == settings);
  seed_rows(env, 7);
  memset(to, 0, sizeof *to);
  double x[ROWS];
  mjenv_batch out = {.struct_size = sizeof out,
                     .obs_dtype = MJENV_DTYPE_FLOAT64,
                     .rows = ROWS,
                     .obs_count = 8,
                     .obs = to->obs,
                     .reset_info_count = 1,
                     .reset_info = x};
  assert_ok(mjenv_reset(env, NULL, &out));
  assert_true(float_settings() == settings);
  for (int i = 1; i <= STEPS; ++i) {
    double action[ROWS];
    for (int row = 0; row < ROWS; ++row) action[row] = 0.125 * ((i + row) % 7);
    out = (mjenv_batch){.struct_size = sizeof out,
                        .obs_dtype = MJENV_DTYPE_FLOAT64,
                        .rows = ROWS,
                        .obs_count = 8,
                        .obs = to->obs[i],
                        .reward = to->reward[i]};
    assert_ok(mjenv_step(env, NULL, action, ROWS, MJENV_DTYPE_FLOAT64, &out));
    assert_true(float_settings() == settings);
  }
  mjenv_destroy(env);
  assert_true(float_settings() == settings);
}

static void test_callbacks(void** state) {
  (void)state;
  struct played *quiet = allocate(sizeof *quiet), *loud = allocate(sizeof *loud);
  for (int64_t threads = 1; threads <= 3; ++threads) {
    play("Quiet-v0", threads, quiet);
    play("Loud-v0", threads, loud);
    assert_memory_equal(quiet, loud, sizeof *quiet);
  }
  for (size_t i = 0; i < COUNT(calls); ++i) assert_true(atomic_load(&calls[i]) > 0);
  free(quiet), free(loud);
}

// The caller's own settings stay, too, and have no effect.
static void test_callers_own(void** state) {
  (void)state;
  const uint64_t settings = float_settings();
  struct played *expected = allocate(sizeof *expected), *found = allocate(sizeof *found);
  play("Quiet-v0", 2, expected);
  fesetround(FE_DOWNWARD);
  assert_true(float_settings() != settings);
  play("Loud-v0", 2, found);
  fesetround(FE_TONEAREST);
  assert_memory_equal(expected, found, sizeof *found);
  free(expected), free(found);
}

// The constructor of this plug-in changes the settings.
static void test_plugin(void** state) {
  (void)state;
  const uint64_t settings = float_settings();
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PLUGINS "/libno_tasks" PLUGIN_SUFFIX), "no task");
  assert_true(float_settings() == settings);
}

int main(void) {
  register_task("Quiet-v0", NULL);
  register_task("Loud-v0", calls);
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_plugin), cmocka_unit_test(test_callbacks),
                                     cmocka_unit_test(test_callers_own)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
