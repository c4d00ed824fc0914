// What callbacks are given, what they may fail with, and what that means for rows.
#include <math.h>

#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 6, BAD = 3 };

// It has no obstacle for lanes, so the rows are stepped together.
static const char model[] =
    "<mujoco><option timestep='0.01'/><worldbody>"
    "<geom name='floor' type='plane' size='5 5 .1'/>"
    "<body name='cart' pos='0 0 1'><joint name='slide' type='slide' axis='1 0 0'/>"
    "<geom name='box' type='box' size='.1 .1 .1'/><site name='tip' pos='0 0 .2'/></body>"
    "<body name='ball' pos='1 0 .099'><freejoint/><geom name='ball' size='.1'/></body>"
    "</worldbody><actuator><motor name='push' joint='slide' gear='10' ctrllimited='true' ctrlrange='-1 "
    "1'/></actuator></mujoco>";

// How the task misbehaves is an option.
static const char modes[] =
    "none build_fails build_is_silent build_unfit build_no_memory build_name build_option build_kind build_array "
    "build_contact build_need build_index "
    "build_length build_draw build_long "
    "build_late reset_fails reset_nan reset_draw reset_uniform step_fails step_silent step_nan step_draw step_busy "
    "info_fails "
    "carry_fails carry_force observe_fails observe_nan observe_memory";

enum mode {
  NONE,
  RESET_FAILS,
  RESET_NAN,
  RESET_DRAW,
  RESET_UNIFORM,
  STEP_FAILS,
  STEP_SILENT,
  STEP_NAN,
  STEP_DRAW,
  STEP_BUSY,
  INFO_FAILS,
  CARRY_FAILS,
  CARRY_FORCE,
  OBSERVE_FAILS,
  OBSERVE_NAN,
  OBSERVE_MEMORY
};
static const char* const mode_names[] = {"none",          "reset_fails",   "reset_nan",   "reset_draw",
                                         "reset_uniform", "step_fails",    "step_silent", "step_nan",
                                         "step_draw",     "step_busy",     "info_fails",  "carry_fails",
                                         "carry_force",   "observe_fails", "observe_nan", "observe_memory"};

struct self {
  enum mode mode;
  int32_t tip, box, floor, mass, inertia;
  bool extras;
};

static int built, destroyed;
static mjenv_env* busy_env;

static const mjenv_task_option options[] = {
    {.struct_size = sizeof(mjenv_task_option),
     .kind = MJENV_KIND_STRING,
     .name = "mode",
     .text = "none",
     .choices = modes},
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_FLAG, .name = "extras"},
    {.struct_size = sizeof(mjenv_task_option),
     .kind = MJENV_KIND_STRING_OR_INT,
     .name = "main",
     .low = 1,
     .high = 2,
     .text = "cart"},
    {.struct_size = sizeof(mjenv_task_option),
     .kind = MJENV_KIND_STRING_OR_INT,
     .name = "other",
     .value = -1,
     .low = -1,
     .high = 5},
};

// The carried numbers: how many steps, a number drawn in reset, one drawn in the last step, x, and how often carry was
// called.
enum { STEPS, DRAWN, DRAWN_LAST, X, CARRIES, CARRIED };

static const mjenv_task_field fields[] = {
    {.struct_size = sizeof(mjenv_task_field),
     .role = MJENV_ROLE_OBSERVATION,
     .name = "kept",
     .ndim = 1,
     .shape = {CARRIED}},
    {.struct_size = sizeof(mjenv_task_field),
     .role = MJENV_ROLE_OBSERVATION,
     .name = "action",
     .ndim = 1,
     .shape = {-1}},
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_INFO, .name = "action", .dtype = MJENV_DTYPE_ACTION},
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_INFO, .name = "contacts"},
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_INFO, .name = "force"},
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_INFO, .name = "unwritten", .ndim = 1, .shape = {2}},
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_RESET_INFO, .name = "x"},
};

