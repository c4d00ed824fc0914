// Tasks that see what belongs to the new state, and whose reset simulates, writes the model and draws from RandomState.
#include <math.h>

#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 3 };

// A ball that falls on the floor, and a marker that a reset moves.
static const char model[] =
    "<mujoco><option timestep='0.01'/><worldbody>"
    "<geom name='floor' type='plane' size='5 5 .1'/><geom name='marker' pos='0 0 2' size='.1' contype='0' "
    "conaffinity='0'/>"
    "<body name='ball' pos='0 0 1'><joint name='z' type='slide' axis='0 0 1'/><geom name='ball' size='.1'/></body>"
    "</worldbody><actuator><motor joint='z' gear='30'/></actuator></mujoco>";

static const mjenv_task_option options[] = {
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_FLAG, .name = "current", .value = 1},
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_STRING, .name = "own", .text = "geom_pos"},
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_FLAG, .name = "twice"},
    {.struct_size = sizeof(mjenv_task_option),
     .kind = MJENV_KIND_STRING,
     .name = "fails",
     .text = "never",
     .choices = "never late value draw_in_step advance"},
};

// x, y and z of the marker, z of the ball's body, and of its joint.
enum { MARKER, BODY = 3, JOINT, SEEN };
static const mjenv_task_field fields[] = {
    {.struct_size = sizeof(mjenv_task_field),
     .role = MJENV_ROLE_OBSERVATION,
     .name = "seen",
     .ndim = 1,
     .shape = {SEEN}},
};

struct self {
  int32_t own;
  char fails[16];
};
static bool breaks;  // the task then fails as the option says

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  (void)user;
  if (mjenv_build_integer(builder, "current")) mjenv_build_current(builder);
  mjenv_build_random_state(builder);
  mjenv_build_need(builder, "geom_xpos");
  struct self* s = allocate(sizeof *s);
  *self = s;
  s->own = mjenv_build_own(builder, mjenv_build_text(builder, "own"));
  if (mjenv_build_integer(builder, "twice")) mjenv_build_own(builder, mjenv_build_text(builder, "own"));
  snprintf(s->fails, sizeof s->fails, "%s", mjenv_build_text(builder, "fails"));
  return 0;
}

static void destroy(void* self) { free(self); }

static bool fails(const void* self, const char* how) {
  return breaks && strcmp(((const struct self*)self)->fails, how) == 0;
}

static int32_t reset(const void* self, mjenv_start* start) {
  const struct self* s = self;
  double* marker = start->own[s->own] + 3;
  marker[0] = mjenv_random_state_uniform(start->random, 0, 1);
  marker[1] += 1;  // counts the resets
  if (fails(self, "value")) marker[0] = NAN;
  if (fails(self, "late")) return mjenv_task_fail(start->api, "too late");
  if (fails(self, "advance")) mjenv_start_advance(start, 0);
  if (!start->sim) return 0;
  // Lets the ball fall until it touches the floor, and begins again 5 cm above.
  while (mjenv_start_contact_count(start) == 0)
    if (mjenv_start_advance(start, 1) != 0) return 1;  // MuJoCo cannot compute with what was written
  const double touching = start->qpos[0];
  mjenv_start_restart(start);
  if (*start->time != 0 || start->qpos[0] != 0) return mjenv_task_fail(start->api, "not restarted");
  start->qpos[0] = touching + 0.05;
  mjenv_start_forward(start);
  return mjenv_start_contact_count(start) == 0 ? 0 : mjenv_task_fail(start->api, "it touches");
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  (void)self;
  memcpy(to + MARKER, sim->geom_xpos + 3, 3 * sizeof *to);
  to[BODY] = sim->xpos[3 + 2];
  to[JOINT] = sim->qpos[0];
  return 0;
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)sim;
  if (fails(self, "draw_in_step")) mjenv_random_state_rand(outcome->random);
  return 0;
}

static const mjenv_task falling = {.struct_size = sizeof(mjenv_task),
                                   .id = "tests/Falling-v0",
                                   .model_text = model,
                                   .frame_skip = 2,
                                   .options = options,
                                   .option_count = COUNT(options),
                                   .fields = fields,
                                   .field_count = COUNT(fields),
                                   .build = build,
                                   .destroy = destroy,
                                   .reset = reset,
                                   .observe = observe,
                                   .step = step};

static mjenv_options* with(const char* option, const char* text) {
  mjenv_options* chosen = options_of_id(falling.id);
  if (option) assert_ok(mjenv_options_set_string(chosen, option, text));
  return chosen;
}

