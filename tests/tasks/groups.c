// Groups of terms: the keys of an observation that is a Gymnasium Dict.
#include <math.h>

#include "mjenv/task.h"
#include "support.h"

enum { ROWS = 5, WIDTH = 17, LIMIT = 5, STACK = 3 };

static const char model[] =
    "<mujoco><option timestep='0.01'/><worldbody><body><joint type='slide' axis='1 0 0'/><geom size='.1'/></body>"
    "<body pos='0 0 1'><freejoint/><geom size='.1'/></body></worldbody></mujoco>";

typedef struct {
  const char *name, *group;
  int64_t count;
} term;

static const term usual[] = {
    {"cart", "policy", 1}, {"ball", "policy", 7}, {"mass", "critic", 1}, {"velocity", "critic", 7}, {"clock", NULL, 1}};
enum { TERMS = COUNT(usual) };

typedef struct {
  const char* name;
  int64_t offset, count, frames;  // frames 0: not stacked
} key;

static int32_t reset(const void* self, mjenv_start* start) {
  (void)self;
  start->qpos[0] = mjenv_random_uniform(start->random, -1, 1);
  start->qvel[0] = mjenv_random_uniform(start->random, -1, 1);
  return 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  (void)self;
  memcpy(to, sim->qpos, 8 * sizeof *to);
  to[8] = sim->body_mass[1];
  memcpy(to + 9, sim->qvel, 7 * sizeof *to);
  to[16] = *sim->time;
  return 0;
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self;
  outcome->reward = sim->qpos[0];
  outcome->terminated = sim->qpos[3] < 0.99;
  return 0;
}

static mjenv_task_field fields[TERMS + 1];

static mjenv_task task_of(const char* id, const term* terms) {
  for (int64_t i = 0; i < TERMS; ++i) {
    fields[i] = (mjenv_task_field)MJENV_TASK_FIELD_INIT;
    fields[i].name = terms[i].name;
    fields[i].group = terms[i].group;
    fields[i].ndim = 1;
    fields[i].shape[0] = terms[i].count;
  }
  mjenv_task task = MJENV_TASK_INIT;
  task.id = id;
  task.model_text = model;
  task.time_limit = LIMIT;
  task.fields = fields;
  task.field_count = TERMS;
  task.reset = reset;
  task.observe = observe;
  task.step = step;
  return task;
}

static mjenv_env* env_with(const char* id, const char* observation, int64_t history) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_string(options, "observation", observation));
  if (history > 0) assert_ok(mjenv_options_set_integer(options, "history", history));
  mjenv_env* env = env_of_options(options, ROWS);
  seed_rows(env, 7);
  return env;
}

static int64_t observe_into(mjenv_env* env, double* obs, bool steps) {
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  mjenv_batch out = MJENV_BATCH_INIT;
  out.rows = ROWS;
  out.obs_count = space.count;
  out.obs = obs;
  assert_ok(steps ? mjenv_step(env, NULL, &space, 0, MJENV_DTYPE_FLOAT64, &out) : mjenv_reset(env, NULL, &out));
  return space.count;
}

static void assert_keys(mjenv_env* env, const key* keys, int64_t count) {
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_GROUPS), count);
  for (int64_t i = 0; i < count; ++i) {
    mjenv_field found = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(env, MJENV_ROLE_GROUPS, i, &found));
    assert_string_equal(found.name, keys[i].name);
    assert_int_equal(found.offset, keys[i].offset);
    assert_int_equal(found.count, keys[i].count);
    assert_int_equal(found.dtype, MJENV_DTYPE_FLOAT64);
    const int64_t frames = keys[i].frames;
    assert_int_equal(found.ndim, frames > 0 ? 2 : 1);
    assert_int_equal(found.shape[0], frames > 0 ? frames : keys[i].count);
    if (frames > 0) assert_int_equal(found.shape[1], keys[i].count / frames);
  }
}