// If count is not 0, the bounds of these carried numbers.
static struct {
  int64_t first, count;
  double low, high;
} bounds;

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  const mjenv_task_api* api = builder->api;
  const char* mode = mjenv_build_text(builder, "mode");
  if (strcmp(mode, "build_fails") == 0) return mjenv_task_fail(api, "no luck");
  if (strcmp(mode, "build_is_silent") == 0) return 77;
  if (strcmp(mode, "build_unfit") == 0) return mjenv_task_fail(api, "it has no leg"), MJENV_E_MODEL;
  if (strcmp(mode, "build_no_memory") == 0) return MJENV_E_MEMORY;
  if (strcmp(mode, "build_long") == 0) {
    char text[2 * 1000 + 2] = "x";
    for (int i = 0; i < 1000; ++i) memcpy(text + 1 + 2 * i, "\xc3\xa9", 3);
    return mjenv_task_fail(api, text);
  }
  assert_ptr_equal(user, options);
  struct self* s = allocate(sizeof *s);
  *self = s;
  ++built;
  s->mode = NONE;
  for (size_t i = 0; i < COUNT(mode_names); ++i)
    if (strcmp(mode, mode_names[i]) == 0) s->mode = (enum mode)i;
  // After one of these has failed the others do nothing; none need be checked.
  if (strcmp(mode, "build_name") == 0) assert_int_equal(mjenv_build_index(builder, "site", "nose"), 0);
  if (strcmp(mode, "build_option") == 0) assert_true(mjenv_build_real(builder, "nothing") == 0);
  if (strcmp(mode, "build_kind") == 0) assert_true(mjenv_build_real(builder, "mode") == 0);
  if (strcmp(mode, "build_array") == 0) mjenv_build_array(builder, "qpoz", NULL);
  if (strcmp(mode, "build_contact") == 0) mjenv_build_array(builder, "contact.dist", NULL);
  if (strcmp(mode, "build_need") == 0) mjenv_build_need(builder, "xpos");
  if (strcmp(mode, "build_index") == 0) assert_int_equal(mjenv_build_option_index(builder, "other", "body"), 0);
  if (strcmp(mode, "build_draw") == 0) mjenv_random_integers(builder->random, 5, 5);
  if (strcmp(mode, "build_length") != 0)
    mjenv_build_length(builder, MJENV_ROLE_OBSERVATION, "action", builder->sim->nu);
  if (bounds.count > 0) mjenv_build_carry_bounds(builder, bounds.first, bounds.count, bounds.low, bounds.high);
  if (strcmp(mode, "build_late") == 0) mjenv_build_length(builder, MJENV_ROLE_OBSERVATION, NULL, 1);
  s->tip = mjenv_build_index(builder, "site", "tip");
  s->box = mjenv_build_index(builder, "geom", "ball");
  s->floor = mjenv_build_index(builder, "geom", "floor");
  mjenv_field field = MJENV_FIELD_INIT;
  s->mass = mjenv_build_array(builder, "body_mass", NULL);
  s->inertia = mjenv_build_array(builder, "qLDiagInv", &field);
  s->extras = mjenv_build_integer(builder, "extras") != 0;
  if (s->extras) {
    mjenv_build_need(builder, "contacts");
    mjenv_build_need(builder, "cfrc_ext");
    mjenv_build_array(builder, "geom_xpos", NULL);
    assert_non_null(builder->sim->contacts);
  }
  return 0;
}

static void destroy(void* self) {
  ++destroyed;
  free(self);
}

static int32_t reset(const void* self, mjenv_start* start) {
  const struct self* s = self;
  for (int i = 0; i < CARRIED; ++i)
    if (start->carried[i] != 0) return mjenv_task_fail(start->api, "what is carried is not 0");
  if (memcmp(start->qpos, start->qpos0, (size_t)start->nq * sizeof(double)) != 0)
    return mjenv_task_fail(start->api, "qpos is not the model's");
  start->carried[DRAWN] = (double)mjenv_random_integers(start->random, 0, 1000);
  start->qpos[0] = mjenv_random_uniform(start->random, -0.1, 0.1);
  const bool bad = start->carried[DRAWN] > 500;
  if (s->mode == RESET_FAILS && bad) return mjenv_task_fail(start->api, "more than 500");
  if (s->mode == RESET_NAN && bad) start->qpos[1] = NAN;
  if (s->mode == RESET_DRAW && bad) mjenv_random_integers(start->random, 5, 5);
  if (s->mode == RESET_UNIFORM && bad && start->carried[DRAWN] > 750) mjenv_random_uniform(start->random, 0.5, 0.25);
  if (s->mode == RESET_UNIFORM && bad) mjenv_random_uniform(start->random, 0.0, -0.0);  // refused by NumPy, too
  return 0;
}

static int32_t reset_info(const void* self, const mjenv_sim* sim, double* to) {
  const struct self* s = self;
  if (s->mode == INFO_FAILS) return mjenv_task_fail(sim->api, "no info");
  to[0] = sim->qpos[0];
  return 0;
}

static int32_t carry(const void* self, const mjenv_sim* sim, double* carried) {
  const struct self* s = self;
  if (s->mode == CARRY_FAILS && sim->qpos[0] > 50) return mjenv_task_fail(sim->api, "cannot carry that");
  carried[CARRIES] += 1;
  carried[X] = s->mode == CARRY_FORCE ? sim->cfrc_ext[2 * 6 + 5] : sim->qpos[0];  // the weight of the ball
  return 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  const struct self* s = self;
  const bool bad = sim->qpos[0] > 50;
  if (s->mode == OBSERVE_FAILS && bad) return mjenv_task_fail(sim->api, "cannot look");
  if (s->mode == OBSERVE_MEMORY && bad) return MJENV_E_MEMORY;
  for (int i = 0; i < CARRIED; ++i) to[i] = sim->carried[i];
  if (!isnan(sim->action[0])) return mjenv_task_fail(sim->api, "there is an action");
  to[CARRIED] = s->mode == OBSERVE_NAN && bad ? NAN : sim->ctrl[0];
  return 0;
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* out) {
  const struct self* s = self;
  const bool bad = sim->qpos[0] > 50;
  out->carried[STEPS] += 1;
  out->carried[DRAWN_LAST] = (double)mjenv_random_integers(out->random, 0, 1000);
  if (bad && s->mode == STEP_FAILS) return mjenv_task_fail(sim->api, "too far");
  if (bad && s->mode == STEP_SILENT) return -5;
  out->reward = bad && s->mode == STEP_NAN ? NAN : out->carried[STEPS];
  if (bad && s->mode == STEP_DRAW) mjenv_random_choice(out->random, 2, (const double[]){0.5, 0.6});
  if (bad && s->mode == STEP_BUSY) {
    if (mjenv_reset(busy_env, NULL, NULL) != MJENV_E_BUSY) return mjenv_task_fail(sim->api, "not busy");
    return mjenv_task_fail(sim->api, mjenv_last_error());
  }
  if (out->carried != sim->carried) return mjenv_task_fail(sim->api, "two places of what is carried");
  const double* mass = sim->arrays[s->mass];
  if (mass != sim->body_mass) return mjenv_task_fail(sim->api, "another body_mass");
  out->info[0] = sim->action[0];
  if (s->extras) {
    out->info[1] = sim->contact_count;
    for (int i = 0; i < sim->contact_count; ++i) {
      const mjenv_contact* c = &sim->contacts[i];
      if ((c->geom1 == s->floor && c->geom2 == s->box) || (c->geom1 == s->box && c->geom2 == s->floor))
        out->info[2] = c->distance < 0 ? c->force[0] : NAN;
    }
  } else if (sim->contacts || sim->cfrc_ext || sim->geom_xpos) {
    return mjenv_task_fail(sim->api, "nobody asked for these");
  }
  return 0;
}