static mjenv_env* failing(const char* how, const char* own, bool current) {
  mjenv_options* chosen = with("fails", how);
  assert_ok(mjenv_options_set_integer(chosen, "current", current));
  assert_ok(mjenv_options_set_string(chosen, "own", own));
  mjenv_env* env = env_of_options(chosen, ROWS);
  seed_rows(env, 1);
  breaks = false;
  assert_ok(mjenv_reset(env, NULL, NULL));
  return env;
}

static void refused(mjenv_options* chosen, mjenv_status status, const char* word) {
  mjenv_env* env = NULL;
  assert_refused(status, mjenv_create(chosen, 1, &env), word);
  mjenv_options_destroy(chosen);
}

static mjenv_status step_all(mjenv_env* env, struct outputs* out) {
  const double action[ROWS] = {0.5, -1, 0};
  return mjenv_step(env, NULL, action, ROWS, MJENV_DTYPE_FLOAT64, &out->batch);
}

static void test_build(void** state) {
  (void)state;
  refused(with("own", "geom_size_"), MJENV_E_NAME, "geom_size_");
  refused(with("own", "geom_contype"), MJENV_E_TYPE, "real numbers");
  refused(with("own", "xpos"), MJENV_E_NAME, "xpos");
  mjenv_options* chosen = with(NULL, NULL);
  assert_ok(mjenv_options_set_integer(chosen, "twice", 1));
  refused(chosen, MJENV_E_VALUE, "already an own array");
}

// After a step, the body is where the joint says, which it is one timestep later without mjenv_build_current.
static void test_new_state(void** state) {
  (void)state;
  mjenv_env* env = failing("never", "geom_pos", true);
  struct outputs* out = outputs_of(env);
  for (int i = 0; i < 50; ++i) {
    assert_ok(step_all(env, out));
    for (int row = 0; row < ROWS; ++row) {
      const double* seen = out->obs + row * SEEN;
      assert_true(seen[BODY] == 1 + seen[JOINT]);
    }
  }
  outputs_free(out);
  mjenv_destroy(env);
}

// Model of a capsule that touches the floor with both ends, for which there is space for one contact.
static const char crowded[] =
    "<mujoco><size nconmax='1'/><option timestep='0.01'/><worldbody>"
    "<geom name='floor' type='plane' size='5 5 .1'/><geom name='marker' pos='0 0 2' size='.1' contype='0' "
    "conaffinity='0'/>"
    "<body name='ball' pos='0 0 1'><joint name='z' type='slide' axis='0 0 1'/>"
    "<geom name='ball' type='capsule' fromto='-.3 0 0 .3 0 0' size='.1'/></body>"
    "</worldbody><actuator><motor joint='z' gear='30'/></actuator></mujoco>";

static double read_element(mjenv_env* env, int64_t row, const char* array, int index) {
  double values[16];
  int64_t count = 0;
  assert_ok(mjenv_read(env, row, array, values, COUNT(values), &count));
  assert_in_range(index, 0, count - 1);
  return values[index];
}

// MuJoCo warns that there is no space for contacts when it finds those of the new state. The warnings are the same if
// they are read at once, if the row's derived arrays are computed again, and in lanes, and so are the images.
static void test_warnings(void** state) {
  (void)state;
  enum { CONTACT_FULL = 1 };  // mjWARN_CONTACTFULL
  mjenv_env* envs[2];
  for (int i = 0; i < 2; ++i) {
    mjenv_options* chosen = with("xml_string", crowded);
    assert_ok(mjenv_options_set_integer(chosen, "frame_skip", 1));
    if (i == 0) assert_ok(mjenv_options_set_integer(chosen, "lanes", 0));
    envs[i] = env_of_options(chosen, ROWS);
    seed_rows(envs[i], 1);
    breaks = false;
    assert_ok(mjenv_reset(envs[i], NULL, NULL));
  }
  struct outputs* out = outputs_of(envs[0]);
  int full = 0;
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 2; ++k) assert_ok(step_all(envs[k], out));
    int64_t sizes[2];
    void* images[2];
    for (int k = 0; k < 2; ++k) images[k] = image_of(envs[k], MJENV_ALL_ROWS, &sizes[k]);
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(images[0], images[1], sizes[0]);
    for (int k = 0; k < 2; ++k) free(images[k]);
    // The last row has been stepped last, so its derived arrays are there without lanes; later they are computed again.
    for (int row = ROWS - 1; row >= -ROWS; --row) {
      const int64_t read = (row + ROWS) % ROWS;
      const double contacts = read_element(envs[0], read, "ncon", 0);
      const double warned = read_element(envs[0], read, "warnings", CONTACT_FULL);
      assert_true(warned == (contacts == 1));
      assert_true(read_element(envs[1], read, "warnings", CONTACT_FULL) == warned);
      full += warned == 1;
    }
  }
  // MuJoCo 4.0 finds memory for all contacts.
  assert_true((full > 0) == (strstr(mjenv_version(), "MuJoCo 2.") != NULL));
  outputs_free(out);
  for (int k = 0; k < 2; ++k) mjenv_destroy(envs[k]);
}