static void test_keys(void** state) {
  static const key groups[] = {{"policy", 0, 8, 0}, {"critic", 8, 8, 0}, {"clock", 16, 1, 0}};
  static const key terms[] = {{"qpos", 0, 5, 0}, {"qvel", 5, 6, 0}};
  mjenv_env* env = env_with(*state, "auto", 0);
  assert_keys(env, groups, COUNT(groups));
  double obs[ROWS][WIDTH], flat[ROWS][WIDTH];
  assert_int_equal(observe_into(env, obs[0], false), WIDTH);
  mjenv_destroy(env);
  env = env_with(*state, "dict", 0);
  assert_keys(env, groups, COUNT(groups));
  mjenv_destroy(env);
  env = env_with(*state, "flat", 0);
  assert_keys(env, groups, 0);
  observe_into(env, flat[0], false);
  assert_same_bits("the flat observation", flat[0], obs[0], ROWS * WIDTH);
  mjenv_destroy(env);

  // Terms without a group are keys by themselves, which only "dict" asks for.
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_string(options, "observation", "dict"));
  env = env_of_options(options, 1);
  assert_keys(env, terms, COUNT(terms));
  mjenv_destroy(env);
  env = env_of_id("Hopper-v5", 1);
  assert_keys(env, terms, 0);
  mjenv_destroy(env);
  options = options_of_id("Hopper-v5");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, "observation", "list"), "observation",
                 "auto, flat, dict");
  mjenv_options_destroy(options);
}

// A history stacks each key by itself, and one of a single Box stacks all.
static void test_history(void** state) {
  static const key stacked[] = {{"policy", 0, 24, STACK}, {"critic", 24, 24, STACK}, {"clock", 48, STACK, STACK}};
  static const key by_term[] = {{"policy", 0, 10, 0}, {"critic", 10, 8, 0}, {"clock", 18, 1, 0}};
  mjenv_options* options = options_of_id(*state);
  assert_ok(mjenv_options_set_string(options, "history", "cart=3"));
  mjenv_env* env = env_of_options(options, ROWS);
  assert_keys(env, by_term, COUNT(by_term));
  mjenv_destroy(env);

  mjenv_env* plain = env_with(*state, "flat", 0);
  mjenv_env* keyed = env_with(*state, "auto", STACK);
  mjenv_env* whole = env_with(*state, "flat", STACK);
  assert_keys(keyed, stacked, COUNT(stacked));
  assert_keys(whole, stacked, 0);
  double frames[STACK][ROWS][WIDTH], got[ROWS][STACK * WIDTH], want[STACK * WIDTH];
  for (int t = 0; t <= LIMIT; ++t) {
    memmove(frames[0], frames[1], (STACK - 1) * sizeof frames[0]);
    observe_into(plain, frames[STACK - 1][0], t > 0);
    for (int i = 0; t == 0 && i < STACK - 1; ++i) memcpy(frames[i], frames[STACK - 1], sizeof frames[0]);
    assert_int_equal(observe_into(keyed, got[0], t > 0), STACK * WIDTH);
    for (int r = 0; r < ROWS; ++r) {
      double* to = want;
      for (size_t k = 0, from = 0; k < COUNT(stacked); ++k) {
        const size_t count = (size_t)stacked[k].count / STACK;
        for (int i = 0; i < STACK; ++i, to += count) memcpy(to, &frames[i][r][from], count * sizeof *to);
        from += count;
      }
      assert_same_bits("stacked keys", got[r], want, STACK * WIDTH);
    }
    observe_into(whole, got[0], t > 0);
    for (int r = 0; r < ROWS; ++r)
      for (int i = 0; i < STACK; ++i) assert_same_bits("stacked frames", &got[r][i * WIDTH], frames[i][r], WIDTH);
  }

  // Without a history, an image fits both kinds of observation; with one, the record differs.
  mjenv_env* dict = env_with(*state, "dict", 0);
  char image[4096];
  int64_t size = 0;
  assert_ok(mjenv_snapshot(plain, 0, image, sizeof image, &size));
  assert_ok(mjenv_restore(dict, 1, image, size));
  assert_ok(mjenv_snapshot(keyed, 0, image, sizeof image, &size));
  assert_ok(mjenv_restore(keyed, 1, image, size));
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(whole, 1, image, size), "options");
  mjenv_destroy(plain);
  mjenv_destroy(keyed);
  mjenv_destroy(whole);
  mjenv_destroy(dict);
}

