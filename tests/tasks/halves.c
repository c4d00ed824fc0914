// Resets and steps whose outputs the caller computes: Hopper-v5's equal the built-in robot's in every bit.
#include "hopper.c"
#include "support.h"

enum { ROWS = 9, NQ = 6, NU = 3, SOIL = 0x5a };

// All outputs in one piece of memory, with a pattern where nothing was written.
struct out {
  mjenv_batch batch;
  size_t bytes;
  unsigned char* memory;
};

static struct out out_of(const mjenv_env* env, mjenv_dtype dtype) {
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  mjenv_batch b = {.struct_size = sizeof b, .obs_dtype = dtype, .rows = ROWS, .obs_count = space.count};
  b.info_count = 6, b.reset_info_count = 2, b.arrays_count = 2 * NQ;
  const size_t obs = ROWS * (size_t)space.count * 8, info = (size_t)ROWS * 6 * 8, reset_info = (size_t)ROWS * 2 * 8;
  struct out out = {.bytes = 2 * obs + 2 * info + reset_info + (size_t)ROWS * (2 * NQ + 5) * 8};
  unsigned char* at = out.memory = allocate(out.bytes);
#define PLACE(member, size) b.member = (void*)at, at += (size)
  PLACE(obs, obs), PLACE(final_obs, obs), PLACE(info, info), PLACE(final_info, info), PLACE(reset_info, reset_info);
  PLACE(arrays, (size_t)ROWS * 2 * NQ * 8), PLACE(reward, ROWS * 8), PLACE(status, ROWS * 8);
  PLACE(terminated, ROWS * 8), PLACE(truncated, ROWS * 8), PLACE(was_reset, ROWS * 8);
  memset(out.memory, SOIL, out.bytes);
  out.batch = b;
  return out;
}

// The caller's Hopper: what it computes, and what its task carries.
struct caller {
  mjenv_env* env;
  hopper hopper;
  mjenv_batch given;
  double obs[ROWS][2 * NQ], reward[ROWS], info[6 * ROWS], reset_info[2 * ROWS], x[ROWS], qpos0[NQ];
  uint8_t terminated[ROWS];
  float narrow[ROWS * 2 * NQ];
};

static struct caller* caller_of(mjenv_env* env, mjenv_dtype dtype) {
  struct caller* c = allocate(sizeof *c);
  *c = (struct caller){.env = env};
  c->hopper = (hopper){1, 1e-3, 1, {-100, 100}, {0.7, INFINITY}, {-0.2, 0.2}, 5e-3, 1, 1};
  int64_t count;
  assert_ok(mjenv_read(env, 0, "qpos0", c->qpos0, NQ, &count));
  c->given = (mjenv_batch){.struct_size = sizeof c->given, .obs_dtype = dtype, .rows = ROWS, .obs_count = 2 * NQ - 1};
  c->given.info_count = 6, c->given.reset_info_count = 2;
  c->given.obs = dtype == MJENV_DTYPE_FLOAT32 ? (void*)c->narrow : (void*)c->obs, c->given.reward = c->reward;
  c->given.terminated = c->terminated, c->given.info = c->info, c->given.reset_info = c->reset_info;
  return c;
}

static mjenv_sim sim_of(const struct caller* c, const mjenv_batch* out, int row) {
  mjenv_sim sim = {.struct_size = sizeof sim, .nq = NQ, .nv = NQ, .nu = NU, .dt = 0.002 * 4};
  sim.qpos = out->arrays + row * NQ, sim.qvel = out->arrays + (ROWS + row) * NQ;
  sim.qpos0 = c->qpos0, sim.carried = &c->x[row];
  return sim;
}

// The observation, the reset's info and what the next step needs, of one row or of all (-1).
static void look(struct caller* c, const mjenv_batch* out, const uint8_t* mask) {
  for (int row = 0; row < ROWS; ++row) {
    if (mask && !mask[row]) continue;
    const mjenv_sim sim = sim_of(c, out, row);
    double infos[2], *obs = &c->obs[0][0] + row * (2 * NQ - 1);
    observe(&c->hopper, &sim, obs);
    reset_info(&c->hopper, &sim, infos);
    carry(&c->hopper, &sim, &c->x[row]);
    for (int i = 0; i < 2; ++i) c->reset_info[i * ROWS + row] = infos[i];
    for (int i = 0; i < 2 * NQ - 1; ++i) c->narrow[row * (2 * NQ - 1) + i] = (float)obs[i];
  }
}

