// Memory runs out at every single allocation of every call in turn: the call fails, nothing else does.
//   test_memory [long]    long: building an environment of every id
#define _GNU_SOURCE  // RTLD_DEFAULT
#include <dlfcn.h>

#include "allocator.h"
#include "golden.h"
#include "mjenv/task.h"

#ifndef MOST_LOST  // bytes that MuJoCo's loader may lose in one creation that fails (docs/reliability.md)
#define MOST_LOST (8 << 20)
#endif

enum { ROWS = 3, BUILT_ROWS = 3, MOST = 100000, NU = 8 };

#define RECORDING "trajectories/Ant-v5.golden"

static struct {
  struct golden* golden;
  mjenv_options* options;
  mjenv_env *env, *threaded;  // a row that follows the recording; rows on two threads
  mjenv_env *built, *drawn;
  mjenv_env* random;  // rows that draw their models
  mjenv_env* task;    // rows of the task below
  mjenv_renderer* renderer;
  struct outputs* out;
  unsigned char image[1 << 16];
  int64_t image_size;
  double action[ROWS * NU], values[4096];
  double mass[64], heavy[64 * BUILT_ROWS], negative[64 * BUILT_ROWS];
  int64_t bodies;
  unsigned char written[1 << 16];
  int64_t written_size;
  const char* id;
} s;

// ---- What may run out of memory ----

static mjenv_status spec_of(void) {
  mjenv_spec spec = MJENV_SPEC_INIT;
  return mjenv_spec_of("Humanoid-v4", &spec);
}

static mjenv_status options_create(void) {
  mjenv_options* options = NULL;
  const mjenv_status status = mjenv_options_create("Humanoid-v5", &options);
  mjenv_options_destroy(options);
  return status;
}

static mjenv_status no_id(void) {
  mjenv_options* options = NULL;
  return mjenv_options_create("an id that there is not, with a name that is allocated", &options);
}

static mjenv_status set_string(void) {
  return mjenv_options_set_string(s.options, "xml_file", "./a path of more than some characters.xml");
}

static mjenv_status set_choice(void) { return mjenv_options_set_string(s.options, "autoreset_mode", "next_step"); }

static mjenv_status set_reals(void) {
  const double range[2] = {0.2, 1.1};
  return mjenv_options_set_reals(s.options, "healthy_z_range", range, 2);
}

static mjenv_status get_reals(void) {
  int64_t count;
  return mjenv_options_get_reals(s.options, "healthy_z_range", s.values, 2, &count);
}

static mjenv_status no_option(void) { return mjenv_options_set_integer(s.options, "an option that there is not", 1); }

static mjenv_status create(void) {
  mjenv_destroy(s.built);
  s.built = NULL;
  mjenv_options* options = NULL;
  mjenv_status status = mjenv_options_create(s.id, &options);
  if (status == MJENV_OK) status = mjenv_create(options, BUILT_ROWS, &s.built);
  mjenv_options_destroy(options);
  return status;
}

static mjenv_status create_with_threads(void) {
  mjenv_destroy(s.built);
  s.built = NULL;
  mjenv_options* options = NULL;
  mjenv_status status = mjenv_options_create("Reacher-v5", &options);
  if (status == MJENV_OK) status = mjenv_options_set_integer(options, "num_threads", 3);
  if (status == MJENV_OK) status = mjenv_options_set_integer(options, "cpu_affinity", 1);
  if (status == MJENV_OK) status = mjenv_options_set_string(options, "arrays", "xpos cfrc_ext");
  if (status == MJENV_OK) status = mjenv_create(options, 4, &s.built);
  mjenv_options_destroy(options);
  return status;
}

static mjenv_status create_from_text(void) {
  static const char* const text =
      "<mujoco><worldbody><body><joint type='hinge' limited='true' range='-1 1'/><geom size='.1'/><body>"
      "<joint type='slide'/><geom type='capsule' fromto='0 0 0 0 0 1' size='.1'/></body></body></worldbody>"
      "<actuator><motor joint='none'/></actuator></mujoco>";
  mjenv_options* options = NULL;
  mjenv_status status = mjenv_options_create("InvertedPendulum-v5", &options);
  if (status == MJENV_OK) status = mjenv_options_set_string(options, "xml_string", text);
  if (status == MJENV_OK) status = mjenv_create(options, 1, &s.built);
  mjenv_options_destroy(options);
  return status;
}