// A group can be delayed alone, here beginning with the reset's own values, and have a history alone.
static void test_a_group_alone(void** state) {
  (void)state;
  enum { SEEN = WIDTH + 8, BEHIND = 2 };
  mjenv_options* options = options_of_id("Groups-v0");
  assert_ok(mjenv_options_set_string(options, "history", "policy=2"));
  mjenv_env *env = env_of_options(options, ROWS), *plain = env_with("Groups-v0", "flat", 0);
  assert_ok(mjenv_randomize(env, "{\"delay\": {\"observation\": {\"policy\": 2}, \"first_observation\": \"reset\"}}"));
  seed_rows(env, 7);
  double seen[ROWS][SEEN], now[LIMIT][ROWS][WIDTH];
  for (int t = 0; t < LIMIT; ++t) {
    assert_int_equal(observe_into(env, seen[0], t > 0), SEEN);
    assert_int_equal(observe_into(plain, now[t][0], t > 0), WIDTH);
    const int newer = t > BEHIND ? t - BEHIND : 0, older = newer > 0 ? newer - 1 : 0;
    for (int row = 0; row < ROWS; ++row) {
      const double *old = now[older][row], *new = now[newer][row], cart[] = {old[0], new[0]};
      assert_same_bits("cart", seen[row], cart, 2);
      assert_same_bits("older", seen[row] + 2, old + 1, 7);
      assert_same_bits("newer", seen[row] + 9, new + 1, 7);
      assert_same_bits("critic", seen[row] + 16, now[t][row] + 8, WIDTH - 8);
    }
  }
  assert_refused(MJENV_E_NAME, mjenv_randomize(env, "{\"noise\": {\"observation\": {\"critics\": 1}}}"),
                 "noise.observation", "critic");
  assert_refused(MJENV_E_SIZE, mjenv_randomize(env, "{\"noise\": {\"observation\": {\"policy\": [1, 2, 3]}}}"),
                 "noise.observation.policy: 3 numbers, 8", "");
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, "{\"delay\": {\"observation\": {\"policy\": 2, \"clock\": 1}}}"),
                 "delay.observation.clock", "same delay");
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, "{\"delay\": {\"observation\": {\"policy\": [0, -1]}}}"),
                 "delay.observation.policy", "order");
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, "{\"noise\": {\"observation\": {\"policy\": 2, \"cart\": 1}}}"),
                 "noise.observation.cart", "twice");
  mjenv_destroy(env);
  mjenv_destroy(plain);
}

static void assert_bad(const char* id, const term* terms, mjenv_status status, const char* word) {
  mjenv_task task = task_of(id, terms);
  assert_ok(mjenv_register_task(&task));
  mjenv_options* options = options_of_id(id);
  mjenv_env* env = NULL;
  assert_refused(status, mjenv_create(options, 1, &env), id, word);
  mjenv_options_destroy(options);
}

