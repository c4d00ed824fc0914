// Memory runs out at every single allocation of every call of the learner in turn: the call fails, nothing else does.
#include <math.h>
#include <sys/resource.h>
#include <unistd.h>

#include "allocator.h"
#include "mjenv/learn.h"
#include "support.h"

enum { ROWS = 3, MOST = 100000 };

static const mjenv_learn_calls calls = MJENV_LEARN_CALLS_INIT;
static const char settings[] = "rollout_steps=8 minibatch_size=10 hidden=8 threads=2";
static char path[] = "/tmp/mjenv-learn-XXXXXX";

static struct {
  mjenv_env *env, *played;
  mjenv_learner *learner, *made;
  mjenv_policy *policy, *parsed;
  char text[1 << 16];
  int64_t size;
  double obs[ROWS * 11];
  float action[ROWS * 3];
} s;

static mjenv_env* env_with(const char* autoreset) {
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", autoreset));
  return env_of_options(options, ROWS);
}

static mjenv_status create(void) {
  mjenv_learner_destroy(s.made);
  s.made = NULL;
  return mjenv_learner_create(&calls, s.env, "Hopper-v5", settings, &s.made);
}

static mjenv_status train(void) { return mjenv_learner_train(s.learner, 1); }
static mjenv_status save(void) { return mjenv_learner_save(s.learner, path, "a note"); }
static mjenv_status load(void) { return mjenv_learner_load(s.learner, path); }
static mjenv_status set_env(void) { return mjenv_learner_set_env(s.learner, s.env); }
static mjenv_status set(void) { return mjenv_learner_set(s.learner, settings); }

static mjenv_status list(void) { return mjenv_learn_settings("Hopper-v5", settings, s.text, sizeof s.text, &s.size); }

static mjenv_status policy(void) {
  return mjenv_learner_policy(s.learner, MJENV_LEARNED_LAST, s.text, sizeof s.text, &s.size);
}

static mjenv_status parse(void) {
  mjenv_policy_destroy(s.parsed);
  s.parsed = NULL;
  return mjenv_policy_parse(s.text, s.size - 1, &s.parsed);
}

static mjenv_status act(void) {
  return mjenv_policy_act(s.policy, MJENV_PRECISION_FLOAT32, ROWS, s.obs, COUNT(s.obs), s.action, COUNT(s.action));
}

static mjenv_status evaluate(void) {
  return mjenv_evaluate(&calls, s.played, s.policy, MJENV_PRECISION_FLOAT64, 1, 1, NULL, NULL);
}

static mjenv_status bad_train(void) { return mjenv_learner_train(s.learner, -1); }

static const struct call {
  const char* name;
  mjenv_status (*run)(void);
  mjenv_status wanted;
  bool file;  // the C++ library reports a stream that finds no memory as one that failed
} all_calls[] = {
    {"create", create, MJENV_OK, false},     {"train", train, MJENV_OK, false},
    {"policy", policy, MJENV_OK, false},     {"parse", parse, MJENV_OK, false},
    {"save", save, MJENV_OK, true},          {"load", load, MJENV_OK, true},
    {"set_env", set_env, MJENV_OK, false},   {"set", set, MJENV_OK, false},
    {"list", list, MJENV_OK, false},         {"act", act, MJENV_OK, false},
    {"evaluate", evaluate, MJENV_OK, false}, {"bad train", bad_train, MJENV_E_VALUE, false},
};

// Runs a call until nothing fails any more. Returns how many allocations failed in turn.
static size_t walk(const struct call* call, enum failing failing, long* lost) {
  *lost = 0;
  for (size_t number = 0; number < MOST; ++number) {
    const long before = allocator_live();
    allocator_arm(failing, number);
    const mjenv_status status = call->run();
    const bool failed = allocator_disarm();
    if (!failed) {
      if (status != call->wanted) fail_msg("%s: %s", call->name, mjenv_learn_last_error());
      return number;
    }
    if (status != call->wanted && status != MJENV_E_MEMORY && !(call->file && status == MJENV_E_FILE))
      fail_msg("%s, allocation %zu: %s: %s", call->name, number, mjenv_status_name(status), mjenv_learn_last_error());
    // What a failed call made must be gone. A successful one may keep its buffers, and create its learner.
    if (status != call->wanted && call->run != create && call->run != parse && allocator_live() > before)
      *lost += allocator_live() - before;
  }
  fail_msg("%s does not end", call->name);
  return 0;
}

static void test_call(void** state) {
  const struct call* call = *state;
  for (int failing = ONE; failing <= ALL; ++failing) {
    long lost = 0;
    walk(call, (enum failing)failing, &lost);  // some things are allocated for good
    const size_t allocations = walk(call, (enum failing)failing, &lost);
    if (lost > 0) fail_msg("%s: %ld blocks were lost", call->name, lost);
    print_message("%s: %zu allocations\n", call->name, allocations);
  }
}

