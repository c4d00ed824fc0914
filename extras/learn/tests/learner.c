// The learner's interface: what it learns, the same bits however it computes, checkpoints, and what it refuses.
//   test_learn_learner [short]    short: without the training that takes longest, for sanitizers
#define _GNU_SOURCE
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "mjenv/learn.h"
#include "support.h"

enum { TEXT = 1 << 20 };

static const mjenv_learn_calls calls = MJENV_LEARN_CALLS_INIT;

// assert_ok and assert_refused with this library's messages.
#define ok(call) learn_status(MJENV_OK, (call), #call, __LINE__, "")
#define refused(status, call, word) learn_status((status), (call), #call, __LINE__, (word))

static void learn_status(mjenv_status wanted, mjenv_status got, const char* call, int line, const char* word) {
  const char* reason = mjenv_learn_last_error();
  if (got != wanted || (wanted != MJENV_OK && !strstr(reason, word)))
    fail_msg("line %d: %s gives %s \"%s\", not %s with \"%s\"", line, call, mjenv_status_name(got), reason,
             mjenv_status_name(wanted), word);
}

static mjenv_env* env_of(const char* id, int64_t rows, int threads, const char* autoreset) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", autoreset));
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  return env_of_options(options, rows);
}

// Settings of short trainings in 20 rows of Hopper-v5, with episodes that end and minibatches that do not divide the
// rollout; `others` follow them.
static const char* short_settings(const char* others) {
  static char words[4][512];
  static int next;
  char* to = words[next++ % 4];
  snprintf(to, sizeof words[0], "rollout_steps=25 minibatch_size=130 epochs=2 steps=4000 hidden=24,16 seed=3 %s",
           others);
  return to;
}

static mjenv_learner* learner_of(mjenv_env* env, const char* others) {
  mjenv_learner* learner = NULL;
  ok(mjenv_learner_create(&calls, env, "Hopper-v5", short_settings(others), &learner));
  return learner;
}

// The policy's text, to be freed.
static char* policy_of(const mjenv_learner* learner) {
  int64_t size = 0;
  ok(mjenv_learner_policy(learner, MJENV_LEARNED_LAST, NULL, 0, &size));
  char* text = allocate((size_t)size);
  ok(mjenv_learner_policy(learner, MJENV_LEARNED_LAST, text, size, &size));
  assert_int_equal(strlen(text) + 1, size);
  return text;
}

static mjenv_learn_report report_of(const mjenv_learner* learner) {
  mjenv_learn_report report = MJENV_LEARN_REPORT_INIT;
  ok(mjenv_learner_report(learner, &report));
  return report;
}

static void assert_same_policy(const char* what, const mjenv_learner* learner, const char* wanted) {
  char* got = policy_of(learner);
  if (strcmp(got, wanted) != 0) fail_msg("%s: the policy has other bits", what);
  free(got);
}

// A file in a folder of the test's own.
static const char* path_of(const char* name) {
  static char path[4][256];
  static int next;
  char* to = path[next++ % 4];
  snprintf(to, 256, "%s/%s", getenv("LEARN_FOLDER"), name);
  return to;
}

// ---- Learning ----

static void test_learns(void** state) {
  (void)state;
  mjenv_env* env = env_of("InvertedPendulum-v5", 8, 1, "same_step");
  mjenv_learner* learner = NULL;
  ok(mjenv_learner_create(&calls, env, "InvertedPendulum-v5", NULL, &learner));
  assert_true(isnan(report_of(learner).mean_return));
  ok(mjenv_learner_train(learner, 100000));
  const mjenv_learn_report report = report_of(learner);
  assert_true(report.mean_return == 1000 && report.mean_length == 1000);
  assert_true(report.steps >= 100000 && report.updates * 2048 == report.steps);
  assert_true(report.std < 0.5 && report.entropy < 1 && report.approx_kl >= 0 && report.grad_norm > 0);
  mjenv_learn_report first = MJENV_LEARN_REPORT_INIT;
  ok(mjenv_learner_report_at(learner, 1, &first));
  assert_true(first.steps == 2048 && first.mean_return < 100 && first.learning_rate == 1e-3);
  refused(MJENV_E_VALUE, mjenv_learner_report_at(learner, report.updates + 1, &first), "not 1 to");

  ok(mjenv_learner_save_policy(learner, MJENV_LEARNED_BEST, path_of("policy.txt")));
  mjenv_policy* policy = NULL;
  ok(mjenv_policy_load(path_of("policy.txt"), &policy));
  assert_string_equal(mjenv_policy_id(policy), "InvertedPendulum-v5");
  // The same episodes with any number of rows and threads.
  double returns[3][20];
  int64_t lengths[20];
  const int64_t rows[] = {20, 1, 3};
  for (int i = 0; i < 3; ++i) {
    mjenv_env* played = env_of("InvertedPendulum-v5", rows[i], i + 1, "disabled");
    ok(mjenv_evaluate(&calls, played, policy, MJENV_PRECISION_FLOAT64, 100, 20, returns[i], lengths));
    for (int k = 0; k < 20; ++k) assert_true(returns[i][k] == 1000 && lengths[k] == 1000);
    ok(mjenv_evaluate(&calls, played, policy, MJENV_PRECISION_FLOAT32, 100, 5, NULL, NULL));
    mjenv_destroy(played);
  }
  mjenv_policy_destroy(policy);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
}

// Trains and returns the policy.
static char* trained(const char* others, int env_threads, int64_t steps) {
  mjenv_env* env = env_of("Hopper-v5", 20, env_threads, "same_step");
  mjenv_learner* learner = learner_of(env, others);
  ok(mjenv_learner_train(learner, steps));
  char* text = policy_of(learner);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  return text;
}

static void test_same_bits(void** state) {
  (void)state;
  char* wanted = trained("", 1, 2000);
  const char* const instructions[] = {"auto", "sse2", "avx2", "avx512", "neon"};
  int compared = 0;
  for (size_t i = 0; i < COUNT(instructions); ++i) {
    char others[64];
    snprintf(others, sizeof others, "instructions=%s threads=%d", instructions[i], 1 + compared);
    mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
    mjenv_learner* learner = NULL;
    const bool usable = mjenv_learner_create(&calls, env, "Hopper-v5", short_settings(others), &learner) == MJENV_OK;
    if (!usable) assert_non_null(strstr(mjenv_learn_last_error(), "this CPU has"));
    mjenv_learner_destroy(learner);
    mjenv_destroy(env);
    if (!usable) continue;
    char* got = trained(others, 1 + compared, 2000);
    assert_string_equal(got, wanted);
    free(got);
    ++compared;
  }
  assert_true(compared >= 2);
  char* other = trained("seed=4", 1, 2000);
  assert_string_not_equal(other, wanted);
  free(other);
  free(wanted);
}

// Threads share the evaluation of large networks.
static void test_same_bits_of_large_networks(void** state) {
  (void)state;
  char* policies[] = {trained("hidden=512,512", 1, 500), trained("hidden=512,512 threads=2", 1, 500)};
  assert_string_equal(policies[1], policies[0]);
  free(policies[1]);
  free(policies[0]);
}

// ---- Rows that the caller steps ----

struct stepped {
  double obs[20 * 11], final_obs[20 * 11], reward[20];
  uint8_t terminated[20], truncated[20];
  mjenv_batch batch;
  float action[20 * 3];
};

static struct stepped* stepped_rows(void) {
  struct stepped* rows = allocate(sizeof *rows);
  memset(rows, 0, sizeof *rows);
  rows->batch = (mjenv_batch)MJENV_BATCH_INIT;
  rows->batch.rows = 20;
  rows->batch.obs_count = 11;
  rows->batch.obs = rows->obs;
  rows->batch.final_obs = rows->final_obs;
  rows->batch.reward = rows->reward;
  rows->batch.terminated = rows->terminated;
  rows->batch.truncated = rows->truncated;
  return rows;
}

static mjenv_learner* learner_apart(mjenv_env* env, struct stepped* rows) {
  mjenv_space observation = MJENV_SPACE_INIT, action = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &observation));
  assert_ok(mjenv_space_of(env, MJENV_ROLE_ACTION, &action));
  seed_rows(env, 3);
  assert_ok(mjenv_reset(env, NULL, &rows->batch));
  mjenv_learner* learner = NULL;
  ok(mjenv_learner_create_apart(&observation, &action, "Hopper-v5", short_settings(""), rows->obs, COUNT(rows->obs),
                                &learner));
  return learner;
}

