// Rows that draw their models at resets, with noise, delays and pushes: the same bits on any number of threads, through
// images and copies; and what is refused. tests/live compares with Gymnasium.
#include <math.h>
#include <time.h>

#include "golden.h"

enum { ROWS = 5, STEPS = 60 };

static double uniform(double low, double high) {
  static uint64_t state = 1;
  state = state * 6364136223846793005u + 1442695040888963407u;
  return low + (high - low) * (double)(state >> 11) * 0x1p-53;
}

// ---- Settings ----

#define ITEM .struct_size = sizeof(mjenv_randomization)
#define PARAMETERS(...) \
  .parameters = (const double[]){__VA_ARGS__}, .parameter_count = COUNT(((const double[]){__VA_ARGS__}))

static void randomize(mjenv_env* env) {
  static const int64_t z[] = {2};
  const mjenv_randomization items[] = {
      {ITEM, MJENV_DISTRIBUTION_UNIFORM, "geom_friction", PARAMETERS(0.5, 1.5), .effect = MJENV_EFFECT_SCALE},
      {ITEM, MJENV_DISTRIBUTION_LOG_UNIFORM, "body_mass", PARAMETERS(0.5, 2), .effect = MJENV_EFFECT_SCALE, .shared = 1,
       .constants = 1},
      {ITEM, MJENV_DISTRIBUTION_NORMAL, "opt.gravity", z, 1, PARAMETERS(0, 0.5), .effect = MJENV_EFFECT_OFFSET},
      {ITEM, MJENV_DISTRIBUTION_TRUNCATED_NORMAL, "dof_damping", PARAMETERS(1, 0.2, 0.9, 1.4),
       .effect = MJENV_EFFECT_SCALE},
      {ITEM, MJENV_DISTRIBUTION_CHOICE, "opt.timestep", PARAMETERS(0.008, 0.01, 0.002), .effect = MJENV_EFFECT_VALUE},
      {ITEM, MJENV_DISTRIBUTION_UNIFORM, "tendon_stiffness", PARAMETERS(0, 1), .effect = MJENV_EFFECT_VALUE},
  };
  assert_ok(mjenv_randomize(env, items, COUNT(items)));
}

#define PERTURBATION .struct_size = sizeof(mjenv_perturbation)
#define PUSH .struct_size = sizeof(mjenv_push)

// Whether body 1 has a free joint, so that it can be kicked.
static bool has_free_trunk(mjenv_env* env) {
  int64_t count;
  double* types = read_array(env, 0, "jnt_type", &count);
  const bool is_free = count > 0 && types[0] == 0;
  free(types);
  return is_free;
}

static void perturb(mjenv_env* env) {
  static const double action_noise[] = {0.1}, observation_noise[] = {0.02};
  const mjenv_push pushes[] = {
      {PUSH, .body = 1, .min_steps = 2, .max_steps = 7, .low = {-20, -20}, .high = {20, 20, 5}},
      {PUSH, .body = 2, .min_steps = 1, .max_steps = 1, .low = {0, 0, 0, -1, -1, -1}, .high = {0, 0, 0, 1, 1, 1}},
      {PUSH, .body = 3, .min_steps = 1, .max_steps = 3, .low = {-3}, .high = {3}, .min_duration = 1, .max_duration = 4},
      {PUSH, .body = 1, .min_steps = 1, .max_steps = 4, .low = {-1, 0, 0, -1}, .high = {1, 0, 0, 1}, .is_kick = 1},
  };
  const mjenv_perturbation perturbation = {PERTURBATION,
                                           .action_noise = action_noise,
                                           .action_noise_count = 1,
                                           .observation_noise = observation_noise,
                                           .observation_noise_count = 1,
                                           .action_delay = 2,
                                           .observation_delay = 1,
                                           .max_observation_delay = 3,
                                           .pushes = pushes,
                                           .push_count = COUNT(pushes) - !has_free_trunk(env)};
  assert_ok(mjenv_perturb(env, &perturbation));
}

static mjenv_env* plain_env(const char* id, int threads, int64_t rows, const char* mode) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  assert_ok(mjenv_options_set_integer(options, "max_episode_steps", 23));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", mode));
  return env_of_options(options, rows);
}

static mjenv_env* drawing_env(const char* id, int threads, int64_t rows, const char* mode) {
  mjenv_env* env = plain_env(id, threads, rows, mode);
  randomize(env);
  perturb(env);
  return env;
}

// ---- Comparisons ----

static void assert_same_row(mjenv_env* a, struct outputs* out_a, int row_a, mjenv_env* b, struct outputs* out_b,
                            int row_b) {
  const size_t count = outputs_row_count(out_a);
  double *got = allocate(count * sizeof *got), *want = allocate(count * sizeof *want);
  outputs_row(a, out_a, MJENV_ROLE_INFO, row_a, got);
  outputs_row(b, out_b, MJENV_ROLE_INFO, row_b, want);
  assert_same_bits("output", got, want, count);
  free(got);
  free(want);
}

static void assert_same_array(mjenv_env* a, int row_a, mjenv_env* b, int row_b, const char* array) {
  int64_t count, same_count;
  double *got = read_array(a, row_a, array, &count), *want = read_array(b, row_b, array, &same_count);
  assert_int_equal(count, same_count);
  assert_same_bits(array, got, want, count);
  free(got);
  free(want);
}

