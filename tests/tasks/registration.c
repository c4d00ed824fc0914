// What a task says about itself is checked when it is registered, and copied.
#include <math.h>
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include "mjenv/task.h"
#include "support.h"

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  (void)builder;
  *self = user;
  return 0;
}
static void destroy(void* self) { (void)self; }
static int32_t reset(const void* self, mjenv_start* start) { return (void)self, (void)start, 0; }
static int32_t reset_info(const void* self, const mjenv_sim* sim, double* to) {
  return (void)self, (void)sim, (void)to, 0;
}
static int32_t carry(const void* self, const mjenv_sim* sim, double* to) { return (void)self, (void)sim, (void)to, 0; }
static int32_t observe(const void* self, const mjenv_sim* sim, double* to) { return (void)self, to[0] = *sim->time, 0; }
static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* out) {
  return (void)self, (void)sim, (void)out, 0;
}

// A task with its parts, to be spoilt.
struct parts {
  mjenv_task task;
  mjenv_task_option options[2];
  mjenv_task_field fields[3];
  mjenv_task_camera camera;
};

static struct parts* parts_of(const char* id) {
  struct parts* p = allocate(sizeof *p);
  memset(p, 0, sizeof *p);
  p->options[0] =
      (mjenv_task_option){.struct_size = sizeof p->options[0], .kind = MJENV_KIND_REALS, .name = "weight", .value = 1};
  p->options[1] = (mjenv_task_option){.struct_size = sizeof p->options[0],
                                      .kind = MJENV_KIND_STRING,
                                      .name = "gait",
                                      .text = "trot",
                                      .choices = "walk trot"};
  p->fields[0] = (mjenv_task_field){.struct_size = sizeof p->fields[0], .role = MJENV_ROLE_OBSERVATION, .name = "time"};
  p->fields[1] = (mjenv_task_field){
      .struct_size = sizeof p->fields[0], .role = MJENV_ROLE_INFO, .name = "pair", .ndim = 1, .shape = {2}};
  p->fields[2] = (mjenv_task_field){
      .struct_size = sizeof p->fields[0], .role = MJENV_ROLE_RESET_INFO, .name = "pair", .ndim = 2, .shape = {2, 3}};
  p->camera = (mjenv_task_camera){.struct_size = sizeof p->camera, .distance = 2, .elevation = NAN};
  p->task = (mjenv_task){.struct_size = sizeof p->task,
                         .id = id,
                         .model = "hopper.xml",
                         .frame_skip = 2,
                         .carry_count = 1,
                         .camera = &p->camera,
                         .options = p->options,
                         .option_count = 2,
                         .fields = p->fields,
                         .field_count = 3,
                         .build = build,
                         .destroy = destroy,
                         .reset = reset,
                         .reset_info = reset_info,
                         .carry = carry,
                         .observe = observe,
                         .step = step};
  return p;
}

#define refused(status, change, ...)                                    \
  do {                                                                  \
    struct parts* p = parts_of("Refused-v0");                           \
    change;                                                             \
    assert_refused(status, mjenv_register_task(&p->task), __VA_ARGS__); \
    free(p);                                                            \
  } while (0)

static void test_bad_ids(void** state) {
  (void)state;
  static const char* const bad[] = {"",
                                    "Cartpole",
                                    "Cartpole-v",
                                    "-v0",
                                    "Cartpole-v0x",
                                    "Cart pole-v0",
                                    "a//b-v0",
                                    "/b-v0",
                                    "a/-v0",
                                    "a/b/c-v0",
                                    "-a/b-v0",
                                    "Cartpole-v-1",
                                    "Cart\"pole-v0",
                                    "-Cart-v0",
                                    "Cartpole-v1234567890",
                                    "\xc3\xa9-v0"};
  for (size_t i = 0; i < COUNT(bad); ++i) refused(MJENV_E_VALUE, p->task.id = bad[i], "\"Cartpole-v0\"");
  char text[200];
  memset(text, 'a', sizeof text);
  strcpy(text + 150, "-v0");
  refused(MJENV_E_VALUE, p->task.id = text, "100 bytes");
  refused(MJENV_E_ARGUMENT, p->task.id = NULL, "id");
  refused(MJENV_E_VALUE, p->task.id = "Hopper-v5", "Hopper-v5", "built-in");
  refused(MJENV_E_VALUE, p->task.id = "Model-v0", "Model-v0", "built-in");
}

