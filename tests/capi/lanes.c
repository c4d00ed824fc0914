// Lanes change no bit: environments with lanes do what one without lanes does, at any number of threads and rows, while
// rows end, are reset, diverge, are perturbed, written, copied and restored at different steps.
#include "support.h"

enum { STEPS = 50, LIMIT = 9, ROLLOUT = 12 };  // a rollout goes on after the ends of episodes

struct way {
  int64_t lanes, threads;
};

struct player {
  mjenv_env* env;
  struct outputs* out;
  // Of a rollout:
  double *obs, *reward, *info;
  uint8_t *terminated, *truncated;
  int32_t* status;
};

static bool runs(int64_t lanes) {
#if defined(LANES) && defined(__aarch64__)
  return lanes == 2;
#elif defined(LANES)
  if (lanes == 8) return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
  return lanes == 4 ? __builtin_cpu_supports("avx2") : lanes == 2;
#else
  return lanes == 0;
#endif
}

static mjenv_options* options_for(const char* id, struct way way, const char* autoreset) {
  mjenv_options* options = options_of_id(id);
  set_lanes(options, way.lanes);
  assert_ok(mjenv_options_set_integer(options, "num_threads", way.threads));
  assert_ok(mjenv_options_set_integer(options, "max_episode_steps", LIMIT));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", autoreset));
  return options;
}

static struct player player_of(const char* id, struct way way, const char* autoreset, int64_t rows) {
  struct player p = {.env = env_of_options(options_for(id, way, autoreset), rows)};
  p.out = outputs_of(p.env);
  const size_t count = (size_t)(rows * ROLLOUT);
  p.obs = allocate(count * (size_t)p.out->obs_count * sizeof(double));
  p.reward = allocate(count * sizeof(double));
  p.info = allocate(count * (size_t)p.out->info_count * sizeof(double));
  p.terminated = allocate(count);
  p.truncated = allocate(count);
  p.status = allocate(count * sizeof *p.status);
  seed_rows(p.env, 11);
  assert_ok(mjenv_reset(p.env, NULL, &p.out->batch));
  return p;
}

static void player_free(struct player* p) {
  free(p->obs);
  free(p->reward);
  free(p->info);
  free(p->terminated);
  free(p->truncated);
  free(p->status);
  outputs_free(p->out);
  mjenv_destroy(p->env);
}

// Random numbers that are the same for all players.
static uint64_t noise_state;
static double noise(void) {
  noise_state = noise_state * 6364136223846793005u + 1442695040888963407u;
  return (double)(noise_state >> 11) * 0x1p-52 - 1;
}

static void send_and_receive(struct player* p, const double* action, size_t count) {
  int64_t rows[64];
  assert_ok(mjenv_send(p->env, NULL, 0, action, count, MJENV_DTYPE_FLOAT64));
  for (int64_t done = 0, some; done < p->out->rows; done += some)
    assert_ok(mjenv_recv(p->env, 1, -1, rows, COUNT(rows), &some, &p->out->batch));
}

static void roll_out(struct player* p, const double* action, size_t count) {
  const mjenv_batch batch = {.struct_size = sizeof batch,
                             .obs_dtype = MJENV_DTYPE_FLOAT64,
                             .rows = p->out->rows * ROLLOUT,
                             .obs_count = p->out->obs_count,
                             .info_count = p->out->info_count,
                             .obs = p->obs,
                             .reward = p->reward,
                             .info = p->info,
                             .terminated = p->terminated,
                             .truncated = p->truncated,
                             .status = p->status};
  assert_ok(mjenv_reset(p->env, NULL, NULL));
  assert_ok(mjenv_rollout(p->env, action, count * ROLLOUT, MJENV_DTYPE_FLOAT64, ROLLOUT, &batch));
}

#define NO_PERTURBATION "{\"noise\": null, \"delay\": null, \"push\": null}"

// From the next reset on.
static void perturb(mjenv_env* env) {
  assert_ok(mjenv_randomize(env,
                            "{\"noise\": {\"action\": 0.1, \"observation\": 0.1}, \"delay\": {\"action\": 1}, \"push\":"
                            "{\"body\": 1, \"every\": [1, 3], \"force\": [[-9, 9], [0, 0], [0, 0]],"
                            " \"torque\": [[0, 0], [0, 1], [0, 0]]}}"));
}