static void assert_same_rows(mjenv_env* a, int row_a, mjenv_env* b, int row_b) {
  static const char* const arrays[] = {"geom_friction", "body_mass", "opt.gravity",    "dof_damping", "opt.timestep",
                                       "xfrc_applied",  "xpos",      "dof_invweight0", "cfrc_ext"};
  for (size_t i = 0; i < COUNT(arrays); ++i) assert_same_array(a, row_a, b, row_b, arrays[i]);
}

static void draw_actions(double* action, size_t count) {
  for (size_t i = 0; i < count; ++i) action[i] = uniform(-1, 1);
}

// ---- Rows against environments of one row ----

static void test_rows(void** state) {
  char id[64], mode[16];
  int threads;
  assert_int_equal(sscanf(*state, "%63s with %d, %15s", id, &threads, mode), 3);
  mjenv_env *many = drawing_env(id, threads, ROWS, mode), *other = drawing_env(id, 1, 2, mode), *single[ROWS];
  struct outputs *out = outputs_of(many), *one[ROWS];
  const size_t nu = (size_t)action_count(many);
  seed_rows(many, 3);
  assert_ok(mjenv_reset(many, NULL, &out->batch));
  for (int row = 0; row < ROWS; ++row) {
    single[row] = drawing_env(id, 1, 1, mode);
    one[row] = outputs_of(single[row]);
    seed_rows(single[row], 3 + (uint64_t)row);
    assert_ok(mjenv_reset(single[row], NULL, &one[row]->batch));
    assert_same_row(many, out, row, single[row], one[row], 0);
  }
  double* action = allocate(ROWS * nu * sizeof *action);
  for (int t = 0; t < STEPS; ++t) {
    const int row = (int)uniform(0, ROWS);
    int64_t size;
    if (t % 7 == 3) {  // through an image, to another environment and back
      unsigned char* image = image_of(many, row, &size);
      assert_ok(mjenv_restore(other, 1, image, size));
      assert_same_rows(other, 1, many, row);
      free(image);
      image = image_of(other, 1, &size);
      assert_ok(mjenv_restore(many, row, image, size));
      free(image);
    }
    if (t % 11 == 5) {
      uint8_t mask[ROWS] = {0};
      mask[row] = 1;
      assert_ok(mjenv_reset(many, mask, NULL));
      assert_ok(mjenv_reset(single[row], NULL, NULL));
    }
    draw_actions(action, ROWS * nu);
    assert_ok(mjenv_step(many, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT64, &out->batch));
    for (int i = 0; i < ROWS; ++i) {
      assert_ok(mjenv_step(single[i], NULL, action + (size_t)i * nu, nu, MJENV_DTYPE_FLOAT64, &one[i]->batch));
      assert_same_row(many, out, i, single[i], one[i], 0);
    }
    if (t % 5 == 4) assert_same_rows(many, row, single[row], 0);
    if (t % 9 == 4) {  // what the caller has seen last
      struct outputs* again = outputs_of(many);
      assert_ok(mjenv_observe(many, &again->batch));
      assert_same_bits("observe", again->obs, out->obs, (size_t)(ROWS * out->obs_count));
      outputs_free(again);
    }
  }
  // A copied row goes on like the one that it was copied from, in the same environment and through an image.
  uint8_t mask[ROWS] = {0, 1, 1, 0, 0};
  assert_ok(mjenv_copy_row(many, mask, 0));
  for (int t = 0; t < 30; ++t) {
    draw_actions(action, ROWS * nu);
    memcpy(action + nu, action, nu * sizeof *action);
    memcpy(action + 2 * nu, action, nu * sizeof *action);
    assert_ok(mjenv_step(many, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT64, &out->batch));
    assert_ok(mjenv_step(single[0], NULL, action, nu, MJENV_DTYPE_FLOAT64, &one[0]->batch));
    for (int row = 0; row < 3; ++row) assert_same_row(many, out, row, single[0], one[0], 0);
  }
  // Rows that are sent, and rollouts.
  uint8_t was_reset[ROWS];
  double rewards[ROWS], again[ROWS];
  out->batch.was_reset = was_reset;
  int64_t size, count;
  unsigned char* image = image_of(many, MJENV_ALL_ROWS, &size);
  assert_ok(mjenv_step(many, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT64, &out->batch));
  const size_t obs_count = (size_t)(ROWS * out->obs_count);
  double *seen = allocate(obs_count * sizeof *seen), *rolled = allocate(obs_count * sizeof *rolled);
  memcpy(rewards, out->reward, sizeof rewards);
  memcpy(seen, out->obs, obs_count * sizeof *seen);
  assert_ok(mjenv_restore(many, MJENV_ALL_ROWS, image, size));
  assert_ok(mjenv_send(many, NULL, 0, action, ROWS * nu, MJENV_DTYPE_FLOAT64));
  assert_refused(MJENV_E_PENDING, mjenv_randomize(many, NULL, 0), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_perturb(many, NULL), "under way");
  int64_t received[ROWS];
  assert_ok(mjenv_recv(many, ROWS, -1, received, ROWS, &count, &out->batch));
  assert_same_bits("rewards of sent rows", out->reward, rewards, ROWS);
  assert_same_bits("observations of sent rows", out->obs, seen, obs_count);
  assert_ok(mjenv_restore(many, MJENV_ALL_ROWS, image, size));
  mjenv_batch batch = {.struct_size = sizeof batch,
                       .obs_dtype = MJENV_DTYPE_FLOAT64,
                       .rows = ROWS,
                       .obs_count = out->obs_count,
                       .obs = rolled,
                       .reward = again};
  assert_ok(mjenv_rollout(many, action, ROWS * nu, MJENV_DTYPE_FLOAT64, 1, &batch));
  for (int row = 0; row < ROWS; ++row) {
    if (was_reset[row]) continue;  // a rollout resets no row
    const size_t start = (size_t)(row * out->obs_count);
    assert_same_bits("rolled out", &again[row], &rewards[row], 1);
    assert_same_bits("rolled out", rolled + start, seen + start, (size_t)out->obs_count);
  }
  free(seen);
  free(rolled);
  free(image);
  free(action);
  outputs_free(out);
  mjenv_destroy(many);
  mjenv_destroy(other);
  for (int row = 0; row < ROWS; ++row) {
    outputs_free(one[row]);
    mjenv_destroy(single[row]);
  }
}