static void register_probe(const char* id, int32_t revision) {
  const mjenv_task task = {.struct_size = sizeof task,
                           .revision = revision,
                           .id = id,
                           .model_text = model,
                           .frame_skip = 2,
                           .carry_count = CARRIED,
                           .options = options,
                           .option_count = COUNT(options),
                           .fields = fields,
                           .field_count = COUNT(fields),
                           .user = (void*)options,
                           .build = build,
                           .destroy = destroy,
                           .reset = reset,
                           .reset_info = reset_info,
                           .carry = carry,
                           .observe = observe,
                           .step = step};
  assert_ok(mjenv_register_task(&task));
}

static mjenv_options* probe(const char* mode) {
  mjenv_options* chosen = options_of_id("Probe-v0");
  assert_ok(mjenv_options_set_string(chosen, "mode", mode));
  return chosen;
}

// The outputs of an environment of ROWS rows.
struct played {
  double obs[ROWS][CARRIED + 1], reward[ROWS], info[5 * ROWS], reset_info[ROWS];
  int32_t status[ROWS];
  mjenv_batch batch;
};

static struct played* played(void) {
  struct played* p = allocate(sizeof *p);
  memset(p, 0x5a, sizeof *p);
  p->batch = (mjenv_batch){.struct_size = sizeof p->batch,
                           .obs_dtype = MJENV_DTYPE_FLOAT64,
                           .rows = ROWS,
                           .obs_count = CARRIED + 1,
                           .info_count = 5,
                           .reset_info_count = 1,
                           .obs = p->obs,
                           .reward = p->reward,
                           .info = p->info,
                           .reset_info = p->reset_info,
                           .status = p->status};
  return p;
}

static const double zeros[ROWS];

static mjenv_status step_all(mjenv_env* env, const struct played* p) {
  return mjenv_step(env, NULL, zeros, ROWS, MJENV_DTYPE_FLOAT64, p ? &p->batch : NULL);
}

// Moves a row to where the task misbehaves.
static void spoil(mjenv_env* env, int64_t row) {
  double qpos[16], qvel[16];
  int64_t nq = 0, nv = 0;
  assert_ok(mjenv_read(env, row, "qpos", qpos, 16, &nq));
  assert_ok(mjenv_read(env, row, "qvel", qvel, 16, &nv));
  qpos[0] = 60;
  assert_ok(mjenv_set_state(env, row, qpos, nq, qvel, nv));
}

static void refused_build(const char* mode, mjenv_status status, const char* word, const char* other) {
  mjenv_options* chosen = probe(mode);
  mjenv_env* env = NULL;
  const int builds = built, destroys = destroyed;
  assert_refused(status, mjenv_create(chosen, 1, &env), "Probe-v0", word, other);
  assert_int_equal(built - builds, destroyed - destroys);
  assert_null(env);
  mjenv_options_destroy(chosen);
}

static void assert_not_built(const char* mode, mjenv_status status) {
  mjenv_options* chosen = probe(mode);
  mjenv_env* env = NULL;
  assert_refused(status, mjenv_create(chosen, 1, &env), "memory");
  mjenv_options_destroy(chosen);
}

static void test_build(void** state) {
  (void)state;
  refused_build("build_fails", MJENV_E_TASK, "no luck", "");
  refused_build("build_is_silent", MJENV_E_TASK, "77", "without a message");
  refused_build("build_unfit", MJENV_E_MODEL, "cannot use model \"Probe-v0\"", "it has no leg");
  assert_not_built("build_no_memory", MJENV_E_MEMORY);
  refused_build("build_name", MJENV_E_MODEL, "\"nose\"", "tip");
  refused_build("build_option", MJENV_E_NAME, "\"nothing\"", "mjenv_options_at");
  refused_build("build_kind", MJENV_E_TYPE, "\"mode\"", "real numbers");
  refused_build("build_array", MJENV_E_NAME, "\"qpoz\"", "mjData");
  refused_build("build_contact", MJENV_E_NAME, "\"contact.dist\"", "mjenv_build_need");
  refused_build("build_need", MJENV_E_NAME, "\"xpos\"", "contacts");
  refused_build("build_index", MJENV_E_MODEL, "\"other\" is -1", "bodies");
  mjenv_destroy(env_of_options(probe("build_draw"), 1));  // only a draw for a row must be possible
  refused_build("build_length", MJENV_E_TASK, "\"action\"", "length");
  refused_build("build_late", MJENV_E_ARGUMENT, "name", "");
}

