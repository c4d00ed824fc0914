// The episodes of the examples, against what Gymnasium gave: episodes.txt, which says what is summed.
#include "golden.h"

enum { EPISODES = 3, SEED = 42 };

struct expected {
  int64_t steps;  // at most in an episode; 0: as many as the task has
  char id[64], norm[8], checksum[17];
  int64_t length;
  double total;
};

static void add_word(uint64_t* checksum, uint64_t word) { *checksum = (*checksum ^ word) * 0x100000001b3u; }

static void add_numbers(uint64_t* checksum, const double* values, int64_t count) {
  for (int64_t i = 0; i < count; ++i) {
    uint64_t word;
    memcpy(&word, values + i, sizeof word);
    add_word(checksum, word);
  }
}

// Motors without limits have the bounds -1e10 and 1e10.
static bool has_limits(const mjenv_env* env) {
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_ACTION, &space));
  return space.low[0] > -1e10;
}

static void test_episodes(void** state) {
  const struct expected* want = *state;
  mjenv_options* options = options_of_id(want->id);
  assert_ok(mjenv_options_set_string(options, "norm", want->norm));
  if (want->steps) assert_ok(mjenv_options_set_integer(options, "max_episode_steps", want->steps));
  mjenv_env* env = env_of_options(options, 1);
  struct outputs* out = outputs_of(env);
  const size_t nu = (size_t)action_count(env);
  float action[64] = {0};
  const bool is_sampled = has_limits(env);  // else the actions are 0
  uint64_t checksum = 0xcbf29ce484222325u;
  int64_t length = 0;
  double total = 0;
  seed_rows(env, SEED);
  assert_ok(mjenv_seed_actions(env, SEED));
  for (int episode = 0; episode < EPISODES; ++episode) {
    assert_ok(mjenv_reset(env, NULL, &out->batch));
    add_numbers(&checksum, out->obs, out->obs_count);
    add_numbers(&checksum, out->reset_info, out->reset_info_count);
    do {
      if (is_sampled) assert_ok(mjenv_sample_actions(env, action, nu));
      assert_ok(mjenv_step(env, NULL, action, nu, MJENV_DTYPE_FLOAT32, &out->batch));
      add_numbers(&checksum, out->obs, out->obs_count);
      add_numbers(&checksum, out->reward, 1);
      add_word(&checksum, *out->terminated);
      add_word(&checksum, *out->truncated);
      add_numbers(&checksum, out->info, out->info_count);
      total += *out->reward;
      ++length;
    } while (!*out->terminated && !*out->truncated);
  }
  char text[17];
  snprintf(text, sizeof text, "%016" PRIx64, checksum);
  assert_true(length == want->length);
  assert_same_bits("return", &total, &want->total, 1);
  assert_string_equal(text, want->checksum);
  outputs_free(out);
  mjenv_destroy(env);
}

// episodes [--goldens FOLDER --steps N] [ID...]: these ids, or all. A plug-in's recordings are in a folder of its own, and are
// of episodes of N steps.
int main(int argc, char** argv) {
  const bool is_of_plugin = argc > 4 && strcmp(argv[1], "--goldens") == 0 && strcmp(argv[3], "--steps") == 0;
  const char* folder = is_of_plugin ? argv[2] : GOLDENS;
  const int64_t steps = is_of_plugin ? atoi(argv[4]) : 0;
  if (is_of_plugin) argc -= 4, argv += 4;
  char path[512];
  char* text = read_file(golden_in(folder, "episodes.txt", path), NULL);
  struct expected expected[64];
  struct CMUnitTest tests[64];
  size_t count = 0, listed = 0;
  for (char* line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
    struct expected* e = &expected[count];
    char total[40];
    if (line[0] == '#') continue;
    if (sscanf(line, "%63s %7s %" SCNd64 " %39s %16s", e->id, e->norm, &e->length, total, e->checksum) != 5) return 1;
    e->total = strtod(total, NULL);
    e->steps = steps;
    ++listed;
    bool is_wanted = argc == 1;
    for (int i = 1; i < argc; ++i) is_wanted = is_wanted || strcmp(argv[i], e->id) == 0;
    if (is_wanted) tests[count++] = (struct CMUnitTest){e->id, test_episodes, NULL, NULL, e};
  }
  free(text);
  if ((!is_of_plugin && (int)listed != (int)mjenv_id_count()) || (argc > 1 && (int)count != argc - 1)) return 1;
  return _cmocka_run_group_tests("episodes", tests, count, NULL, NULL);
}