static void test_bad_parts(void** state) {
  (void)state;
  assert_refused(MJENV_E_ARGUMENT, mjenv_register_task(NULL), "task is NULL");
  refused(MJENV_E_ARGUMENT, p->task.struct_size = 8, "struct_size is 8");
  refused(MJENV_E_ARGUMENT, p->task.model = NULL, "Refused-v0", "model_text");
  refused(MJENV_E_ARGUMENT, p->task.model_text = "<mujoco/>", "one of model and model_text");
  refused(MJENV_E_VALUE, p->task.model = "", "model is empty");
  refused(MJENV_E_VALUE, p->task.frame_skip = 0, "frame_skip is 0");
  refused(MJENV_E_VALUE, p->task.time_limit = -1, "time_limit is -1");
  refused(MJENV_E_VALUE, p->task.carry_count = -1, "carry_count is -1");
  refused(MJENV_E_VALUE, p->task.carry_count = INT64_MAX, "carry_count");
  refused(MJENV_E_ARGUMENT, p->camera.struct_size = 0, "camera", "struct_size");
}

static void test_bad_callbacks(void** state) {
  (void)state;
  refused(MJENV_E_ARGUMENT, p->task.physics_only = 1, "callback reset_info is given, but the task is physics_only");
  refused(MJENV_E_ARGUMENT, (p->task.physics_only = 1, p->task.reset_info = NULL),
          "is given, but the task is physics_only");
  refused(MJENV_E_ARGUMENT, p->task.reset = NULL, "callback reset is NULL");
  refused(MJENV_E_ARGUMENT, p->task.observe = NULL, "callback observe is NULL");
  refused(MJENV_E_ARGUMENT, p->task.step = NULL, "callback step is NULL");
  refused(MJENV_E_ARGUMENT, p->task.reset_info = NULL, "reset_info is NULL");
  refused(MJENV_E_ARGUMENT, p->task.build = NULL, "destroy is given");
  refused(MJENV_E_ARGUMENT, (p->task.build = NULL, p->task.destroy = NULL, p->task.carry_count = 0),
          "carry_count is 0");
  refused(MJENV_E_ARGUMENT, (p->task.build = NULL, p->task.destroy = NULL, p->fields[0].role = MJENV_ROLE_STRUCTURE),
          "no field of the observation");
}

static void test_bad_options(void** state) {
  (void)state;
  refused(MJENV_E_ARGUMENT, p->task.options = NULL, "options is NULL");
  refused(MJENV_E_SIZE, p->task.option_count = -1, "option_count is -1");
  refused(MJENV_E_ARGUMENT, p->options[1].struct_size = 0, "options[1]", "struct_size");
  refused(MJENV_E_ARGUMENT, p->options[1].name = NULL, "an option has no name");
  refused(MJENV_E_ARGUMENT, p->options[1].name = "", "an option has no name");
  refused(MJENV_E_VALUE, p->options[1].name = "my gait", "no blanks");
  refused(MJENV_E_VALUE, p->options[1].name = "weight", "already", "\"weight\"");
  refused(MJENV_E_VALUE, p->options[1].name = "frame_skip", "already", "\"frame_skip\"");
  refused(MJENV_E_VALUE, p->options[1].name = "num_threads", "already", "\"num_threads\"");
  refused(MJENV_E_VALUE, p->options[1].text = "fly", "\"fly\"", "choices");
  refused(MJENV_E_VALUE, p->options[1].text = "walk trot", "\"walk trot\"", "choices");
  refused(MJENV_E_TYPE, p->options[0].kind = 77, "kind 77");
  refused(MJENV_E_VALUE, (p->options[0].low = 2, p->options[0].high = 3), "does not lie in [2, 3]");
  refused(MJENV_E_VALUE, (p->options[0].low = 3, p->options[0].high = 2), "bounds");
  refused(MJENV_E_VALUE, p->options[0].low = NAN, "bounds");
  refused(MJENV_E_VALUE, p->options[0].value = NAN, "nan");
  refused(MJENV_E_VALUE, p->options[0].count = -2, "count is -2");
  refused(MJENV_E_ARGUMENT, p->options[0].count = 2, "values is NULL");
  refused(MJENV_E_VALUE, (p->options[0].kind = MJENV_KIND_INTEGER, p->options[0].value = 0.5), "not an integer");
  refused(MJENV_E_VALUE, (p->options[0].kind = MJENV_KIND_FLAG, p->options[0].value = 2), "[0, 1]");
}