// A message that is too long ends after a whole character.
static void test_long_message(void** state) {
  (void)state;
  mjenv_options* chosen = probe("build_long");
  mjenv_env* env = NULL;
  assert_refused(MJENV_E_TASK, mjenv_create(chosen, 1, &env), "Probe-v0", "x\xc3\xa9\xc3\xa9");
  const char* message = mjenv_last_error();
  const size_t length = strlen(message);
  assert_true(length > 1000);
  assert_memory_equal(message + length - 2, "\xc3\xa9", 2);
  mjenv_options_destroy(chosen);
}

// Which row a call names, and that the row keeps its state while the others are stepped.
static void failing_row(const char* mode, const char* word, const char* callback) {
  mjenv_env* env = env_of_options(probe(mode), ROWS);
  struct played* p = played();
  double before[16], after[16], time = 0;
  int64_t count = 0;
  seed_rows(env, 0);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(step_all(env, p));
  spoil(env, BAD);
  busy_env = env;
  assert_ok(mjenv_read(env, BAD, "qpos", before, 16, &count));
  uint64_t stream[2][6];
  assert_ok(mjenv_get_stream(env, BAD, stream[0], 6));
  for (int i = 0; i < 2; ++i) assert_refused(MJENV_E_TASK, step_all(env, p), "row 3", "Probe-v0", callback, word);
  for (int row = 0; row < ROWS; ++row) {
    assert_int_equal(p->status[row], row == BAD ? MJENV_E_TASK : MJENV_OK);
    if (row == BAD) {
      assert_true(p->reward[row] == 0);
      continue;
    }
    assert_true(p->obs[row][STEPS] == 3);
    assert_ok(mjenv_read(env, row, "time", &time, 1, &count));
    assert_true(fabs(time - 3 * 0.02) < 1e-9);
  }
  if (strcmp(callback, "observe") != 0) {  // an observation is written when the step is done
    assert_ok(mjenv_read(env, BAD, "qpos", after, 16, &count));
    assert_same_bits("qpos", after, before, count);
    assert_ok(mjenv_get_stream(env, BAD, stream[1], 6));
    assert_memory_equal(stream[0], stream[1], sizeof stream[0]);
  }
  const uint8_t mask[ROWS] = {[BAD] = 1};
  assert_ok(mjenv_reset(env, mask, &p->batch));
  assert_ok(step_all(env, p));
  assert_true(p->obs[BAD][STEPS] == 1);
  mjenv_destroy(env);
  free(p);
}

static void test_failing_rows(void** state) {
  (void)state;
  failing_row("step_fails", "too far", "step");
  failing_row("step_silent", "-5 without a message", "step");
  failing_row("step_nan", "the reward is NaN", "step");
  failing_row("step_draw", "the sum of p is not 1", "step");
  failing_row("step_busy", "another thread is inside", "step");
  failing_row("observe_fails", "cannot look", "observe");
  failing_row("observe_nan", "observation[5] is NaN", "observe");
}

// mjenv_observe names the row that fails and writes the others, also if a work space holds the arrays of that row.
static void test_failing_observe(void** state) {
  (void)state;
  mjenv_env* env = env_of_options(probe("observe_fails"), ROWS);
  struct played *p = played(), *stepped = played();
  seed_rows(env, 0);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(step_all(env, stepped));
  spoil(env, BAD);
  assert_refused(MJENV_E_TASK, mjenv_observe(env, &p->batch), "row 3", "Probe-v0", "observe", "cannot look");
  for (int row = 0; row < ROWS; ++row)
    if (row != BAD) assert_same_bits("obs", p->obs[row], stepped->obs[row], CARRIED + 1);
  mjenv_destroy(env);
  free(p);
  free(stepped);
}

// Moves a row to where it reaches the place at which the task misbehaves in its second step from now.
static void send_there(mjenv_env* env, int64_t row) {
  double qpos[16], qvel[16];
  int64_t nq = 0, nv = 0;
  assert_ok(mjenv_read(env, row, "qpos", qpos, 16, &nq));
  assert_ok(mjenv_read(env, row, "qvel", qvel, 16, &nv));
  qpos[0] = 49.7;  // m; the task fails from 50 on
  qvel[0] = 10;
  assert_ok(mjenv_set_state(env, row, qpos, nq, qvel, nv));
}

// What failed steps write: a reward and flags of 0 in place of those of the step before.
static void test_outputs_of_failing_rows(void** state) {
  (void)state;
  mjenv_env* env = env_of_options(probe("step_fails"), ROWS);
  struct played* p = played();
  int64_t rows[ROWS], count = 0;
  for (int sent = 0; sent < 2; ++sent) {
    seed_rows(env, 0);
    assert_ok(mjenv_reset(env, NULL, NULL));
    send_there(env, BAD);
    for (int t = 0; t < 2; ++t) {
      mjenv_status status = MJENV_OK;
      memset(p->reward, 0x5a, sizeof p->reward);
      if (sent) {
        assert_ok(mjenv_send(env, NULL, 0, zeros, ROWS, MJENV_DTYPE_FLOAT64));
        status = mjenv_recv(env, ROWS, -1, rows, ROWS, &count, &p->batch);
        assert_int_equal(count, ROWS);
      } else {
        status = step_all(env, p);
      }
      assert_int_equal(status, t == 0 ? MJENV_OK : MJENV_E_TASK);
      for (int row = 0; row < ROWS; ++row) {
        const bool has_failed = t == 1 && row == BAD;
        assert_int_equal(p->status[row], has_failed ? MJENV_E_TASK : MJENV_OK);
        assert_true(p->reward[row] == (has_failed ? 0 : t + 1));
      }
    }
  }
  mjenv_destroy(env);
  free(p);
}