static void step_apart(mjenv_env* env, mjenv_learner* learner, struct stepped* rows) {
  ok(mjenv_learner_act(learner, rows->action, COUNT(rows->action)));
  assert_ok(mjenv_step(env, NULL, rows->action, COUNT(rows->action), MJENV_DTYPE_FLOAT32, &rows->batch));
}

static void test_rows_of_the_caller(void** state) {
  (void)state;
  char* wanted = trained("", 1, 2000);
  struct stepped* rows = stepped_rows();
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_apart(env, rows);
  static const char* const names[] = {"qpos", "qvel"};
  static const int64_t counts[] = {5, 6};
  ok(mjenv_learner_describe(learner, NULL, names, counts, 2));
  refused(MJENV_E_VALUE, mjenv_learner_train(learner, 1), "mjenv_learner_act");
  refused(MJENV_E_VALUE, mjenv_learner_feed(learner, &rows->batch), "no actions");
  for (int step = 0; step < 100; ++step) {
    step_apart(env, learner, rows);
    refused(MJENV_E_VALUE, mjenv_learner_act(learner, rows->action, COUNT(rows->action)), "no outcome");
    ok(mjenv_learner_feed(learner, &rows->batch));
  }
  assert_same_policy("stepped by the caller", learner, wanted);
  // An observation that is not finite, in a rollout under way.
  step_apart(env, learner, rows);
  ok(mjenv_learner_feed(learner, &rows->batch));
  step_apart(env, learner, rows);
  rows->obs[3 * 11 + 5] = NAN;
  refused(MJENV_E_VALUE, mjenv_learner_feed(learner, &rows->batch), "row 3, step 102 of the training: obs[5] is nan");
  refused(MJENV_E_VALUE, mjenv_learner_act(learner, rows->action, COUNT(rows->action)), "mjenv_learner_restart");
  assert_same_policy("after an error", learner, wanted);
  refused(MJENV_E_VALUE, mjenv_learner_restart(learner, rows->obs, COUNT(rows->obs)), "row 3");
  assert_ok(mjenv_reset(env, NULL, &rows->batch));
  refused(MJENV_E_SIZE, mjenv_learner_restart(learner, rows->obs, 11), "obs_count is 11");
  ok(mjenv_learner_restart(learner, rows->obs, COUNT(rows->obs)));
  for (int step = 0; step < 25; ++step) {
    step_apart(env, learner, rows);
    ok(mjenv_learner_feed(learner, &rows->batch));
  }
  assert_int_equal(report_of(learner).updates, 5);
  // Sums and squares of larger numbers would be infinite, and such a policy could not be read.
  for (int i = 0; i < 2; ++i) {
    char* before = policy_of(learner);
    rows->obs[3 * 11 + 5] = i == 0 ? 1e300 : -1.1e100;
    ok(mjenv_learner_act(learner, rows->action, COUNT(rows->action)));
    refused(MJENV_E_VALUE, mjenv_learner_feed(learner, &rows->batch), "not a number from -1e100 to 1e100");
    assert_same_policy("after a huge observation", learner, before);
    free(before);
    rows->obs[3 * 11 + 5] = 0;
    ok(mjenv_learner_restart(learner, rows->obs, COUNT(rows->obs)));
  }
  for (int step = 0; step < 25; ++step) {
    ok(mjenv_learner_act(learner, rows->action, COUNT(rows->action)));
    for (int i = 0; i < 20; ++i) {
      rows->obs[i * 11 + 5] = i % 2 == 0 ? 1e100 : -1e100;
      rows->reward[i] = i % 2 == 0 ? 1e100 : -1e100;
    }
    ok(mjenv_learner_feed(learner, &rows->batch));
  }
  ok(mjenv_learner_save(learner, path_of("good"), NULL));
  ok(mjenv_learner_load(learner, path_of("good")));
  char* text = policy_of(learner);
  mjenv_policy* policy = NULL;
  ok(mjenv_policy_parse(text, (int64_t)strlen(text), &policy));
  mjenv_policy_destroy(policy);
  free(text);
  rows->reward[19] = -INFINITY;
  ok(mjenv_learner_act(learner, rows->action, COUNT(rows->action)));
  refused(MJENV_E_VALUE, mjenv_learner_feed(learner, &rows->batch),
          "row 19, step 151 of the training: the reward is -inf");
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  free(rows);
  free(wanted);
}

// A truncated episode is valued by the critic, a terminated one is not: they lead to different policies.
static void test_truncation(void** state) {
  (void)state;
  char* policies[2];
  for (int truncated = 0; truncated < 2; ++truncated) {
    struct stepped* rows = stepped_rows();
    mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
    mjenv_learner* learner = learner_apart(env, rows);
    for (int step = 0; step < 25; ++step) {
      step_apart(env, learner, rows);
      for (int row = 0; row < 20; ++row) {
        rows->truncated[row] = step == 12 && truncated;
        rows->terminated[row] = step == 12 && !truncated;
      }
      if (step == 12) memcpy(rows->final_obs, rows->obs, sizeof rows->obs);
      ok(mjenv_learner_feed(learner, &rows->batch));
    }
    assert_true(report_of(learner).episodes >= 20);
    policies[truncated] = policy_of(learner);
    mjenv_learner_destroy(learner);
    mjenv_destroy(env);
    free(rows);
  }
  assert_string_not_equal(policies[0], policies[1]);
  free(policies[0]);
  free(policies[1]);
}

// ---- Checkpoints ----

static void test_resume(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "");
  ok(mjenv_learner_train(learner, 1000));
  ok(mjenv_learner_save(learner, path_of("checkpoint"), NULL));
  ok(mjenv_learner_train(learner, 1500));
  char* wanted = policy_of(learner);
  const mjenv_learn_report report = report_of(learner);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);

  env = env_of("Hopper-v5", 20, 2, "same_step");
  learner = learner_of(env, "threads=2 seed=99");  // the checkpoint's random state replaces the seed
  ok(mjenv_learner_load(learner, path_of("checkpoint")));
  assert_int_equal(report_of(learner).updates, 2);
  ok(mjenv_learner_train(learner, 1500));
  assert_same_policy("resumed", learner, wanted);
  const mjenv_learn_report again = report_of(learner);
  assert_memory_equal(&again, &report, sizeof report);
  // Back again, in a learner that has trained further.
  ok(mjenv_learner_load(learner, path_of("checkpoint")));
  ok(mjenv_learner_train(learner, 1500));
  assert_same_policy("resumed twice", learner, wanted);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  free(wanted);
}