// A model for which MuJoCo allocates in other ways: with a mesh, a texture, a height field, a cloth with a skin, and a muscle,
// whose range it finds in few steps.
static mjenv_status create_from_assets(void) {
  static const char* const text =
      "<mujoco><compiler><lengthrange inttotal='.1' inteval='.05' tolrange='9'/></compiler><asset><mesh name='m' "
      "vertex='0 0 0 1 0 0 0 1 0 0 0 1'/><texture name='t' type='2d' builtin='checker' "
      "width='8' height='8' mark='edge'/><material name='a' texture='t'/><hfield name='h' nrow='3' ncol='3' "
      "size='1 1 1 1'/></asset><worldbody><geom type='hfield' hfield='h' material='a'/><body pos='0 0 3'><joint "
      "name='j' limited='true' range='-9 9'/>"
      "<geom type='mesh' mesh='m' mass='1'/></body><body pos='0 0 5'><joint/><geom size='.1'/><composite type='grid' "
      "count='3 3 1' spacing='.1' flatinertia='.1'><geom size='.02' mass='.1'/><skin texcoord='true'/></composite>"
      "</body></worldbody><actuator><muscle joint='j' ctrllimited='true' ctrlrange='0 1'/></actuator></mujoco>";
  mjenv_destroy(s.built);
  s.built = NULL;
  mjenv_options* options = NULL;
  mjenv_status status = mjenv_options_create("Model-v0", &options);
  if (status == MJENV_OK) status = mjenv_options_set_string(options, "xml_string", text);
  if (status == MJENV_OK) status = mjenv_create(options, 1, &s.built);
  mjenv_options_destroy(options);
  return status;
}

static mjenv_status reset(void) { return mjenv_reset(s.env, NULL, NULL); }
static mjenv_status reset_threaded(void) { return mjenv_reset(s.threaded, NULL, &s.out->batch); }
static mjenv_status step(void) { return mjenv_step(s.env, NULL, s.action, NU, MJENV_DTYPE_FLOAT64, NULL); }

static mjenv_status step_threaded(void) {
  return mjenv_step(s.threaded, NULL, s.action, ROWS * NU, MJENV_DTYPE_FLOAT64, &s.out->batch);
}

static mjenv_status bad_step(void) { return mjenv_step(s.env, NULL, s.action, NU - 1, MJENV_DTYPE_FLOAT64, NULL); }

static mjenv_status send_and_recv(void) {
  int64_t rows[ROWS];
  int64_t count = 0;
  mjenv_status status = mjenv_send(s.threaded, NULL, 0, s.action, ROWS * NU, MJENV_DTYPE_FLOAT64);
  for (size_t left = ROWS; status == MJENV_OK && left > 0; left -= count)
    status = mjenv_recv(s.threaded, 1, -1, rows, ROWS, &count, &s.out->batch);
  return status;
}

static mjenv_status rollout(void) {
  const mjenv_status status = mjenv_reset(s.env, NULL, NULL);
  return status ? status : mjenv_rollout(s.env, s.action, ROWS * NU, MJENV_DTYPE_FLOAT64, ROWS, NULL);
}

static mjenv_status sample(void) {
  float action[NU];
  return mjenv_sample_actions(s.env, action, NU);
}

static mjenv_status seed_words(void) {
  static const uint64_t seeds[ROWS][5] = {{1, 2, 3, 4, 5}};
  return mjenv_seed(s.env, NULL, seeds[0], ROWS * 5);
}

static mjenv_status read(void) {
  int64_t count;
  return mjenv_read(s.env, 0, "cfrc_ext", s.values, COUNT(s.values), &count);
}

static mjenv_status no_array(void) {
  int64_t count;
  return mjenv_read(s.env, 0, "an array that there is not", s.values, COUNT(s.values), &count);
}

static mjenv_status object(void) {
  int64_t index;
  return mjenv_object_index(s.env, "joint", "ankle_4", &index);
}

static mjenv_status no_object(void) {
  int64_t index;
  return mjenv_object_index(s.env, "joint", "a joint that there is not", &index);
}

static mjenv_status observe(void) { return mjenv_observe(s.threaded, &s.out->batch); }
static mjenv_status snapshot(void) { return mjenv_snapshot(s.built, 0, s.image, sizeof s.image, &s.image_size); }
static mjenv_status restore(void) { return mjenv_restore(s.built, 0, s.image, s.image_size); }