// A row that fails in a rollout stays there: nothing is written for its later steps, and the others are played to the
// end.
static void test_failing_rollout(void** state) {
  (void)state;
  enum { LENGTH = 4 };
  mjenv_env* env = env_of_options(probe("step_fails"), ROWS);
  double reward[ROWS][LENGTH], time = 0;
  int32_t status[ROWS][LENGTH];
  const double action[ROWS * LENGTH] = {0};
  const int32_t unwritten = 77;
  for (int row = 0; row < ROWS; ++row)
    for (int t = 0; t < LENGTH; ++t) status[row][t] = unwritten;
  const mjenv_batch out = {.struct_size = sizeof out, .rows = ROWS * LENGTH, .reward = reward[0], .status = status[0]};
  seed_rows(env, 0);
  assert_ok(mjenv_reset(env, NULL, NULL));
  send_there(env, BAD);
  assert_refused(MJENV_E_TASK, mjenv_rollout(env, action, COUNT(action), MJENV_DTYPE_FLOAT64, LENGTH, &out), "row 3",
                 "too far");
  for (int row = 0; row < ROWS; ++row)
    for (int t = 0; t < LENGTH; ++t) {
      const bool is_fine = row != BAD || t == 0;
      assert_int_equal(status[row][t], is_fine ? MJENV_OK : t == 1 ? MJENV_E_TASK : unwritten);
      if (is_fine) assert_true(reward[row][t] == t + 1);
    }
  int64_t count = 0;
  for (int row = 0; row < ROWS; ++row) {
    assert_ok(mjenv_read(env, row, "time", &time, 1, &count));
    assert_true(fabs(time - 0.02 * (row == BAD ? 1 : LENGTH)) < 1e-9);
  }
  mjenv_destroy(env);
}

// A row whose observation failed has no last observation that mjenv_observe could repeat.
static void test_failing_noisy_observation(void** state) {
  (void)state;
  mjenv_env* env = env_of_options(probe("observe_fails"), ROWS);
  struct played* p = played();
  assert_ok(mjenv_randomize(env, "{\"noise\": {\"observation\": 0.5}}"));
  assert_ok(mjenv_reset(env, NULL, NULL));
  send_there(env, BAD);
  assert_ok(step_all(env, p));
  assert_ok(mjenv_observe(env, &p->batch));
  assert_refused(MJENV_E_TASK, step_all(env, p), "row 3", "cannot look");
  assert_refused(MJENV_E_TASK, mjenv_observe(env, &p->batch), "row 3", "cannot look");
  mjenv_destroy(env);
  free(p);
}

// A row that has no memory for its observation has failed, too.
static void test_observe_without_memory(void** state) {
  (void)state;
  mjenv_env* env = env_of_options(probe("observe_memory"), ROWS);
  struct played* p = played();
  const uint8_t bad[ROWS] = {[BAD] = 1};
  assert_ok(mjenv_reset(env, NULL, NULL));
  spoil(env, BAD);
  assert_refused(MJENV_E_MEMORY, step_all(env, p), "row 3", "memory");
  for (int row = 0; row < ROWS; ++row) assert_int_equal(p->status[row], row == BAD ? MJENV_E_PHYSICS : MJENV_OK);
  assert_ok(mjenv_reset(env, bad, NULL));
  assert_ok(step_all(env, p));
  mjenv_destroy(env);
  free(p);
}

// carry is called once before a step of a row that was written, also if an earlier attempt at this step failed.
static void test_carried_once(void** state) {
  (void)state;
  mjenv_env* env = env_of_options(probe("step_fails"), ROWS);
  struct played* p = played();
  double x[2] = {60, 0}, qpos[16];
  int64_t nq = 0;
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_read(env, BAD, "qpos", qpos, 16, &nq));
  for (int i = 0; i < 2; ++i) {
    qpos[0] = x[i];
    assert_ok(write_row(env, BAD, "qpos", qpos, nq));
    if (i == 0) assert_refused(MJENV_E_TASK, step_all(env, p), "row 3", "too far");
  }
  assert_ok(step_all(env, p));
  assert_true(p->obs[BAD][CARRIES] == 3);  // after the reset, before and after the step
  mjenv_destroy(env);
  free(p);
}

// What a task carries after mjenv_set_state does not depend on whether a work space still has the row's last step.
static void test_carried_forces(void** state) {
  (void)state;
  mjenv_options* chosen = probe("carry_force");
  assert_ok(mjenv_options_set_integer(chosen, "extras", 1));
  mjenv_env* env = env_of_options(chosen, ROWS);
  struct played* p = played();
  const uint64_t seeds[ROWS] = {0};
  assert_ok(mjenv_seed(env, NULL, seeds, ROWS));
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int i = 0; i < 100; ++i) assert_ok(step_all(env, NULL));
  double qpos[16], qvel[16];
  int64_t nq = 0, nv = 0;
  assert_ok(mjenv_read(env, 0, "qpos", qpos, 16, &nq));
  assert_ok(mjenv_read(env, 0, "qvel", qvel, 16, &nv));
  // The only thread stepped the last row last.
  for (int row = ROWS - 1; row >= 0; --row) assert_ok(mjenv_set_state(env, row, qpos, nq, qvel, nv));
  assert_ok(mjenv_observe(env, &p->batch));
  assert_true(p->obs[ROWS - 1][X] > 1);
  for (int row = 0; row < ROWS; ++row) assert_same_bits("force", &p->obs[row][X], &p->obs[ROWS - 1][X], 1);
  mjenv_destroy(env);
  free(p);
}