static void write_file(const char* path, const char* content, size_t size) {
  FILE* file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(content, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
}

static void test_bad_checkpoints(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "");
  ok(mjenv_learner_train(learner, 500));
  char* wanted = policy_of(learner);
  ok(mjenv_learner_save(learner, path_of("good"), "speed=2"));
  size_t size = 0;
  char* content = read_file(path_of("good"), &size);
  refused(MJENV_E_FILE, mjenv_learner_load(learner, path_of("missing")), "No such file");
  refused(MJENV_E_FILE, mjenv_learner_load(learner, path_of("")), "");
  int64_t needed = 0;
  char note[8];
  ok(mjenv_checkpoint_note(path_of("good"), note, sizeof note, &needed));
  assert_string_equal(note, "speed=2");
  assert_int_equal(needed, sizeof note);
  refused(MJENV_E_SIZE, mjenv_checkpoint_note(path_of("good"), note, 7, &needed), "8");
  refused(MJENV_E_FILE, mjenv_checkpoint_note(path_of("missing"), note, 8, &needed), "No such file");
  refused(MJENV_E_ARGUMENT, mjenv_checkpoint_note(NULL, note, 8, &needed), "path is NULL");
  for (int place = 1; place <= 4; ++place) {  // bits turn somewhere
    const size_t at = size * (size_t)place / 5;
    content[at] ^= 16;
    write_file(path_of("bad"), content, size);
    content[at] ^= 16;
    refused(MJENV_E_SNAPSHOT, mjenv_learner_load(learner, path_of("bad")), "checksum");
    refused(MJENV_E_SNAPSHOT, mjenv_checkpoint_note(path_of("bad"), NULL, 0, &needed), "checksum");
  }
  for (size_t cut = 0; cut < size; cut += size / 7) {
    write_file(path_of("bad"), content, cut);
    refused(MJENV_E_SNAPSHOT, mjenv_learner_load(learner, path_of("bad")), cut < 400 ? "no checkpoint" : "checksum");
  }
  assert_same_policy("after bad checkpoints", learner, wanted);
  ok(mjenv_learner_load(learner, path_of("good")));
  // Settings are compared by name. One that did not exist when the checkpoint was saved had its default; the library
  // does not know one that was added later.
  char* window = strstr(content, "window 20\n");
  assert_non_null(window);
  memcpy(window, "future 99\n", 10);
  write_file(path_of("bad"), content, size);
  refused(MJENV_E_SNAPSHOT, mjenv_learner_load(learner, path_of("bad")), "it has \"future 99\", this one \"\"");
  memmove(window, window + 10, size - (size_t)(window + 10 - content));
  write_file(path_of("bad"), content, size - 10);
  ok(mjenv_learner_load(learner, path_of("bad")));
  // Other learners.
  mjenv_learner* second = learner_of(env, "hidden=24");
  refused(MJENV_E_SNAPSHOT, mjenv_learner_load(second, path_of("good")), "\"hidden 24,16\", this one \"hidden 24\"");
  mjenv_learner_destroy(second);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  env = env_of("Walker2d-v5", 20, 1, "same_step");
  ok(mjenv_learner_create(&calls, env, "Walker2d-v5", short_settings(""), &second));
  refused(MJENV_E_SNAPSHOT, mjenv_learner_load(second, path_of("good")),
          "\"id Hopper-v5\", this one \"id Walker2d-v5\"");
  ok(mjenv_learner_train(second, 500));
  mjenv_learner_destroy(second);
  mjenv_destroy(env);
  // The same sizes, but another model: its image does not fit.
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", "same_step"));
  assert_ok(mjenv_options_set_integer(options, "frame_skip", 3));
  env = env_of_options(options, 20);
  second = learner_of(env, "");
  char* before = policy_of(second);
  refused(MJENV_E_SNAPSHOT, mjenv_learner_load(second, path_of("good")), "");
  assert_same_policy("after another model's checkpoint", second, before);
  ok(mjenv_learner_train(second, 500));
  mjenv_learner_destroy(second);
  mjenv_destroy(env);
  free(before);
  free(content);
  free(wanted);
}

// FNV-1a.
static uint64_t checksum(const char* bytes, size_t size) {
  uint64_t sum = 0xcbf29ce484222325;
  for (size_t i = 0; i < size; ++i) sum = (sum ^ (uint8_t)bytes[i]) * 0x100000001b3;
  return sum;
}

// A checkpoint without a note: where its checksum and its state begin, and the learner that refuses it once it is changed.
struct forged {
  mjenv_learner* learner;
  char* content;
  size_t size, sum, state;
};

// Replaces bytes of the checkpoint, and expects that it is refused. size: how long the checkpoint shall be.
static void assert_forged(const struct forged* f, const char* name, size_t at, const void* bytes, size_t count,
                          size_t size) {
  char* content = allocate(size + 1);
  memset(content, 0, size);
  memcpy(content, f->content, size < f->size ? size : f->size);
  memcpy(content + at, bytes, count);
  const uint64_t sum = checksum(content + f->sum + sizeof sum, size - f->sum - sizeof sum);
  memcpy(content + f->sum, &sum, sizeof sum);
  write_file(path_of("bad"), content, size);
  free(content);
  const mjenv_status status = mjenv_learner_load(f->learner, path_of("bad"));
  if (status != MJENV_E_SNAPSHOT || !strstr(mjenv_learn_last_error(), "damaged"))
    fail_msg("%s: %s \"%s\"", name, mjenv_status_name(status), mjenv_learn_last_error());
}

// What the state consists of, in the order of the file, and values that no learner gives these numbers. kind: r for a
// report, f for float, d for double, i for int32, q for int64, b for a byte. A vector comes after its length.
static const struct part {
  const char* name;
  bool is_vector, has_padding;
  char kind;
  double bad[3];
} parts[] = {
    {"curve", true, false, 'r', {0}},
    {"random state", false, false, 'q', {0}},
    {"has kept", false, false, 'q', {2, -1, 9e18}},
    {"kept", false, false, 'd', {NAN, 1e9, -INFINITY}},
    {"parameters", true, true, 'f', {NAN, INFINITY, -INFINITY}},
    {"first moments", true, true, 'f', {NAN, INFINITY, -INFINITY}},
    {"second moments", true, true, 'f', {NAN, -1, -INFINITY}},
    {"power 1", false, false, 'd', {NAN, -1e-3, 1.5}},
    {"power 2", false, false, 'd', {NAN, -1e-3, 1.5}},
    {"mean", true, false, 'd', {NAN, 1e300, -INFINITY}},
    {"variance", true, false, 'd', {NAN, -1e-3, 1e300}},
    {"count", false, false, 'd', {NAN, 0, -1}},
    {"mean of returns", true, false, 'd', {NAN, 1e300, -INFINITY}},
    {"variance of returns", true, false, 'd', {NAN, -1e-3, 1e300}},
    {"count of returns", false, false, 'd', {NAN, 0, -1}},
    {"discounted returns", true, false, 'd', {NAN, 1e300, -INFINITY}},
    {"totals", true, false, 'd', {NAN, 1e300, -INFINITY}},
    {"steps", true, false, 'q', {-1, -9e18, 9e18}},
    {"returns", true, false, 'd', {NAN, 1e300, -INFINITY}},
    {"lengths", true, false, 'd', {NAN, -1, INFINITY}},
    {"episodes", false, false, 'q', {-2, -9e18, 9e18}},
    {"inputs", true, true, 'f', {NAN, INFINITY, -INFINITY}},
    {"order", true, false, 'i', {-1, 500, 2147483647}},
    {"best return", false, false, 'd', {NAN, INFINITY, 1e300}},
    {"best parameters", true, false, 'f', {NAN, INFINITY, -INFINITY}},
    {"best mean", true, false, 'd', {NAN, 1e300, -INFINITY}},
    {"best scale", true, false, 'd', {NAN, 0, -1}},
    {"image", true, false, 'b', {0}},
};

static size_t size_of(char kind) {
  return kind == 'r' ? sizeof(mjenv_learn_report) : kind == 'b' ? 1 : kind == 'f' || kind == 'i' ? 4 : 8;
}

static void assert_bad_numbers(const struct forged* f, const struct part* part, size_t at) {
  for (int k = 0; k < 3 && part->bad[k] != 0; ++k) {
    const float single = (float)part->bad[k];
    const int32_t small = part->kind == 'i' ? (int32_t)part->bad[k] : 0;
    const int64_t large = part->kind == 'q' ? (int64_t)part->bad[k] : 0;
    const void* bytes = part->kind == 'f'   ? (const void*)&single
                        : part->kind == 'i' ? (const void*)&small
                        : part->kind == 'q' ? (const void*)&large
                                            : (const void*)&part->bad[k];
    assert_forged(f, part->name, at, bytes, size_of(part->kind), f->size);
  }
}

// The checksum of a stranger's checkpoint is right. Whatever number it holds, it is a learner's or it is refused.
static void test_forged_checkpoints(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  struct forged f = {.learner = learner_of(env, "")};
  ok(mjenv_learner_train(f.learner, 1500));
  ok(mjenv_learner_save(f.learner, path_of("good"), NULL));
  f.content = read_file(path_of("good"), &f.size);
  f.sum = (size_t)(strstr(f.content, "\n\n") - f.content) + 2;
  f.state = f.sum + 2 * sizeof(uint64_t);  // after the note's size
  char* wanted = policy_of(f.learner);
  size_t at = f.state;
  for (size_t i = 0; i < COUNT(parts); ++i) {
    const struct part* part = &parts[i];
    const size_t each = size_of(part->kind);
    uint64_t count = 1;
    if (part->is_vector) {
      memcpy(&count, f.content + at, sizeof count);
      const uint64_t lengths[] = {count - 1, count + 1, 0, UINT64_MAX, UINT64_MAX / 8 + 1, (uint64_t)1 << 40};
      for (size_t k = 0; k < COUNT(lengths); ++k)
        if (part->kind != 'b' || lengths[k] != count - 1)  // the environment's image is refused in other words
          assert_forged(&f, part->name, at, &lengths[k], sizeof count, f.size);
      at += sizeof count;
    }
    assert_bad_numbers(&f, part, at);
    assert_bad_numbers(&f, part, at + (count - 1) * each);
    const float one = 1;
    if (part->has_padding) assert_forged(&f, part->name, at + (count - 1) * each, &one, sizeof one, f.size);
    if (part->kind == 'i') assert_forged(&f, part->name, at, f.content + at + 4, 4, f.size);  // one step twice
    if (part->kind == 'r') {
      const size_t members[] = {offsetof(mjenv_learn_report, struct_size), offsetof(mjenv_learn_report, reserved),
                                offsetof(mjenv_learn_report, updates),     offsetof(mjenv_learn_report, steps),
                                offsetof(mjenv_learn_report, episodes),    offsetof(mjenv_learn_report, epochs)};
      for (size_t k = 0; k < COUNT(members); ++k)
        assert_forged(&f, part->name, at + each + members[k], "\xff\xff\xff\xff\xff\xff\xff\xff", k < 2 ? 4 : 8,
                      f.size);
      const int64_t more = (int64_t)1 << 62;
      assert_forged(&f, "more episodes than steps", at + each + members[4], &more, sizeof more, f.size);
    }
    at += count * each;
  }
  assert_int_equal(at, f.size);
  const uint64_t too_long = f.size;
  assert_forged(&f, "note", f.sum + 8, &too_long, 8, f.size);
  assert_forged(&f, "too long", f.state, f.content + f.state, 1, f.size + 1);
  for (size_t cut = f.state; cut < f.size; cut += 1 + (f.size - f.state) / 50)
    assert_forged(&f, "cut", f.sum, f.content + f.sum, 8, cut);
  assert_same_policy("after forged checkpoints", f.learner, wanted);
  ok(mjenv_learner_load(f.learner, path_of("good")));
  ok(mjenv_learner_train(f.learner, 500));
  mjenv_learner_destroy(f.learner);
  mjenv_destroy(env);
  free(f.content);
  free(wanted);
}