static mjenv_status first_snapshot(void) {
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  mjenv_status status = mjenv_options_create("Reacher-v4", &options);
  if (status == MJENV_OK) status = mjenv_create(options, 1, &env);
  if (status == MJENV_OK) status = mjenv_snapshot(env, 0, s.image, sizeof s.image, &s.image_size);
  if (status == MJENV_OK) status = mjenv_restore(env, 0, s.image, s.image_size);
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return status;
}

static mjenv_status randomize(void) {
  return mjenv_randomize(s.random,
                         "{\"randomize\": {\"geom_friction\": {\"kind\": \"scale\", \"low\": 0.5, \"high\": 1.5,"
                         " \"set_constants\": true}, \"body_mass\": {\"kind\": \"scale\", \"distribution\": \"normal\","
                         " \"mean\": 1, \"std\": 0}}}");
}

static mjenv_status bad_randomize(void) {
  return mjenv_randomize(s.random, "{\"randomize\": {\"an array that there is not\": {\"low\": 0, \"high\": 1}}}");
}

static mjenv_status perturb(void) {
  return mjenv_randomize(
      s.random,
      "{\"noise\": {\"action\": 0.5, \"observation\": 0.5}, \"delay\": {\"action\": [2, 4],"
      " \"observation\": [3, 5], \"first_action\": 0.5, \"redraw\": \"step\"}, \"push\": {\"body\": 1,"
      " \"every\": 1, \"force\": [[0, 1], [0, 2], [0, 3]]}}");
}

// The step frees what the resets have kept of the rows, so that as many blocks are left as before.
static mjenv_status reset_random(void) {
  const mjenv_status status = mjenv_reset(s.random, NULL, &s.out->batch);
  const mjenv_status stepped = mjenv_step(s.random, NULL, s.action, ROWS * NU, MJENV_DTYPE_FLOAT64, &s.out->batch);
  return status ? status : stepped;
}

static mjenv_status restore_random(void) {
  static unsigned char image[1 << 16];
  int64_t size;
  const mjenv_status status = mjenv_snapshot(s.random, 0, image, sizeof image, &size);
  return status ? status : mjenv_restore(s.random, 1, image, size);
}

// ---- A task that uses what mjenv/task.h offers ----

static const mjenv_task_option options_of_task[] = {
    {.struct_size = sizeof(mjenv_task_option), .kind = MJENV_KIND_REALS, .name = "speed", .value = 0.5, .live = 1},
};
static const mjenv_task_field fields_of_task[] = {
    {.struct_size = sizeof(mjenv_task_field), .name = "achieved_goal", .role = MJENV_ROLE_OBSERVATION},
    {.struct_size = sizeof(mjenv_task_field), .name = "desired_goal", .role = MJENV_ROLE_OBSERVATION},
};
enum { HEIGHTS = 6 };

static int32_t build_task(mjenv_builder* builder, void* user, void** self) {
  (void)user;
  *self = NULL;
  const double low[] = {-1}, high[] = {1};
  mjenv_build_current(builder);
  mjenv_build_random_state(builder);
  mjenv_build_own(builder, "hfield_data");
  mjenv_build_own(builder, "qfrc_applied");
  mjenv_build_action(builder, 1, low, high);
  mjenv_build_keep(builder, 0, 1);
  mjenv_build_carry_bounds(builder, 1, 1, -9, 9);
  mjenv_build_parameter(builder, "speed");
  mjenv_build_need(builder, "contacts");
  mjenv_build_array(builder, "hfield_data", NULL);
  return 0;
}

static int32_t reset_task(const void* self, mjenv_start* start) {
  (void)self;
  int64_t order[HEIGHTS];
  mjenv_random_state_permutation(start->random, HEIGHTS, order);
  for (int i = 0; i < HEIGHTS; ++i) start->own[0][i] = (double)order[i] / HEIGHTS;
  start->qpos[0] = mjenv_random_uniform(start->random, 0, 0.1) + mjenv_random_state_randn(start->random) / 100;
  start->carried[1] = start->parameters[0];
  return mjenv_start_forward(start) || mjenv_start_advance(start, 3) || mjenv_start_restart(start);
}

static int32_t map_task(const void* self, const mjenv_sim* sim, mjenv_control* control) {
  (void)self;
  control->ctrl[0] = sim->action[0];
  control->own[1][0] = mjenv_random_normal(control->random);
  return 0;
}

static int32_t observe_task(const void* self, const mjenv_sim* sim, double* to) {
  (void)self;
  to[0] = sim->qpos[0];
  to[1] = sim->carried[1];
  return 0;
}

