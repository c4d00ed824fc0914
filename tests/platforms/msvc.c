// A program as Microsoft's compiler makes it, linked to mjenv.lib, without a C library.
#include <mjenv/mjenv.h>

int _fltused;  // which Microsoft's compiler asks for where there are floating-point numbers

static double obs[11], reward;
static double action[3];
static mjenv_batch out;

int start(void) {
  mjenv_options* options;
  mjenv_env* env;
  const uint64_t seed = 42;
  out.struct_size = sizeof out;
  out.rows = 1;
  out.obs_count = 11;
  out.obs = obs;
  out.reward = &reward;
  if (mjenv_options_create("Hopper-v5", &options) != MJENV_OK) return 1;
  if (mjenv_create(options, 1, &env) != MJENV_OK) return 2;
  if (mjenv_seed(env, 0, &seed, 1) != MJENV_OK) return 3;
  if (mjenv_reset(env, 0, &out) != MJENV_OK) return 4;
  if (mjenv_step(env, 0, action, 3, MJENV_DTYPE_FLOAT64, &out) != MJENV_OK) return 5;
  if (!(reward > 0 && obs[0] > 1)) return 6;
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return 0;
}
