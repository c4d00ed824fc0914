// Tasks written outside of the library equal the built-in ones that they repeat, in every bit of every output.
#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 16, STEPS = 1000, SOIL = 0x5a };

struct repeated {
  const char *plugin, *own, *built_in;
};
static const struct repeated tasks[] = {
    {PLUGINS "/libhopper_c" PLUGIN_SUFFIX, "OwnHopper-v5", "Hopper-v5"},
    {PLUGINS "/libhopper_cpp" PLUGIN_SUFFIX, "CppHopper-v5", "Hopper-v5"},
    {PLUGINS "/libant_cpp" PLUGIN_SUFFIX, "CppAnt-v5", "Ant-v5"},
};

// What is set in both environments.
struct setting {
  int64_t threads;
  const char* autoreset;
  bool changed;  // options of the task, too
};

static mjenv_env* env_of(const char* id, const struct setting* setting) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", setting->threads));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", setting->autoreset));
  if (setting->changed) {
    const double weight = 0.25, noise = 0.02;
    assert_ok(mjenv_options_set_integer(options, "healthy_reward", 2));
    assert_ok(mjenv_options_set_integer(options, "exclude_current_positions_from_observation", 0));
    assert_ok(mjenv_options_set_integer(options, "frame_skip", 3));
    assert_ok(mjenv_options_set_integer(options, "max_episode_steps", 20));
    assert_ok(mjenv_options_set_reals(options, "ctrl_cost_weight", &weight, 1));
    assert_ok(mjenv_options_set_reals(options, "reset_noise_scale", &noise, 1));
  }
  return env_of_options(options, ROWS);
}

// All outputs of `rows` rows in one piece of memory, with a pattern where nothing was written.
struct arrays {
  size_t bytes;
  unsigned char* memory;
  mjenv_batch out;
};

static struct arrays arrays_of(const mjenv_env* env, int64_t rows) {
  const size_t n = (size_t)rows;
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  mjenv_batch b = {.struct_size = sizeof b, .obs_dtype = MJENV_DTYPE_FLOAT64, .rows = rows, .obs_count = space.count};
  b.info_count = role_count(env, MJENV_ROLE_INFO);
  b.reset_info_count = role_count(env, MJENV_ROLE_RESET_INFO);
  const size_t obs = n * (size_t)b.obs_count * 8, info = n * (size_t)b.info_count * 8;
  const size_t reset_info = n * (size_t)b.reset_info_count * 8, flags = (n + 7) / 8 * 8;
  struct arrays a = {.bytes = 2 * obs + 2 * info + reset_info + 8 * n + 8 * n + 3 * flags};
  unsigned char* at = a.memory = allocate(a.bytes);
#define PLACE(member, size) b.member = (void*)at, at += (size)
  PLACE(obs, obs), PLACE(final_obs, obs), PLACE(info, info), PLACE(final_info, info), PLACE(reset_info, reset_info);
  PLACE(reward, 8 * n), PLACE(status, 8 * n), PLACE(terminated, flags), PLACE(truncated, flags);
  PLACE(was_reset, flags);
  memset(a.memory, SOIL, a.bytes);
  a.out = b;
  return a;
}

// An environment and its outputs.
struct side {
  mjenv_env* env;
  struct arrays arrays;
};

static struct side side_of(const char* id, const struct setting* setting) {
  struct side side = {.env = env_of(id, setting)};
  side.arrays = arrays_of(side.env, ROWS);
  seed_rows(side.env, 7);
  assert_ok(mjenv_reset(side.env, NULL, &side.arrays.out));
  return side;
}

static void side_free(struct side* side) {
  mjenv_destroy(side->env);
  free(side->arrays.memory);
}

struct pair {
  struct side side[2];  // the built-in one's, the repeated one's
};

static struct pair pair_of(const struct repeated* task, const struct setting* setting) {
  return (struct pair){{side_of(task->built_in, setting), side_of(task->own, setting)}};
}

static void pair_free(struct pair* p) {
  for (int i = 0; i < 2; ++i) side_free(&p->side[i]);
}