// ---- Settings that come and go ----

static void assert_same_play(mjenv_env* a, mjenv_env* b, int steps) {
  struct outputs *out_a = outputs_of(a), *out_b = outputs_of(b);
  double action[ROWS * 3];
  for (int t = 0; t < steps; ++t) {
    draw_actions(action, COUNT(action));
    assert_ok(mjenv_step(a, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT64, &out_a->batch));
    assert_ok(mjenv_step(b, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT64, &out_b->batch));
    for (int row = 0; row < ROWS; ++row) assert_same_row(a, out_a, row, b, out_b, row);
  }
  outputs_free(out_a);
  outputs_free(out_b);
}

static void test_begin_with_a_reset(void** state) {
  (void)state;
  mjenv_env *env = plain_env("Hopper-v5", 2, ROWS, "disabled"), *plain = plain_env("Hopper-v5", 1, ROWS, "disabled");
  seed_rows(env, 1);
  seed_rows(plain, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_reset(plain, NULL, NULL));
  assert_same_play(env, plain, 5);
  randomize(env);
  perturb(env);
  assert_same_play(env, plain, 10);
  // Rows that are pushed lose the force when the pushes end; rows keep what they have drawn.
  assert_ok(mjenv_reset(env, NULL, NULL));
  const double action[ROWS * 3] = {0};
  assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT64, NULL));
  int64_t count;
  double *force = read_array(env, 0, "xfrc_applied", &count), *friction = read_array(env, 0, "geom_friction", &count);
  assert_true(force[2 * 6 + 4] != 0);
  free(force);
  assert_ok(mjenv_perturb(env, NULL));
  assert_ok(mjenv_randomize(env, NULL, 0));
  double* kept = read_array(env, 0, "geom_friction", &count);
  assert_same_bits("geom_friction", kept, friction, count);
  force = read_array(env, 0, "xfrc_applied", &count);
  for (int64_t i = 0; i < count; ++i) assert_true(force[i] == 0);
  free(force);
  free(kept);
  free(friction);
  mjenv_destroy(env);
  mjenv_destroy(plain);
}

// Settings that have been removed leave no trace.
static void test_removed(void** state) {
  (void)state;
  mjenv_env *env = plain_env("Hopper-v5", 2, ROWS, "next_step"), *plain = plain_env("Hopper-v5", 1, ROWS, "next_step");
  randomize(env);
  perturb(env);
  assert_ok(mjenv_randomize(env, NULL, 0));
  const mjenv_perturbation none = {PERTURBATION};
  assert_ok(mjenv_perturb(env, &none));
  seed_rows(env, 1);
  seed_rows(plain, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_reset(plain, NULL, NULL));
  assert_same_play(env, plain, 50);
  int64_t size;
  unsigned char* image = image_of(env, 0, &size);
  assert_ok(mjenv_restore(plain, 1, image, size));
  free(image);
  mjenv_destroy(env);
  mjenv_destroy(plain);
}

// After its state was set or written, also by mj_setConst, a row shows the task's own observation.
static void test_observe(void** state) {
  (void)state;
  mjenv_env *env = drawing_env("Hopper-v5", 1, 1, "disabled"), *plain = plain_env("Hopper-v5", 1, 1, "disabled");
  struct outputs *out = outputs_of(env), *clean = outputs_of(plain);
  seed_rows(env, 1);
  seed_rows(plain, 1);
  assert_ok(mjenv_reset(env, NULL, &out->batch));
  assert_ok(mjenv_reset(plain, NULL, &clean->batch));
  for (int64_t i = 0; i < out->obs_count; ++i) assert_true(out->obs[i] == 0);  // the first one is on its way
  int64_t nq, nv;
  double *qpos = read_array(env, 0, "qpos", &nq), *qvel = read_array(env, 0, "qvel", &nv);
  assert_ok(mjenv_set_state(env, 0, qpos, nq, qvel, nv));
  assert_ok(mjenv_observe(env, &out->batch));
  assert_same_bits("observation", out->obs, clean->obs, (size_t)out->obs_count);
  const double action[3] = {0};
  assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT64, &out->batch));
  assert_ok(set_constants(env, 0));
  assert_ok(mjenv_observe(env, &out->batch));
  free(qpos);
  free(qvel);
  qpos = read_array(env, 0, "qpos", &nq), qvel = read_array(env, 0, "qvel", &nv);
  assert_same_bits("positions", out->obs, qpos + 1, nq - 1);
  assert_same_bits("velocities", out->obs + nq - 1, qvel, nv);
  assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT64, NULL));
  qpos[1] = 1.5;
  assert_ok(write_row(env, 0, "qpos", qpos, nq));
  assert_ok(mjenv_observe(env, &out->batch));
  assert_same_bits("written", out->obs, qpos + 1, nq - 1);
  free(qpos);
  free(qvel);
  outputs_free(out);
  outputs_free(clean);
  mjenv_destroy(env);
  mjenv_destroy(plain);
}

// ---- Images ----