static void test_failing_carry(void** state) {
  (void)state;
  mjenv_env* env = env_of_options(probe("carry_fails"), ROWS);
  assert_ok(mjenv_reset(env, NULL, NULL));
  double qpos[16] = {60}, qvel[16] = {0}, x = 0;
  int64_t nq = 0, nv = 0;
  assert_ok(mjenv_read(env, 0, "qpos", NULL, 0, &nq));
  assert_ok(mjenv_read(env, 0, "qvel", NULL, 0, &nv));
  qpos[4] = 1;
  assert_refused(MJENV_E_TASK, mjenv_set_state(env, 0, qpos, nq, qvel, nv), "carry", "cannot carry that");
  assert_ok(mjenv_read(env, 0, "qpos", qpos, 16, &nq));
  x = qpos[0];
  assert_true(fabs(x) <= 0.1);
  assert_ok(step_all(env, NULL));
  // Of all rows, it fails in one.
  double *all = read_array(env, MJENV_ALL_ROWS, "qpos", &nq), *speeds = read_array(env, MJENV_ALL_ROWS, "qvel", &nv);
  for (int row = 0; row < ROWS; ++row) all[row * (nq / ROWS)] = row == 1 ? 60 : 40;
  assert_refused(MJENV_E_TASK, mjenv_set_state(env, MJENV_ALL_ROWS, all, nq, speeds, nv), "row 1", "cannot carry that");
  free(all), free(speeds);
  for (int row = 0; row < ROWS; ++row) {
    assert_ok(mjenv_read(env, row, "qpos", qpos, 16, &nq));
    assert_true(row == 1 ? fabs(qpos[0]) < 1 : qpos[0] == 40);
  }
  assert_ok(step_all(env, NULL));
  // Written rows are carried anew before they are stepped. Here that fails in all rows, so none is left to be stepped.
  qpos[0] = 60;
  assert_ok(write_row(env, MJENV_ALL_ROWS, "qpos", qpos, nq));
  assert_refused(MJENV_E_TASK, step_all(env, NULL), "carry", "cannot carry that");
  mjenv_destroy(env);
}

static void test_failing_resets(void** state) {
  (void)state;
  static const struct {
    const char *mode, *word;
  } cases[] = {{"reset_fails", "more than 500"},
               {"reset_nan", "qpos[1] is nan"},
               {"reset_draw", "low is not below high"},
               {"reset_uniform", "high is below low"}};
  for (size_t i = 0; i < COUNT(cases); ++i) {
    mjenv_env* env = env_of_options(probe(cases[i].mode), ROWS);
    struct played* p = played();
    seed_rows(env, 0);
    assert_refused(MJENV_E_TASK, mjenv_reset(env, NULL, &p->batch), "Probe-v0: reset", cases[i].word);
    int failed = 0;
    for (int row = 0; row < ROWS; ++row) {
      failed += p->status[row] == MJENV_E_TASK;
      assert_true(p->status[row] == MJENV_OK || p->status[row] == MJENV_E_TASK);
    }
    assert_true(failed > 0 && failed < ROWS);
    mjenv_destroy(env);
    free(p);
  }
  mjenv_env* env = env_of_options(probe("info_fails"), 1);
  double info = 0;
  const mjenv_batch out = {.struct_size = sizeof out, .rows = 1, .reset_info_count = 1, .reset_info = &info};
  assert_refused(MJENV_E_TASK, mjenv_reset(env, NULL, &out), "row 0", "reset_info", "no info");
  assert_ok(mjenv_reset(env, NULL, NULL));
  mjenv_destroy(env);
}

// What the task writes as NaN passes without the option "strict".
static void test_lenient(void** state) {
  (void)state;
  mjenv_options* chosen = probe("step_nan");
  assert_ok(mjenv_options_set_integer(chosen, "strict", 0));
  mjenv_env* env = env_of_options(chosen, ROWS);
  struct played* p = played();
  assert_ok(mjenv_reset(env, NULL, NULL));
  spoil(env, BAD);
  assert_ok(step_all(env, p));
  assert_true(isnan(p->reward[BAD]) && p->reward[0] == 1);
  mjenv_destroy(env);
  free(p);
}

static void test_extras(void** state) {
  (void)state;
  mjenv_options* chosen = probe("none");
  assert_ok(mjenv_options_set_integer(chosen, "extras", 1));
  mjenv_env* env = env_of_options(chosen, ROWS);
  struct played* p = played();
  const float action[ROWS] = {0.1f, 0.2f, 0.3f, 0.4f, 0.5f, 0.6f};
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int i = 0; i < 300; ++i) assert_ok(mjenv_step(env, NULL, action, ROWS, MJENV_DTYPE_FLOAT32, &p->batch));
  int64_t count = 0;
  double mass[8];
  assert_ok(mjenv_read(env, 0, "body_mass", mass, 8, &count));
  for (int row = 0; row < ROWS; ++row) {
    assert_true(p->info[row] == (double)action[row]);                              // a float32 is held exactly
    assert_true(p->info[ROWS + row] == 1);                                         // the ball lies on the floor
    assert_true(fabs(p->info[2 * ROWS + row] - 9.81 * mass[2]) < 1e-3 * mass[2]);  // which bears its weight
    assert_true(isnan(p->info[3 * ROWS + 2 * row]) && isnan(p->info[3 * ROWS + 2 * row + 1]));
  }
  mjenv_destroy(env);
  free(p);
}