// Creates and destroys, with a failure at each allocation in turn. check: nothing may stay allocated.
static void create_and_destroy(bool check) {
  for (size_t number = 0; number < MOST; ++number) {
    const long before = allocator_live();
    allocator_arm(ONE, number);
    const mjenv_status status = create();
    const bool failed = allocator_disarm();
    mjenv_learner_destroy(s.made);
    s.made = NULL;
    const long lost = allocator_live() - before;
    if (check && lost > 0) fail_msg("allocation %zu: %ld blocks were lost", number, lost);
    if (!failed) {
      assert_int_equal(status, MJENV_OK);
      return;
    }
  }
  fail();
}

static void test_creating_loses_nothing(void** state) {
  (void)state;
  create_and_destroy(false);  // the environment keeps the reason of its last failure
  create_and_destroy(true);
}

// After all these failures, a learner that continues from the checkpoint learns what one without failures learns.
static void test_the_bits_are_the_same(void** state) {
  (void)state;
  mjenv_learner* learner = NULL;
  char* wanted = allocate(sizeof s.text);
  int64_t size = 0;
  mjenv_env* env = env_with("same_step");
  assert_int_equal(mjenv_learner_create(&calls, env, "Hopper-v5", settings, &learner), MJENV_OK);
  assert_int_equal(save(), MJENV_OK);
  assert_int_equal(mjenv_learner_load(learner, path), MJENV_OK);
  assert_int_equal(load(), MJENV_OK);
  assert_int_equal(mjenv_learner_train(learner, 1), MJENV_OK);
  assert_int_equal(train(), MJENV_OK);
  assert_int_equal(mjenv_learner_policy(learner, MJENV_LEARNED_LAST, wanted, sizeof s.text, &size), MJENV_OK);
  assert_int_equal(policy(), MJENV_OK);
  assert_string_equal(s.text, wanted);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  free(wanted);
}

// A short text that claims to have huge layers is refused for what it lacks, without memory for what it claims.
static void test_claims_take_no_memory(void** state) {
  (void)state;
  char text[1000] =
      "mjenv-policy 1\nid Some-v0\nmean 0\nscale 1\nclip 10\nlow -1\nhigh 1\nlayer 1048576 200 tanh\nweights";
  for (int i = 0; i < 200; ++i) strcat(text, " 0");
  long pages = 0;
  FILE* file = fopen("/proc/self/statm", "r");
  assert_int_equal(fscanf(file, "%ld", &pages), 1);
  fclose(file);
  struct rlimit before, small;
  assert_int_equal(getrlimit(RLIMIT_AS, &before), 0);
  small = before;
  small.rlim_cur = (rlim_t)(pages * sysconf(_SC_PAGESIZE)) + (64 << 20);
  assert_int_equal(setrlimit(RLIMIT_AS, &small), 0);
  mjenv_policy* parsed = NULL;
  const mjenv_status status = mjenv_policy_parse(text, (int64_t)strlen(text), &parsed);
  assert_int_equal(setrlimit(RLIMIT_AS, &before), 0);
  assert_int_equal(status, MJENV_E_VALUE);
  assert_non_null(strstr(mjenv_learn_last_error(), "layer 1 has 1 of 1048576 lines \"weights\""));
}

static int set_up(void** state) {
  (void)state;
  const int file = mkstemp(path);
  close(file);
  s.env = env_with("same_step");
  s.played = env_with("disabled");
  if (mjenv_learner_create(&calls, s.env, "Hopper-v5", settings, &s.learner)) return 1;
  if (save() || policy() || mjenv_policy_parse(s.text, s.size - 1, &s.policy)) return 1;
  return 0;
}

static int tear_down(void** state) {
  (void)state;
  mjenv_learner_destroy(s.learner);
  mjenv_learner_destroy(s.made);
  mjenv_policy_destroy(s.policy);
  mjenv_policy_destroy(s.parsed);
  mjenv_destroy(s.env);
  mjenv_destroy(s.played);
  return remove(path);
}

int main(void) {
  struct CMUnitTest tests[COUNT(all_calls) + 3];
  for (size_t i = 0; i < COUNT(all_calls); ++i)
    tests[i] = (struct CMUnitTest){all_calls[i].name, test_call, NULL, NULL, (void*)(uintptr_t)&all_calls[i]};
  tests[COUNT(all_calls)] = (struct CMUnitTest)cmocka_unit_test(test_creating_loses_nothing);
  tests[COUNT(all_calls) + 1] = (struct CMUnitTest)cmocka_unit_test(test_the_bits_are_the_same);
  tests[COUNT(all_calls) + 2] = (struct CMUnitTest)cmocka_unit_test(test_claims_take_no_memory);
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