static void test_images(void** state) {
  (void)state;
  mjenv_env *plain = plain_env("Hopper-v5", 1, 1, "disabled"), *drawing = plain_env("Hopper-v5", 1, 1, "disabled");
  mjenv_env* perturbed = plain_env("Hopper-v5", 1, 1, "disabled");
  randomize(drawing);
  perturb(perturbed);
  mjenv_env* const envs[] = {plain, drawing, perturbed};
  int64_t size;
  for (size_t i = 0; i < COUNT(envs); ++i) {
    seed_rows(envs[i], 1);
    assert_ok(mjenv_reset(envs[i], NULL, NULL));
  }
  unsigned char* image = image_of(plain, 0, &size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(drawing, 0, image, size), "without randomisation", "mjenv_randomize");
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(perturbed, 0, image, size), "without noise", "mjenv_perturb");
  free(image);
  image = image_of(drawing, 0, &size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(plain, 0, image, size), "with randomisation", "has none");
  const mjenv_randomization item = {ITEM, MJENV_DISTRIBUTION_UNIFORM, "body_mass", PARAMETERS(1, 2),
                                    .effect = MJENV_EFFECT_SCALE};
  assert_ok(mjenv_randomize(drawing, &item, 1));
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(drawing, 0, image, size), "with other randomisation");
  free(image);
  image = image_of(perturbed, 0, &size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(plain, 0, image, size), "with noise, delays or pushes", "has none");
  const mjenv_perturbation other = {PERTURBATION, .action_delay = 1};
  assert_ok(mjenv_perturb(perturbed, &other));
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(perturbed, 0, image, size), "with other noise");
  free(image);
  for (size_t i = 0; i < COUNT(envs); ++i) mjenv_destroy(envs[i]);
}

// A record that no row can have, under a checksum that fits.
static void test_forged(void** state) {
  (void)state;
  mjenv_env* env = drawing_env("Hopper-v5", 1, 1, "disabled");
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  // A phase, twice, and the steps until a push; the last one is right: after a reset, an observation was seen.
  // Three pushes have two numbers each. Number 6 is how many steps the third one lasts, 0 to 4, and number 8 is the
  // observations' delay, which lies in 1 to 3.
  const double forged[] = {7, NAN, 0.5, 5, 1.5, 4, 1.5, NAN, 2};
  const size_t places[] = {0, 0, 1, 6, 6, 8, 8, 8, 0};
  for (size_t i = 0; i < COUNT(forged); ++i) {
    int64_t size;
    size_t bytes;
    unsigned char* image = image_of(env, 0, &size);
    memcpy(image_part(image, "perturbation", &bytes) + 8 * places[i], &forged[i], sizeof forged[i]);
    image_seal(image, size);
    if (i + 1 < COUNT(forged))
      assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, image, size), "damaged");
    else
      assert_ok(mjenv_restore(env, 0, image, size));
    free(image);
  }
  // The ranges of friction, and of masses, which must be positive; in the end, other ranges that are right.
  const double ranges[] = {2, NAN, -1, 0, 0.7};
  const size_t ends[] = {0, 1, 2, 2, 2};
  for (size_t i = 0; i < COUNT(ranges); ++i) {
    int64_t size, count;
    size_t bytes;
    unsigned char* image = image_of(env, 0, &size);
    memcpy(image_part(image, "ranges", &bytes) + 8 * ends[i], &ranges[i], sizeof ranges[i]);
    image_seal(image, size);
    if (i + 1 < COUNT(ranges))
      assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, image, size), "damaged");
    else
      assert_ok(mjenv_restore(env, 0, image, size));
    free(image);
    double range[2];
    assert_ok(mjenv_read(env, 0, "draws[1]", range, 2, &count));
    assert_true(count == 2 && range[0] == (i + 1 < COUNT(ranges) ? 0.5 : 0.7) && range[1] == 2);
  }
  mjenv_destroy(env);
}

// ---- Ranges of rows ----

static void test_refused_ranges(void** state) {
  (void)state;
  mjenv_env* env = drawing_env("Hopper-v5", 2, ROWS, "disabled");
  double values[2 * ROWS], row[2];
  const double none[] = {0.5, 0.5}, descending[] = {2, 1}, infinite[] = {1, INFINITY}, negative[] = {-1, 1};
  uint8_t mask[ROWS] = {0, 0, 0, 1};
  int64_t count = 0;
  assert_refused(MJENV_E_VALUE, mjenv_write(env, mask, "draws[0]", descending, 2), "row 3", "draws[0]",
                 "\"geom_friction\"", "above high");
  assert_refused(MJENV_E_VALUE, mjenv_write(env, mask, "draws[0]", infinite, 2), "row 3", "inf");
  assert_refused(MJENV_E_VALUE, mjenv_write(env, NULL, "draws[1]", negative, 2), "row 0", "\"body_mass\"", "logarithm");
  for (int i = 0; i < 2 * ROWS; ++i) values[i] = 1;
  values[2 * ROWS - 1] = 0.5;
  assert_refused(MJENV_E_VALUE, mjenv_write(env, NULL, "draws[0]", values, 2 * ROWS), "row 4", "above high");
  assert_refused(MJENV_E_SIZE, mjenv_write(env, NULL, "draws[3]", none, 2), "\"draws[3]\" is 2, not 4");
  assert_refused(MJENV_E_NAME, mjenv_write(env, NULL, "draws[4]", none, 2), "\"opt.timestep\" is a choice");
  assert_refused(MJENV_E_NAME, mjenv_write(env, NULL, "draws[6]", none, 2), "no \"draws[6]\"", "6 item(s)");
  assert_refused(MJENV_E_NAME, mjenv_read(env, 0, "draws[-1]", row, 2, &count), "no \"draws[-1]\"");
  for (int64_t i = 0; i < ROWS; ++i) {  // nothing was written
    assert_ok(mjenv_read(env, i, "draws[0]", row, 2, &count));
    assert_true(count == 2 && row[0] == 0.5 && row[1] == 1.5);
  }
  assert_ok(mjenv_write(env, mask, "draws[0]", none, 2));
  assert_ok(mjenv_read(env, 3, "draws[0]", row, 2, &count));
  assert_true(row[1] == 0.5);
  assert_ok(mjenv_read(env, 2, "draws[0]", row, 2, &count));
  assert_true(row[1] == 1.5);
  assert_ok(mjenv_randomize(env, NULL, 0));
  assert_refused(MJENV_E_NAME, mjenv_write(env, NULL, "draws[0]", none, 2), "0 item(s)");
  mjenv_destroy(env);
}