// Rows draw values that lanes can have of their own.
static void randomise(mjenv_env* env) {
#define SCALE "{\"kind\": \"scale\", \"low\": 0.5, \"high\": 1.5"
#define OTHERS                                                                             \
  "}, \"dof_damping\": " SCALE "}, \"geom_friction\": " SCALE "}, \"opt.gravity\": " SCALE \
  "}, \"actuator_gear\": " SCALE "}}}"
  // 4.0's mj_setConst would change boxes that all rows share.
  assert_ok(mjenv_randomize(env, MUJOCO[0] == '4' ? "{\"randomize\": {\"body_mass\": " SCALE OTHERS
                                                  : "{\"randomize\": {\"body_mass\": " SCALE
                                                    ", \"set_constants\": true" OTHERS));
}

static void fill_array(mjenv_env* env, int64_t row, const char* array, double value) {
  int64_t count;
  double* values = read_array(env, row == MJENV_ALL_ROWS ? 0 : row, array, &count);
  for (int64_t i = 0; i < count; ++i) values[i] = value;
  assert_ok(write_row(env, row, array, values, count));
  free(values);
}

static void scale_array(mjenv_env* env, int64_t row, const char* array, double factor) {
  int64_t count;
  double* values = read_array(env, row, array, &count);
  for (int64_t i = 0; i < count; ++i) values[i] *= factor;
  assert_ok(write_row(env, row, array, values, count));
  free(values);
}

// Gives a row friction, where the model has none.
static void rub(mjenv_env* env, int64_t row) {
  int64_t count;
  double* values = read_array(env, row, "dof_frictionloss", &count);
  values[count - 1] = 0.1;
  assert_ok(write_row(env, row, "dof_frictionloss", values, count));
  free(values);
}

// What happens to rows between two steps, at some of the steps.
static void disturb(struct player* p, int step) {
  const int64_t rows = p->out->rows;
  int64_t size, nq, nv;
  double *qpos = read_array(p->env, 0, "qpos", &nq), *qvel = read_array(p->env, 0, "qvel", &nv);
  if (step == 10) {  // rows that diverge, at once or in a later frame
    qvel[0] = 1e11;
    assert_ok(write_row(p->env, rows / 2, "qvel", qvel, nv));
    qvel[0] = 3e9;
    assert_ok(write_row(p->env, rows - 1, "qvel", qvel, nv));
  }
  if (step == 12) fill_array(p->env, 1, "qfrc_applied", 0.3);
  if (step == 13) fill_array(p->env, rows / 2, "xfrc_applied", 0.2);
  if (step == 15) fill_array(p->env, 1, "qfrc_applied", 0);
  if (step == 22) fill_array(p->env, MJENV_ALL_ROWS, "qfrc_applied", -0.0);
  if (step == 24) fill_array(p->env, MJENV_ALL_ROWS, "qfrc_applied", 0);
  if (step == 16) {
    unsigned char* image = image_of(p->env, rows - 1, &size);
    assert_ok(mjenv_restore(p->env, rows / 3, image, size));
    free(image);
  }
  if (step == 20) assert_ok(mjenv_set_state(p->env, rows / 2, qpos, nq, qvel, nv));
  if (step == 26) {
    uint8_t* mask = allocate((size_t)rows);
    for (int64_t row = 0; row < rows; ++row) mask[row] = row % 3 == 1;
    assert_ok(mjenv_copy_row(p->env, mask, 0));
    free(mask);
  }
  if (step == 32) {  // noise and a delay
    perturb(p->env);
    assert_ok(mjenv_reset(p->env, NULL, NULL));
  }
  if (step == 37) assert_ok(mjenv_randomize(p->env, NO_PERTURBATION));
  if (step == 38) scale_array(p->env, 0, "body_mass", 1.5);  // from now on rows have models of their own
  if (step == 40) {
    randomise(p->env);
    perturb(p->env);
    assert_ok(mjenv_reset(p->env, NULL, NULL));
  }
  if (step == 43) rub(p->env, 1);
  static const char* const arrays[] = {"geom_size", "actuator_gear", "actuator_ctrlrange", "geom_rbound", "jnt_axis",
                                       "qpos0",     "opt.timestep",  "dof_armature",       "jnt_pos"};
  if (step > 40) scale_array(p->env, step % rows, arrays[step - 41], 1.02);
  if (step == 47) {  // rows with values of their own
    unsigned char* image = image_of(p->env, rows - 1, &size);
    assert_ok(mjenv_restore(p->env, rows / 3, image, size));
    free(image);
  }
  free(qpos);
  free(qvel);
}