static void reset_by_caller(struct caller* c, const uint8_t* mask, const mjenv_batch* out) {
  assert_ok(mjenv_begin(c->env, mask, NULL, 0, NULL, 0, out));
  look(c, out, mask);
  assert_ok(mjenv_finish(c->env, mask, &c->given, out));
}

static void step_by_caller(struct caller* c, const void* action, mjenv_dtype dtype, const mjenv_batch* out) {
  double seen[ROWS * NU];
  uint8_t resets[ROWS];
  assert_ok(mjenv_act(c->env, NULL, action, ROWS * NU, dtype, seen));
  assert_ok(mjenv_advance(c->env, NULL, action, ROWS * NU, dtype, NULL, 0, out));
  memcpy(resets, out->was_reset, ROWS);
  for (int row = 0; row < ROWS; ++row) {
    double wide[NU], infos[6];
    for (int i = 0; i < NU; ++i)
      wide[i] = dtype == MJENV_DTYPE_FLOAT32 ? (double)((float*)(void*)seen)[row * NU + i] : seen[row * NU + i];
    mjenv_sim sim = sim_of(c, out, row);
    sim.action = wide, sim.action_dtype = dtype;
    mjenv_outcome outcome = {.struct_size = sizeof outcome, .info = infos};
    step(&c->hopper, &sim, &outcome);
    c->reward[row] = outcome.reward, c->terminated[row] = outcome.terminated != 0;
    for (int i = 0; i < 6; ++i) c->info[i * ROWS + row] = infos[i];
  }
  if (memchr(resets, 1, ROWS)) assert_ok(mjenv_begin(c->env, resets, NULL, 0, NULL, 0, out));
  look(c, out, NULL);
  assert_ok(mjenv_finish(c->env, NULL, &c->given, out));
  memcpy(resets, out->was_reset, ROWS);
  for (int row = 0; row < ROWS; ++row) resets[row] &= out->terminated[row] | out->truncated[row];
  if (memchr(resets, 1, ROWS)) reset_by_caller(c, resets, out);
}

struct setting {
  const char *name, *autoreset;
  int64_t history, lanes, limit;
  bool narrow_obs, is_perturbed;
};

static void perturb(mjenv_env* env) {
  assert_ok(mjenv_randomize(env,
                            "{\"randomize\": {\"geom_friction\": {\"low\": 0.5, \"high\": 1.5}},"
                            "\"noise\": {\"action\": 0.05, \"observation\": 0.01},"
                            "\"delay\": {\"action\": [0, 2], \"observation\": 1},"
                            "\"push\": {\"body\": 1, \"every\": [2, 5], \"force\": [[-20, 20], [0, 0], [0, 0]]}}"));
}

static mjenv_env* env_for(const char* id, const struct setting* s) {
  mjenv_options* options_of_env = options_of_id(id);
  const double bounds[] = {-1, 1};
  set_lanes(options_of_env, s->lanes);
  assert_ok(mjenv_options_set_string(options_of_env, "autoreset_mode", s->autoreset));
  assert_ok(mjenv_options_set_string(options_of_env, "arrays", "qpos qvel"));
  assert_ok(mjenv_options_set_integer(options_of_env, "history", s->history));
  assert_ok(mjenv_options_set_integer(options_of_env, "max_episode_steps", s->limit));
  if (s->is_perturbed) assert_ok(mjenv_options_set_integer(options_of_env, "time_aware", 1));
  if (s->is_perturbed) assert_ok(mjenv_options_set_reals(options_of_env, "rescale_actions", bounds, 2));
  mjenv_env* env = env_of_options(options_of_env, ROWS);
  if (s->is_perturbed) perturb(env);
  seed_rows(env, 7);
  return env;
}

static void assert_same(const struct out* a, const struct out* b, const char* what, int step) {
  for (size_t i = 0; i < a->bytes; ++i)
    if (a->memory[i] != b->memory[i]) fail_msg("%s, step %d: byte %zu of %zu differs", what, step, i, a->bytes);
}

static void draw_actions(int t, double* wide, float* narrow) {
  for (int i = 0; i < ROWS * NU; ++i) {
    wide[i] = (double)((7919 * (i + ROWS * NU * t) + 13) % 2003) / 1001.0 - 1;
    narrow[i] = (float)wide[i];
  }
}