static int32_t step_task(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self;
  (void)sim;
  outcome->own[0][0] = mjenv_random_real(outcome->random);
  outcome->own[1][0] = 1;
  outcome->carried[0] += 1;
  outcome->qvel[0] += 0.1;
  return 0;
}

static int32_t reward_of_task(const void* self, const mjenv_task_api* api, const double* achieved,
                              const double* desired, int64_t size, double* reward) {
  (void)self;
  *reward = achieved[0] - desired[size - 1];
  return desired[0] > 5 ? mjenv_task_fail(api, "a reason that is longer than what fits into a std::string itself") : 0;
}

static const mjenv_task task = {
    .struct_size = sizeof(mjenv_task),
    .id = "tests/Everything-v0",
    .model_text =
        "<mujoco><asset><hfield name='ground' nrow='2' ncol='3' size='1 1 .2 .1'/></asset><worldbody>"
        "<geom type='hfield' hfield='ground'/><body pos='0 0 .3'><joint name='z' type='slide' axis='0 0 1'/>"
        "<geom size='.1'/></body></worldbody><actuator><motor joint='z'/></actuator></mujoco>",
    .frame_skip = 2,
    .carry_count = 2,
    .options = options_of_task,
    .option_count = COUNT(options_of_task),
    .fields = fields_of_task,
    .field_count = COUNT(fields_of_task),
    .build = build_task,
    .reset = reset_task,
    .observe = observe_task,
    .step = step_task,
    .before_step = map_task,
    .before_substep = map_task,
    .compute_reward = reward_of_task};

static mjenv_status register_known(void) { return mjenv_register_task(&task); }

static mjenv_status create_task(void) {
  mjenv_destroy(s.built);
  s.built = NULL;
  mjenv_options* options = NULL;
  mjenv_status status = mjenv_options_create(task.id, &options);
  if (status == MJENV_OK) status = mjenv_create(options, BUILT_ROWS, &s.built);
  mjenv_options_destroy(options);
  return status;
}

// Its observations with a history of each term, and the time.
static mjenv_status create_with_history(void) {
  mjenv_destroy(s.built);
  s.built = NULL;
  mjenv_options* options = NULL;
  mjenv_status status = mjenv_options_create(task.id, &options);
  if (status == MJENV_OK) status = mjenv_options_set_string(options, "history", "achieved_goal=3 desired_goal=2");
  if (status == MJENV_OK) status = mjenv_options_set_integer(options, "time_aware", 1);
  if (status == MJENV_OK) status = mjenv_options_set_integer(options, "max_episode_steps", 9);
  if (status == MJENV_OK) status = mjenv_options_set_reals(options, "rescale_actions", (const double[]){-2, 2}, 2);
  if (status == MJENV_OK) status = mjenv_create(options, BUILT_ROWS, &s.built);
  if (status == MJENV_OK) status = mjenv_reset(s.built, NULL, NULL);
  mjenv_options_destroy(options);
  return status;
}

static mjenv_status reset_rows_of_task(void) { return mjenv_reset(s.task, NULL, NULL); }

static mjenv_status step_rows_of_task(void) {
  const mjenv_status status = mjenv_step(s.task, NULL, s.action, ROWS, MJENV_DTYPE_FLOAT64, NULL);
  return status ? status : mjenv_copy_row(s.task, NULL, 1);
}

static mjenv_status write_parameter(void) { return write_row(s.task, 1, "parameters.speed", s.action, 1); }

static mjenv_status write_no_parameter(void) {
  return write_row(s.task, 1, "parameters.that there is not, with a long name", s.action, 1);
}

static mjenv_status restore_task(void) {
  static unsigned char image[1 << 14];
  int64_t size;
  const mjenv_status status = mjenv_snapshot(s.task, 0, image, sizeof image, &size);
  return status ? status : mjenv_restore(s.task, 1, image, size);
}

static mjenv_status compute_reward(void) { return mjenv_compute_reward(s.task, s.action, s.action, 2, s.values, 2); }

static mjenv_status bad_reward(void) {
  static const double far[] = {9};
  return mjenv_compute_reward(s.task, far, far, 1, s.values, 1);
}

static mjenv_status lane_stages(void) { return mjenv_lane_stages_of(s.task) ? MJENV_OK : MJENV_E_MEMORY; }

static mjenv_status bad_restore(void) { return mjenv_restore(s.env, 0, s.image, 3); }

// ---- Rows that differ, in an environment that was just built ----