// Sets the states of all rows: quaternions are not normalised, and one row is too fast for lanes.
static void set_states(mjenv_env* env, int64_t rows) {
  int64_t nq, nv;
  double *qpos = read_array(env, MJENV_ALL_ROWS, "qpos", &nq), *qvel = read_array(env, MJENV_ALL_ROWS, "qvel", &nv);
  for (int64_t i = 0; i < nq; ++i) qpos[i] *= 1.01;
  for (int64_t i = 0; i < nv; ++i) qvel[i] *= 0.5;
  qvel[rows / 2 * (nv / rows)] = 1e11;
  assert_ok(mjenv_set_state(env, MJENV_ALL_ROWS, qpos, nq, qvel, nv));
  free(qpos);
  free(qvel);
}

static void compare_outputs(const struct player* want, const struct player* got, double* records) {
  const size_t count = outputs_row_count(want->out);
  for (int64_t row = 0; row < want->out->rows; ++row) {
    outputs_row(want->env, want->out, MJENV_ROLE_INFO, row, records);
    outputs_row(got->env, got->out, MJENV_ROLE_INFO, row, records + count);
    assert_same_bits("outputs", records + count, records, count);
  }
}

static void compare_arrays(struct player* want, struct player* got) {
  static const char* const arrays[] = {
      "time", "qpos",     "qvel", "qacc_warmstart", "xpos",     "geom_xmat",      "qLDiagInv",
      "qLD",  "cdof_dot", "ncon", "contact.pos",    "cfrc_ext", "qfrc_constraint"};
  for (int64_t row = 0; row < want->out->rows; ++row)
    for (size_t i = 0; i < COUNT(arrays); ++i) {
      int64_t count, other;
      double *expected = read_array(want->env, row, arrays[i], &count),
             *found = read_array(got->env, row, arrays[i], &other);
      assert_int_equal(count, other);
      assert_same_bits(arrays[i], found, expected, count);
      free(expected);
      free(found);
    }
}

static void compare_rollouts(const struct player* want, const struct player* got) {
  const size_t count = (size_t)(want->out->rows * ROLLOUT);
  assert_same_bits("observations", got->obs, want->obs, count * (size_t)want->out->obs_count);
  assert_same_bits("rewards", got->reward, want->reward, count);
  assert_same_bits("infos", got->info, want->info, count * (size_t)want->out->info_count);
  assert_memory_equal(got->terminated, want->terminated, count);
  assert_memory_equal(got->truncated, want->truncated, count);
  assert_memory_equal(got->status, want->status, count * sizeof *got->status);
}

static void play(const char* id, struct way way, const char* autoreset, int64_t rows) {
  struct player players[] = {player_of(id, (struct way){0, 1}, autoreset, rows), player_of(id, way, autoreset, rows)};
  const size_t nu = (size_t)action_count(players[0].env), count = (size_t)rows * nu;
  double *action = allocate(count * ROLLOUT * sizeof *action),
         *records = allocate(2 * outputs_row_count(players[0].out) * sizeof *records);
  uint8_t* mask = allocate((size_t)rows);
  noise_state = 5;
  for (int step = 0; step < STEPS; ++step) {
    for (size_t i = 0; i < count * ROLLOUT; ++i) action[i] = noise();
    for (int64_t row = 0; row < rows; ++row) mask[row] = noise() < 0.6;
    for (size_t i = 0; i < COUNT(players); ++i) {
      struct player* p = &players[i];
      disturb(p, step);
      if (step == 30)
        roll_out(p, action, count);
      else if (step % 4 == 3)
        send_and_receive(p, action, count);
      else
        assert_ok(mjenv_step(p->env, step % 4 == 1 ? mask : NULL, action, count, MJENV_DTYPE_FLOAT64, &p->out->batch));
    }
    compare_outputs(&players[0], &players[1], records);
    if (step == 30) compare_rollouts(&players[0], &players[1]);
    for (size_t i = 0; i < COUNT(players) && step % 6 == 3; ++i) set_states(players[i].env, rows);
    if (step % 12 == 9) compare_arrays(&players[0], &players[1]);
    if (step % 6 == 5) compare_arrays(&players[0], &players[1]);
  }
  free(mask);
  free(records);
  free(action);
  for (size_t i = 0; i < COUNT(players); ++i) player_free(&players[i]);
}