static void test_equal(void** state) {
  const struct setting* s = *state;
  const mjenv_dtype obs_dtype = s->narrow_obs ? MJENV_DTYPE_FLOAT32 : MJENV_DTYPE_FLOAT64;
  mjenv_env *env = env_for("Hopper-v5", s), *own = env_for("HalfHopper-v5", s), *other = env_for("HalfHopper-v5", s);
  struct out a = out_of(env, obs_dtype), b = out_of(own, obs_dtype);
  // With noise, the library computes with what the caller gives: the doubles.
  struct caller* c = caller_of(own, s->is_perturbed ? MJENV_DTYPE_FLOAT64 : obs_dtype);
  unsigned char* image = NULL;
  double wide[ROWS * NU];
  float narrow[ROWS * NU];
  int64_t size = 0, count;
  int resets = 0;
  assert_ok(mjenv_reset(env, NULL, &a.batch));
  reset_by_caller(c, NULL, &b.batch);
  assert_same(&a, &b, "reset", 0);
  for (int t = 0; t < 120; ++t) {
    if (t == 50) {  // in the middle of episodes, an image goes on in another environment
      assert_ok(mjenv_write(c->env, NULL, "carried", c->x, ROWS));
      image = image_of(c->env, MJENV_ALL_ROWS, &size);
      c->env = other;
      memset(c->x, 0, sizeof c->x);
      assert_ok(mjenv_restore(c->env, MJENV_ALL_ROWS, image, size));
      for (int row = 0; row < ROWS; ++row) assert_ok(mjenv_read(c->env, row, "carried", &c->x[row], 1, &count));
      const mjenv_batch none = {.struct_size = sizeof none, .rows = ROWS, .obs_count = 2 * NQ - 1};
      assert_ok(mjenv_observe(env, &a.batch));
      assert_ok(mjenv_observe(c->env, &b.batch));
      look(c, &b.batch, NULL);
      assert_ok(mjenv_finish(c->env, NULL, s->is_perturbed ? &none : &c->given, &b.batch));  // the record has it all
      assert_same(&a, &b, "observe", t);
    }
    draw_actions(t, wide, narrow);
    const mjenv_dtype dtype = t % 3 ? MJENV_DTYPE_FLOAT32 : MJENV_DTYPE_FLOAT64;
    const void* action = t % 3 ? (const void*)narrow : (const void*)wide;
    assert_ok(mjenv_step(env, NULL, action, ROWS * NU, dtype, &a.batch));
    step_by_caller(c, action, dtype, &b.batch);
    assert_same(&a, &b, s->name, t);
    uint8_t ended[ROWS];
    for (int row = 0; row < ROWS; ++row) {
      ended[row] = strcmp(s->autoreset, "disabled") == 0 && (a.batch.terminated[row] | a.batch.truncated[row]);
      resets += a.batch.was_reset[row] + ended[row];
    }
    if (!memchr(ended, 1, ROWS)) continue;
    assert_ok(mjenv_reset(env, ended, &a.batch));
    reset_by_caller(c, ended, &b.batch);
    assert_same(&a, &b, "reset of some rows", t);
  }
  assert_true(resets > 2 * ROWS);
  for (int row = 0; row < ROWS; ++row) {
    uint64_t words[2][6];
    assert_ok(mjenv_get_stream(env, row, words[0], 6));
    assert_ok(mjenv_get_stream(c->env, row, words[1], 6));
    assert_memory_equal(words[0], words[1], sizeof words[0]);
  }
  free(image), free(a.memory), free(b.memory), free(c);
  mjenv_destroy(env), mjenv_destroy(own), mjenv_destroy(other);
}