static mjenv_status write(void) { return write_row(s.built, 1, "body_mass", s.heavy, s.bodies); }
static mjenv_status write_all(void) { return write_row(s.built, MJENV_ALL_ROWS, "body_mass", s.heavy, s.bodies); }
static mjenv_status bad_write(void) { return write_row(s.built, 1, "body_mass", s.negative, s.bodies); }
static mjenv_status write_no_array(void) { return write_row(s.built, 1, "an array that there is not", s.heavy, 1); }
static mjenv_status write_rows(void) { return mjenv_write(s.built, NULL, "body_mass", s.heavy, BUILT_ROWS * s.bodies); }

static mjenv_status write_constants(void) {
  const mjenv_status status = write();
  return status ? status : set_constants(s.built, 1);
}

static mjenv_status copy_written(void) {
  const mjenv_status status = write();
  return status ? status : mjenv_copy_row(s.built, (const uint8_t[BUILT_ROWS]){1, 0, 1}, 1);
}

static mjenv_status restore_written(void) { return mjenv_restore(s.built, 0, s.written, s.written_size); }

static mjenv_status create_and_reset(void) {
  const mjenv_status status = create();
  return status ? status : mjenv_reset(s.built, NULL, NULL);
}

static void destroy_built(void) {
  mjenv_destroy(s.built);
  s.built = NULL;
}

// An image of a row with own arrays, and with what is kept of them because they were written after a reset.
static void make_written(void) {
  assert_ok(mjenv_read(s.env, 0, "body_mass", s.mass, COUNT(s.mass), &s.bodies));
  for (int64_t i = 0; i < BUILT_ROWS * s.bodies; ++i) {
    s.heavy[i] = 2 * s.mass[i % s.bodies];
    s.negative[i] = -1;
  }
  assert_ok(create_and_reset());
  assert_ok(write_constants());
  assert_ok(write());
  assert_ok(mjenv_snapshot(s.built, 1, s.written, sizeof s.written, &s.written_size));
  destroy_built();
}

static mjenv_status render_settings(void) {
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  return mjenv_render_defaults(s.env, &settings);
}

// ---- Drawing ----

enum { SIDE = 16 };