// An item that repeats takes as many elements as were drawn, or for each draw as many of one row of its array. MuJoCo can
// compute with what it takes.
static void test_refused_repeats(void** state) {
  (void)state;
  mjenv_env* env = plain_env("Hopper-v5", 1, 2, "disabled");
  static const int64_t two[] = {1, 2};
  const mjenv_randomization masses = {
      ITEM, MJENV_DISTRIBUTION_UNIFORM, "body_mass", two, 2, PARAMETERS(1, 2), .effect = MJENV_EFFECT_SCALE};
  mjenv_randomization items[] = {masses, masses};
  items[1].repeats = 1;
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, items + 1, 1), "items[0]", "repeats the item before");
  items[1].factor = NAN;
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, items, 2), "items[1]", "factor is nan");
  items[1].factor = -1;
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, items, 2), "items[1]", "body_mass[1]");
  items[1].factor = 0;  // 1
  items[1].element_count = 1;
  assert_refused(MJENV_E_SIZE, mjenv_randomize(env, items, 2), "items[1]", "element_count is 1");
  items[1].array = "body_inertia";
  static const int64_t columns[] = {3, 4, 6, 7, 8, 9};
  items[1].elements = columns;
  items[1].element_count = 4;
  assert_ok(mjenv_randomize(env, items, 2));
  items[1].element_count = 5;
  assert_refused(MJENV_E_SIZE, mjenv_randomize(env, items, 2), "items[1]", "element_count is 5, not 2", "one row");
  items[1].element_count = 6;  // body 1 has the elements 3 to 5
  assert_refused(MJENV_E_SIZE, mjenv_randomize(env, items, 2), "items[1]", "element_count is 6, not 2", "one row");
  items[1].array = "geom_contype";
  items[1].elements = two;
  items[1].element_count = 2;
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, items, 2), "items[1]", "integers");
  items[1].array = "body_inertia";
  items[1].element_count = 1;
  items[0].shared = 1;
  assert_ok(mjenv_randomize(env, items, 2));
  double range[2] = {1, 2};
  int64_t count;
  assert_refused(MJENV_E_NAME, mjenv_read(env, 0, "draws[1]", range, 2, &count), "\"body_inertia\" repeats");
  range[0] = -1;
  assert_refused(MJENV_E_VALUE, mjenv_write(env, NULL, "draws[0]", range, 2), "row 0", "body_mass");
  mjenv_destroy(env);
}

// ---- A draw that is refused ----

// A value that mjenv_write refuses is not drawn either, also if the model itself has such a value as one end.
static void test_refused_draws_beside_the_models_own(void** state) {
  (void)state;
  static const char xml[] =
      "<mujoco><option density='-1'/><worldbody><body><joint/><geom size='.1'/></body></worldbody></mujoco>";
  mjenv_env* env = env_of_model(xml);
  const mjenv_randomization item = {
      ITEM, MJENV_DISTRIBUTION_UNIFORM, "opt.density", NULL, 0, PARAMETERS(-1, 5), .effect = MJENV_EFFECT_VALUE};
  const double negative = -0.5;
  assert_refused(MJENV_E_VALUE, write_row(env, 0, "opt.density", &negative, 1), "opt.density");
  assert_ok(mjenv_randomize(env, &item, 1));
  seed_rows(env, 1);
  int refused = 0, drawn = 0;
  for (int attempt = 0; attempt < 60; ++attempt) {
    const mjenv_status status = mjenv_reset(env, NULL, NULL);
    if (status != MJENV_OK) {
      ++refused;
      assert_refused(MJENV_E_VALUE, status, "opt.density");
      continue;
    }
    ++drawn;
    double density;
    int64_t count;
    assert_ok(mjenv_read(env, 0, "opt.density", &density, 1, &count));
    assert_true(density >= 0);
  }
  assert_true(refused > 3 && drawn > 3);
  mjenv_destroy(env);
}