// Initial states of the caller, and ctrl that it makes of actions of its own.
static void test_given_states_and_ctrl(void** state) {
  (void)state;
  const struct setting s = {"given", "disabled", 0, AUTO_LANES, 1000, false, false};
  mjenv_env *env = env_for("HalfHopper-v5", &s), *own = env_for("ActsHopper-v5", &s);
  struct out a = out_of(env, MJENV_DTYPE_FLOAT64), b = out_of(own, MJENV_DTYPE_FLOAT64);
  struct caller *c = caller_of(env, MJENV_DTYPE_FLOAT64), *d = caller_of(own, MJENV_DTYPE_FLOAT64);
  reset_by_caller(c, NULL, &a.batch);
  const double* states = a.batch.arrays;
  assert_ok(mjenv_begin(own, NULL, states, ROWS * NQ, states + ROWS * NQ, ROWS * NQ, &b.batch));
  look(d, &b.batch, NULL);
  assert_ok(mjenv_finish(own, NULL, &d->given, &b.batch));
  assert_same(&a, &b, "reset", 0);
  double ctrl[ROWS * NU], zeros[ROWS * 2] = {0}, seen[ROWS * 2];
  float narrow[ROWS * NU];
  assert_int_equal(action_count(own), 2);
  for (int t = 0; t < 5; ++t) {
    draw_actions(t, ctrl, narrow);
    assert_ok(mjenv_advance(env, NULL, ctrl, ROWS * NU, MJENV_DTYPE_FLOAT64, NULL, 0, &a.batch));
    assert_ok(mjenv_act(own, NULL, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64, seen));
    assert_ok(mjenv_advance(own, NULL, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64, ctrl, ROWS * NU, &b.batch));
    assert_memory_equal(a.batch.arrays, b.batch.arrays, ROWS * 2 * NQ * sizeof(double));
    assert_ok(mjenv_finish(env, NULL, &c->given, &a.batch));
    assert_ok(mjenv_finish(own, NULL, &d->given, &b.batch));
  }
  const char* use = "use mjenv_advance";
  assert_refused(MJENV_E_TASK, mjenv_step(own, NULL, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64, NULL), use);
  assert_refused(MJENV_E_TASK, mjenv_rollout(own, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64, 1, NULL), use);
  assert_refused(MJENV_E_TASK, mjenv_send(own, NULL, 0, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64), use);
  assert_refused(MJENV_E_TASK, mjenv_advance(own, NULL, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64, NULL, 0, NULL), use);
  assert_refused(MJENV_E_SIZE, mjenv_advance(own, NULL, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64, ctrl, 1, NULL),
                 "ctrl_count is 1");
  ctrl[7] = NAN;
  assert_refused(MJENV_E_TASK, mjenv_advance(own, NULL, zeros, ROWS * 2, MJENV_DTYPE_FLOAT64, ctrl, ROWS * NU, NULL),
                 "row 2: ActsHopper-v5: before_step: ctrl[1] is nan");
  assert_refused(MJENV_E_SIZE, mjenv_begin(own, NULL, states, 1, NULL, 0, NULL), "nq is 1");
  a.batch.arrays[ROWS * NQ] = NAN;
  assert_refused(MJENV_E_TASK, mjenv_begin(own, NULL, NULL, 0, states + ROWS * NQ, ROWS * NQ, NULL),
                 "row 0: ActsHopper-v5: reset: qvel[0] is nan");
  free(a.memory), free(b.memory), free(c), free(d);
  mjenv_destroy(env), mjenv_destroy(own);
}