// Only files are read and replaced, and nobody waits for a pipe. Links that lie where a file is written first are not
// followed.
static void test_no_files(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "");
  assert_int_equal(mkfifo(path_of("pipe"), 0600), 0);
  mjenv_policy* policy = NULL;
  int64_t needed = 0;
  const char* const others[] = {path_of("pipe"), "/dev/zero", "/"};
  for (size_t i = 0; i < COUNT(others); ++i) {
    refused(MJENV_E_FILE, mjenv_learner_load(learner, others[i]), "it is no regular file");
    refused(MJENV_E_FILE, mjenv_checkpoint_note(others[i], NULL, 0, &needed), "it is no regular file");
    refused(MJENV_E_FILE, mjenv_policy_load(others[i], &policy), "it is no regular file");
  }
  refused(MJENV_E_FILE, mjenv_learner_save(learner, path_of("pipe"), NULL), "it is no regular file");
  refused(MJENV_E_FILE, mjenv_learner_save_policy(learner, MJENV_LEARNED_LAST, path_of("pipe")), "no regular file");
  write_file(path_of("bad"), "", 0);  // and has no end
  assert_int_equal(truncate(path_of("bad"), (off_t)1 << 40), 0);
  refused(MJENV_E_VALUE, mjenv_policy_load(path_of("bad"), &policy), "the limit is 268435456");
  refused(MJENV_E_MEMORY, mjenv_learner_load(learner, path_of("bad")), "the limit is");
  assert_null(policy);

  write_file(path_of("mine"), "mine", 4);
  assert_int_equal(symlink(path_of("mine"), path_of("kept.partial")), 0);
  assert_int_equal(symlink(path_of("mine"), path_of("kept.txt.partial")), 0);
  ok(mjenv_learner_save(learner, path_of("kept"), NULL));
  ok(mjenv_learner_save_policy(learner, MJENV_LEARNED_LAST, path_of("kept.txt")));
  ok(mjenv_learner_load(learner, path_of("kept")));
  ok(mjenv_policy_load(path_of("kept.txt"), &policy));
  size_t size = 0;
  char* content = read_file(path_of("mine"), &size);
  assert_int_equal(size, 4);
  assert_memory_equal(content, "mine", 4);
  free(content);
  const char* const left[] = {"pipe", "mine", "kept.partial", "kept.txt.partial"};
  for (size_t i = 0; i < COUNT(left); ++i) assert_int_equal(remove(path_of(left[i])), 0);
  mjenv_policy_destroy(policy);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
}

// A file that may not grow stands for a disk that is full: the old file stays, and no other is left.
static void test_full_disk(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "");
  ok(mjenv_learner_save(learner, path_of("kept"), NULL));
  ok(mjenv_learner_save_policy(learner, MJENV_LEARNED_LAST, path_of("kept.txt")));
  ok(mjenv_learner_train(learner, 500));
  struct rlimit before, small;
  assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
  small = before;
  small.rlim_cur = 1000;
  void (*handler)(int) = signal(SIGXFSZ, SIG_IGN);
  assert_int_equal(setrlimit(RLIMIT_FSIZE, &small), 0);
  const mjenv_status saved = mjenv_learner_save(learner, path_of("kept"), NULL);
  char reason[1000];
  snprintf(reason, sizeof reason, "%s", mjenv_learn_last_error());
  const mjenv_status policy = mjenv_learner_save_policy(learner, MJENV_LEARNED_LAST, path_of("kept.txt"));
  assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
  signal(SIGXFSZ, handler);
  assert_int_equal(saved, MJENV_E_FILE);
  assert_int_equal(policy, MJENV_E_FILE);
  assert_non_null(strstr(reason, "File too large"));
  assert_int_equal(access(path_of("kept.partial"), F_OK), -1);
  assert_int_equal(access(path_of("kept.txt.partial"), F_OK), -1);
  ok(mjenv_learner_load(learner, path_of("kept")));
  assert_int_equal(report_of(learner).updates, 0);
  refused(MJENV_E_FILE, mjenv_learner_save(learner, "/no such folder/file", NULL), "No such file or directory");
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
}

// ---- Environments ----

// With a huge weight of the action, rewards are infinite.
static void test_infinite_rewards(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Hopper-v5");
  const double huge = 1.7e308;
  assert_ok(mjenv_options_set_reals(options, "ctrl_cost_weight", &huge, 1));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", "same_step"));
  mjenv_env* bad = env_of_options(options, 20);
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "");
  ok(mjenv_learner_train(learner, 500));
  ok(mjenv_learner_set_env(learner, bad));
  char* before = policy_of(learner);
  for (int i = 0; i < 2; ++i) {
    refused(MJENV_E_VALUE, mjenv_learner_train(learner, 500), "of the training: the reward is -");
    assert_non_null(strstr(mjenv_learn_last_error(), "row "));
    assert_same_policy("after infinite rewards", learner, before);
    ok(mjenv_learner_save(learner, path_of("after"), NULL));
  }
  ok(mjenv_learner_set_env(learner, env));
  ok(mjenv_learner_train(learner, 500));
  assert_int_equal(report_of(learner).updates, 2);
  mjenv_env* few = env_of("Hopper-v5", 19, 1, "same_step");
  refused(MJENV_E_SIZE, mjenv_learner_set_env(learner, few), "19");
  mjenv_env* other = env_of("Walker2d-v5", 20, 1, "same_step");
  refused(MJENV_E_VALUE, mjenv_learner_set_env(learner, other), "other spaces");
  mjenv_env* disabled = env_of("Hopper-v5", 20, 1, "disabled");
  refused(MJENV_E_VALUE, mjenv_learner_set_env(learner, disabled), "not \"same_step\"");
  ok(mjenv_learner_train(learner, 500));
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  mjenv_destroy(bad);
  mjenv_destroy(few);
  mjenv_destroy(other);
  mjenv_destroy(disabled);
  free(before);
}

// With a huge weight of the value, gradients are infinite.
static void test_infinite_weights(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "");
  ok(mjenv_learner_train(learner, 500));
  char* before = policy_of(learner);
  ok(mjenv_learner_set(learner, "value_coef=1e300"));
  for (int i = 0; i < 2; ++i) {
    refused(MJENV_E_VALUE, mjenv_learner_train(learner, 500), "update 2 made weights of the networks infinite");
    assert_same_policy("after infinite weights", learner, before);
  }
  ok(mjenv_learner_set(learner, "value_coef=0.5"));
  ok(mjenv_learner_train(learner, 500));
  assert_int_equal(report_of(learner).updates, 2);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  free(before);
}