static void test_bad_fields(void** state) {
  (void)state;
  refused(MJENV_E_ARGUMENT, p->task.fields = NULL, "fields is NULL");
  refused(MJENV_E_ARGUMENT, p->fields[1].struct_size = 4, "fields[1]", "struct_size");
  refused(MJENV_E_ARGUMENT, p->fields[1].name = NULL, "a field has no name");
  refused(MJENV_E_ARGUMENT, p->fields[1].name = "", "a field has no name");
  refused(MJENV_E_VALUE, (p->fields[1].role = MJENV_ROLE_OBSERVATION, p->fields[1].name = "time"), "already",
          "\"time\"");
  refused(MJENV_E_TYPE, p->fields[1].role = MJENV_ROLE_ACTION, "role 2");
  refused(MJENV_E_TYPE, p->fields[1].role = 99, "role 99");
  refused(MJENV_E_TYPE, p->fields[1].dtype = 99, "type 99");
  refused(MJENV_E_TYPE, p->fields[0].dtype = MJENV_DTYPE_FLOAT32, "an observation is of");
  refused(MJENV_E_VALUE, p->fields[1].ndim = 5, "5 dimensions");
  refused(MJENV_E_VALUE, p->fields[0].ndim = 2, "vectors");
  refused(MJENV_E_VALUE, p->fields[1].shape[0] = -2, "length -2");
  refused(MJENV_E_VALUE, p->fields[1].shape[0] = INT64_MAX, "length");
  refused(MJENV_E_VALUE, (p->fields[2].shape[0] = 1 << 20, p->fields[2].shape[1] = 1 << 20), "length");
}

// What was registered may be overwritten and freed; the task is the one that it was.
static void test_copied(void** state) {
  (void)state;
  const int64_t before = mjenv_id_count();
  struct parts* p = parts_of("Copied-v12");
  char id[] = "Copied-v12", name[] = "weight";
  p->task.id = id, p->options[0].name = name;
  assert_ok(mjenv_register_task(&p->task));
  assert_refused(MJENV_E_VALUE, mjenv_register_task(&p->task), "\"Copied-v12\"", "already registered");
  memset(id, 'x', sizeof id), memset(name, 'x', sizeof name), memset(p, 0xee, sizeof *p);
  free(p);
  assert_int_equal(mjenv_id_count(), before + 1);
  mjenv_spec spec = MJENV_SPEC_INIT;
  assert_ok(mjenv_spec_of("Copied-v12", &spec));
  assert_string_equal(spec.robot, "Copied");
  assert_int_equal(spec.version, 12);
  assert_true(isnan(spec.reward_threshold) && spec.camera_distance == 2 && isnan(spec.camera_elevation));
  mjenv_options* options = options_of_id("Copied-v12");
  double weight = 0;
  int64_t count = 0;
  const char* gait = NULL;
  assert_ok(mjenv_options_get_reals(options, "weight", &weight, 1, &count));
  assert_ok(mjenv_options_get_string(options, "gait", &gait));
  assert_true(weight == 1 && strcmp(gait, "trot") == 0);
  assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, "gait", "fly"), "walk");
  mjenv_env* env = env_of_options(options, 3);
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_OBSERVATION), 1);
  mjenv_field field = MJENV_FIELD_INIT;
  assert_ok(mjenv_field_at(env, MJENV_ROLE_RESET_INFO, 0, &field));
  assert_true(field.ndim == 2 && field.shape[0] == 2 && field.shape[1] == 3 && field.count == 6);
  assert_ok(mjenv_reset(env, NULL, NULL));
  mjenv_destroy(env);
}

