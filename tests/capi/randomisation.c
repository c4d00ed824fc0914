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

static void randomize(mjenv_env* env) {
  assert_ok(mjenv_randomize(
      env,
      "{\"randomize\": {\"geom_friction\": {\"kind\": \"scale\", \"low\": 0.5, \"high\": 1.5},"
      "\"body_mass\": {\"kind\": \"scale\", \"distribution\": \"log_uniform\", \"low\": 0.5, \"high\": 2,"
      " \"shared\": true, \"set_constants\": true},"
      "\"opt.gravity\": {\"kind\": \"offset\", \"distribution\": \"normal\", \"mean\": 0, \"std\": 0.5,"
      " \"elements\": [2]},"
      "\"dof_damping\": {\"kind\": \"scale\", \"distribution\": \"truncated_normal\", \"mean\": 1, \"std\": 0.2,"
      " \"low\": 0.9, \"high\": 1.4},"
      "\"opt.timestep\": {\"choices\": [0.008, 0.01, 0.002]},"
      "\"tendon_stiffness\": {\"low\": 0, \"high\": 1}}}"));
}

// Whether body 1 has a free joint, so that it can be kicked.
static bool has_free_trunk(mjenv_env* env) {
  int64_t count;
  double* types = read_array(env, 0, "jnt_type", &count);
  const bool is_free = count > 0 && types[0] == 0;
  free(types);
  return is_free;
}

static void perturb(mjenv_env* env) {
  char document[1000];
  snprintf(document, sizeof document,
           "{\"noise\": {\"action\": 0.1, \"observation\": 0.02}, \"delay\": {\"action\": 2, \"observation\": [1, 3]},"
           "\"push\": [{\"body\": 1, \"every\": [2, 7], \"force\": [[-20, 20], [-20, 20], [0, 5]]},"
           "{\"body\": 2, \"every\": 1, \"torque\": [[-1, 1], [-1, 1], [-1, 1]]},"
           "{\"body\": 3, \"every\": [1, 3], \"duration\": [1, 4], \"force\": [[-3, 3], [0, 0], [0, 0]]}%s]}",
           has_free_trunk(env) ? ", {\"body\": 1, \"every\": [1, 4], \"velocity\": [[-1, 1], [0, 0], [0, 0]],"
                                 " \"angular_velocity\": [[-1, 1], [0, 0], [0, 0]]}"
                               : "");
  assert_ok(mjenv_randomize(env, document));
}

// Documents in which nothing is drawn, and nothing perturbed.
#define MASSES(draw) "{\"randomize\": {\"body_mass\": {\"kind\": \"scale\", " draw "}}}"
#define NO_DRAWS "{\"randomize\": null}"
#define NO_PERTURBATION "{\"noise\": null, \"delay\": null, \"push\": null}"

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
  assert_refused(MJENV_E_PENDING, mjenv_randomize(many, "{}"), "under way");
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
  assert_ok(mjenv_randomize(env, NO_PERTURBATION));
  assert_ok(mjenv_randomize(env, NO_DRAWS));
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
  assert_ok(mjenv_randomize(env, NULL));
  const char* document;
  assert_ok(mjenv_randomization(env, &document));
  assert_string_equal(document, "{}");
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
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(perturbed, 0, image, size), "without noise", "mjenv_randomize");
  free(image);
  image = image_of(drawing, 0, &size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(plain, 0, image, size), "with randomisation", "has none");
  assert_ok(mjenv_randomize(drawing, MASSES("\"low\": 1, \"high\": 2")));
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(drawing, 0, image, size), "with other randomisation");
  free(image);
  image = image_of(perturbed, 0, &size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(plain, 0, image, size), "with noise, delays or pushes", "has none");
  assert_ok(mjenv_randomize(perturbed, "{\"noise\": null, \"push\": null, \"delay\": {\"action\": 1}}"));
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
  assert_ok(mjenv_randomize(env, NO_DRAWS));
  assert_refused(MJENV_E_NAME, mjenv_write(env, NULL, "draws[0]", none, 2), "0 item(s)");
  mjenv_destroy(env);
}