static void test_infinite_spaces(void** state) {
  (void)state;
  double low[] = {-1, -INFINITY}, high[] = {1, 2}, obs[20] = {0};
  mjenv_space observation = MJENV_SPACE_INIT, action = MJENV_SPACE_INIT;
  observation.count = 1;
  observation.low = low;
  observation.high = high;
  action = observation;
  action.count = 2;
  mjenv_learner* learner = NULL;
  refused(MJENV_E_VALUE,
          mjenv_learner_create_apart(&observation, &action, "Some-v0", short_settings("rows=20"), obs, 20, &learner),
          "the bounds of action 1 are -inf and 2");
  action.count = 1;
  observation.count = 0;
  refused(MJENV_E_SIZE,
          mjenv_learner_create_apart(&observation, &action, "Some-v0", short_settings("rows=20"), obs, 20, &learner),
          "0 observations");
  observation.count = 1;
  refused(MJENV_E_SIZE,
          mjenv_learner_create_apart(&observation, &action, "Some-v0", short_settings("rows=20"), obs, 19, &learner),
          "19");
  obs[7] = INFINITY;
  refused(MJENV_E_VALUE,
          mjenv_learner_create_apart(&observation, &action, "Some-v0", short_settings("rows=20"), obs, 20, &learner),
          "the first observation of row 7: obs[0] is inf");
  assert_null(learner);
}

// ---- Settings ----

static void test_settings(void** state) {
  (void)state;
  static const struct {
    const char* word;
    mjenv_status status;
    const char* reason;
  } bad[] = {
      {"activation=sigmoid", MJENV_E_VALUE, "settings.activation is \"sigmoid\", not one of tanh relu elu"},
      {"activation=tanh,relu", MJENV_E_VALUE, "not one of"},
      {"rows=0", MJENV_E_VALUE, "settings.rows is 0, not 1 to 67108864"},
      {"rows=21", MJENV_E_VALUE, "settings.rows is 21, but the environment has 20 rows"},
      {"steps=0", MJENV_E_VALUE, "settings.steps is 0"},
      {"steps=1e6", MJENV_E_TYPE, "settings.steps is \"1e6\", not an integer"},
      {"rollout_steps=0", MJENV_E_VALUE, "settings.rollout_steps is 0"},
      {"rollout_steps=3355444", MJENV_E_VALUE, "settings.rollout_steps is 3355444, not 1 to 3355443"},
      {"rollout_steps=9223372036854775808", MJENV_E_VALUE, "settings.rollout_steps is 9223372036854775808, not 1"},
      {"epochs=0", MJENV_E_VALUE, "settings.epochs"},
      {"epochs=", MJENV_E_TYPE, "settings.epochs is \"\", not an integer"},
      {"minibatch_size=0", MJENV_E_VALUE, "settings.minibatch_size"},
      {"decay_steps=-1", MJENV_E_VALUE, "settings.decay_steps is -1, not 0 to"},
      {"learning_rate=nan", MJENV_E_VALUE, "settings.learning_rate is nan, not 0 to 1"},
      {"learning_rate=0.1x", MJENV_E_TYPE, "settings.learning_rate is \"0.1x\", not a number"},
      {"final_learning_rate=-1e-9", MJENV_E_VALUE, "settings.final_learning_rate is -1e-09"},
      {"gamma=1.01", MJENV_E_VALUE, "settings.gamma is 1.01, not 0 to 1"},
      {"gae_lambda=-0.1", MJENV_E_VALUE, "settings.gae_lambda"},
      {"clip=0", MJENV_E_VALUE, "settings.clip is 0, not a finite number greater than 0"},
      {"value_clip=-1", MJENV_E_VALUE, "settings.value_clip"},
      {"value_coef=inf", MJENV_E_VALUE, "settings.value_coef is inf, not a finite number from 0 on"},
      {"entropy_coef=-1", MJENV_E_VALUE, "settings.entropy_coef"},
      {"max_grad_norm=-1", MJENV_E_VALUE, "settings.max_grad_norm"},
      {"target_kl=nan", MJENV_E_VALUE, "settings.target_kl"},
      {"initial_std=0", MJENV_E_VALUE, "settings.initial_std"},
      {"obs_clip=0", MJENV_E_VALUE, "settings.obs_clip"},
      {"reward_clip=-1", MJENV_E_VALUE, "settings.reward_clip"},
      {"normalize_obs=2", MJENV_E_TYPE, "settings.normalize_obs is \"2\", not true or false"},
      {"normalize_reward=True", MJENV_E_TYPE, "settings.normalize_reward"},
      {"normalize_advantage=", MJENV_E_TYPE, "settings.normalize_advantage"},
      {"scale_actions=-1", MJENV_E_TYPE, "settings.scale_actions"},
      {"hidden=1,1,1,1,1,1,1,1,1", MJENV_E_VALUE, "settings.hidden is a list of more than 8"},
      {"hidden=8,0", MJENV_E_VALUE, "settings.hidden[1] is 0, not 1 to 4096"},
      {"hidden=8,", MJENV_E_TYPE, "settings.hidden[1] is \"\""},
      {"hidden=8.5", MJENV_E_TYPE, "settings.hidden[0] is \"8.5\", not an integer"},
      {"actor_obs=1,0,1", MJENV_E_SIZE, "settings.actor_obs has 3 elements, but an observation has 11"},
      {"critic_obs=1,1,2", MJENV_E_VALUE, "settings.critic_obs[2] is 2, not 0 to 1"},
      {"critic_obs=0,0,0,0,0,0,0,0,0,0,0", MJENV_E_VALUE, "settings.critic_obs is 0 for every element"},
      {"window=0", MJENV_E_VALUE, "settings.window"},
      {"seed=-1", MJENV_E_VALUE, "settings.seed is -1"},
      {"seed=18446744073709551616", MJENV_E_VALUE, "settings.seed is 18446744073709551616"},
      {"threads=0", MJENV_E_VALUE, "settings.threads"},
      {"threads=65", MJENV_E_VALUE, "settings.threads is 65, not 1 to 64"},
      {"instructions=mmx", MJENV_E_VALUE, "settings.instructions is \"mmx\", not one of auto sse2"},
      {"gama=0.9", MJENV_E_NAME, "there is no setting \"gama\"; nearest: gamma; mjenv_learn_setting_at lists all"},
      {"clips=1", MJENV_E_NAME, "nearest: clip;"},
      {"=1", MJENV_E_NAME, "there is no setting \"\""},
      {"gamma", MJENV_E_VALUE, "settings has \"gamma\", not NAME=VALUE"},
  };
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = NULL;
  for (size_t i = 0; i < COUNT(bad); ++i)
    refused(bad[i].status, mjenv_learner_create(&calls, env, "Hopper-v5", short_settings(bad[i].word), &learner),
            bad[i].reason);
  refused(MJENV_E_VALUE, mjenv_learner_create(&calls, env, "two\nlines", NULL, &learner), "id is \"two\nlines\"");
  refused(MJENV_E_VALUE, mjenv_learner_create(&calls, env, "", NULL, &learner), "id is \"\"");
  assert_null(learner);

  learner = learner_of(env, "actor_obs=0,0,0,0,1,0,0,0,0,0,0");
  ok(mjenv_learner_train(learner, 500));
  // Settings that may change, and some that may not: then none changes.
  ok(mjenv_learner_set(learner, "gamma=0.9\n epochs=1\ttarget_kl=1e-9 "));
  ok(mjenv_learner_train(learner, 500));
  assert_int_equal(report_of(learner).epochs, 1);
  static const char* const fixed[] = {"rows=10",    "rollout_steps=26", "activation=relu",   "hidden=8,8,8",
                                      "actor_obs=", "critic_obs=0,1",   "normalize_obs=0",   "scale_actions=1",
                                      "seed=4",     "threads=2",        "instructions=sse2", "window=21"};
  for (size_t i = 0; i < COUNT(fixed); ++i) {
    char words[64], reason[64];
    snprintf(words, sizeof words, "epochs=2 %s", fixed[i]);
    snprintf(reason, sizeof reason, "settings.%.*s cannot change", (int)strcspn(fixed[i], "="), fixed[i]);
    refused(MJENV_E_VALUE, mjenv_learner_set(learner, words), reason);
  }
  refused(MJENV_E_TYPE, mjenv_learner_set(learner, "epochs=2 gamma=x"), "settings.gamma is \"x\"");
  refused(MJENV_E_ARGUMENT, mjenv_learner_set(learner, NULL), "settings is NULL");
  ok(mjenv_learner_set(learner, "rows=20 seed=3"));  // as they are
  ok(mjenv_learner_set(learner, "target_kl=0"));
  ok(mjenv_learner_train(learner, 500));
  assert_int_equal(report_of(learner).epochs, 1);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);

  char* whole = trained("minibatch_size=500", 1, 500);
  char* greater = trained("minibatch_size=501", 1, 500);
  assert_string_equal(greater, whole);
  free(greater);
  free(whole);
}