static bool has_option(const char* id, const char* name) {
  mjenv_options* options = options_of_id(id);
  bool found = false;
  for (int64_t i = 0; i < mjenv_options_count(options); ++i) {
    mjenv_option option = MJENV_OPTION_INIT;
    assert_ok(mjenv_options_at(options, i, &option));
    found = found || strcmp(option.name, name) == 0;
  }
  mjenv_options_destroy(options);
  return found;
}

static void test_fixed(void** state) {
  (void)state;
  struct parts* p = parts_of("FixedModel-v0");
  p->task.fixed_model = 1;
  assert_ok(mjenv_register_task(&p->task));
  p->task.id = "FixedFrames-v0", p->task.fixed_model = 0, p->task.fixed_frame_skip = 1;
  assert_ok(mjenv_register_task(&p->task));
  for (const char* const* name = (const char* const[]){"xml_file", "xml_string", "trust_xml", NULL}; *name; ++name)
    assert_true(!has_option("FixedModel-v0", *name) && has_option("FixedFrames-v0", *name));
  assert_true(has_option("FixedModel-v0", "frame_skip") && !has_option("FixedFrames-v0", "frame_skip"));
  for (const char* const* id = (const char* const[]){"FixedModel-v0", "FixedFrames-v0", NULL}; *id; ++id) {
    mjenv_env* env = env_of_id(*id, 1);
    assert_int_equal(frame_skip_of(env), 2);
    mjenv_destroy(env);
  }
  free(p);
}

// A caller may know more of the structs than the library.
static void test_longer_structs(void** state) {
  (void)state;
  struct {
    mjenv_task task;
    unsigned char more[64];
  } longer;
  struct {
    mjenv_task_field field;
    unsigned char more[24];
  } fields[2];
  struct parts* p = parts_of("Longer-v0");
  memset(&longer, 0x77, sizeof longer), memset(fields, 0x77, sizeof fields);
  longer.task = p->task;
  longer.task.struct_size = sizeof longer;
  for (int i = 0; i < 2; ++i) {
    fields[i].field = p->fields[i];
    fields[i].field.struct_size = sizeof fields[i];
  }
  longer.task.fields = &fields[0].field, longer.task.field_count = 2, longer.task.reset_info = NULL;
  assert_ok(mjenv_register_task(&longer.task));
  mjenv_env* env = env_of_id("Longer-v0", 1);
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_INFO), 1);
  mjenv_destroy(env);
  free(p);
}

enum { THREADS = 4, EACH = 20 };

static void* register_many(void* argument) {
  const int thread = *(const int*)argument;
  for (int i = 0; i < EACH; ++i) {
    char id[32];
    snprintf(id, sizeof id, "Many%d_%d-v0", thread, i);
    struct parts* p = parts_of(id);
    if (mjenv_register_task(&p->task) != MJENV_OK) return NULL;
    p->task.id = "Raced-v0";
    mjenv_register_task(&p->task);  // one of all these succeeds
    free(p);
    for (int64_t k = 0, count = mjenv_id_count(); k < count; ++k)
      if (!mjenv_id_at(k)) return NULL;
    mjenv_options* options = NULL;
    if (mjenv_options_create(id, &options) != MJENV_OK) return NULL;
    mjenv_options_destroy(options);
  }
  return argument;
}