// A box that tumbles, so that MuJoCo normalises its quaternion in each timestep. %s: the integrator.
static const char tumbling[] =
    "<mujoco><option timestep='0.01' integrator='%s'/><worldbody>"
    "<geom name='floor' type='plane' size='5 5 .1'/><geom name='marker' pos='0 0 2' size='.1' contype='0' "
    "conaffinity='0'/>"
    "<body name='ball' pos='0 0 1'><joint name='z' type='slide' axis='0 0 1'/><geom name='ball' size='.1'/></body>"
    "<body pos='1 0 1.5' euler='20 30 0'><freejoint/><geom type='box' size='.1 .2 .3'/></body>"
    "</worldbody><actuator><motor joint='z' gear='30'/></actuator></mujoco>";

// A step goes on from what the last one has computed for the new state. The result is the same as that of a step that
// computes it again, which it does if another row has been computed since: here, because the row was restored.
static void check_continued_steps(const char* integrator, int64_t frame_skip) {
  char text[sizeof tumbling + 10];
  snprintf(text, sizeof text, tumbling, integrator);
  mjenv_env* envs[2];
  for (int i = 0; i < 2; ++i) {
    mjenv_options* chosen = with("xml_string", text);
    assert_ok(mjenv_options_set_integer(chosen, "frame_skip", frame_skip));
    envs[i] = env_of_options(chosen, 1);
    seed_rows(envs[i], 1);
    breaks = false;
    assert_ok(mjenv_reset(envs[i], NULL, NULL));
  }
  for (int i = 0; i < 120; ++i) {
    const double action = 0.3 * sin(i), kick = 0.1 * i;
    void* images[2];
    int64_t sizes[2];
    for (int k = 0; k < 2; ++k) {
      if (i % 10 == 9) assert_ok(mjenv_write(envs[k], NULL, "qvel", (double[7]){kick, 1, 0, -1, kick, 2, 3}, 7));
      images[k] = image_of(envs[k], MJENV_ALL_ROWS, &sizes[k]);
      if (k == 1) assert_ok(mjenv_restore(envs[k], MJENV_ALL_ROWS, images[k], sizes[k]));
    }
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(images[0], images[1], sizes[0]);
    for (int k = 0; k < 2; ++k) {
      free(images[k]);
      assert_ok(mjenv_step(envs[k], NULL, &action, 1, MJENV_DTYPE_FLOAT64, NULL));
    }
    static const char* const arrays[] = {"qpos", "qacc", "xquat", "cfrc_ext", "ncon"};
    for (size_t a = 0; i % 3 == 0 && a < COUNT(arrays); ++a) {
      double values[2][32];
      int64_t counts[2];
      for (int k = 0; k < 2; ++k) assert_ok(mjenv_read(envs[k], 0, arrays[a], values[k], COUNT(values[k]), &counts[k]));
      assert_same_bits(arrays[a], values[0], values[1], (size_t)counts[0]);
    }
  }
  for (int k = 0; k < 2; ++k) mjenv_destroy(envs[k]);
}

static void test_continued_steps(void** state) {
  (void)state;
  static const char* const integrators[] = {"Euler", "implicit", "RK4"};
  for (size_t i = 0; i < COUNT(integrators); ++i)
    for (int64_t frame_skip = 1; frame_skip <= 3; frame_skip += 2) check_continued_steps(integrators[i], frame_skip);
}

// numpy.random.RandomState(seed).uniform(0, 1), for the seeds 1, 2 and 3.
static const double drawn[ROWS] = {0.417022004702574, 0.43599490214200376, 0.5507979025745755};