static void test_refused_draws(void** state) {
  (void)state;
  mjenv_env *env = plain_env("Hopper-v5", 2, ROWS, "disabled"), *same = plain_env("Hopper-v5", 1, ROWS, "disabled");
  const mjenv_randomization item = {ITEM,
                                    MJENV_DISTRIBUTION_NORMAL,
                                    "body_mass",
                                    (const int64_t[]){1, 2},
                                    2,
                                    PARAMETERS(1, 1),
                                    .effect = MJENV_EFFECT_SCALE};
  struct outputs* out = outputs_of(env);
  seed_rows(env, 1);
  seed_rows(same, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_reset(same, NULL, NULL));
  assert_ok(mjenv_randomize(env, &item, 1));
  int refused = 0, drawn = 0;
  for (int attempt = 0; attempt < 20; ++attempt) {
    for (int row = 0; row < ROWS; ++row) {
      uint8_t mask[ROWS] = {0};
      mask[row] = 1;
      int64_t size;
      unsigned char* image = image_of(env, row, &size);
      const mjenv_status status = mjenv_reset(env, mask, &out->batch);
      if (status == MJENV_OK) {
        ++drawn;
        assert_ok(mjenv_restore(env, row, image, size));
        // The next attempt draws other values.
        uint64_t words[4] = {(uint64_t)(attempt * ROWS + row), 2, 3, 4};
        assert_ok(mjenv_set_stream(env, row, words, 4));
      } else {
        ++refused;
        assert_refused(MJENV_E_VALUE, status, "body_mass[", "row ");
        assert_int_equal(out->status[row], MJENV_E_VALUE);
      }
      free(image);
    }
  }
  assert_true(refused > 5 && drawn > 5);
  // The rows are where they were.
  assert_same_play(env, same, 10);
  outputs_free(out);
  mjenv_destroy(env);
  mjenv_destroy(same);
}

// ---- Bad input ----

static void test_refused_randomizations(void** state) {
  (void)state;
  mjenv_env* env = plain_env("Hopper-v5", 1, 2, "disabled");
  const int64_t past[] = {0, 100000}, negative[] = {-1};
  const double range[] = {0.5, 1.5};
  const mjenv_randomization good = {ITEM,
                                    MJENV_DISTRIBUTION_UNIFORM,
                                    "body_mass",
                                    .parameters = range,
                                    .parameter_count = 2,
                                    .effect = MJENV_EFFECT_SCALE};
  assert_refused(MJENV_E_ARGUMENT, mjenv_randomize(NULL, &good, 1), "env");
  assert_refused(MJENV_E_ARGUMENT, mjenv_randomize(env, NULL, 1), "items");
  assert_refused(MJENV_E_SIZE, mjenv_randomize(env, &good, INT64_MAX), "count is");
  mjenv_randomization item;
#define REFUSED(status, change, ...)                                       \
  do {                                                                     \
    item = good;                                                           \
    change;                                                                \
    const mjenv_randomization items[] = {good, item};                      \
    assert_refused((status), mjenv_randomize(env, items, 2), __VA_ARGS__); \
  } while (0)
#define DRAWN(...) \
  item.parameters = (const double[]){__VA_ARGS__}, item.parameter_count = COUNT(((const double[]){__VA_ARGS__}))
  REFUSED(MJENV_E_ARGUMENT, item.struct_size = 8, "items[1]", "struct_size");
  REFUSED(MJENV_E_ARGUMENT, item.array = NULL, "items[1]", "array");
  REFUSED(MJENV_E_NAME, item.array = "no_such_array", "items[1]", "no_such_array");
  REFUSED(MJENV_E_NAME, item.array = "gravity", "items[1], \"gravity\"", "is one of these meant? opt.gravity");
  REFUSED(MJENV_E_NAME, item.array = "mass", "is one of these meant? body_mass");
  REFUSED(MJENV_E_NAME, item.array = "geom_frictoin", "is one of these meant? geom_friction");
  REFUSED(MJENV_E_NAME, item.array = "xpos", "those that can be drawn are", "body_pos");
  REFUSED(MJENV_E_NAME, item.array = "body_parentid", "structure");
  REFUSED(MJENV_E_NAME, item.array = "xfrc_applied", "mjModel");
  REFUSED(MJENV_E_NAME, item.array = "qpos", "\"qpos\"");
  REFUSED(MJENV_E_ARGUMENT, item.distribution = 0, "no distribution 0");
  REFUSED(MJENV_E_ARGUMENT, item.distribution = 6, "no distribution 6");
  REFUSED(MJENV_E_ARGUMENT, item.effect = 0, "no effect 0");
  REFUSED(MJENV_E_ARGUMENT, item.parameters = NULL, "parameters");
  REFUSED(MJENV_E_SIZE, item.parameter_count = 3, "parameter_count is 3");
  REFUSED(MJENV_E_SIZE, item.parameter_count = -1, "parameter_count is -1");
  REFUSED(MJENV_E_SIZE, (item.distribution = MJENV_DISTRIBUTION_CHOICE, item.parameter_count = 0), "parameter_count");
  REFUSED(MJENV_E_SIZE, (item.distribution = MJENV_DISTRIBUTION_CHOICE, item.parameter_count = INT64_MAX), "body_mass");
  REFUSED(MJENV_E_SIZE, item.element_count = 1, "element_count");
  REFUSED(MJENV_E_SIZE, (item.elements = past, item.element_count = INT64_MAX), "element_count");
  REFUSED(MJENV_E_VALUE, (item.elements = past, item.element_count = 2), "body_mass", "element 100000");
  REFUSED(MJENV_E_VALUE, (item.elements = negative, item.element_count = 1), "element -1");
  REFUSED(MJENV_E_VALUE, DRAWN(1.5, 0.5), "body_mass", "above high");
  REFUSED(MJENV_E_VALUE, DRAWN(NAN, 0.5), "a parameter is nan");
  REFUSED(MJENV_E_VALUE, DRAWN(0.5, INFINITY), "a parameter is inf");
  REFUSED(MJENV_E_VALUE, DRAWN(-1, 1), "body_mass[", "negative");
  REFUSED(MJENV_E_VALUE, DRAWN(0, 1), "body_mass[", "positive");
  REFUSED(MJENV_E_VALUE, (item.array = "opt.gravity", DRAWN(-1.7e308, 1.7e308)), "not finite");
  REFUSED(MJENV_E_VALUE, (item.distribution = MJENV_DISTRIBUTION_LOG_UNIFORM, DRAWN(0, 1)), "logarithm");
  REFUSED(MJENV_E_VALUE, (item.distribution = MJENV_DISTRIBUTION_NORMAL, DRAWN(1, -1)), "standard deviation");
  REFUSED(MJENV_E_VALUE, (item.distribution = MJENV_DISTRIBUTION_NORMAL, DRAWN(-1, 1)), "negative");
  REFUSED(MJENV_E_VALUE, (item.distribution = MJENV_DISTRIBUTION_CHOICE, DRAWN(1, 2, -3)), "negative");
  REFUSED(MJENV_E_VALUE, (item.distribution = MJENV_DISTRIBUTION_TRUNCATED_NORMAL, DRAWN(0, 1, 20, 30)), "thousandth");
  REFUSED(MJENV_E_VALUE, (item.distribution = MJENV_DISTRIBUTION_TRUNCATED_NORMAL, DRAWN(0, 0, 1, 2)), "thousandth");
  REFUSED(MJENV_E_VALUE, (item.distribution = MJENV_DISTRIBUTION_TRUNCATED_NORMAL, DRAWN(1, 1, 2, 1)), "above high");
  REFUSED(MJENV_E_VALUE, item.array = "geom_contype", "MJENV_DISTRIBUTION_CHOICE");
  REFUSED(MJENV_E_VALUE,
          (item.array = "geom_contype", item.distribution = MJENV_DISTRIBUTION_CHOICE, DRAWN(1, 0.5),
           item.effect = MJENV_EFFECT_VALUE),
          "integer");
  // Nothing was set.
  mjenv_env* plain = plain_env("Hopper-v5", 1, 2, "disabled");
  int64_t size, same_size;
  free(image_of(env, 0, &size));
  free(image_of(plain, 0, &same_size));
  assert_int_equal(size, same_size);
  mjenv_destroy(env);
  mjenv_destroy(plain);
}