static void assert_same_outputs(const struct side* a, const struct side* b, const char* what, int64_t step) {
  const struct arrays *of_a = &a->arrays, *of_b = &b->arrays;
  assert_int_equal(of_a->bytes, of_b->bytes);
  for (size_t i = 0; i < of_a->bytes; ++i)
    if (of_a->memory[i] != of_b->memory[i]) fail_msg("%s, step %d: byte %zu differs", what, (int)step, i);
}

static void assert_equal(const struct pair* p, const char* what, int64_t step) {
  assert_same_outputs(&p->side[0], &p->side[1], what, step);
}

// Actions that any language can compute, in either type.
struct actions {
  int64_t count;
  double* wide;
  float* narrow;
};

static struct actions actions_for(const mjenv_env* env, int64_t rows) {
  struct actions a = {.count = (size_t)(rows * action_count(env))};
  a.wide = allocate(a.count * sizeof(double));
  a.narrow = allocate(a.count * sizeof(float));
  return a;
}

static void draw(struct actions* a, int64_t step) {
  for (int64_t i = 0; i < a->count; ++i) {
    a->wide[i] = (double)((7919 * (i + a->count * (size_t)step) + 13) % 2003) / 1001.0 - 1;
    a->narrow[i] = (float)a->wide[i];
  }
}

static void actions_free(struct actions* a) {
  free(a->wide);
  free(a->narrow);
}

static void step_side(struct side* side, const struct actions* a, mjenv_dtype dtype) {
  const void* action = dtype == MJENV_DTYPE_FLOAT32 ? (const void*)a->narrow : (const void*)a->wide;
  assert_ok(mjenv_step(side->env, NULL, action, a->count, dtype, &side->arrays.out));
}

static void step_both(struct pair* p, struct actions* a, int64_t step, mjenv_dtype dtype) {
  draw(a, step);
  for (int i = 0; i < 2; ++i) step_side(&p->side[i], a, dtype);
}

// ---- The tests; each for one of the tasks ----

static void same_text(const char* what, const char* a, const char* b) {
  if (strcmp(a ? a : "(null)", b ? b : "(null)") != 0) fail_msg("%s: %s, not %s", what, b, a);
}

static void test_descriptions(void** state) {
  const struct repeated* task = *state;
  const struct setting setting = {1, "disabled", false};
  mjenv_env* env[2] = {env_of(task->built_in, &setting), env_of(task->own, &setting)};
  mjenv_spec spec[2] = {{.struct_size = sizeof *spec}, {.struct_size = sizeof *spec}};
  assert_ok(mjenv_spec_of(task->built_in, &spec[0]));
  assert_ok(mjenv_spec_of(task->own, &spec[1]));
  same_text("the id", task->own, spec[1].id);
  assert_int_equal(spec[1].version, 5);
  assert_int_equal(strlen(spec[1].robot), strlen(task->own) - 3);
  const size_t numbers = offsetof(mjenv_spec, max_episode_steps);
  assert_memory_equal((char*)&spec[0] + numbers, (char*)&spec[1] + numbers, sizeof *spec - numbers);
  assert_int_equal(frame_skip_of(env[0]), frame_skip_of(env[1]));

  const mjenv_options *a = mjenv_options_of(env[0]), *b = mjenv_options_of(env[1]);
  assert_int_equal(mjenv_options_count(a), mjenv_options_count(b));
  for (int64_t i = 0; i < mjenv_options_count(a); ++i) {
    mjenv_option of_a = {.struct_size = sizeof of_a}, of_b = of_a;
    assert_ok(mjenv_options_at(a, i, &of_a));
    assert_ok(mjenv_options_at(b, i, &of_b));
    same_text("an option", of_a.name, of_b.name);
    same_text(of_a.name, of_a.doc, of_b.doc);
    same_text(of_a.name, of_a.choices, of_b.choices);
    assert_int_equal(of_a.kind, of_b.kind);
    assert_int_equal(of_a.count, of_b.count);
    assert_true(of_a.low == of_b.low && of_a.high == of_b.high);
    if (of_a.kind != MJENV_KIND_REALS) continue;
    double values[2][8];
    int64_t count;
    assert_ok(mjenv_options_get_reals(a, of_a.name, values[0], 8, &count));
    assert_ok(mjenv_options_get_reals(b, of_a.name, values[1], 8, &count));
    assert_same_bits(of_a.name, values[1], values[0], count);
  }
  for (mjenv_role role = MJENV_ROLE_OBSERVATION; role <= MJENV_ROLE_MODEL; ++role) {
    assert_int_equal(mjenv_field_count(env[0], role), mjenv_field_count(env[1], role));
    for (int64_t i = 0; i < mjenv_field_count(env[0], role); ++i) {
      mjenv_field of_a = {.struct_size = sizeof of_a}, of_b = of_a;
      assert_ok(mjenv_field_at(env[0], role, i, &of_a));
      assert_ok(mjenv_field_at(env[1], role, i, &of_b));
      same_text("a field", of_a.name, of_b.name);
      same_text(of_a.name, of_a.doc, of_b.doc);
      assert_int_equal(of_a.ndim, of_b.ndim);
      assert_int_equal(of_a.offset, of_b.offset);
      assert_int_equal(of_a.count, of_b.count);
      assert_int_equal(of_a.dtype, of_b.dtype);
      assert_memory_equal(of_a.shape, of_b.shape, sizeof of_a.shape);
    }
  }
  mjenv_destroy(env[0]);
  mjenv_destroy(env[1]);
}