// An item that repeats takes as many elements as were drawn, or for each draw as many of one row of its array. MuJoCo can
// compute with what it takes.
static void test_refused_repeats(void** state) {
  (void)state;
  mjenv_env* env = plain_env("Hopper-v5", 1, 2, "disabled");
#define TWO(first, array, second)                                                                             \
  "{\"randomize\": {\"body_mass\": {\"kind\": \"scale\", \"low\": 1, \"high\": 2, \"elements\": [1, 2]" first \
  "}, \"" array "\": {\"kind\": \"same\"" second "}}}"
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, "{\"randomize\": {\"body_mass\": {\"kind\": \"same\"}}}"),
                 "randomize.body_mass", "there is none");
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, TWO("", "body_inertia", ", \"factor\": 0")), "must not be 0");
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, TWO("", "body_ipos", ", \"elements\": [3, 6], \"factor\": 1e999")),
                 "no JSON");
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, TWO("", "body_inertia", ", \"elements\": [3, 6], \"factor\": -1")),
                 "randomize.body_inertia", "body_inertia[");
  assert_refused(MJENV_E_SIZE, mjenv_randomize(env, TWO("", "body_inertia", ", \"elements\": 3")), "1 elements, not 2");
  assert_ok(mjenv_randomize(env, TWO("", "body_inertia", ", \"elements\": [3, 4, 6, 7]")));
  assert_refused(MJENV_E_SIZE, mjenv_randomize(env, TWO("", "body_inertia", ", \"elements\": [3, 4, 6, 7, 8]")),
                 "5 elements, not 2", "one row");
  assert_refused(MJENV_E_SIZE,  // body 1 has the elements 3 to 5
                 mjenv_randomize(env, TWO("", "body_inertia", ", \"elements\": [3, 4, 6, 7, 8, 9]")),
                 "6 elements, not 2", "one row");
  assert_refused(MJENV_E_VALUE, mjenv_randomize(env, TWO("", "geom_contype", ", \"elements\": [1, 2]")), "integers");
  assert_ok(mjenv_randomize(env, TWO(", \"shared\": true", "body_inertia", ", \"elements\": [3]")));
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
  const double negative = -0.5;
  assert_refused(MJENV_E_VALUE, write_row(env, 0, "opt.density", &negative, 1), "opt.density");
  assert_ok(mjenv_randomize(env, "{\"randomize\": {\"opt.density\": {\"low\": -1, \"high\": 5}}}"));
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
  struct outputs* out = outputs_of(env);
  seed_rows(env, 1);
  seed_rows(same, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_reset(same, NULL, NULL));
  assert_ok(
      mjenv_randomize(env, MASSES("\"distribution\": \"normal\", \"mean\": 1, \"std\": 1, \"elements\": [1, 2]")));
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