// A step that is open: what is refused, what acts on it, and giving it up.
static void test_order(void** state) {
  (void)state;
  const struct setting s = {"order", "next_step", 2, 0, 3, false, false};
  mjenv_env *env = env_for("HalfHopper-v5", &s), *built_in = env_for("Hopper-v5", &s);
  struct out a = out_of(env, MJENV_DTYPE_FLOAT64);
  struct caller* c = caller_of(env, MJENV_DTYPE_FLOAT64);
  double action[ROWS * NU] = {0}, numbers[NQ];
  int64_t size;
  uint8_t first[ROWS] = {1};
  uint64_t words[6];
  const mjenv_dtype f64 = MJENV_DTYPE_FLOAT64;
  assert_refused(MJENV_E_TASK, mjenv_begin(built_in, NULL, NULL, 0, NULL, 0, NULL), "use mjenv_reset and mjenv_step");
  assert_refused(MJENV_E_TASK, mjenv_finish(built_in, NULL, &c->given, NULL), "Hopper-v5 computes its own");
  assert_refused(MJENV_E_NAME, mjenv_write(built_in, NULL, "carried", numbers, 1), "carried");
  assert_refused(MJENV_E_NOT_RESET, mjenv_advance(env, NULL, action, ROWS * NU, f64, NULL, 0, NULL), "row 0");
  for (int open = 0; open < 2; ++open) {
    if (open == 0) assert_ok(mjenv_begin(env, NULL, NULL, 0, NULL, 0, &a.batch));
    if (open == 1) assert_ok(mjenv_advance(env, first, action, ROWS * NU, f64, NULL, 0, &a.batch));
    const char* what = "row 0: its step or reset is not finished";
    assert_refused(MJENV_E_PENDING, mjenv_advance(env, first, action, ROWS * NU, f64, NULL, 0, NULL), what);
    assert_refused(MJENV_E_PENDING, mjenv_step(env, NULL, action, ROWS * NU, f64, NULL), what);
    assert_refused(MJENV_E_PENDING, mjenv_send(env, NULL, 0, action, ROWS * NU, f64), what);
    assert_refused(MJENV_E_PENDING, mjenv_rollout(env, action, ROWS * NU, f64, 1, NULL), what);
    assert_refused(MJENV_E_PENDING, mjenv_reset(env, NULL, NULL), what);
    assert_refused(MJENV_E_PENDING, mjenv_snapshot(env, 0, NULL, 0, &size), what);
    assert_refused(MJENV_E_PENDING, mjenv_restore(env, 0, a.memory, 8), what);
    assert_refused(MJENV_E_PENDING, mjenv_copy_row(env, NULL, 1), what);
    assert_refused(MJENV_E_PENDING, mjenv_set_state(env, 1, numbers, NQ, numbers, NQ), what);
    assert_refused(MJENV_E_PENDING, mjenv_simulate(env, 1, action, NU, 1), what);
    assert_refused(MJENV_E_PENDING, mjenv_randomize(env, NULL), what);
    assert_ok(mjenv_read(env, 0, "qvel", numbers, NQ, &size));
    numbers[1] += 1;
    assert_ok(mjenv_write_row(env, 0, "qvel", numbers, NQ));
    assert_ok(mjenv_get_stream(env, 0, words, 6));
    assert_ok(mjenv_set_stream(env, 0, words, 6));
    look(c, &a.batch, NULL);
    c->obs[0][3] = NAN;
    assert_refused(MJENV_E_TASK, mjenv_finish(env, NULL, &c->given, &a.batch),
                   "row 0: HalfHopper-v5: observe: observation[3] is NaN");
    look(c, &a.batch, NULL);
    c->reward[0] = NAN;
    if (open == 1)
      assert_refused(MJENV_E_TASK, mjenv_finish(env, NULL, &c->given, &a.batch),
                     "row 0: HalfHopper-v5: step: the reward is NaN");
    c->reward[0] = 0;
    mjenv_batch bad = c->given;
    bad.obs_count = 10;
    assert_refused(MJENV_E_SIZE, mjenv_finish(env, NULL, &bad, &a.batch), "obs_count is 10");
    bad.struct_size = 3;
    assert_refused(MJENV_E_ARGUMENT, mjenv_finish(env, NULL, &bad, &a.batch), "given");
    assert_ok(mjenv_finish(env, NULL, &c->given, &a.batch));
    assert_ok(mjenv_snapshot(env, 0, NULL, 0, &size));
  }
  // A reset that is given up must begin again, which with next_step is the next step; a step that is given up counts.
  assert_ok(mjenv_begin(env, first, NULL, 0, NULL, 0, &a.batch));
  assert_ok(mjenv_finish(env, NULL, NULL, NULL));
  for (int t = 0; t < 4; ++t) {
    assert_ok(mjenv_advance(env, NULL, action, ROWS * NU, f64, NULL, 0, &a.batch));
    assert_int_equal(a.batch.was_reset[0], t == 0);
    assert_int_equal(a.batch.was_reset[1], t == 3);
    if (t == 0) assert_ok(mjenv_begin(env, first, NULL, 0, NULL, 0, &a.batch));
    assert_ok(mjenv_finish(env, NULL, t == 0 ? &c->given : NULL, &a.batch));
  }
  free(a.memory), free(c);
  mjenv_destroy(env), mjenv_destroy(built_in);
}