static void check_own_arrays(bool current) {
  mjenv_env* env = failing("never", "geom_pos", current);
  struct outputs* out = outputs_of(env);
  assert_ok(mjenv_observe(env, &out->batch));
  for (int row = 0; row < ROWS; ++row) {
    assert_same_bits("marker", out->obs + row * SEEN + MARKER, drawn + row, 1);
    assert_true(out->obs[row * SEEN + MARKER + 1] == 1);
  }
  const uint8_t last[ROWS] = {0, 0, 1};
  assert_ok(mjenv_reset(env, last, NULL));
  assert_ok(mjenv_copy_row(env, last, 1));
  assert_ok(mjenv_observe(env, &out->batch));
  for (int row = 0; row < ROWS; ++row) assert_true(out->obs[row * SEEN + MARKER + 1] == 1);
  assert_true(out->obs[2 * SEEN + MARKER] == drawn[1]);
  assert_ok(mjenv_reset(env, NULL, &out->batch));
  assert_same_bits("equal streams", out->obs + 2 * SEEN, out->obs + SEEN, SEEN);
  assert_true(out->obs[SEEN + MARKER] != drawn[1]);
  assert_true(out->obs[SEEN + MARKER + 1] == 2);
  outputs_free(out);
  mjenv_destroy(env);
}

static void test_own_arrays(void** state) {
  (void)state;
  check_own_arrays(true);
  check_own_arrays(false);
}

// A reset that fails leaves all of the row as it was: state, own arrays and both streams.
static void failing_reset(const char* how, const char* own, mjenv_status status, const char* word) {
  mjenv_env* env = failing(how, own, true);
  struct outputs *out = outputs_of(env), *again = outputs_of(env);
  assert_ok(step_all(env, out));
  int64_t size = 0, size_after = 0;
  void* before = image_of(env, MJENV_ALL_ROWS, &size);
  breaks = true;
  assert_refused(status, mjenv_reset(env, NULL, NULL), "row 0", word);
  void* after = image_of(env, MJENV_ALL_ROWS, &size_after);
  assert_int_equal(size, size_after);
  assert_memory_equal(before, after, size);
  breaks = false;
  assert_ok(step_all(env, out));
  assert_ok(mjenv_restore(env, MJENV_ALL_ROWS, before, size));
  assert_ok(step_all(env, again));
  assert_same_bits("continued", again->obs, out->obs, ROWS * SEEN);
  free(before);
  free(after);
  outputs_free(out);
  outputs_free(again);
  mjenv_destroy(env);
}

static void test_failing_resets(void** state) {
  (void)state;
  for (int i = 0; i < 2; ++i) {
    const char* own = i == 0 ? "geom_pos" : "geom_rgba";  // doubles, and float32
    failing_reset("late", own, MJENV_E_TASK, "too late");
    failing_reset("advance", own, MJENV_E_TASK, "count is less than 1");
    failing_reset("value", own, MJENV_E_TASK, "[3] is nan");  // before the reset simulates
  }
}

static void test_refused_draws(void** state) {
  (void)state;
  mjenv_env* env = failing("draw_in_step", "geom_pos", true);
  struct outputs* out = outputs_of(env);
  breaks = true;
  assert_refused(MJENV_E_TASK, step_all(env, out), "only the reset of a task that called");
  breaks = false;
  outputs_free(out);
  mjenv_destroy(env);
}

// A damaged stream could make RandomState read behind its words, or draw zeros for ever, so that randn would not end.
static void test_damaged_stream(void** state) {
  (void)state;
  mjenv_env* env = env_of_id(falling.id, 1);
  breaks = false;
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  int64_t size = 0;
  unsigned char* image = image_of(env, MJENV_ALL_ROWS, &size);
  size_t bytes = 0;
  unsigned char* stream = image_part(image, "random_state", &bytes);
  for (int32_t position = 625; position >= 624; --position) {
    if (position == 624) memset(stream, 0, 624 * sizeof(uint32_t));
    memcpy(stream + 624 * sizeof(uint32_t), &position, sizeof position);
    image_seal(image, (size_t)size);
    assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, MJENV_ALL_ROWS, image, size), "damaged");
  }
  free(image);
  uint64_t words[627] = {[0] = 0x7fffffff, [624] = 624};
  assert_refused(MJENV_E_VALUE, mjenv_set_stream(env, 0, words, 627), "state");
  words[623] = 1;
  assert_ok(mjenv_set_stream(env, 0, words, 627));
  mjenv_destroy(env);
}

static int setup(void** state) {
  (void)state;
  assert_ok(mjenv_register_task(&falling));
  return 0;
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_build),         cmocka_unit_test(test_new_state),
      cmocka_unit_test(test_own_arrays),    cmocka_unit_test(test_failing_resets),
      cmocka_unit_test(test_refused_draws), cmocka_unit_test(test_damaged_stream),
      cmocka_unit_test(test_warnings),      cmocka_unit_test(test_continued_steps),
  };
  return cmocka_run_group_tests(tests, setup, NULL);
}