// The list describes every setting, and the text has every value: those of an id, and those that replace them.
static void test_list_of_settings(void** state) {
  (void)state;
  char text[2000];
  int64_t size = 0;
  ok(mjenv_learn_settings("Swimmer-v5",
                          "gamma=0.5 hidden= actor_obs=1,0 normalize_obs=0 seed=18446744073709551615 gamma=0.1", text,
                          sizeof text, &size));
  static const char* const expected[] = {"rows=8 steps=1000000 rollout_steps=1024 epochs=10 minibatch_size=256 ",
                                         " learning_rate=6e-04 ",
                                         " gamma=0.1 gae_lambda=0.98 clip=0.2 ",
                                         " normalize_obs=false normalize_reward=true ",
                                         " hidden= activation=tanh actor_obs=1,0 critic_obs= ",
                                         " seed=18446744073709551615 threads=1 "};
  for (size_t i = 0; i < COUNT(expected); ++i)
    if (!strstr(text, expected[i])) fail_msg("\"%s\" is not in %s", expected[i], text);
  assert_int_equal(size, strlen(text) + 1);
  refused(MJENV_E_SIZE, mjenv_learn_settings("Swimmer-v5", NULL, text, 10, &size), "the capacity is 10");
  refused(MJENV_E_ARGUMENT, mjenv_learn_settings(NULL, NULL, NULL, 0, &size), "id is NULL");
  refused(MJENV_E_NAME, mjenv_learn_settings("Swimmer-v5", "gama=1", NULL, 0, &size), "nearest: gamma");
  ok(mjenv_learn_settings("Some-v0", NULL, text, sizeof text, &size));
  const char* word = text;
  const int64_t count = mjenv_learn_setting_count();
  for (int64_t i = 0; i < count; ++i) {
    mjenv_option setting = MJENV_OPTION_INIT;
    ok(mjenv_learn_setting_at(i, &setting));
    const size_t length = strlen(setting.name);
    assert_true(strncmp(word, setting.name, length) == 0 && word[length] == '=');
    const double value = strtod(word + length + 1, NULL);
    const bool is_number = setting.kind == MJENV_KIND_INTEGER || setting.kind == MJENV_KIND_REALS;
    if (is_number && setting.count == 1) assert_true(setting.low <= value && value <= setting.high);
    assert_true((setting.kind == MJENV_KIND_STRING) == (setting.choices != NULL) && strlen(setting.doc) > 5);
    word += strcspn(word, " ") + 1;
  }
  assert_int_equal(word - text, strlen(text) + 1);
  mjenv_option setting = MJENV_OPTION_INIT;
  refused(MJENV_E_VALUE, mjenv_learn_setting_at(count, &setting), " is outside 0..");
  refused(MJENV_E_VALUE, mjenv_learn_setting_at(-1, &setting), "setting -1");
}

// An update ends early once the policy has moved further than target_kl.
static void test_kl_limit(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "epochs=10 learning_rate=0.01 target_kl=1e-4");
  ok(mjenv_learner_train(learner, 500));
  assert_in_range(report_of(learner).epochs, 1, 5);
  assert_true(report_of(learner).approx_kl > 1e-4);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
}

// ---- Policies ----

static const char* const small_policy =
    "mjenv-policy 1\nid Some-v0\nmean 1 2\nscale 2 0.5\nclip 10\nlow -1\nhigh 1.5\nlayer 2 2 tanh\nbias 0.5 -0.5\n"
    "weights 1 0\nweights 0.25 2\nlayer 1 2 identity\nbias 0.125\nweights 2 -1\n";

static void test_policies(void** state) {
  (void)state;
  mjenv_policy* policy = NULL;
  ok(mjenv_policy_parse(small_policy, (int64_t)strlen(small_policy), &policy));
  const double obs[] = {2, 2.25, -100, 100};
  float action[2];
  ok(mjenv_policy_act(policy, MJENV_PRECISION_FLOAT64, 2, obs, 4, action, 2));
  // (x - mean) / scale is 0.5 and 0.5; the second row is clipped to -10 and 10.
  assert_true(action[0] == (float)fmin(1.5, 0.125 + 2 * tanh(0.5 + 0.5) - tanh(-0.5 + 0.25 * 0.5 + 2 * 0.5)));
  assert_true(action[1] == -1);
  float rounded[2];
  ok(mjenv_policy_act(policy, MJENV_PRECISION_FLOAT32, 2, obs, 4, rounded, 2));
  for (int i = 0; i < 2; ++i) assert_true(fabsf(rounded[i] - action[i]) <= 1e-6F);
  mjenv_policy_spec spec = MJENV_POLICY_SPEC_INIT;
  ok(mjenv_policy_spec_of(policy, &spec));
  assert_true(spec.layer_count == 2 && spec.clip == 10 && spec.mean[1] == 2 && spec.scale[1] == 0.5);
  assert_true(spec.low[0] == -1 && spec.high[0] == 1.5);
  mjenv_policy_layer layer = MJENV_POLICY_LAYER_INIT;
  ok(mjenv_policy_layer_at(policy, 0, &layer));
  assert_string_equal(layer.activation, "tanh");
  assert_true(layer.inputs == 2 && layer.outputs == 2 && layer.bias[1] == -0.5);
  assert_true(layer.weights[0] == 1 && layer.weights[1] == 0.25 && layer.weights[2] == 0 && layer.weights[3] == 2);
  ok(mjenv_policy_layer_at(policy, 1, &layer));
  assert_string_equal(layer.activation, "identity");
  refused(MJENV_E_VALUE, mjenv_policy_layer_at(policy, 2, &layer), "layer 2 is outside 0..1");
  refused(MJENV_E_SIZE, mjenv_policy_act(policy, MJENV_PRECISION_FLOAT64, 2, obs, 3, action, 2),
          "obs_count is 3, not 4");
  refused(MJENV_E_SIZE, mjenv_policy_act(policy, MJENV_PRECISION_FLOAT64, 2, obs, 4, action, 3), "action_count");
  refused(MJENV_E_VALUE, mjenv_policy_act(policy, 3, 2, obs, 4, action, 2), "precision is 3");
  mjenv_env* env = env_of("Hopper-v5", 2, 1, "disabled");
  refused(MJENV_E_SIZE, mjenv_evaluate(&calls, env, policy, MJENV_PRECISION_FLOAT64, 0, 1, NULL, NULL),
          "\"Some-v0\" sees 2 numbers, but an observation has 11");
  refused(MJENV_E_VALUE, mjenv_evaluate(&calls, env, policy, MJENV_PRECISION_FLOAT64, 0, 0, NULL, NULL),
          "episodes is 0");
  mjenv_env* same_step = env_of("Hopper-v5", 2, 1, "same_step");
  refused(MJENV_E_VALUE, mjenv_evaluate(&calls, same_step, policy, MJENV_PRECISION_FLOAT64, 0, 1, NULL, NULL),
          "disabled");
  mjenv_destroy(same_step);
  mjenv_destroy(env);
  mjenv_policy_destroy(policy);
  refused(MJENV_E_FILE, mjenv_policy_load(path_of("missing"), &policy), "No such file");
}

static const char* const named_policy =
    "mjenv-policy 2\nid Some-v0\nabout {\"engine\": \"2.2.2\"}\ninput gyro 3 0 2\ninput joints 1\nmean 0 0 0\n"
    "scale 1 1 1\nclip 10\nlow -999\nhigh 999\nlayer 1 3 identity\nbias 0\nweights 1 10 100\n";