// What a row carries is part of it: in images, in copies, and whatever worker steps it.
static void test_carried(void** state) {
  (void)state;
  mjenv_env* env[2];
  struct played* p[2] = {played(), played()};
  int64_t size = 0;
  for (int i = 0; i < 2; ++i) {
    mjenv_options* chosen = probe("none");
    assert_ok(mjenv_options_set_integer(chosen, "num_threads", i ? 4 : 1));
    env[i] = env_of_options(chosen, ROWS);
    seed_rows(env[i], 5);
    assert_ok(mjenv_reset(env[i], NULL, NULL));
    for (int t = 0; t < 11; ++t) assert_ok(step_all(env[i], p[i]));
  }
  assert_memory_equal(p[0]->obs, p[1]->obs, sizeof p[0]->obs);
  uint64_t stream[2][6];
  assert_ok(mjenv_get_stream(env[0], 0, stream[0], 6));
  assert_ok(step_all(env[0], p[0]));
  assert_ok(step_all(env[1], p[1]));
  assert_ok(mjenv_get_stream(env[0], 0, stream[1], 6));
  assert_memory_not_equal(stream[0], stream[1], sizeof stream[0]);  // the step has drawn
  assert_true(p[0]->obs[0][DRAWN] != p[0]->obs[1][DRAWN] && p[0]->obs[2][STEPS] == 12);
  void* image = image_of(env[0], MJENV_ALL_ROWS, &size);
  for (int t = 0; t < 5; ++t) assert_ok(step_all(env[0], p[0]));
  for (int t = 0; t < 9; ++t) assert_ok(step_all(env[1], p[1]));
  assert_ok(mjenv_restore(env[1], MJENV_ALL_ROWS, image, size));
  for (int t = 0; t < 5; ++t) assert_ok(step_all(env[1], p[1]));
  assert_memory_equal(p[0]->obs, p[1]->obs, sizeof p[0]->obs);

  uint8_t all[ROWS];
  memset(all, 1, sizeof all);
  assert_ok(mjenv_copy_row(env[1], all, 2));
  assert_ok(mjenv_observe(env[1], &p[1]->batch));
  for (int row = 0; row < ROWS; ++row) assert_memory_equal(p[1]->obs[row], p[0]->obs[2], sizeof p[0]->obs[2]);
  assert_ok(step_all(env[1], p[1]));
  for (int row = 0; row < ROWS; ++row) assert_memory_equal(p[1]->obs[row], p[1]->obs[2], sizeof p[0]->obs[2]);

  // An image of another revision of the task is refused.
  mjenv_spec spec = MJENV_SPEC_INIT;
  assert_ok(mjenv_spec_of("Probe-v1", &spec));
  assert_int_equal(spec.revision, 1);
  mjenv_env* revised = env_of_id("Probe-v1", ROWS);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(revised, MJENV_ALL_ROWS, image, size), "another id");
  mjenv_destroy(revised);
  for (int i = 0; i < 2; ++i) {
    mjenv_destroy(env[i]);
    free(p[i]);
  }
  free(image);
}

static mjenv_env* bounded_env(int64_t first, int64_t count, double low, double high) {
  bounds.first = first, bounds.count = count, bounds.low = low, bounds.high = high;
  mjenv_env* env = env_of_options(probe("none"), ROWS);
  bounds.count = 0;
  seed_rows(env, 5);
  return env;
}

// An image may come from a stranger. It is refused if a number that a row carries is not within the task's bounds.
static void test_bounds_of_images(void** state) {
  (void)state;
  struct played *before = played(), *after = played();
  mjenv_env* unbounded = bounded_env(0, 0, 0, 0);
  assert_ok(mjenv_reset(unbounded, NULL, NULL));
  assert_ok(step_all(unbounded, before));
  double greatest = 0;
  for (int row = 0; row < ROWS; ++row) greatest = fmax(greatest, before->obs[row][DRAWN]);
  assert_true(greatest > 1 && before->obs[0][STEPS] == 1);
  int64_t size = 0;
  assert_ok(mjenv_snapshot(unbounded, MJENV_ALL_ROWS, NULL, 0, &size));
  // At an odd address, as in a file.
  unsigned char* image = (unsigned char*)allocate(size + 1) + 1;
  assert_ok(mjenv_snapshot(unbounded, MJENV_ALL_ROWS, image, size, &size));

  const struct {
    int64_t first, count;
    double low, high;
    bool fits;
  } cases[] = {{DRAWN, 1, 0, greatest, true},
               {DRAWN, 1, 0, greatest - 1, false},
               {DRAWN, 1, -1e300, INFINITY, true},
               {STEPS, 1, -1, 1, true},
               {STEPS, 1, 0, 0.5, false},
               {0, CARRIED, -1e9, 1e9, true},
               {0, CARRIED, -1e9, greatest - 1, false}};
  for (size_t i = 0; i < COUNT(cases); ++i) {
    mjenv_env* env = bounded_env(cases[i].first, cases[i].count, cases[i].low, cases[i].high);
    assert_ok(mjenv_observe(env, &before->batch));
    if (cases[i].fits) {
      assert_ok(mjenv_restore(env, MJENV_ALL_ROWS, image, size));
    } else {
      assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, MJENV_ALL_ROWS, image, size), "damaged");
      assert_ok(mjenv_observe(env, &after->batch));
      assert_memory_equal(before->obs, after->obs, sizeof before->obs);
    }
    mjenv_destroy(env);
  }

  // Rows that were never reset carry zeros, which all bounds contain.
  mjenv_env* fresh = bounded_env(0, CARRIED, 0, 0);
  assert_ok(mjenv_snapshot(fresh, MJENV_ALL_ROWS, image, size, &size));
  assert_ok(mjenv_restore(fresh, MJENV_ALL_ROWS, image, size));
  mjenv_destroy(fresh);
  free(image - 1);
  free(before);
  free(after);
  mjenv_destroy(unbounded);
}