static void test_id(void** state) {
  static const struct {
    struct way way;
    const char* autoreset;
    int64_t rows;
  } cases[] = {{{2, 1}, "same_step", 3},  {{2, 3}, "next_step", 7}, {{4, 1}, "same_step", 13},
               {{4, 2}, "next_step", 13}, {{4, 3}, "same_step", 6}, {{4, 5}, "same_step", 21},
               {{8, 1}, "next_step", 11}, {{8, 2}, "same_step", 17}};
  for (size_t i = 0; i < COUNT(cases); ++i)
    if (runs(cases[i].way.lanes)) play(*state, cases[i].way, cases[i].autoreset, cases[i].rows);
}

// A number of lanes that the CPU or the library has not is refused, also if the environment variable says it.
static void test_refused(void** state) {
  (void)state;
  mjenv_env* env = NULL;
  mjenv_options* options = options_for("Hopper-v5", (struct way){3, 1}, "disabled");
  assert_refused(MJENV_E_VALUE, mjenv_create(options, 64, &env), "\"lanes\" is 3", "0");
  set_lanes(options, AUTO_LANES);
  static const char* const wrong[] = {"3", "many", "4x"};
  for (size_t i = 0; i < COUNT(wrong); ++i) {
    set_variable("MJENV_LANES", wrong[i]);
    assert_refused(MJENV_E_VALUE, mjenv_create(options, 64, &env), "MJENV_LANES", wrong[i]);
  }
  set_variable("MJENV_LANES", runs(2) ? "2" : "0");
  assert_ok(mjenv_create(options, 64, &env));
  mjenv_destroy(env);
  set_variable("MJENV_LANES", NULL);
  mjenv_options_destroy(options);
  options = options_of_id("Hopper-v5");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "lanes", 9), "lanes");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "lanes", -1), "lanes");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, "lanes", "all"), "auto, max");
  mjenv_options_destroy(options);
}

// The environment's answer is this number, with a reason that contains the text; "": there is none.
static void assert_lanes(mjenv_env* env, int64_t wanted, const char* why) {
  mjenv_info info = MJENV_INFO_INIT;
  assert_ok(mjenv_info_of(env, &info));
  if (info.lanes != wanted || (*why ? !strstr(info.lanes_reason, why) : *info.lanes_reason != 0))
    fail_msg("%" PRId64 " lanes (%s), not %" PRId64 " (%s)", info.lanes, info.lanes_reason, wanted, why);
}

static mjenv_options* options_with_lanes(const char* id, int64_t lanes) {
  mjenv_options* options = options_of_id(id);
  set_lanes(options, lanes);
  return options;
}

static mjenv_options* options_with_obstacle(int64_t lanes) {
  mjenv_options* options = options_with_lanes("Model-v0", lanes);
  assert_ok(mjenv_options_set_string(options, "xml_string",
                                     "<mujoco><option><flag fwdinv='enable'/></option>"
                                     "<worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>"));
  return options;
}

static void assert_lanes_of(mjenv_options* options, int64_t rows, int64_t wanted, const char* why) {
  mjenv_env* env = env_of_options(options, rows);
  assert_lanes(env, wanted, why);
  mjenv_destroy(env);
}

static void assert_refused_lanes(mjenv_options* options, int64_t rows, const char* why) {
  mjenv_env* env = NULL;
  assert_refused(MJENV_E_VALUE, mjenv_create(options, rows, &env), "\"lanes\" is 2", why);
  mjenv_options_destroy(options);
}