// "Batch-v0" needs no registration: options say what the caller computes.
static void test_batch(void** state) {
  (void)state;
  mjenv_options* chosen = options_of_id("Batch-v0");
  const char* twice = "infos: the name speed occurs twice";
  mjenv_env* env = NULL;
  assert_refused(MJENV_E_VALUE, mjenv_create(chosen, 2, &env), "no model");
  assert_ok(mjenv_options_set_string(chosen, "xml_file", "hopper.xml"));
  assert_ok(mjenv_options_set_string(chosen, "infos", "speed speed"));
  assert_refused(MJENV_E_TASK, mjenv_create(chosen, 2, &env), twice);
  assert_ok(mjenv_options_set_string(chosen, "infos", "speed height"));
  assert_ok(mjenv_options_set_string(chosen, "reset_infos", "start"));
  for (const char** wrong = (const char*[]){"mass", "=1", "policy/=1", "mass=-1", "mass=9999999", NULL}; *wrong;
       ++wrong) {
    assert_ok(mjenv_options_set_string(chosen, "terms", *wrong));
    assert_refused(MJENV_E_TASK, mjenv_create(chosen, 2, &env), "is not GROUP/NAME=COUNT or NAME=COUNT");
  }
  assert_ok(mjenv_options_set_string(chosen, "terms", "policy/joints=1 policy/speed=1 mass=1"));  // for observations=3
  assert_ok(mjenv_options_set_integer(chosen, "carried", 4));
  assert_ok(mjenv_options_set_integer(chosen, "actions", 2));
  env = env_of_options(chosen, 2);
  assert_int_equal(role_count(env, MJENV_ROLE_OBSERVATION), 3);
  mjenv_field field = MJENV_FIELD_INIT;
  assert_ok(mjenv_field_at(env, MJENV_ROLE_GROUPS, 0, &field));
  assert_true(strcmp(field.name, "policy") == 0 && field.count == 2);
  assert_int_equal(role_count(env, MJENV_ROLE_INFO), 2);
  assert_int_equal(role_count(env, MJENV_ROLE_RESET_INFO), 1);
  assert_int_equal(action_count(env), 2);
  double obs[] = {1, 2, 3, 4, 5, 6}, info[] = {7, 8, 9, 10}, reward[] = {11, 12}, got[6] = {0}, infos[4], rewards[2];
  const double action[4] = {0}, ctrl[6] = {0};
  const mjenv_batch given = {.struct_size = sizeof given,
                             .obs_dtype = MJENV_DTYPE_FLOAT64,
                             .rows = 2,
                             .obs_count = 3,
                             .info_count = 2,
                             .obs = obs,
                             .info = info,
                             .reward = reward};
  mjenv_batch out = given;
  out.obs = got, out.info = infos, out.reward = rewards;
  assert_ok(mjenv_begin(env, NULL, NULL, 0, NULL, 0, &out));
  assert_ok(mjenv_finish(env, NULL, &given, &out));
  assert_ok(mjenv_advance(env, NULL, action, 4, MJENV_DTYPE_FLOAT64, ctrl, 6, &out));
  assert_ok(mjenv_finish(env, NULL, &given, &out));
  assert_same_bits("obs", got, obs, 6);
  assert_same_bits("info", infos, info, 4);
  assert_same_bits("reward", rewards, reward, 2);
  int64_t count;
  double* carried = read_array(env, 1, "carried", &count);
  assert_int_equal(count, 4);
  free(carried);
  mjenv_destroy(env);
}

static int32_t build_acts(mjenv_builder* builder, void* user, void** self) {
  mjenv_build_action(builder, 2, NULL, NULL);
  return build(builder, user, self);
}

#define EQUAL(setting) \
  { "equal: " #setting, test_equal, NULL, NULL, (void*)&setting }

int main(void) {
  mjenv_task half = task;
  half.id = "HalfHopper-v5", half.physics_only = 1;
  half.observe = NULL, half.step = NULL, half.carry = NULL, half.reset_info = NULL;
  mjenv_task acts = half;
  acts.id = "ActsHopper-v5", acts.build = build_acts, acts.reset = NULL;
  if (mjenv_register_task(&half) != MJENV_OK || mjenv_register_task(&acts) != MJENV_OK) {
    print_error("%s\n", mjenv_last_error());
    return 1;
  }
  static const struct setting plain = {"plain", "next_step", 0, AUTO_LANES, 20, false, false};
  static const struct setting disabled = {"disabled", "disabled", 3, AUTO_LANES, 20, true, true};
  static const struct setting next = {"next_step", "next_step", 3, AUTO_LANES, 20, false, true};
  static const struct setting same = {"same_step", "same_step", 3, AUTO_LANES, 20, false, true};
  static const struct setting one_by_one = {"one by one", "same_step", 0, 0, 30, true, false};
  const struct CMUnitTest tests[] = {
      EQUAL(plain),
      EQUAL(disabled),
      EQUAL(next),
      EQUAL(same),
      EQUAL(one_by_one),
      cmocka_unit_test(test_given_states_and_ctrl),
      cmocka_unit_test(test_order),
      cmocka_unit_test(test_batch),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