// The built-in one on one thread, and the repeated one on 1, 2 and 5.
static void test_threads(void** state) {
  const struct repeated* task = *state;
  const struct setting one = {1, "next_step", false};
  const struct setting more[] = {{2, "next_step", false}, {5, "next_step", false}};
  struct pair p = pair_of(task, &one);
  struct side others[COUNT(more)];
  for (size_t i = 0; i < COUNT(more); ++i) others[i] = side_of(task->own, &more[i]);
  struct actions a = actions_for(p.side[0].env, ROWS);
  int64_t resets = 0;
  assert_equal(&p, "reset", 0);
  for (int64_t t = 0; t < STEPS; ++t) {
    step_both(&p, &a, t, MJENV_DTYPE_FLOAT32);
    assert_equal(&p, "one thread", t);
    for (size_t i = 0; i < COUNT(more); ++i) {
      step_side(&others[i], &a, MJENV_DTYPE_FLOAT32);
      assert_same_outputs(&p.side[0], &others[i], "more threads", t);
    }
    for (int row = 0; row < ROWS; ++row) resets += p.side[0].arrays.out.was_reset[row];
  }
  assert_true(resets > ROWS / 4);
  for (size_t i = 0; i < COUNT(more); ++i) side_free(&others[i]);
  actions_free(&a);
  pair_free(&p);
}

static void test_changed_options(void** state) {
  const struct setting setting = {2, "same_step", true};
  struct pair p = pair_of(*state, &setting);
  struct actions a = actions_for(p.side[0].env, ROWS);
  int64_t resets = 0;
  for (int64_t t = 0; t < 100; ++t) {
    step_both(&p, &a, t, MJENV_DTYPE_FLOAT64);
    assert_equal(&p, "changed options", t);
    for (int row = 0; row < ROWS; ++row) resets += p.side[0].arrays.out.was_reset[row];
  }
  assert_true(resets > ROWS);
  actions_free(&a);
  pair_free(&p);
}