static void test_threads(void** state) {
  (void)state;
  const int64_t before = mjenv_id_count();
  pthread_t threads[THREADS];
  int numbers[THREADS];
  for (int i = 0; i < THREADS; ++i) {
    numbers[i] = i;
    assert_int_equal(pthread_create(&threads[i], NULL, register_many, &numbers[i]), 0);
  }
  for (int i = 0; i < THREADS; ++i) {
    void* result = NULL;
    pthread_join(threads[i], &result);
    assert_ptr_equal(result, &numbers[i]);
  }
  assert_int_equal(mjenv_id_count(), before + THREADS * EACH + 1);
  for (int64_t i = 1; i < mjenv_id_count(); ++i) assert_true(strcmp(mjenv_id_at(i - 1), mjenv_id_at(i)) < 0);
}

static void test_fork(void** state) {
  (void)state;
  struct parts* p = parts_of("Forked-v0");
  assert_ok(mjenv_register_task(&p->task));
  const pid_t pid = fork();
  if (pid == 0) {
    mjenv_options* options = NULL;
    mjenv_env* env = NULL;
    bool fine = mjenv_options_create("Forked-v0", &options) == MJENV_OK && mjenv_create(options, 2, &env) == MJENV_OK &&
                mjenv_reset(env, NULL, NULL) == MJENV_OK;
    p->task.id = "InChild-v0";
    fine = fine && mjenv_register_task(&p->task) == MJENV_OK;
    _exit(fine ? 0 : 1);
  }
  int status = 0;
  assert_int_equal(waitpid(pid, &status, 0), pid);
  assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  free(p);
  mjenv_options* options = NULL;
  assert_refused(MJENV_E_NAME, mjenv_options_create("InChild-v0", &options), "no environment");
}

// ---- Where callbacks run ----

static pthread_t caller;
static int calls, elsewhere;

static void note_thread(void) {
  ++calls;
  if (!pthread_equal(pthread_self(), caller)) ++elsewhere;
}
static int32_t reset_noted(const void* self, mjenv_start* start) { return note_thread(), reset(self, start); }
static int32_t carry_noted(const void* self, const mjenv_sim* sim, double* to) {
  return note_thread(), carry(self, sim, to);
}
static int32_t observe_noted(const void* self, const mjenv_sim* sim, double* to) {
  return note_thread(), observe(self, sim, to);
}
static int32_t step_noted(const void* self, const mjenv_sim* sim, mjenv_outcome* out) {
  return note_thread(), step(self, sim, out);
}

static void test_caller_thread(void** state) {
  (void)state;
  struct parts* p = parts_of("Caller-v0");
  p->task.caller_thread = 1;
  p->task.reset = reset_noted, p->task.carry = carry_noted, p->task.observe = observe_noted, p->task.step = step_noted;
  assert_ok(mjenv_register_task(&p->task));
  free(p);
  mjenv_options* options = options_of_id("Caller-v0");
  mjenv_env* env = NULL;
  assert_ok(mjenv_options_set_integer(options, "num_threads", 2));
  assert_refused(MJENV_E_VALUE, mjenv_create(options, 64, &env), "num_threads", "2", "Caller-v0", "set it to 1");
  assert_ok(mjenv_options_set_integer(options, "num_threads", 0));
  env = env_of_options(options, 64);

  caller = pthread_self();
  double action[64 * 3] = {0}, obs[64];
  int64_t rows[64];
  int64_t count = 0;
  mjenv_batch out = {.struct_size = sizeof out,
                     .obs_dtype = MJENV_DTYPE_FLOAT64,
                     .rows = 64,
                     .obs_count = 1,
                     .info_count = 2,
                     .reset_info_count = 6};
  out.obs = obs;
  assert_ok(mjenv_reset(env, NULL, &out));
  assert_ok(mjenv_step(env, NULL, action, 64 * 3, MJENV_DTYPE_FLOAT64, &out));
  assert_ok(mjenv_send(env, NULL, 64, action, 64 * 3, MJENV_DTYPE_FLOAT64));
  assert_ok(mjenv_recv(env, 64, -1, rows, 64, &count, &out));
  assert_int_equal(count, 64);
  assert_int_equal(calls, 64 * 9);  // reset, carry and observe; twice step, carry and observe
  assert_int_equal(elsewhere, 0);
  mjenv_destroy(env);
}