static void test_refused_perturbations(void** state) {
  (void)state;
  mjenv_env* env = plain_env("Hopper-v5", 1, 2, "disabled");
  const double noise[] = {0.1, 0.1, 0.1}, negative[] = {0.1, -1, 0}, not_a_number[] = {NAN};
  const mjenv_push push = {PUSH, .body = 1, .min_steps = 1, .max_steps = 2, .high = {1}};
  const mjenv_perturbation good = {PERTURBATION, .action_noise = noise, .action_noise_count = 3, .pushes = &push,
                                   .push_count = 1};
  assert_refused(MJENV_E_ARGUMENT, mjenv_perturb(NULL, &good), "env");
  mjenv_perturbation given;
  mjenv_push pushes[2];
#undef REFUSED
#define REFUSED(status, change, ...)                                   \
  do {                                                                 \
    given = good;                                                      \
    pushes[0] = pushes[1] = push;                                      \
    pushes[1].body = 2;                                                \
    given.pushes = pushes;                                             \
    given.push_count = 2;                                              \
    change;                                                            \
    assert_refused((status), mjenv_perturb(env, &given), __VA_ARGS__); \
  } while (0)
  REFUSED(MJENV_E_ARGUMENT, given.struct_size = 8, "perturbation", "struct_size");
  REFUSED(MJENV_E_ARGUMENT, given.action_noise = NULL, "action_noise");
  REFUSED(MJENV_E_SIZE, given.action_noise_count = 2, "action_noise_count");
  REFUSED(MJENV_E_SIZE, given.action_noise_count = -1, "action_noise_count");
  REFUSED(MJENV_E_VALUE, given.action_noise = negative, "action_noise[1]");
  REFUSED(MJENV_E_VALUE, (given.observation_noise = not_a_number, given.observation_noise_count = 1),
          "observation_noise[0]");
  REFUSED(MJENV_E_SIZE, (given.observation_noise = noise, given.observation_noise_count = 3), "observation_noise");
  REFUSED(MJENV_E_VALUE, given.action_delay = -1, "action_delay");
  REFUSED(MJENV_E_VALUE, given.observation_delay = INT64_MAX, "observation_delay");
  REFUSED(MJENV_E_VALUE, (given.action_delay = 3, given.max_action_delay = 2), "max_action_delay is 2, not 3");
  REFUSED(MJENV_E_VALUE, given.max_action_delay = -1, "max_action_delay is -1");
  REFUSED(MJENV_E_VALUE, given.max_observation_delay = 1000001, "max_observation_delay is 1000001");
  REFUSED(MJENV_E_ARGUMENT, given.pushes = NULL, "pushes");
  REFUSED(MJENV_E_SIZE, given.push_count = -1, "push_count");
  REFUSED(MJENV_E_SIZE, given.push_count = INT64_MAX, "push_count");
  REFUSED(MJENV_E_ARGUMENT, pushes[0].struct_size = 8, "pushes[0]", "struct_size");
  REFUSED(MJENV_E_VALUE, pushes[1].body = 0, "pushes[1]", "body is 0");
  REFUSED(MJENV_E_VALUE, pushes[1].body = 100, "body is 100");
  REFUSED(MJENV_E_VALUE, pushes[1].body = 1, "twice");
  REFUSED(MJENV_E_VALUE, pushes[1].min_steps = 0, "min_steps is 0");
  REFUSED(MJENV_E_VALUE, pushes[1].min_steps = 3, "min_steps is 3");
  REFUSED(MJENV_E_VALUE, pushes[1].max_steps = INT64_MAX, "max_steps");
  REFUSED(MJENV_E_VALUE, pushes[1].low[2] = 1, "low[2]");
  REFUSED(MJENV_E_VALUE, pushes[1].low[5] = NAN, "low[5]");
  REFUSED(MJENV_E_VALUE, pushes[1].high[0] = INFINITY, "high[0]");
  REFUSED(MJENV_E_VALUE, pushes[1].is_kick = 1, "pushes[1]", "body 2 has no free joint");
  REFUSED(MJENV_E_VALUE, pushes[1].max_duration = 2, "min_duration is 0 and max_duration 2");
  REFUSED(MJENV_E_VALUE, (pushes[1].min_duration = 3, pushes[1].max_duration = 2), "min_duration is 3");
  REFUSED(MJENV_E_VALUE, (pushes[1].min_duration = 1, pushes[1].max_duration = INT64_MAX), "max_duration");
  mjenv_destroy(env);
}