// Images, copies of rows, set_state, simulate, observe: what changes rows from outside.
static void test_state(void** state) {
  const struct repeated* task = *state;
  const struct setting setting = {2, "same_step", false}, elsewhere = {5, "same_step", false};
  struct pair p = pair_of(task, &setting);
  struct actions a = actions_for(p.side[0].env, ROWS);
  for (int64_t t = 0; t < 20; ++t) step_both(&p, &a, t, MJENV_DTYPE_FLOAT32);

  // The repeated one goes on in another environment, with other threads.
  int64_t size = 0;
  void* image = image_of(p.side[1].env, MJENV_ALL_ROWS, &size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(p.side[0].env, MJENV_ALL_ROWS, image, size), "another id");
  mjenv_destroy(p.side[1].env);
  p.side[1].env = env_of(task->own, &elsewhere);
  assert_ok(mjenv_restore(p.side[1].env, MJENV_ALL_ROWS, image, size));
  free(image);
  for (int64_t t = 20; t < 40; ++t) {
    step_both(&p, &a, t, MJENV_DTYPE_FLOAT32);
    assert_equal(&p, "after an image", t);
  }

  uint8_t some[ROWS] = {0};
  for (int row = 0; row < ROWS; row += 3) some[row] = 1;
  double qpos[64] = {0}, qvel[64] = {0}, ctrl[32] = {0};
  int64_t nq = 0, nv = 0;
  for (int i = 0; i < 2; ++i) {
    assert_ok(mjenv_copy_row(p.side[i].env, some, 4));
    assert_ok(mjenv_read(p.side[i].env, 10, "qpos", qpos, 64, &nq));
    assert_ok(mjenv_read(p.side[i].env, 10, "qvel", qvel, 64, &nv));
    qpos[2] += 0.01, qvel[1] = -0.5, ctrl[0] = 0.3;
    assert_ok(mjenv_set_state(p.side[i].env, 7, qpos, nq, qvel, nv));
    assert_ok(mjenv_simulate(p.side[i].env, 8, ctrl, (size_t)action_count(p.side[i].env), 3));
    assert_ok(mjenv_observe(p.side[i].env, &p.side[i].arrays.out));
  }
  assert_equal(&p, "after a change of state", 0);
  for (int64_t t = 40; t < 60; ++t) {
    step_both(&p, &a, t, MJENV_DTYPE_FLOAT64);
    assert_equal(&p, "after a change of state", t);
  }
  uint64_t words[2][6];
  for (int i = 0; i < 2; ++i) assert_ok(mjenv_get_stream(p.side[i].env, 5, words[i], 6));
  assert_memory_equal(words[0], words[1], sizeof words[0]);
  actions_free(&a);
  pair_free(&p);
}

static void test_rollout(void** state) {
  enum { LENGTH = 40 };
  const struct setting setting = {2, "disabled", false};
  struct pair p = pair_of(*state, &setting);
  struct actions a = actions_for(p.side[0].env, ROWS * LENGTH);
  draw(&a, 0);
  for (int i = 0; i < 2; ++i) {
    free(p.side[i].arrays.memory);
    p.side[i].arrays = arrays_of(p.side[i].env, ROWS * LENGTH);
    assert_ok(mjenv_rollout(p.side[i].env, a.narrow, a.count, MJENV_DTYPE_FLOAT32, LENGTH, &p.side[i].arrays.out));
  }
  assert_equal(&p, "rollout", 0);
  actions_free(&a);
  pair_free(&p);
}

// Sends the actions of all rows and waits for the rows.
static void send_and_receive(mjenv_env* env, const float* action, int64_t count, const mjenv_batch* out) {
  int64_t done[ROWS];
  int64_t received = 0;
  assert_ok(mjenv_send(env, NULL, 0, action, count, MJENV_DTYPE_FLOAT32));
  assert_ok(mjenv_recv(env, ROWS, -1, done, ROWS, &received, out));
  assert_int_equal(received, ROWS);
}

static void test_pipeline(void** state) {
  const struct setting setting = {3, "next_step", false};
  struct pair p = pair_of(*state, &setting);
  struct actions a = actions_for(p.side[0].env, ROWS);
  for (int64_t t = 0; t < 30; ++t) {
    draw(&a, t);
    for (int i = 0; i < 2; ++i) {
      send_and_receive(p.side[i].env, a.narrow, a.count, &p.side[i].arrays.out);
    }
    assert_equal(&p, "pipeline", t);
  }
  actions_free(&a);
  pair_free(&p);
}

int main(int count, char** arguments) {
  const struct repeated* found = NULL;
  for (size_t i = 0; i < COUNT(tasks); ++i)
    if (count == 2 && strcmp(arguments[1], tasks[i].own) == 0) found = &tasks[i];
  if (!found || mjenv_load_tasks(found->plugin) != MJENV_OK) {
    print_error("%s\n", found ? mjenv_last_error() : "name one of the tasks");
    return 1;
  }
  void* task = (void*)found;
  const struct CMUnitTest group[] = {
      cmocka_unit_test_prestate(test_descriptions, task),    cmocka_unit_test_prestate(test_threads, task),
      cmocka_unit_test_prestate(test_changed_options, task), cmocka_unit_test_prestate(test_state, task),
      cmocka_unit_test_prestate(test_rollout, task),         cmocka_unit_test_prestate(test_pipeline, task),
  };
  return cmocka_run_group_tests_name(found->own, group, NULL, NULL);
}
