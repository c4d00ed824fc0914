/* Plays three seeded episodes of an id. The same source links with libmjenv.so or libmjenv.a.
 *
 *   linked ID
 *
 * Prints ID, steps and return, separated by tabs. */
#include <mjenv/mjenv.h>
#include <stdio.h>
#include <stdlib.h>

static void check(mjenv_status status) {
  if (status == MJENV_OK) return;
  fprintf(stderr, "%s: %s\n", mjenv_status_name(status), mjenv_last_error());
  exit(1);
}

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: %s ID\n", argv[0]);
    return 2;
  }
  mjenv_options* options;
  mjenv_env* env;
  check(mjenv_options_create(argv[1], &options));
  check(mjenv_create(options, 1, &env));
  mjenv_options_destroy(options);

  mjenv_space space = MJENV_SPACE_INIT;
  check(mjenv_space_of(env, MJENV_ROLE_ACTION, &space));
  float* action = malloc((size_t)space.count * sizeof *action);
  if (!action) return 1;
  double reward, total = 0;
  uint8_t terminated, truncated;
  mjenv_batch out = MJENV_BATCH_INIT;
  out.rows = 1;
  out.reward = &reward;
  out.terminated = &terminated;
  out.truncated = &truncated;
  const uint64_t seed = 42;
  long steps = 0;
  check(mjenv_seed(env, NULL, &seed, 1));
  check(mjenv_seed_actions(env, seed));
  for (int episode = 0; episode < 3; ++episode) {
    check(mjenv_reset(env, NULL, NULL));
    do {
      check(mjenv_sample_actions(env, action, space.count));
      check(mjenv_step(env, NULL, action, space.count, MJENV_DTYPE_FLOAT32, &out));
      total += reward;
      ++steps;
    } while (!terminated && !truncated);
  }
  printf("%s\t%ld\t%a\n", argv[1], steps, total);
  free(action);
  mjenv_destroy(env);
  return 0;
}