// A body can have a force and a kick, so there can be more pushes than bodies.
static void test_force_and_kick_of_each_body(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Model-v0");
  assert_ok(mjenv_options_set_string(options, "xml_string",
                                     "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body><body pos='1 0 0'>"
                                     "<freejoint/><geom size='.1'/></body></worldbody></mujoco>"));
  mjenv_env* env = env_of_options(options, 1);
  mjenv_push pushes[4];
  for (int32_t i = 0; i < 4; ++i)
    pushes[i] = (mjenv_push){PUSH,       .body = 1 + i / 2, .min_steps = 1,  .max_steps = 1,
                             .low = {1}, .high = {1},       .is_kick = i % 2};
  const mjenv_perturbation all = {PERTURBATION, .pushes = pushes, .push_count = 4};
  assert_ok(mjenv_perturb(env, &all));
  assert_ok(mjenv_reset(env, NULL, NULL));
  const double action[1] = {0};
  assert_ok(mjenv_step(env, NULL, action, 0, MJENV_DTYPE_FLOAT64, NULL));
  int64_t count;
  double* forces = read_array(env, 0, "xfrc_applied", &count);
  double* velocities = read_array(env, 0, "qvel", &count);
  for (int body = 0; body < 2; ++body) {
    assert_true(forces[6 * (body + 1)] == 1);
    assert_true(velocities[6 * body] > 1);  // the kick's, and what the force adds
  }
  free(forces);
  free(velocities);
  mjenv_destroy(env);
}

// The processor's seconds that a reset takes, the fewest of some.
static double reset_seconds(mjenv_env* env) {
  double least = INFINITY;
  for (int i = 0; i < 5; ++i) {
    const clock_t start = clock();
    assert_ok(mjenv_reset(env, NULL, NULL));
    least = fmin(least, (double)(clock() - start) / CLOCKS_PER_SEC);
  }
  return least;
}

// mj_setConst does not touch textures or arrays of constraints, so a reset that calls it must not copy or clear these:
// it took more than 500 times as long as one without, and takes less than 5 times.
static void test_cost_of_constants(void** state) {
  (void)state;
  static const char xml[] =
      "<mujoco><size njmax='700'/><asset><texture type='skybox' builtin='gradient' rgb1='0 0 0' rgb2='1 1 1' "
      "width='800' height='800'/></asset><worldbody><body><joint/><geom size='1'/></body></worldbody></mujoco>";
  double seconds[2];
  for (int32_t constants = 0; constants < 2; ++constants) {
    const mjenv_randomization item = {ITEM,
                                      MJENV_DISTRIBUTION_UNIFORM,
                                      "body_mass",
                                      PARAMETERS(0.5, 1.5),
                                      .effect = MJENV_EFFECT_SCALE,
                                      .constants = constants};
    mjenv_options* options = options_of_id("Model-v0");
    assert_ok(mjenv_options_set_string(options, "xml_string", xml));
    mjenv_env* env = env_of_options(options, 100);
    assert_ok(mjenv_randomize(env, &item, 1));
    assert_ok(mjenv_reset(env, NULL, NULL));
    seconds[constants] = reset_seconds(env);
    mjenv_destroy(env);
  }
  assert_true(seconds[1] < 30 * seconds[0] + 0.02);  // some clocks are coarse
}

int main(int argc, char** argv) {
  (void)argc, (void)argv;
#define WITH(id, threads, mode) \
  { id " with " #threads ", " mode, test_rows, NULL, NULL, id " with " #threads ", " mode }
  const struct CMUnitTest tests[] = {
      WITH("Hopper-v5", 1, "next_step"),
      WITH("Hopper-v5", 5, "same_step"),
      WITH("Ant-v5", 2, "next_step"),
      WITH("Humanoid-v4", 5, "same_step"),
      WITH("Reacher-v5", 2, "next_step"),
      cmocka_unit_test(test_begin_with_a_reset),
      cmocka_unit_test(test_removed),
      cmocka_unit_test(test_force_and_kick_of_each_body),
      cmocka_unit_test(test_cost_of_constants),
      cmocka_unit_test(test_observe),
      cmocka_unit_test(test_images),
      cmocka_unit_test(test_forged),
      cmocka_unit_test(test_refused_ranges),
      cmocka_unit_test(test_refused_repeats),
      cmocka_unit_test(test_refused_draws),
      cmocka_unit_test(test_refused_draws_beside_the_models_own),
      cmocka_unit_test(test_refused_randomizations),
      cmocka_unit_test(test_refused_perturbations),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