static void test_refused_documents(void** state) {
  (void)state;
  static const struct {
    mjenv_status status;
    const char *document, *words[2];
  } cases[] = {
      {MJENV_E_VALUE, " ", {"no JSON"}},
      {MJENV_E_VALUE, "{\"noise\": {}} {}", {"no JSON"}},
      {MJENV_E_VALUE, "{", {"no JSON", "line 1, column 2"}},
      {MJENV_E_VALUE, "{\"noise\": {\"action\": 1e999}}", {"no JSON"}},
      {MJENV_E_VALUE, "{\"noise\": {\"action\": NaN}}", {"no JSON"}},
      {MJENV_E_SIZE, "[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]", {"more than 16 brackets"}},
      {MJENV_E_TYPE, "[]", {"an object"}},
      {MJENV_E_NAME, "{\"noise\": {}, \"noise\": {}}", {"\"noise\" twice"}},
      {MJENV_E_NAME, "{\"noises\": {}}", {"noises", "is one of these meant? noise"}},
      {MJENV_E_NAME, "{\"x\": {}}", {"\"x\"", "there are randomize, noise, delay, push"}},
      {MJENV_E_TYPE, "{\"randomize\": []}", {"randomize:"}},
      {MJENV_E_TYPE, "{\"randomize\":{\"body_mass\":2}}", {"randomize.body_mass"}},
      {MJENV_E_NAME, "{\"randomize\":{\"no_such_array\":{\"low\":1,\"high\":2}}}", {"randomize.no_such_array"}},
      {MJENV_E_NAME, "{\"randomize\":{\"gravity\":{\"low\":1,\"high\":2}}}", {"is one of these meant? opt.gravity"}},
      {MJENV_E_NAME, "{\"randomize\":{\"mass\":{\"low\":1,\"high\":2}}}", {"is one of these meant? body_mass"}},
      {MJENV_E_NAME,
       "{\"randomize\":{\"geom_frictoin\":{\"low\":1,\"high\":2}}}",
       {"is one of these meant? geom_friction"}},
      {MJENV_E_NAME, "{\"randomize\":{\"xpos\":{\"low\":1,\"high\":2}}}", {"those that can be drawn are", "body_pos"}},
      {MJENV_E_NAME, "{\"randomize\":{\"body_parentid\":{\"low\":1,\"high\":2}}}", {"structure"}},
      {MJENV_E_NAME, "{\"randomize\":{\"xfrc_applied\":{\"low\":1,\"high\":2}}}", {"mjModel"}},
      {MJENV_E_NAME, "{\"randomize\":{\"qpos\":{\"low\":1,\"high\":2}}}", {"qpos"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"distribution\":\"beta\"}}}",
       {"randomize.body_mass.distribution", "beta"}},
      {MJENV_E_VALUE, "{\"randomize\":{\"body_mass\":{\"kind\":\"other\"}}}", {"randomize.body_mass.kind"}},
      {MJENV_E_NAME, "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"lowest\":1}}}", {"lowest"}},
      {MJENV_E_TYPE, "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1}}}", {"low, high"}},
      {MJENV_E_TYPE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":\"1\",\"high\":2}}}",
       {"randomize.body_mass.low", "a number"}},
      {MJENV_E_SIZE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"choices\":[]}}}",
       {"randomize.body_mass.choices"}},
      {MJENV_E_TYPE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"shared\":1}}}",
       {"randomize.body_mass.shared"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"elements\":[0,100000]}}}",
       {"randomize.body_mass.elements[1]", "100000"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"elements\":-1}}}",
       {"element -1"}},
      {MJENV_E_TYPE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"elements\":9223372036854775808}}}",
       {"an integer"}},
      {MJENV_E_TYPE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"elements\":1.5}}}",
       {"an integer"}},
      {MJENV_E_TYPE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"geom\":1}}}",
       {"not selected by geom"}},
      {MJENV_E_NAME,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"body\":[\"torso\",\"arm\"]}}}",
       {"randomize.body_mass.body[1]", "arm"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"body\":99}}}",
       {"no element"}},
      {MJENV_E_TYPE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"body\":1,\"elements\":1}}}",
       {"give one of"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"columns\":0}}}",
       {"no columns"}},
      {MJENV_E_VALUE, "{\"randomize\":{\"geom_friction\":{\"low\":1,\"high\":2,\"columns\":3}}}", {"3 columns"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1,\"high\":2,\"body\":\"torso\\u0000\"}}}",
       {"null character"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":1.5,\"high\":0.5}}}",
       {"body_mass", "above high"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":-1,\"high\":1}}}",
       {"body_mass[", "negative"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":0,\"high\":1}}}",
       {"body_mass[", "positive"}},
      {MJENV_E_VALUE, "{\"randomize\":{\"opt.gravity\":{\"low\":-1.7e308,\"high\":1.7e308}}}", {"not finite"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"distribution\":\"log_uniform\",\"low\":0,\"high\":1}}}",
       {"logarithm"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"distribution\":\"normal\",\"mean\":1,\"std\":-1}}}",
       {"standard deviation"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"distribution\":\"normal\",\"mean\":-1,\"std\":1}}}",
       {"negative"}},
      {MJENV_E_VALUE, "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"choices\":[1,2,-3]}}}", {"negative"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"distribution\":\"truncated_normal\",\"mean\":0,\"std\":1,"
       "\"low\":20,\"high\":30}}}",
       {"thousandth"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"distribution\":\"truncated_normal\",\"mean\":0,\"std\":0,"
       "\"low\":1,\"high\":2}}}",
       {"thousandth"}},
      {MJENV_E_VALUE,
       "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"distribution\":\"truncated_normal\",\"mean\":1,\"std\":1,"
       "\"low\":2,\"high\":1}}}",
       {"above high"}},
      {MJENV_E_VALUE, "{\"randomize\":{\"geom_contype\":{\"low\":1,\"high\":2}}}", {"integers"}},
      {MJENV_E_VALUE, "{\"randomize\":{\"geom_contype\":{\"choices\":[1,0.5]}}}", {"integer"}},
      {MJENV_E_SIZE, "{\"noise\":{\"action\":[0.1,0.1]}}", {"noise.action: 2 numbers, 3 or 1 expected"}},
      {MJENV_E_SIZE, "{\"noise\":{\"action\":[]}}", {"0 numbers"}},
      {MJENV_E_VALUE, "{\"noise\":{\"action\":[0.1,-1,0]}}", {"noise.action[1]"}},
      {MJENV_E_SIZE, "{\"noise\":{\"observation\":[1,2,3]}}", {"noise.observation: 3 numbers, 11 or 1 expected"}},
      {MJENV_E_VALUE, "{\"delay\":{\"action\":-1}}", {"delay.action"}},
      {MJENV_E_VALUE, "{\"delay\":{\"observation\":9223372036854775807}}", {"delay.observation"}},
      {MJENV_E_VALUE, "{\"delay\":{\"action\":[3,2]}}", {"wrong order"}},
      {MJENV_E_VALUE, "{\"delay\":{\"observation\":[0,1000001]}}", {"1000001"}},
      {MJENV_E_TYPE, "{\"delay\":{\"action\":[1,2,3]}}", {"pair"}},
      {MJENV_E_VALUE, "{\"delay\":{\"redraw\":\"episode\"}}", {"reset, step"}},
      {MJENV_E_SIZE, "{\"delay\":{\"action\":1,\"first_action\":[1,2]}}", {"delay.first_action"}},
      {MJENV_E_TYPE, "{\"push\":{}}", {"no body"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":0}]}", {"push[0].body: body 0"}},
      {MJENV_E_VALUE, "{\"push\":{\"body\":100}}", {"push.body: body 100"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":1},{\"body\":1}]}", {"push[1]", "twice"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":1},{\"body\":2,\"every\":[0,1]}]}", {"every is [0, 1]"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":1},{\"body\":2,\"every\":[3,2]}]}", {"wrong order"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":1},{\"body\":2,\"every\":[1,9223372036854775807]}]}", {"every"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":1},{\"body\":2,\"force\":[[0,0],[0,0],[1,0]]}]}", {"low[2]"}},
      {MJENV_E_TYPE, "{\"push\":[{\"body\":1},{\"body\":2,\"force\":[[0,0],[0,0]]}]}", {"push[1].force"}},
      {MJENV_E_TYPE, "{\"push\":[{\"body\":1},{\"body\":2,\"force\":[[0,0],[0,0],[1]]}]}", {"push[1].force[2]"}},
      {MJENV_E_VALUE,
       "{\"push\":[{\"body\":1},{\"body\":2,\"velocity\":[[0,1],[0,0],[0,0]]}]}",
       {"push[1]", "body 2 has no free joint"}},
      {MJENV_E_VALUE,
       "{\"push\":[{\"body\":1},{\"body\":2,\"force\":[[0,1],[0,0],[0,0]],\"velocity\":[[0,1],[0,0],[0,0]]}]}",
       {"two pushes"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":1},{\"body\":2,\"duration\":[0,2]}]}", {"duration is [0, 2]"}},
      {MJENV_E_VALUE, "{\"push\":[{\"body\":1},{\"body\":2,\"duration\":[1,9223372036854775807]}]}", {"duration"}},
  };
  mjenv_env *env = plain_env("Hopper-v5", 1, 2, "disabled"), *plain = plain_env("Hopper-v5", 1, 2, "disabled");
  assert_refused(MJENV_E_ARGUMENT, mjenv_randomize(NULL, "{}"), "env");
  // Too many bytes, too many values, a long text.
  static const struct {
    const char *begin, *again, *words;
    int times;
  } huge[] = {{"1", " ", "16777216", 1 << 24}, {"[1", ",1", "1000000", 1000000}, {"\"", "x", "1000", 1001}};
  for (size_t i = 0; i < COUNT(huge); ++i) {
    const size_t width = strlen(huge[i].again);
    char *document = allocate(huge[i].times * width + 4), *end = stpcpy(document, huge[i].begin);
    for (int k = 0; k < huge[i].times; ++k, end += width) memcpy(end, huge[i].again, width);
    strcpy(end, i == 2 ? "\"" : "");
    assert_refused(MJENV_E_SIZE, mjenv_randomize(env, document), "more than", huge[i].words);
    free(document);
  }
  for (size_t i = 0; i < COUNT(cases); ++i) {
    const char* second = cases[i].words[1] ? cases[i].words[1] : "";
    assert_refused(cases[i].status, mjenv_randomize(env, cases[i].document), cases[i].words[0], second);
  }
  // Nothing was set.
  int64_t size, same_size;
  free(image_of(env, 0, &size));
  free(image_of(plain, 0, &same_size));
  assert_int_equal(size, same_size);
  const char* document;
  assert_ok(mjenv_randomization(env, &document));
  assert_string_equal(document, "{}");
  mjenv_destroy(env);
  mjenv_destroy(plain);
}

// A part that a document lacks stays, and what is set is a document that sets it again.
static void test_parts(void** state) {
  (void)state;
  mjenv_env *env = plain_env("Hopper-v5", 1, 2, "disabled"), *same = plain_env("Hopper-v5", 1, 2, "disabled");
  const char* document;
  assert_ok(mjenv_randomize(env, MASSES("\"low\": 0.1, \"high\": 2, \"body\": null")));
  assert_ok(mjenv_randomize(env, "{\"push\": {\"body\": \"torso\"}, \"noise\": {\"action\": [0.1, 0, 1e-3]}}"));
  assert_ok(mjenv_randomization(env, &document));
  assert_string_equal(document,
                      "{\"randomize\":{\"body_mass\":{\"kind\":\"scale\",\"low\":0.1,\"high\":2}},"
                      "\"noise\":{\"action\":[0.1,0,0.001]},\"push\":{\"body\":\"torso\"}}");
  assert_ok(mjenv_randomize(same, document));
  int64_t size;
  assert_ok(mjenv_reset(env, NULL, NULL));
  unsigned char* image = image_of(env, 0, &size);
  assert_ok(mjenv_restore(same, 0, image, size));
  free(image);
  mjenv_destroy(env);
  mjenv_destroy(same);
}

// A body can have a force and a kick, so there can be more pushes than bodies.
static void test_force_and_kick_of_each_body(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Model-v0");
  assert_ok(mjenv_options_set_string(options, "xml_string",
                                     "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body><body pos='1 0 0'>"
                                     "<freejoint/><geom size='.1'/></body></worldbody></mujoco>"));
  mjenv_env* env = env_of_options(options, 1);
#define ONE "[[1, 1], [0, 0], [0, 0]]"
  assert_ok(mjenv_randomize(
      env, "{\"push\": [{\"body\": 1, \"every\": 1, \"force\": " ONE "}, {\"body\": 1, \"every\": 1, \"velocity\": " ONE
           "}, {\"body\": 2, \"every\": 1, \"force\": " ONE "}, {\"body\": 2, \"every\": 1, \"velocity\": " ONE "}]}"));
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
    mjenv_options* options = options_of_id("Model-v0");
    assert_ok(mjenv_options_set_string(options, "xml_string", xml));
    mjenv_env* env = env_of_options(options, 100);
    assert_ok(mjenv_randomize(env, constants ? MASSES("\"low\": 0.5, \"high\": 1.5, \"set_constants\": true")
                                             : MASSES("\"low\": 0.5, \"high\": 1.5")));
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
      cmocka_unit_test(test_refused_documents),
      cmocka_unit_test(test_parts),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