// A policy finds what it sees by names, and says what is missing.
static void test_names(void** state) {
  (void)state;
  mjenv_policy* policy = NULL;
  ok(mjenv_policy_parse(named_policy, (int64_t)strlen(named_policy), &policy));
  mjenv_policy_spec spec = MJENV_POLICY_SPEC_INIT;
  mjenv_policy_input input = MJENV_POLICY_INPUT_INIT;
  ok(mjenv_policy_spec_of(policy, &spec));
  assert_int_equal(spec.input_count, 2);
  assert_string_equal(spec.about, "{\"engine\": \"2.2.2\"}");
  ok(mjenv_policy_input_at(policy, 0, &input));
  assert_string_equal(input.name, "gyro");
  assert_true(input.count == 3 && input.seen == 2 && input.elements[0] == 0 && input.elements[1] == 2);
  ok(mjenv_policy_input_at(policy, 1, &input));
  assert_true(input.count == 1 && input.seen == 1 && !input.elements);
  refused(MJENV_E_VALUE, mjenv_policy_input_at(policy, 2, &input), "input 2 is outside 0..1");

  static const char *const names[] = {"joints", "height", "gyro"}, *const strange[] = {"joints", "height", "Gyro"};
  static const int64_t counts[] = {1, 2, 3}, short_gyro[] = {1, 2, 2};
  int64_t places[3];
  ok(mjenv_policy_find(policy, names, counts, 3, places, 3));
  assert_true(places[0] == 3 && places[1] == 5 && places[2] == 0);
  const double obs[] = {1, 2, 3, 4, 5, 6}, seen[] = {obs[places[0]], obs[places[1]], obs[places[2]]};
  float action = 0;
  ok(mjenv_policy_act(policy, MJENV_PRECISION_FLOAT64, 1, seen, 3, &action, 1));
  assert_true(action == 4 + 60 + 100);
  refused(MJENV_E_NAME, mjenv_policy_find(policy, strange, counts, 3, places, 3),
          "sees \"gyro\", 3 numbers, but the observation has no such term; there are joints, height, Gyro");
  refused(MJENV_E_SIZE, mjenv_policy_find(policy, names, short_gyro, 3, places, 3),
          "sees \"gyro\", 3 numbers, but this term of the observation has 2");
  refused(MJENV_E_SIZE, mjenv_policy_find(policy, names, counts, 3, places, 2), "place_count is 2, not 3");
  refused(MJENV_E_SIZE, mjenv_policy_find(policy, names, counts, -1, places, 3), "term_count is -1");
  refused(MJENV_E_ARGUMENT, mjenv_policy_find(policy, NULL, counts, 3, places, 3), "names is NULL");
  mjenv_env* env = env_of("Hopper-v5", 2, 1, "disabled");
  refused(MJENV_E_NAME, mjenv_evaluate(&calls, env, policy, MJENV_PRECISION_FLOAT64, 0, 1, NULL, NULL),
          "sees \"gyro\", 3 numbers, but the observation has no such term; there are qpos, qvel");
  mjenv_destroy(env);
  mjenv_policy_destroy(policy);
  ok(mjenv_policy_parse(small_policy, (int64_t)strlen(small_policy), &policy));
  ok(mjenv_policy_find(policy, names + 1, counts + 1, 1, places, 2));
  assert_true(places[0] == 0 && places[1] == 1);
  refused(MJENV_E_SIZE, mjenv_policy_find(policy, names, counts, 3, places, 2),
          "sees 2 numbers, but an observation has 6");
  mjenv_policy_destroy(policy);
}

// The text of a learner's policy has what the actor sees alone.
static void test_what_an_actor_sees(void** state) {
  (void)state;
  static const char settings[] = "hidden=4 actor_obs=0,1,0,0,1,0,0,0,0,0,0 rollout_steps=16";
  mjenv_env *env = env_of("Hopper-v5", 20, 1, "same_step"), *played = env_of("Hopper-v5", 3, 1, "disabled");
  mjenv_learner* learner = learner_of(env, settings);
  ok(mjenv_learner_describe(learner, "{\"options\": {}}", NULL, NULL, 0));
  ok(mjenv_learner_train(learner, 640));
  char* text = policy_of(learner);
  assert_non_null(strstr(text, "mjenv-policy 2\nid Hopper-v5\nabout {\"options\": {}}\ninput qpos 5 1 4\nmean "));
  assert_non_null(strstr(text, "\nlayer 4 2 tanh\n"));
  mjenv_policy* policy = NULL;
  ok(mjenv_policy_parse(text, (int64_t)strlen(text), &policy));
  double returns[5], again[5];
  ok(mjenv_evaluate(&calls, played, policy, MJENV_PRECISION_FLOAT64, 0, 5, returns, NULL));
  free(text);
  mjenv_policy_destroy(policy);

  // An observation whose terms have other names, in which the weights of what the actor does not see are 0.
  static const char* const names[] = {"all"};
  static const int64_t counts[] = {11}, wrong[] = {10};
  static const char* const blank[] = {"qpos qvel"};
  refused(MJENV_E_SIZE, mjenv_learner_describe(learner, NULL, names, wrong, 1),
          "10 numbers, but an observation has 11");
  refused(MJENV_E_NAME, mjenv_learner_describe(learner, NULL, blank, counts, 1), "\"qpos qvel\"");
  static const char* const twice[] = {"all", "all"};
  static const int64_t halves[] = {5, 6};
  refused(MJENV_E_NAME, mjenv_learner_describe(learner, NULL, twice, halves, 2), "\"all\", as another is");
  refused(MJENV_E_VALUE, mjenv_learner_describe(learner, "{\n}", NULL, NULL, 0), "about is not one line");
  ok(mjenv_learner_describe(learner, NULL, names, counts, 1));
  text = policy_of(learner);
  assert_non_null(strstr(text, "mjenv-policy 2\nid Hopper-v5\ninput all 11 1 4\nmean "));
  char* head = strstr(text, "input all 11 1 4");
  memcpy(head, "input qpos 5 1 4", 16);
  ok(mjenv_policy_parse(text, (int64_t)strlen(text), &policy));
  ok(mjenv_evaluate(&calls, played, policy, MJENV_PRECISION_FLOAT64, 0, 5, again, NULL));
  assert_memory_equal(again, returns, sizeof returns);
  free(text);
  mjenv_policy_destroy(policy);
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
  mjenv_destroy(played);
}

static void refuse_changes(const char* valid, const char* const changes[][3], size_t count) {
  for (size_t i = 0; i < count; ++i) {
    const char* at = strstr(valid, changes[i][0]);
    assert_non_null(at);
    char text[1000];
    const int size =
        snprintf(text, sizeof text, "%.*s%s%s", (int)(at - valid), valid, changes[i][1], at + strlen(changes[i][0]));
    mjenv_policy* policy = NULL;
    refused(MJENV_E_VALUE, mjenv_policy_parse(text, size, &policy), changes[i][2]);
    assert_null(policy);
  }
}

static void test_bad_policies(void** state) {
  (void)state;
  static const char* const bad_names[][3] = {
      {"mjenv-policy 2", "mjenv-policy 1", "line 3 begins with \"about\""},
      {"2.2.2", "\t", "line 3 is not printable ASCII"},
      {"\ninput gyro", "\nabout {}\ninput gyro", "line 4 repeats"},
      {"gyro 3 0 2", "gyro 3 2 0", "line 4 has \"0\", not the next element"},
      {"gyro 3 0 2", "gyro 3 0 3", "line 4 has \"3\", not the next element"},
      {"gyro 3 0 2", "gyro 3 0", "mean has 3 elements, but the inputs have 2"},
      {"gyro 3 0 2", "gyro 0", "line 4 has \"0\", not a number of inputs"},
      {"gyro 3 0 2", "gyro\x1b 3 0 2", "line 4 has no name"},
      {"joints 1", "gyro 1", "line 5 repeats"},
      {"joints 1", "", "line 5 has no name"},
      {"joints 1", "joints 1048576", "mean has 3 elements, but the inputs have 1048578"},
      {"input joints 1\n", "", "mean has 3 elements, but the inputs have 2"},
  };
  refuse_changes(named_policy, bad_names, COUNT(bad_names));
  static const char* const changes[][3] = {
      {"mjenv-policy 1", "mjenv-policy 3", "line 1"},
      {"mjenv-policy 1", "mjenv-policy 2", "mean has 2 elements, but the inputs have 0"},
      {"id Some-v0", "od Some-v0", "line 2"},
      {"mean 1 2", "mean 1 x", "line 3 has \"x\""},
      {"mean 1 2", "mean 1 inf", "line 3 has \"inf\""},
      {"mean 1 2", "mean 1 nan", "line 3 has \"nan\""},
      {"mean 1 2", "mean 1 1e999", "line 3 has \"1e999\""},
      {"mean 1 2", "mean 1 1_0", "line 3 has \"1_0\""},
      {"mean 1 2", "mean 1 0x10", "line 3 has \"0x10\""},
      {"mean 1 2",
       "mean 1\xe2\x80\xa8"
       "2",
       "line 3 has \"1\xe2\x80\xa8"
       "2\""},                                                     // U+2028
      {"mean 1 2", "mean 1 \xd9\xa1", "line 3 has \"\xd9\xa1\""},  // the Arabic digit 1
      {"id Some-v0", "id ", "line 2 names no environment"},
      {"id Some-v0", "id Some\xff-v0", "line 2 names no environment"},
      {"id Some-v0", "id Some-v0\x1b[2J", "line 2 names no environment"},
      {"low -1", "low 2", "low is greater"},
      {"mean 1 2", "mean 1 2 3", "layer 1 has 2 inputs, but mean has 3 elements"},
      {"mean 1 2", "maen 1 2", "line 3 begins with \"maen\""},
      {"scale 2 0.5", "scale 2 0", "scale is not greater than 0"},
      {"scale 2 0.5", "scale 2", "different lengths"},
      {"clip 10", "clip -1", "clip"},
      {"clip 10\n", "", "clip is missing"},
      {"low -1", "low -1 1", "low or high"},
      {"layer 2 2 tanh", "layer 2 2 sinh", "line 8 has the unknown activation \"sinh\""},
      {"layer 2 2 tanh", "layer 0 2 tanh", "line 8 has \"0\""},
      {"layer 2 2 tanh", "layer 99999999999 2 tanh", "line 8 has"},
      {"layer 2 2 tanh", "layer 1 2 tanh", "line 9 has 2 numbers, not 1"},
      {"layer 2 2 tanh\n", "", "belongs to no layer"},
      {"weights 0.25 2\n", "", "layer 1 has 1 of 2 lines \"weights\""},
      {"weights 0.25 2", "weights 0.25 2 1", "3 numbers, not 2"},
      {"weights 2 -1\n", "weights 2 -1\nweights 2 -1\n", "one line \"weights\" too many"},
      {"bias 0.125", "bias 0.125\nbias 0.125", "repeats"},
  };
  refuse_changes(small_policy, changes, COUNT(changes));
  const size_t length = strlen(small_policy);
  for (size_t cut = 0; cut < length - strlen("weights 2 -1\n"); ++cut) {  // whatever the end, nothing breaks
    mjenv_policy* policy = NULL;
    refused(MJENV_E_VALUE, mjenv_policy_parse(small_policy, (int64_t)cut, &policy), "no policy");
  }
}