// A callback that writes another number fails, and its row keeps its state.
static void test_bounds_of_callbacks(void** state) {
  (void)state;
  struct played* p = played();
  mjenv_env* env = bounded_env(DRAWN, 1, 0, 0);
  assert_refused(MJENV_E_TASK, mjenv_reset(env, NULL, NULL), "Probe-v0: reset: carried[1] is ", ", not 0 to 0");
  mjenv_destroy(env);
  env = bounded_env(CARRIES, 1, 0, 0);
  assert_refused(MJENV_E_TASK, mjenv_reset(env, NULL, NULL), "Probe-v0: carry: carried[4] is 1, not 0 to 0");
  mjenv_destroy(env);
  env = bounded_env(STEPS, 1, 0, 2);
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int t = 0; t < 2; ++t) assert_ok(step_all(env, p));
  assert_refused(MJENV_E_TASK, step_all(env, p), "row 0: Probe-v0: step: carried[0] is 3, not 0 to 2");
  assert_int_equal(p->status[ROWS - 1], MJENV_E_TASK);
  assert_ok(mjenv_observe(env, &p->batch));
  assert_true(p->obs[0][STEPS] == 2);
  mjenv_destroy(env);
  free(p);
}

static void refused_bounds(mjenv_status status, int64_t first, int64_t count, double low, double high,
                           const char* word) {
  bounds.first = first, bounds.count = count, bounds.low = low, bounds.high = high;
  refused_build("none", status, "carry_bounds: ", word);
  bounds.count = 0;
}

static void test_bad_bounds(void** state) {
  (void)state;
  refused_bounds(MJENV_E_VALUE, -1, 1, 0, 1, "first is -1");
  refused_bounds(MJENV_E_VALUE, INT64_MAX, 1, 0, 1, "first is 9223372036854775807");
  refused_bounds(MJENV_E_VALUE, 0, INT64_MAX, 0, 1, "count is 9223372036854775807");
  refused_bounds(MJENV_E_TASK, CARRIED, 1, 0, 1, "carry_count is 5");
  refused_bounds(MJENV_E_VALUE, 0, 1, 1, 3, "[1, 3] does not contain 0");
  refused_bounds(MJENV_E_VALUE, 0, 1, 3, -3, "[3, -3] does not contain 0");
  refused_bounds(MJENV_E_VALUE, 0, 1, NAN, 1, "does not contain 0");
  refused_bounds(MJENV_E_VALUE, 0, 1, 0, NAN, "does not contain 0");
}

static void test_model_option(void** state) {
  (void)state;
  mjenv_options* chosen = options_of_id("Probe-v0");
  mjenv_env* env = NULL;
  assert_ok(mjenv_options_set_string(chosen, "xml_string", "<mujoco><worldbody/></mujoco>"));
  assert_refused(MJENV_E_MODEL, mjenv_create(chosen, 1, &env), "Probe-v0", "\"tip\"");
  assert_ok(mjenv_options_set_string(chosen, "xml_string", model));
  assert_ok(mjenv_create(chosen, 1, &env));
  mjenv_destroy(env);
  mjenv_options_destroy(chosen);
}

static void test_all_are_destroyed(void** state) {
  (void)state;
  assert_true(built > 10);
  assert_int_equal(built, destroyed);
}

int main(void) {
  register_probe("Probe-v0", 0);
  register_probe("Probe-v1", 1);
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_build),
      cmocka_unit_test(test_long_message),
      cmocka_unit_test(test_failing_rows),
      cmocka_unit_test(test_failing_observe),
      cmocka_unit_test(test_failing_noisy_observation),
      cmocka_unit_test(test_outputs_of_failing_rows),
      cmocka_unit_test(test_failing_rollout),
      cmocka_unit_test(test_observe_without_memory),
      cmocka_unit_test(test_carried_forces),
      cmocka_unit_test(test_carried_once),
      cmocka_unit_test(test_failing_carry),
      cmocka_unit_test(test_failing_resets),
      cmocka_unit_test(test_lenient),
      cmocka_unit_test(test_extras),
      cmocka_unit_test(test_carried),
      cmocka_unit_test(test_bounds_of_images),
      cmocka_unit_test(test_bounds_of_callbacks),
      cmocka_unit_test(test_bad_bounds),
      cmocka_unit_test(test_model_option),
      cmocka_unit_test(test_all_are_destroyed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