// Why environments have no lanes. The option is refused where it cannot be followed; the variable is for all
// environments of the process, so those that cannot follow it only say so.
static void test_reasons(void** state) {
  (void)state;
  const bool has = runs(2);
  const int64_t widest = runs(8) ? 8 : runs(4) ? 4 : has ? 2 : 0;
  const char* const obstacle = has ? "opt.enableflags" : "lanes";
  assert_lanes_of(options_with_lanes("Hopper-v5", AUTO_LANES), 64,
                  runs(4) ? 4
                  : has   ? 2
                          : 0,
                  has ? "" : "this library");
  assert_lanes_of(options_with_lanes("Hopper-v5", MAX_LANES), 64, widest, has ? "" : "this library");
  assert_lanes_of(options_with_lanes("Hopper-v5", MAX_LANES), 7, runs(4) ? 4 : has ? 2 : 0, has ? "" : "this library");
  assert_lanes_of(options_with_lanes("Hopper-v5", 0), 64, 0, "option \"lanes\" is 0");
  assert_lanes_of(options_with_lanes("Hopper-v5", AUTO_LANES), 1, 0, has ? "only one row" : "this library");
  assert_lanes_of(options_with_obstacle(AUTO_LANES), 64, 0, obstacle);
  assert_lanes_of(options_with_obstacle(MAX_LANES), 64, 0, obstacle);
  assert_refused_lanes(options_with_obstacle(2), 64, obstacle);
  if (has)
    assert_lanes_of(options_with_lanes("Hopper-v5", 2), 2, 2, "");
  else
    assert_refused_lanes(options_with_lanes("Hopper-v5", 2), 64, "this library");
  assert_refused_lanes(options_with_lanes("Hopper-v5", 2), 1, has ? "only 1 row" : "this library");
  set_variable("MJENV_LANES", "2");
  for (int64_t option = MAX_LANES; option < 0; ++option)
    assert_lanes_of(options_with_lanes("Hopper-v5", option), 64, has ? 2 : 0, has ? "" : "this library");
  assert_lanes_of(options_with_lanes("Hopper-v5", AUTO_LANES), 1, 0, has ? "only 1 row" : "this library");
  assert_lanes_of(options_with_obstacle(AUTO_LANES), 64, 0, obstacle);
  set_variable("MJENV_LANES", "0");
  assert_lanes_of(options_with_lanes("Hopper-v5", AUTO_LANES), 64, 0, "MJENV_LANES is 0");
  set_variable("MJENV_LANES", NULL);
}

// Forces keep rows in their lanes.
static void test_forces(void** state) {
  (void)state;
  if (!runs(2)) return;
  enum { ROWS = 5 };
  mjenv_env* env = env_of_options(options_with_lanes("Hopper-v5", 2), ROWS);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_lanes(env, 2, "");
  fill_array(env, 3, "qfrc_applied", 1);
  fill_array(env, 1, "xfrc_applied", 2);
  assert_lanes(env, 2, "");
  const float action[ROWS * 3] = {0};

  assert_ok(mjenv_randomize(env, "{\"push\": {\"body\": 1, \"every\": 2, \"force\": [[1, 2], [0, 0], [0, 0]]}}"));
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int step = 0; step < 4; ++step) {  // the second and the fourth push
    assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, NULL));
    assert_lanes(env, 2, "");
  }
  assert_ok(mjenv_randomize(env, NO_PERTURBATION));
  assert_lanes(env, 2, "");

  assert_ok(mjenv_send(env, NULL, 0, action, COUNT(action), MJENV_DTYPE_FLOAT32));
  int64_t rows[ROWS], size;
  assert_lanes(env, 2, "");  // also while rows are under way
  assert_ok(mjenv_recv(env, ROWS, -1, rows, ROWS, &size, NULL));
  assert_refused(MJENV_E_ARGUMENT, mjenv_info_of(env, NULL), "info");
  scale_array(env, 1, "actuator_gear", 1.1);
  assert_lanes(env, 2, "");
  mjenv_destroy(env);
}

static mjenv_options* options_of_model(const char* xml, int64_t lanes) {
  mjenv_options* options = options_with_lanes("Model-v0", lanes);
  assert_ok(mjenv_options_set_string(options, "xml_string", xml));
  return options;
}