// ---- Handles ----

static void test_handles(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = NULL;
  mjenv_learn_report report = MJENV_LEARN_REPORT_INIT;
  int64_t size = 0;
  refused(MJENV_E_ARGUMENT, mjenv_learner_create(NULL, env, "Hopper-v5", NULL, &learner), "calls is NULL");
  refused(MJENV_E_ARGUMENT, mjenv_learner_create(&calls, NULL, "Hopper-v5", NULL, &learner), "env is NULL");
  refused(MJENV_E_ARGUMENT, mjenv_learner_create(&calls, env, NULL, NULL, &learner), "id is NULL");
  refused(MJENV_E_ARGUMENT, mjenv_learner_create(&calls, env, "Hopper-v5", NULL, NULL), "learner is NULL");
  mjenv_learn_calls incomplete = calls;
  incomplete.step = NULL;
  refused(MJENV_E_ARGUMENT, mjenv_learner_create(&incomplete, env, "Hopper-v5", NULL, &learner), "function of calls");
  refused(MJENV_E_ARGUMENT, mjenv_learner_train(NULL, 1), "learner is NULL");
  learner = learner_of(env, "");
  refused(MJENV_E_VALUE, mjenv_learner_train(learner, -1), "steps is -1");
  ok(mjenv_learner_train(learner, 0));
  refused(MJENV_E_VALUE, mjenv_learner_policy(learner, 3, NULL, 0, &size), "which is 3");
  char little[4];
  refused(MJENV_E_SIZE, mjenv_learner_policy(learner, MJENV_LEARNED_LAST, little, 4, &size), "capacity is 4");
  refused(MJENV_E_ARGUMENT, mjenv_learner_save(learner, NULL, NULL), "path is NULL");
  mjenv_learner_destroy(learner);
  mjenv_learner_destroy(learner);
  mjenv_learner_destroy(NULL);
  refused(MJENV_E_ARGUMENT, mjenv_learner_report(learner, &report), "learner is no live handle");
  assert_null(mjenv_policy_id(NULL));
  mjenv_destroy(env);
  // The environment was destroyed before the learner.
  env = env_of("Hopper-v5", 20, 1, "same_step");
  learner = learner_of(env, "");
  mjenv_destroy(env);
  refused(MJENV_E_ARGUMENT, mjenv_learner_train(learner, 1), "env is no live handle");
  mjenv_learner_destroy(learner);
}

// ---- Threads and processes ----

struct other_thread {
  mjenv_learner* learner;
  bool stop;
  int entered, busy;
};

static void* ask_without_end(void* argument) {
  struct other_thread* s = argument;
  while (!__atomic_load_n(&s->stop, __ATOMIC_ACQUIRE)) {
    mjenv_learn_report report = MJENV_LEARN_REPORT_INIT;
    const mjenv_status status = mjenv_learner_report(s->learner, &report);
    if (status == MJENV_OK) ++s->entered;
    if (status == MJENV_E_BUSY) ++s->busy;
    if (status != MJENV_OK && status != MJENV_E_BUSY) abort();
  }
  return NULL;
}

static void test_two_threads(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 2, "same_step");
  struct other_thread s = {.learner = learner_of(env, "threads=2")};
  pthread_t thread;
  assert_int_equal(pthread_create(&thread, NULL, ask_without_end, &s), 0);
  int trained_rollouts = 0;
  for (int i = 0; i < 20; ++i) {
    const mjenv_status status = mjenv_learner_train(s.learner, 500);
    assert_true(status == MJENV_OK || status == MJENV_E_BUSY);
    trained_rollouts += status == MJENV_OK;
  }
  __atomic_store_n(&s.stop, true, __ATOMIC_RELEASE);
  assert_int_equal(pthread_join(thread, NULL), 0);
  assert_int_equal(report_of(s.learner).updates, trained_rollouts);
  mjenv_learner_destroy(s.learner);
  mjenv_destroy(env);
}

#ifndef NO_THREADS_AFTER_FORK
static void test_forked(void** state) {
  (void)state;
  mjenv_env* env = env_of("Hopper-v5", 20, 1, "same_step");
  mjenv_learner* learner = learner_of(env, "threads=2");
  const pid_t child = fork();
  if (child == 0) _exit(mjenv_learner_train(learner, 500) == MJENV_E_FORKED ? 0 : 1);
  int status = 0;
  assert_int_equal(waitpid(child, &status, 0), child);
  assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  ok(mjenv_learner_train(learner, 500));
  mjenv_learner_destroy(learner);
  mjenv_destroy(env);
}
#endif

static int set_up(void** state) {
  (void)state;
  static char folder[] = "/tmp/mjenv-learn-XXXXXX";
  assert_non_null(mkdtemp(folder));
  set_variable("LEARN_FOLDER", folder);
  return 0;
}

static int tear_down(void** state) {
  (void)state;
  const char* const names[] = {"policy.txt", "checkpoint", "good", "bad", "kept", "kept.txt", "after"};
  for (size_t i = 0; i < COUNT(names); ++i) remove(path_of(names[i]));
  return rmdir(getenv("LEARN_FOLDER"));
}

int main(int argc, char** argv) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_learns),
      cmocka_unit_test(test_same_bits),
      cmocka_unit_test(test_same_bits_of_large_networks),
      cmocka_unit_test(test_rows_of_the_caller),
      cmocka_unit_test(test_truncation),
      cmocka_unit_test(test_resume),
      cmocka_unit_test(test_bad_checkpoints),
      cmocka_unit_test(test_forged_checkpoints),
      cmocka_unit_test(test_no_files),
      cmocka_unit_test(test_full_disk),
      cmocka_unit_test(test_infinite_rewards),
      cmocka_unit_test(test_infinite_weights),
      cmocka_unit_test(test_infinite_spaces),
      cmocka_unit_test(test_settings),
      cmocka_unit_test(test_list_of_settings),
      cmocka_unit_test(test_kl_limit),
      cmocka_unit_test(test_policies),
      cmocka_unit_test(test_names),
      cmocka_unit_test(test_what_an_actor_sees),
      cmocka_unit_test(test_bad_policies),
      cmocka_unit_test(test_handles),
      cmocka_unit_test(test_two_threads),
#ifndef NO_THREADS_AFTER_FORK
      cmocka_unit_test(test_forked),
#endif
  };
  if (argc > 1 && strcmp(argv[1], "short") == 0) cmocka_set_skip_filter("test_learns");
  return cmocka_run_group_tests(tests, set_up, tear_down);
}