// The library simulates, and calls nothing: observations and rewards are 0, and infos NaN.
static void test_physics_only(void** state) {
  (void)state;
  struct parts* p = parts_of("Physics-v0");
  p->task.physics_only = 1;
  p->task.carry_count = 0;
  p->task.reset = NULL, p->task.reset_info = NULL, p->task.carry = NULL, p->task.observe = NULL, p->task.step = NULL;
  assert_ok(mjenv_register_task(&p->task));
  free(p);
  mjenv_options *options = options_of_id("Physics-v0"), *bare = options_of_id("Model-v0");
  assert_ok(mjenv_options_set_string(options, "arrays", "qpos qvel"));
  assert_ok(mjenv_options_set_integer(options, "num_threads", 2));
  assert_ok(mjenv_options_set_string(bare, "xml_file", "hopper.xml"));
  assert_ok(mjenv_options_set_integer(bare, "frame_skip", 2));
  mjenv_env *env = env_of_options(options, 2), *other = env_of_options(bare, 2);

  double obs[2] = {1, 1}, reward[2] = {1, 1}, info[4] = {0}, reset_info[12] = {0}, arrays[24], expected[24];
  mjenv_batch out = {.struct_size = sizeof out,
                     .obs_dtype = MJENV_DTYPE_FLOAT64,
                     .rows = 2,
                     .obs_count = 1,
                     .info_count = 2,
                     .reset_info_count = 6,
                     .arrays_count = 12,
                     .obs = obs,
                     .reward = reward,
                     .info = info,
                     .reset_info = reset_info,
                     .arrays = arrays};
  mjenv_batch simulated = {
      .struct_size = sizeof simulated, .obs_dtype = MJENV_DTYPE_FLOAT64, .rows = 2, .obs_count = 12, .obs = expected};
  assert_ok(mjenv_reset(env, NULL, &out));
  assert_ok(mjenv_reset(other, NULL, &simulated));
  for (int i = 0; i < 12; ++i) assert_true(isnan(reset_info[i]));
  const double action[6] = {0.5, -0.5, 1, 0.25, 0, -1};
  for (int t = 0; t < 20; ++t) {
    assert_ok(mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, &out));
    assert_ok(mjenv_step(other, NULL, action, 6, MJENV_DTYPE_FLOAT64, &simulated));
  }
  for (int row = 0; row < 2; ++row) {
    assert_true(obs[row] == 0 && reward[row] == 0);
    // Exported arrays lie one after the other, those of Model-v0's observation row by row.
    assert_memory_equal(arrays + 6 * row, expected + 12 * row, 6 * sizeof(double));
    assert_memory_equal(arrays + 12 + 6 * row, expected + 12 * row + 6, 6 * sizeof(double));
  }
  for (int i = 0; i < 4; ++i) assert_true(isnan(info[i]));
  mjenv_destroy(env);
  mjenv_destroy(other);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_bad_ids),        cmocka_unit_test(test_bad_parts),    cmocka_unit_test(test_bad_callbacks),
      cmocka_unit_test(test_bad_options),    cmocka_unit_test(test_bad_fields),   cmocka_unit_test(test_copied),
      cmocka_unit_test(test_longer_structs), cmocka_unit_test(test_threads),      cmocka_unit_test(test_fork),
      cmocka_unit_test(test_caller_thread),  cmocka_unit_test(test_physics_only), cmocka_unit_test(test_fixed),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