// MuJoCo resets a simulation whose accelerations are bad (mj_checkAcc), also if only the constraints make them so and
// the timestep is so short that the velocities stay good.
static void test_bad_accelerations(void** state) {
  (void)state;
  if (!runs(2)) return;
  static const char xml[] =
      "<mujoco><option timestep='1e-6'/><worldbody><body><geom size='.1' pos='0 0 -.5'/>"
      "<joint name='hinge' axis='0 1 0' limited='true' range='-57 57' solreflimit='1e-6 1'/></body></worldbody>"
      "<actuator><motor joint='hinge'/></actuator></mujoco>";
  enum { ROWS = 3 };
  const double action[ROWS] = {0};
  for (int64_t lanes = 0; lanes <= 2; lanes += 2) {
    mjenv_env* env = env_of_options(options_of_model(xml, lanes), ROWS);
    struct outputs* out = outputs_of(env);
    assert_lanes(env, lanes, lanes == 0 ? "option" : "");
    seed_rows(env, 1);
    assert_ok(mjenv_reset(env, NULL, NULL));
    fill_array(env, 1, "qpos", 2);  // 1 rad beyond the limit
    assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT64, &out->batch));
    for (int row = 0; row < ROWS; ++row) assert_int_equal(out->status[row], row == 1 ? MJENV_DIVERGED : MJENV_OK);
    outputs_free(out);
    mjenv_destroy(env);
  }
}

static mjenv_options* options_with_stack(int64_t lanes, int size, const char* jacobian) {
  enum { JOINTS = 10 };
  char joints[200 * JOINTS] = "", motors[100 * JOINTS] = "", xml[300 * JOINTS + 200];
  for (int i = 0, at = 0, end = 0; i < JOINTS; ++i) {
    at += snprintf(joints + at, sizeof joints - (size_t)at,
                   "<body pos='.1 0 0'><geom size='.1' contype='0'/>"
                   "<joint name='joint%d' axis='%d 1 2' limited='true' range='-57 57'/>",
                   i, i);
    end += snprintf(motors + end, sizeof motors - (size_t)end, "<general joint='joint%d' dyntype='integrator'/>", i);
  }
  int end =
      snprintf(xml, sizeof xml, "<mujoco><size nstack='%d'/><option integrator='RK4' jacobian='%s'/><worldbody>%s",
               size, jacobian, joints);
  for (int i = 0; i < JOINTS; ++i) end += snprintf(xml + end, sizeof xml - (size_t)end, "</body>");
  snprintf(xml + end, sizeof xml - (size_t)end, "</worldbody><actuator>%s</actuator></mujoco>", motors);
  return options_of_model(xml, lanes);
}

// A row whose constraints find too little room on the stack of mjData fails with lanes as it does without, also if
// mj_RungeKutta takes a part of the stack.
static void compare_on_small_stacks(const char* jacobian, int most) {
  enum { ROWS = 2 };
  int counts[2] = {0};
  for (int size = 420; size < most; size += 16) {
    int32_t statuses[2];
    for (int i = 0; i < 2; ++i) {
      mjenv_env* env = env_of_options(options_with_stack(2 * i, size, jacobian), ROWS);
      struct outputs* out = outputs_of(env);
      double* action = allocate((size_t)(ROWS * action_count(env)) * sizeof *action);
      memset(action, 0, (size_t)(ROWS * action_count(env)) * sizeof *action);
      assert_lanes(env, 2 * i, i == 0 ? "option" : "");
      seed_rows(env, 1);
      assert_ok(mjenv_reset(env, NULL, NULL));
      fill_array(env, 1, "qpos", 2);  // beyond all limits
      mjenv_step(env, NULL, action, ROWS * action_count(env), MJENV_DTYPE_FLOAT64, &out->batch);
      statuses[i] = out->status[1];
      free(action);
      outputs_free(out);
      mjenv_destroy(env);
    }
    assert_int_equal(statuses[1], statuses[0]);
    ++counts[statuses[0] == MJENV_OK];
  }
  assert_true(counts[0] > 0 && counts[1] > 0);
}