static void test_refusals(void** state) {
  (void)state;
  term terms[TERMS];
  memcpy(terms, usual, sizeof terms);
  terms[1].group = NULL;
  terms[2].group = "policy";
  assert_bad("SplitGroup-v0", terms, MJENV_E_VALUE, "two keys \"policy\"");
  memcpy(terms, usual, sizeof terms);
  terms[4].name = "critic";
  assert_bad("SameName-v0", terms, MJENV_E_VALUE, "two keys \"critic\"");

  mjenv_task task = task_of("BadGroup-v0", usual);
  fields[0].group = "po licy";
  assert_refused(MJENV_E_VALUE, mjenv_register_task(&task), "BadGroup-v0", "the group of field \"cart\"", "blanks");
  task = task_of("BadGroup-v0", usual);
  fields[TERMS] = (mjenv_task_field)MJENV_TASK_FIELD_INIT;
  fields[TERMS].role = MJENV_ROLE_INFO;
  fields[TERMS].name = "height";
  fields[TERMS].group = "critic";
  task.field_count = TERMS + 1;
  assert_refused(MJENV_E_TYPE, mjenv_register_task(&task), "BadGroup-v0", "height", "only terms of the observation");

  mjenv_options* options = options_of_id("Groups-v0");
  assert_ok(mjenv_options_set_integer(options, "time_aware", 1));
  mjenv_env* env = env_of_options(options, 1);
  static const key timed[] = {{"policy", 0, 8, 0}, {"critic", 8, 8, 0}, {"clock", 16, 1, 0}, {"time", 17, 1, 0}};
  assert_keys(env, timed, COUNT(timed));
  mjenv_destroy(env);
  memcpy(terms, usual, sizeof terms);
  terms[0].group = terms[1].group = "time";
  task = task_of("TimeGroup-v0", terms);
  assert_ok(mjenv_register_task(&task));
  options = options_of_id("TimeGroup-v0");
  assert_ok(mjenv_options_set_integer(options, "time_aware", 1));
  assert_refused(MJENV_E_VALUE, mjenv_create(options, 1, &env), "time_aware", "\"time\"");
  mjenv_options_destroy(options);
}

static int32_t reward_of(const void* self, const mjenv_task_api* api, const double* achieved, const double* desired,
                         int64_t size, double* reward) {
  (void)self;
  (void)api;
  (void)size;
  *reward = achieved[0] - desired[0];
  return 0;
}

static void test_rewards_of_goals(void** state) {
  (void)state;
  enum { GOALS = 3 };
  mjenv_env* env = env_of_id("tests/Goal-v0", GOALS);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  struct outputs* out = outputs_of(env);
  assert_ok(mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, &out->batch));
  double achieved[2 * GOALS], desired[2 * GOALS], rewards[GOALS];
  for (int row = 0; row < GOALS; ++row) {
    memcpy(achieved + 2 * row, out->obs + 6 * row, 2 * sizeof(double));
    memcpy(desired + 2 * row, out->obs + 6 * row + 2, 2 * sizeof(double));
  }
  assert_ok(mjenv_compute_reward(env, achieved, desired, 2 * GOALS, rewards, GOALS));
  assert_same_bits("rewards", rewards, out->reward, GOALS);
  const double from[] = {0, 1}, to[] = {0.5, -1};
  assert_ok(mjenv_compute_reward(env, from, to, 2, rewards, 1));
  assert_true(rewards[0] == -4.5);
  assert_refused(MJENV_E_SIZE, mjenv_compute_reward(env, from, to, 2, rewards, 2), "2, not 2 times 2");
  assert_refused(MJENV_E_SIZE, mjenv_compute_reward(env, from, to, -2, rewards, -1), "-2");
  assert_refused(MJENV_E_ARGUMENT, mjenv_compute_reward(env, NULL, to, 2, rewards, 1), "achieved is NULL");
  const double far[] = {10, 0};
  assert_refused(MJENV_E_TASK, mjenv_compute_reward(env, from, far, 2, rewards, 1),
                 "tests/Goal-v0: compute_reward: the goal is out of reach");
  const double bad[] = {NAN, 0};
  assert_refused(MJENV_E_TASK, mjenv_compute_reward(env, from, bad, 2, rewards, 1), "the reward is NaN");
  outputs_free(out);
  mjenv_destroy(env);

  env = env_of_id("Groups-v0", 1);
  assert_refused(MJENV_E_TASK, mjenv_compute_reward(env, from, to, 2, rewards, 1), "Groups-v0 has no compute_reward");
  mjenv_destroy(env);
  term terms[TERMS];
  memcpy(terms, usual, sizeof terms);
  terms[0].name = "achieved_goal", terms[0].group = NULL;
  for (int i = 0; i < 2; ++i) {
    if (i > 0) terms[1].name = "desired_goal", terms[1].group = NULL;
    const char* id = i == 0 ? "OneGoal-v0" : "OtherGoal-v0";
    mjenv_task task = task_of(id, terms);
    task.compute_reward = reward_of;
    assert_ok(mjenv_register_task(&task));
    mjenv_options* options = options_of_id(id);
    assert_refused(MJENV_E_TASK, mjenv_create(options, 1, &env), id,
                   i == 0 ? "no group or term \"desired_goal\"" : "achieved_goal has 1 number(s) and desired_goal 7");
    mjenv_options_destroy(options);
  }
}