// With a skin, for which MuJoCo has arrays of its own.
static mjenv_env* drawn_env(void) {
  static const char* const text =
      "<mujoco><asset><skin vertex='0 0 0 1 0 0 0 1 0' face='0 1 2'><bone body='cart' bindpos='0 0 0' "
      "bindquat='1 0 0 0' vertid='0 1 2' vertweight='1 1 1'/></skin></asset><worldbody><body name='cart'><joint "
      "type='slide' axis='1 0 0'/><geom size='.1'/><body><joint name='hinge' type='hinge' axis='0 1 0'/>"
      "<geom type='capsule' fromto='0 0 0 0 0 1' size='.1'/></body></body></worldbody>"
      "<actuator><motor joint='hinge'/></actuator></mujoco>";
  mjenv_options* options = options_of_id("InvertedPendulum-v5");
  assert_ok(mjenv_options_set_string(options, "xml_string", text));
  mjenv_env* env = env_of_options(options, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  return env;
}

static mjenv_status renderer_create(void) {
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  mjenv_status status = mjenv_render_defaults(s.drawn, &settings);
  settings.gl = MJENV_GL_OSMESA;
  settings.width = settings.height = SIDE;
  return status ? status : mjenv_renderer_create(s.drawn, &settings, &s.renderer);
}

static void renderer_destroy(void) {
  mjenv_renderer_destroy(s.renderer);
  s.renderer = NULL;
}

static uint8_t pixels[SIDE * SIDE * 3];

static mjenv_status render(void) { return mjenv_render(s.renderer, 0, pixels, sizeof pixels, NULL, 0); }

// ---- Walking through them ----

enum use {
  KEEPS,  // the environments that there are
  LOADS,  // a model, in which MuJoCo loses memory when it runs out
  FRESH,  // an environment that was built for the call, when there was memory
};

struct call {
  const char* name;
  mjenv_status (*run)(void);
  mjenv_status status;  // when there is memory
  mjenv_status also;    // that may be given without memory, beside MJENV_E_MEMORY
  enum use use;
};

static const struct call calls[] = {
    {"spec_of", spec_of, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"options_create", options_create, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"options_create, no id", no_id, MJENV_E_NAME, MJENV_E_MEMORY, KEEPS},
    {"options_set_string", set_string, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"options_set_string, choice", set_choice, MJENV_OK, MJENV_E_VALUE, KEEPS},
    {"options_set_reals", set_reals, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"options_get_reals", get_reals, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"options_set_integer, no option", no_option, MJENV_E_NAME, MJENV_E_MEMORY, KEEPS},
    {"create", create, MJENV_OK, MJENV_E_MODEL, LOADS},
    {"create with threads", create_with_threads, MJENV_OK, MJENV_E_MODEL, LOADS},
    {"create from bad text", create_from_text, MJENV_E_MODEL, MJENV_E_MODEL, LOADS},
    {"create from assets", create_from_assets, MJENV_OK, MJENV_E_MODEL, LOADS},
    {"reset", reset, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"reset on threads", reset_threaded, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"step", step, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"step on threads", step_threaded, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"step, bad count", bad_step, MJENV_E_SIZE, MJENV_E_MEMORY, KEEPS},
    {"send and recv", send_and_recv, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"rollout", rollout, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"sample_actions", sample, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"seed_words", seed_words, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"read", read, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"read, no array", no_array, MJENV_E_NAME, MJENV_E_MEMORY, KEEPS},
    {"object_index", object, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"object_index, no object", no_object, MJENV_E_NAME, MJENV_E_MEMORY, KEEPS},
    {"observe", observe, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"snapshot", snapshot, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"restore", restore, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"first snapshot", first_snapshot, MJENV_OK, MJENV_E_MODEL, LOADS},
    {"restore, bad image", bad_restore, MJENV_E_SNAPSHOT, MJENV_E_MEMORY, KEEPS},
    {"randomize", randomize, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"randomize, no array", bad_randomize, MJENV_E_NAME, MJENV_E_MEMORY, KEEPS},
    {"reset that draws", reset_random, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"restore rows that draw", restore_random, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"perturb", perturb, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"register_task, known id", register_known, MJENV_E_VALUE, MJENV_E_MEMORY, KEEPS},
    {"create a task", create_task, MJENV_OK, MJENV_E_MODEL, LOADS},
    {"create a task with a history", create_with_history, MJENV_OK, MJENV_E_MODEL, LOADS},
    {"reset a task", reset_rows_of_task, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"step a task", step_rows_of_task, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"write a parameter", write_parameter, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"write a parameter, none", write_no_parameter, MJENV_E_NAME, MJENV_E_MEMORY, KEEPS},
    {"restore a task", restore_task, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"compute_reward", compute_reward, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"compute_reward that fails", bad_reward, MJENV_E_TASK, MJENV_E_MEMORY, KEEPS},
    {"lane_stages_of", lane_stages, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"render_defaults", render_settings, MJENV_OK, MJENV_E_MEMORY, KEEPS},
    {"write", write, MJENV_OK, MJENV_E_MEMORY, FRESH},
    {"write, all rows", write_all, MJENV_OK, MJENV_E_MEMORY, FRESH},
    {"write, bad value", bad_write, MJENV_E_VALUE, MJENV_E_MEMORY, FRESH},
    {"write, no array", write_no_array, MJENV_E_NAME, MJENV_E_MEMORY, FRESH},
    {"write_rows", write_rows, MJENV_OK, MJENV_E_MEMORY, FRESH},
    {"set_constants", write_constants, MJENV_OK, MJENV_E_MEMORY, FRESH},
    {"copy_row of written rows", copy_written, MJENV_OK, MJENV_E_MEMORY, FRESH},
    {"restore, own arrays", restore_written, MJENV_OK, MJENV_E_MEMORY, FRESH},
};

// What the failing allocations of one call did.
struct walk {
  size_t allocations, lost;  // in all; blocks that were not freed
  size_t last_lossy;         // the last allocation whose failure lost any
  long most_bytes;           // that one failure lost
};

// Each handle keeps the text of its last error, so that each has one text when blocks are counted.
static long blocks(void) {
  int64_t count;
  mjenv_options_set_integer(s.options, "no option", 0);
  mjenv_read(s.env, -2, "qpos", NULL, 0, &count);
  mjenv_read(s.threaded, -2, "qpos", NULL, 0, &count);
  mjenv_read(s.random, -2, "qpos", NULL, 0, &count);
  mjenv_read(s.task, -2, "qpos", NULL, 0, &count);
  if (s.built) mjenv_read(s.built, -2, "qpos", NULL, 0, &count);
  return allocator_live();
}

// A call that fails has written nothing: copy_written has perhaps written row 1 before the copy fails.
static void assert_unwritten(bool row_1) {
  for (int row = 0; row < BUILT_ROWS; ++row) {
    if (row == 1 && !row_1) continue;
    double mass[COUNT(s.mass)];
    int64_t count;
    assert_ok(mjenv_read(s.built, row, "body_mass", mass, COUNT(mass), &count));
    assert_same_bits("body_mass", mass, s.mass, count);
  }
}

static struct walk walk(const struct call* call, enum failing failing, size_t stride) {
  struct walk result = {0, 0, 0, 0};
  for (size_t number = 0; number < MOST; number += stride) {
    if (call->use != KEEPS) destroy_built();
    const long before = blocks(), bytes_before = allocator_bytes();
    if (call->use == FRESH) assert_ok(create_and_reset());
    allocator_arm(failing, number);
    const mjenv_status status = call->run();
    const bool failed = allocator_disarm();
    const bool fine = status == call->status || (failed && (status == MJENV_E_MEMORY || status == call->also));
    if (!fine)
      fail_msg("%s, allocation %zu: %s: %s", call->name, number, mjenv_status_name(status), mjenv_last_error());
    if (failed && status == MJENV_E_MEMORY)
      assert_true(strstr(mjenv_last_error(), "memory") || strstr(mjenv_last_error(), "threads"));
    if (call->use == FRESH && status != MJENV_OK && call->run != write_constants)
      assert_unwritten(call->run != copy_written);
    if (call->use != KEEPS) destroy_built();
    const long lost = blocks() - before, lost_bytes = allocator_bytes() - bytes_before;
    if (lost < 0) fail_msg("%s, allocation %zu: %ld blocks fewer", call->name, number, -lost);
    result.lost += (size_t)lost;
    if (lost > 0) result.last_lossy = number;
    if (lost_bytes > result.most_bytes) result.most_bytes = lost_bytes;
    result.allocations = number;
    if (!failed) return result;
  }
  fail_msg("%s does not end", call->name);
  return result;
}

// How many allocations come before the model of s.id has been loaded: as many as of a create that then fails.
static size_t allocations_of_loading(void) {
  mjenv_options* options = options_of_id("Ant-v5");
  assert_ok(mjenv_options_set_integer(options, "main_body", 1000000));
  mjenv_env* env = NULL;
  allocator_arm(ONE, SIZE_MAX);
  const mjenv_status status = mjenv_create(options, 2, &env);
  allocator_disarm();
  const size_t count = allocator_count();
  assert_int_equal(status, MJENV_E_MODEL);
  mjenv_options_destroy(options);
  options = NULL;
  allocator_arm(ONE, SIZE_MAX);
  assert_ok(mjenv_options_create("Ant-v5", &options));
  allocator_disarm();
  mjenv_options_destroy(options);
  return count + allocator_count();
}

// First in larger strides, because some things are allocated for good: each thread's exceptions, the tables of handles.
static void test_call(void** state) {
  const struct call* call = *state;
  if (call->use == KEEPS && !s.built) assert_ok(create());
  if (call->use == KEEPS) assert_ok(snapshot());
  for (int failing = ONE; failing <= ALL; ++failing) {
    walk(call, (enum failing)failing, call->use == LOADS ? 50 : 1);
    const struct walk walked = walk(call, (enum failing)failing, 1);
    if (walked.lost > 0 && call->use != LOADS)
      fail_msg("%s: %zu blocks were lost, the last at allocation %zu", call->name, walked.lost, walked.last_lossy);
    if (call->run == create) {
      const size_t loading = allocations_of_loading();
      assert_in_range(loading, 100, walked.allocations);
      if (walked.last_lossy > loading)
        fail_msg("blocks were lost at allocation %zu; the model was loaded at %zu", walked.last_lossy, loading);
    }
    print_message("%s: %zu allocations\n", call->name, walked.allocations);
    if (walked.lost > 0)
      print_message("  MuJoCo's loader lost %zu blocks, at most %ld bytes at once\n", walked.lost, walked.most_bytes);
    assert_true(walked.most_bytes <= MOST_LOST);
  }
  golden_assert_plays(s.golden, s.env);
}

// OpenGL's own allocations do not fail: its drivers end the process. Nor are they counted.
static void walk_drawing(const char* name, mjenv_status (*run)(void), enum failing failing, bool may_lose) {
  for (size_t number = 0; number < MOST; ++number) {
    const long before = allocator_live();
    if (run != renderer_create) assert_ok(renderer_create());
    allocator_arm(failing, number);
    const mjenv_status status = run();
    const bool failed = allocator_disarm();
    renderer_destroy();
    const long lost = allocator_live() - before;
    if (lost != 0 && !may_lose) fail_msg("%s, allocation %zu: %ld blocks were lost", name, number, lost);
    if (!failed) {
      assert_ok(status);
      if (!may_lose) print_message("%s: %zu allocations\n", name, number);
      return;
    }
    // A message that found no memory may be lost, not the work.
    if (status != MJENV_OK && status != MJENV_E_MEMORY && status != MJENV_E_RENDER)
      fail_msg("%s, allocation %zu: %s: %s", name, number, mjenv_status_name(status), mjenv_last_error());
  }
  fail_msg("%s does not end", name);
}

static void test_drawing(void** state) {
  (void)state;
  uint8_t before[sizeof pixels];
  s.drawn = drawn_env();
  assert_ok(renderer_create());
  assert_ok(render());
  memcpy(before, pixels, sizeof pixels);
  renderer_destroy();
  // MuJoCo's library, where it is not within ours.
  void (*libraries[ALLOCATOR_LIBRARIES])(void) = {(void (*)(void))mjenv_render, NULL};
  *(void**)&libraries[1] = dlsym(RTLD_DEFAULT, "mju_malloc");
  allocator_only(libraries);
  for (int failing = ONE; failing <= ALL; ++failing) {
    for (int may_lose = 1; may_lose >= 0; --may_lose) {  // at first some things are allocated for good
      walk_drawing("renderer_create", renderer_create, (enum failing)failing, may_lose);
      walk_drawing("render", render, (enum failing)failing, may_lose);
    }
  }
  allocator_only(NULL);
  assert_ok(renderer_create());
  assert_ok(render());
  assert_memory_equal(pixels, before, sizeof pixels);
  renderer_destroy();
  mjenv_destroy(s.drawn);
}

static int set_up(void** state) {
  (void)state;
  s.golden = golden_read(RECORDING);
  s.options = options_of_id("Ant-v5");
  s.env = golden_create(s.golden, 1);
  mjenv_options* options = options_of_id("Ant-v5");
  assert_ok(mjenv_options_set_integer(options, "num_threads", 2));
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  s.threaded = env_of_options(options, ROWS);
  s.out = outputs_of(s.threaded);
  options = options_of_id("Ant-v5");
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  s.random = env_of_options(options, ROWS);
  assert_ok(randomize());
  assert_ok(perturb());
  assert_ok(reset_random());
  assert_ok(mjenv_register_task(&task));
  options = options_of_id(task.id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", 2));
  s.task = env_of_options(options, ROWS);
  seed_rows(s.task, 1);
  assert_ok(reset_rows_of_task());
  s.id = "Ant-v5";
  assert_ok(mjenv_reset(s.threaded, NULL, NULL));
  golden_assert_plays(s.golden, s.env);
  assert_ok(mjenv_reset(s.env, NULL, NULL));
  make_written();
  return 0;
}

static int tear_down(void** state) {
  (void)state;
  outputs_free(s.out);
  mjenv_destroy(s.built);
  mjenv_destroy(s.threaded);
  mjenv_destroy(s.random);
  mjenv_destroy(s.task);
  mjenv_destroy(s.env);
  mjenv_options_destroy(s.options);
  golden_free(s.golden);
  return 0;
}

static void test_every_id(void** state) {
  (void)state;
  const struct call call = {"create", create, MJENV_OK, MJENV_E_MODEL, LOADS};
  for (int64_t i = 0; i < mjenv_id_count(); ++i) {
    s.id = mjenv_id_at(i);
    for (int failing = ONE; failing <= ALL; ++failing)
      print_message("%s: %zu allocations\n", s.id, walk(&call, (enum failing)failing, 1).allocations);
  }
}

int main(int argc, char** argv) {
  struct CMUnitTest tests[COUNT(calls) + 2];
  for (size_t i = 0; i < COUNT(calls); ++i)
    tests[i] = (struct CMUnitTest){calls[i].name, test_call, NULL, NULL, (void*)(uintptr_t)&calls[i]};
  tests[COUNT(calls)] = (struct CMUnitTest)cmocka_unit_test(test_drawing);
  tests[COUNT(calls) + 1] = (struct CMUnitTest)cmocka_unit_test(test_every_id);
  if (argc > 1 && strcmp(argv[1], "long") == 0) return cmocka_run_group_tests(tests, set_up, tear_down);
  struct CMUnitTest usual[COUNT(calls) + 1];
  memcpy(usual, tests, sizeof usual);
  return cmocka_run_group_tests(usual, set_up, tear_down);
}