// Models with features that no built-in id has: fluids on ellipsoids, adhesion, noslip, and PGS with elliptic cones. From
// the fifth step on, rows have their own numbers of iterations of noslip, with which some rows have none.
static void test_features(void** state) {
  (void)state;
  static const char* const options[] = {"density='900' viscosity='0.1'", "noslip_iterations='3'",
                                        "noslip_iterations='2' cone='elliptic' integrator='RK4'",
                                        "solver='PGS' cone='elliptic'", "solver='PGS' noslip_iterations='4'"};
  enum { ROWS = 5, TURNS = 12 };
  for (size_t i = 0; i < 2 * COUNT(options); ++i) {
    const bool sticks = i % 2 == 1;
    char xml[2000];
    snprintf(
        xml, sizeof xml,
        "<mujoco><option %s/><default><geom conaffinity='0' fluidshape='ellipsoid'/></default><worldbody>"
        "<geom type='plane' size='5 5 1' conaffinity='1'/><body name='trunk' pos='0 0 .15'><freejoint/>"
        "<geom type='ellipsoid' size='.2 .1 .05'/><body pos='.2 0 0'><joint name='hip' axis='0 1 0' frictionloss='.2'/>"
        "<geom type='capsule' size='.03' fromto='0 0 0 .1 0 -.12'/></body></body></worldbody><actuator>"
        "<motor joint='hip' gear='3'/>%s</actuator></mujoco>",
        options[i / 2], sticks ? "<adhesion body='trunk' ctrlrange='0 1' gain='5'/>" : "");
    for (int64_t lanes = 2; lanes <= 4 && runs(lanes); lanes *= 2) {
      mjenv_env* envs[2];
      struct outputs* outs[2];
      for (int k = 0; k < 2; ++k) {
        envs[k] = env_of_options(options_of_model(xml, k * lanes), ROWS);
        outs[k] = outputs_of(envs[k]);
        seed_rows(envs[k], 1);
        assert_ok(mjenv_reset(envs[k], NULL, NULL));
      }
      assert_lanes(envs[1], lanes, "");
      for (int turn = 0; turn < TURNS; ++turn) {
        double action[ROWS * 2];
        const int64_t count = ROWS * (sticks ? 2 : 1);
        for (int64_t n = 0; n < count; ++n) action[n] = noise();
        for (int k = 0; k < 2; ++k) {
          for (int64_t row = 0; row < ROWS && turn == 4; ++row)
            fill_array(envs[k], row, "opt.noslip_iterations", (double)(row % 3));
          assert_ok(mjenv_step(envs[k], NULL, action, count, MJENV_DTYPE_FLOAT64, &outs[k]->batch));
        }
        assert_memory_equal(outs[1]->obs, outs[0]->obs, (size_t)(ROWS * outs[0]->obs_count) * sizeof(double));
      }
      for (int k = 0; k < 2; ++k) {
        outputs_free(outs[k]);
        mjenv_destroy(envs[k]);
      }
    }
  }
}

static void test_small_stacks(void** state) {
  (void)state;
  if (!runs(2) || MUJOCO[0] == '4') return;  // 4.0's stack lies in its arena
  compare_on_small_stacks("dense", 740);
  compare_on_small_stacks("sparse", 1200);
}

int main(void) {
  const int64_t ids = mjenv_id_count();
  struct CMUnitTest tests[ids + 6];
  for (int64_t i = 0; i < ids; ++i)
    tests[i] = (struct CMUnitTest){mjenv_id_at(i), test_id, NULL, NULL, (void*)(uintptr_t)mjenv_id_at(i)};
  tests[ids] = (struct CMUnitTest)cmocka_unit_test(test_refused);
  tests[ids + 1] = (struct CMUnitTest)cmocka_unit_test(test_reasons);
  tests[ids + 2] = (struct CMUnitTest)cmocka_unit_test(test_forces);
  tests[ids + 3] = (struct CMUnitTest)cmocka_unit_test(test_bad_accelerations);
  tests[ids + 4] = (struct CMUnitTest)cmocka_unit_test(test_small_stacks);
  tests[ids + 5] = (struct CMUnitTest)cmocka_unit_test(test_features);
  return cmocka_run_group_tests(tests, NULL, NULL);
}