// A callback under an option is called if the option is set, whatever its default.
static void test_optional(void** state) {
  static const char* const callbacks[] = {"before_step", "before_substep", "carry", "reset_info", "compute_reward"};
  mjenv_env* env = NULL;
  for (int chosen = 0; chosen < 1 << COUNT(callbacks); ++chosen) {
    mjenv_options* options = options_of_id(*state);
    for (size_t i = 0; i < COUNT(callbacks); ++i)
      assert_ok(mjenv_options_set_integer(options, callbacks[i], chosen >> i & 1));
    env = env_of_options(options, 1);
    struct outputs* out = outputs_of(env);
    assert_ok(mjenv_reset(env, NULL, &out->batch));
    assert_int_equal(mjenv_field_count(env, MJENV_ROLE_RESET_INFO), chosen >> 3 & 1);
    if (chosen & 8) assert_true(out->reset_info[0] == 8);
    const double action = 1, goals[2] = {5, 3};
    assert_ok(mjenv_step(env, NULL, &action, 1, MJENV_DTYPE_FLOAT64, &out->batch));
    const int ctrl = (chosen & 1 ? 3 : 1) + (chosen & 2 ? 4 : 0);
    assert_true(out->reward[0] == 10 * ctrl + (chosen & 4 ? 7 : 0));
    double reward = 0;
    const mjenv_status status = mjenv_compute_reward(env, goals, goals + 1, 1, &reward, 1);
    assert_true(chosen & 16 ? status == MJENV_OK && reward == 2 : status == MJENV_E_TASK);
    outputs_free(out);
    mjenv_destroy(env);
  }
  static const char* const bad[][2] = {{"limited", "calls time_limit only under an option"}, {"asks", "\"asked\""}};
  for (size_t i = 0; i < COUNT(bad); ++i) {
    mjenv_options* options = options_of_id(*state);
    assert_ok(mjenv_options_set_integer(options, bad[i][0], 1));
    assert_int_not_equal(mjenv_create(options, 1, &env), MJENV_OK);
    assert_non_null(strstr(mjenv_last_error(), bad[i][1]));
    mjenv_options_destroy(options);
  }
}

int main(void) {
  const mjenv_task task = task_of("Groups-v0", usual);
  assert_ok(mjenv_register_task(&task));
  assert_ok(mjenv_load_tasks(PLUGINS "/libgroups" PLUGIN_SUFFIX));
  const struct CMUnitTest tests[] = {
      {"keys", test_keys, NULL, NULL, "Groups-v0"},
      {"keys in C++", test_keys, NULL, NULL, "CppGroups-v0"},
      {"history", test_history, NULL, NULL, "Groups-v0"},
      cmocka_unit_test(test_a_group_alone),
      {"history in C++", test_history, NULL, NULL, "CppGroups-v0"},
      cmocka_unit_test(test_refusals),
      cmocka_unit_test(test_rewards_of_goals),
      {"callbacks under options that are off", test_optional, NULL, NULL, "tests/Off-v0"},
      {"callbacks under options that are on", test_optional, NULL, NULL, "tests/On-v0"},
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
