// One row's state: arrays by name, set_state, simulate, snapshots, streams.
#include <math.h>

#include "golden.h"

enum { RESET, STEP, SET_STATE, SIMULATE, FRAMES = 3 };

// ---- Against Gymnasium ----

static void follow_stage(const struct golden* golden, mjenv_env* env, struct outputs* out, size_t stage) {
  double action[64], qpos[64], qvel[64], ctrl[64];
  mjenv_dtype dtype;
  int64_t nu;
  golden_action(golden, stage, action, &dtype, &nu);
  switch (((const uint8_t*)golden_array(golden, "stage", "u1")->data)[stage]) {
    case RESET: assert_ok(mjenv_reset(env, NULL, &out->batch)); break;
    case STEP: assert_ok(mjenv_step(env, NULL, action, nu, dtype, &out->batch)); break;
    case SET_STATE:
      golden_row(golden, "set_qpos", stage, qpos);
      golden_row(golden, "set_qvel", stage, qvel);
      assert_ok(mjenv_set_state(env, 0, qpos, golden_array(golden, "set_qpos", "f8")->columns, qvel,
                                golden_array(golden, "set_qvel", "f8")->columns));
      break;
    case SIMULATE:
      assert_int_equal(dtype, MJENV_DTYPE_FLOAT32);
      for (int64_t i = 0; i < nu; ++i) ctrl[i] = ((const float*)(const void*)action)[i];
      assert_ok(mjenv_simulate(env, 0, ctrl, nu, FRAMES));
      break;
  }
}

static void assert_same(const struct golden* golden, const char* recorded, size_t row, const double* got,
                        size_t count) {
  char why[256];
  if (!golden_same(golden, recorded, row, got, count, why, sizeof why)) fail_msg("stage %zu: %s", row, why);
}

static void assert_array(const struct golden* golden, mjenv_env* env, const char* recorded, size_t row) {
  int64_t count = 0;
  double* got = read_array(env, 0, strchr(recorded, '.') + 1, &count);
  assert_same(golden, recorded, row, got, (size_t)count);
  free(got);
}

static void assert_stage(const struct golden* golden, mjenv_env* env, struct outputs* out, size_t stage) {
  if (((const uint8_t*)golden_array(golden, "stage", "u1")->data)[stage] == STEP) {
    assert_same(golden, "reward", stage, out->reward, 1);
    assert_same(golden, "info", stage, out->info, (size_t)out->info_count);
  }
  assert_ok(mjenv_observe(env, &out->batch));
  assert_same(golden, "obs", stage, out->obs, (size_t)out->obs_count);
  for (size_t i = 0; i < golden->array_count; ++i)
    if (strncmp(golden->arrays[i].name, "data.", 5) == 0) assert_array(golden, env, golden->arrays[i].name, stage);
}

// Every stage a second time, from the image of the stage before.
static void test_recorded(void** state) {
  struct golden* golden = golden_read(*state);
  mjenv_env *env = golden_create(golden, 1), *other = golden_create(golden, 1);
  struct outputs* out = outputs_of(env);
  assert_ok(mjenv_seed(env, NULL, &golden->seed, 1));
  for (size_t stage = 0; stage < golden_array(golden, "stage", "u1")->rows; ++stage) {
    int64_t image_size;
    unsigned char* image = image_of(env, 0, &image_size);
    assert_ok(mjenv_restore(other, 0, image, image_size));
    free(image);
    for (int turn = 0; turn < 2; ++turn) {
      mjenv_env* player = turn ? other : env;
      follow_stage(golden, player, out, stage);
      assert_stage(golden, player, out, stage);
    }
    // And read from an image.
    image = image_of(env, 0, &image_size);
    assert_ok(mjenv_restore(other, 0, image, image_size));
    free(image);
    for (size_t i = 0; i < golden->array_count; ++i)
      if (strncmp(golden->arrays[i].name, "data.", 5) == 0) assert_array(golden, other, golden->arrays[i].name, stage);
  }
  for (size_t i = 0; i < golden->array_count; ++i)
    if (strncmp(golden->arrays[i].name, "model.", 6) == 0) assert_array(golden, env, golden->arrays[i].name, 0);
  outputs_free(out);
  mjenv_destroy(env);
  mjenv_destroy(other);
  golden_free(golden);
}

// ---- Images of rows ----

static const char* const recordings[] = {"Ant-v5", "HalfCheetah-v5", "Humanoid-v4", "InvertedPendulum-v5",
                                         PUSHER,   "Reacher-v4",     "Walker2d-v5"};

static struct golden* recording_of(const char* id) {
  char path[512];
  snprintf(path, sizeof path, "trajectories/%s.golden", id);
  return golden_read(path);
}

// From the middle of an episode in another environment, over the resets that follow.
static void test_continue(void** state) {
  (void)state;
  char why[512];
  for (size_t i = 0; i < COUNT(recordings); ++i) {
    struct golden* golden = recording_of(recordings[i]);
    const size_t steps = golden_steps(golden), middle = steps / 4;
    mjenv_env *first = golden_create(golden, 1), *second = golden_create(golden, 1);
    if (!golden_replay(golden, first, 0, middle, why, sizeof why)) fail_msg("%s", why);
    int64_t image_size;
    unsigned char* image = image_of(first, 0, &image_size);
    mjenv_destroy(first);
    seed_rows(second, 999);
    assert_ok(mjenv_reset(second, NULL, NULL));
    assert_ok(mjenv_restore(second, 0, image, image_size));
    if (!golden_replay(golden, second, middle, steps, why, sizeof why)) fail_msg("%s", why);
    // And once more.
    assert_ok(mjenv_restore(second, 0, image, image_size));
    if (!golden_replay(golden, second, middle, steps, why, sizeof why)) fail_msg("%s", why);
    mjenv_destroy(second);
    free(image);
    golden_free(golden);
  }
}

// The arrays that MuJoCo derived in the last step follow a row into another environment.
static void test_derived_arrays(void** state) {
  (void)state;
  static const char* const arrays[] = {"time", "qpos",     "qvel",          "xpos", "cinert",
                                       "cvel", "cfrc_ext", "qfrc_actuator", "ctrl"};
  char why[512];
  for (size_t i = 0; i < COUNT(recordings); ++i) {
    struct golden* golden = recording_of(recordings[i]);
    mjenv_env *first = golden_create(golden, 1), *second = golden_create(golden, 3);
    if (!golden_replay(golden, first, 0, 10, why, sizeof why)) fail_msg("%s", why);
    int64_t image_size;
    unsigned char* image = image_of(first, 0, &image_size);
    assert_ok(mjenv_restore(second, 1, image, image_size));
    int64_t copy_size;
    unsigned char* copy = image_of(second, 1, &copy_size);
    assert_int_equal(copy_size, image_size);
    assert_memory_equal(copy, image, image_size);
    for (size_t k = 0; k < COUNT(arrays); ++k) {
      int64_t count = 0;
      double *want = read_array(first, 0, arrays[k], &count), *got = read_array(second, 1, arrays[k], NULL);
      assert_same_bits(arrays[k], got, want, count);
      // The row that a work space holds comes back, too.
      assert_ok(mjenv_reset(first, NULL, NULL));
      free(read_array(first, 0, arrays[k], NULL));
      assert_ok(mjenv_restore(first, 0, image, image_size));
      double* back = read_array(first, 0, arrays[k], NULL);
      assert_same_bits(arrays[k], back, want, count);
      free(want);
      free(got);
      free(back);
    }
    free(image);
    free(copy);
    mjenv_destroy(first);
    mjenv_destroy(second);
    golden_free(golden);
  }
}

// A row that was never reset, and one whose episode has ended, are so after their return, too.
static void test_condition_is_kept(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("InvertedPendulum-v5", 2);
  const double action[2] = {3, 3}, fallen[2] = {0, 1.5}, qvel[2] = {0, 0};
  int64_t fresh_size;
  unsigned char* fresh = image_of(env, 0, &fresh_size);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_set_state(env, 1, fallen, 2, qvel, 2));
  assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, NULL));
  int64_t ended_size;
  unsigned char* ended = image_of(env, 1, &ended_size);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_restore(env, 0, fresh, fresh_size));
  assert_refused(MJENV_E_NOT_RESET, mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, NULL), "row 0", "reset");
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_restore(env, 1, ended, ended_size));
  assert_refused(MJENV_E_EPISODE_ENDED, mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, NULL), "row 1", "ended");
  free(fresh);
  free(ended);
  mjenv_destroy(env);
}

// The step count travels too: truncation comes when it was due.
static void test_step_count_is_kept(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Reacher-v5", 1);
  struct outputs* out = outputs_of(env);
  const float action[2] = {0.1f, 0};
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int step = 0; step < 48; ++step) assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT32, NULL));
  int64_t image_size;
  unsigned char* image = image_of(env, 0, &image_size);
  for (int time = 0; time < 2; ++time) {
    assert_ok(mjenv_restore(env, 0, image, image_size));
    assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT32, &out->batch));
    assert_false(*out->truncated);
    assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT32, &out->batch));
    assert_true(*out->truncated);
  }
  free(image);
  outputs_free(out);
  mjenv_destroy(env);
}

// A change of any byte is found, and the row goes on as if nothing had been tried.
static void test_damaged(void** state) {
  (void)state;
  struct golden* golden = recording_of("Hopper-v5");
  mjenv_env* env = golden_create(golden, 1);
  char why[512];
  if (!golden_replay(golden, env, 0, 10, why, sizeof why)) fail_msg("%s", why);
  int64_t image_size;
  unsigned char* image = image_of(env, 0, &image_size);
  for (int64_t i = 0; i < image_size; ++i) {
    for (int bit = 0; bit < 8; bit += 7) {
      image[i] ^= (unsigned char)(1 << bit);
      assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, image, image_size), "image");
      image[i] ^= (unsigned char)(1 << bit);
    }
    assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, image, i), "image");
  }
  unsigned char* longer = allocate(image_size + 8);
  memset(longer, 0, image_size + 8);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, longer, image_size), "image");
  memcpy(longer, image, image_size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, longer, image_size + 8), "image");
  if (!golden_replay(golden, env, 10, golden_steps(golden), why, sizeof why)) fail_msg("%s", why);
  free(longer);
  free(image);
  mjenv_destroy(env);
  golden_free(golden);
}

// What no row can hold, under a checksum that fits: a stream of one number, from which a reset would draw for ever,
// and a count of steps that the next one would overflow.
static void test_forged(void** state) {
  (void)state;
  enum { STREAM_SIZE = 40, STEPS = STREAM_SIZE };  // in a head
  mjenv_env* env = env_of_id("Reacher-v5", 1);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int forgery = 0; forgery < 3; ++forgery) {
    int64_t image_size;
    unsigned char* image = image_of(env, 0, &image_size);
    size_t size;
    unsigned char* head = image_part(image, "head", &size);
    if (forgery == 0) memset(head, 0, STREAM_SIZE);
    if (forgery == 1) memset(head + STEPS, 0x7f, 8);
    image_seal(image, image_size);
    if (forgery < 2)
      assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, image, image_size), "damaged");
    else  // nothing forged: this is how the checksum is made
      assert_ok(mjenv_restore(env, 0, image, image_size));
    free(image);
  }
  mjenv_destroy(env);
}

// A history's record begins with 0 or 1.
static void test_forged_history(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Reacher-v5");
  assert_ok(mjenv_options_set_integer(options, "history", 2));
  mjenv_env* env = env_of_options(options, 1);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  int64_t image_size;
  unsigned char* image = image_of(env, 0, &image_size);
  size_t size;
  unsigned char* history = image_part(image, "history", &size);
  double* record = allocate(size);
  memcpy(record, history, size);
  assert_true(size == (1 + 2 * 10) * sizeof(double) && record[0] == 1);
  const double forged[] = {0, 1, 0.5, NAN};
  for (size_t i = 0; i < COUNT(forged); ++i) {
    memcpy(history, &forged[i], sizeof forged[i]);
    image_seal(image, image_size);
    if (i < 2)
      assert_ok(mjenv_restore(env, 0, image, image_size));
    else
      assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, image, image_size), "damaged");
  }
  free(record);
  free(image);
  mjenv_destroy(env);
}

static void test_of_another(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  int64_t image_size;
  unsigned char* image = image_of(env, 0, &image_size);
  mjenv_options *weight = options_of_id("Hopper-v5"), *model = options_of_id("Hopper-v5"),
                *same = options_of_id("Hopper-v5");
  const double heavy = 1.25;
  assert_ok(mjenv_options_set_reals(weight, "forward_reward_weight", &heavy, 1));
  assert_ok(mjenv_options_set_string(model, "xml_file", "walker2d.xml"));
  mjenv_env* others[] = {env_of_id("Hopper-v4", 1), env_of_id("Walker2d-v5", 1), env_of_options(weight, 1),
                         env_of_options(model, 1)};
  for (size_t i = 0; i < COUNT(others); ++i) {
    assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(others[i], 0, image, image_size), "image");
    mjenv_destroy(others[i]);
  }
  // The same model by another way is the same model.
  char* xml = read_file(PROJECT_FOLDER "/assets/hopper.xml", NULL);
  assert_ok(mjenv_options_set_string(same, "xml_string", xml));
  mjenv_env* twin = env_of_options(same, 1);
  assert_ok(mjenv_restore(twin, 0, image, image_size));
  free(xml);
  mjenv_destroy(twin);
  // An option set to something and back is as if it had never been set.
  mjenv_options* again = options_of_id("Ant-v5");
  mjenv_env* ant = env_of_id("Ant-v5", 1);
  int64_t of_ant_size;
  unsigned char* of_ant = image_of(ant, 0, &of_ant_size);
  assert_ok(mjenv_options_set_string(again, "main_body", "torso"));
  assert_ok(mjenv_options_set_integer(again, "main_body", 1));
  mjenv_env* back = env_of_options(again, 1);
  assert_ok(mjenv_restore(back, 0, of_ant, of_ant_size));
  mjenv_destroy(back);
  mjenv_destroy(ant);
  free(of_ant);
  free(image);
  mjenv_destroy(env);
}

static mjenv_env* env_with_norm(const char* id, const char* norm) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_string(options, "norm", norm));
  return env_of_options(options, 1);
}

// An image fits where norms are rounded as in the environment that it was taken from, whatever the option says there.
static void test_rounding(void** state) {
  (void)state;
  mjenv_env *fused = env_with_norm("Ant-v5", "fused"), *plain = env_with_norm("Ant-v5", "plain"),
            *chosen = env_with_norm("Ant-v5", "auto");
  int64_t size;
  unsigned char *of_fused = image_of(fused, 0, &size), *of_plain = image_of(plain, 0, &size),
                *of_chosen = image_of(chosen, 0, &size);
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(plain, 0, of_fused, size), "\"norm\" to \"fused\"");
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(fused, 0, of_plain, size), "\"norm\" to \"plain\"");
  // `auto` is one of the two on this CPU: its images fit that one, and no other.
  const bool fuses = mjenv_restore(fused, 0, of_chosen, size) == MJENV_OK;
  const bool is_plain = mjenv_restore(plain, 0, of_chosen, size) == MJENV_OK;
  assert_true(fuses != is_plain);
  assert_ok(mjenv_restore(chosen, 0, fuses ? of_fused : of_plain, size));
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(chosen, 0, fuses ? of_plain : of_fused, size), "\"norm\"");
  free(of_fused), free(of_plain), free(of_chosen);
  mjenv_destroy(fused), mjenv_destroy(plain), mjenv_destroy(chosen);

  // Hopper computes no norms, so its images fit everywhere.
  mjenv_env *one = env_with_norm("Hopper-v5", "fused"), *other = env_with_norm("Hopper-v5", "plain");
  int64_t of_one_size;
  unsigned char* of_one = image_of(one, 0, &of_one_size);
  assert_ok(mjenv_restore(other, 0, of_one, of_one_size));
  free(of_one);
  mjenv_destroy(one), mjenv_destroy(other);
}

// The math that an image was made with is in its bytes 14 and 15: 0, or 1 for the portable one.
static void test_math(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  int64_t image_size;
  unsigned char* image = image_of(env, 0, &image_size);
  const bool is_portable = strstr(mjenv_version(), "portable math") != NULL;
  unsigned char* bytes = image;
  assert_int_equal(bytes[14], is_portable);
  bytes[14] = !is_portable;
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(env, 0, bytes, image_size),
                 is_portable ? "MJENV_MATH=system" : "MJENV_MATH=portable");
  bytes[14] = is_portable;
  assert_ok(mjenv_restore(env, 0, bytes, image_size));
  free(image);
  mjenv_destroy(env);
}

static void test_size_of_image(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Ant-v5", 1);
  int64_t size = 0, again = 77;
  assert_ok(mjenv_snapshot(env, 0, NULL, 0, &size));
  unsigned char* bytes = allocate(size);
  memset(bytes, 0x33, size);
  assert_refused(MJENV_E_SIZE, mjenv_snapshot(env, 0, bytes, size - 1, &again), "needed");
  assert_true(again == 77);
  for (int64_t i = 0; i < size; ++i) assert_int_equal(bytes[i], 0x33);
  free(bytes);
  mjenv_destroy(env);
}

// ---- Mirrors ----

static void assert_mirrored(mjenv_env* env, const char* array, const double* memory) {
  int64_t count;
  double* values = read_array(env, 0, array, &count);
  assert_same_bits(array, memory, values, (size_t)count);
  free(values);
}

// What is written in the memory has the effect of mjenv_write_row in another environment, whose arrays it then shows.
static void test_mirrors(void** state) {
  (void)state;
  mjenv_env *env = env_of_id("Hopper-v5", 1), *twin = env_of_id("Hopper-v5", 1);
  struct outputs *out = outputs_of(env), *of_twin = outputs_of(twin);
  double qpos[6], qvel[6], xpos[15], forces[30], mass[5];
  int32_t ncon = -1;
  const struct {
    const char* array;
    void* memory;
    int64_t bytes;
  } mirrors[] = {{"qpos", qpos, sizeof qpos},         {"qvel", qvel, sizeof qvel},      {"xpos", xpos, sizeof xpos},
                 {"cfrc_ext", forces, sizeof forces}, {"body_mass", mass, sizeof mass}, {"ncon", &ncon, sizeof ncon}};
  for (size_t i = 0; i < COUNT(mirrors); ++i)
    assert_ok(mjenv_mirror(env, 0, mirrors[i].array, mirrors[i].memory, mirrors[i].bytes));
  seed_rows(env, 5), seed_rows(twin, 5);
  assert_ok(mjenv_reset(env, NULL, &out->batch));
  assert_ok(mjenv_reset(twin, NULL, &of_twin->batch));
  for (int step = 0; step < 60; ++step) {
    const double action[3] = {step % 3 - 1, 0.5, -0.1 * (step % 7)};
    if (step % 8 == 3) {
      qpos[1] += 0.01, mass[2] *= 1.1;
      assert_ok(write_row(twin, 0, "qpos", qpos, 6));
      assert_ok(write_row(twin, 0, "body_mass", mass, 5));
    }
    if (step % 8 == 5) {
      assert_ok(mjenv_set_state(env, 0, qpos, 6, qvel, 6));
      assert_ok(mjenv_set_state(twin, 0, qpos, 6, qvel, 6));
    } else {
      assert_ok(mjenv_step(env, NULL, action, 3, MJENV_DTYPE_FLOAT64, &out->batch));
      assert_ok(mjenv_step(twin, NULL, action, 3, MJENV_DTYPE_FLOAT64, &of_twin->batch));
      assert_same_bits("obs", out->obs, of_twin->obs, (size_t)out->obs_count);
    }
    for (size_t i = 0; i < COUNT(mirrors) - 1; ++i) assert_mirrored(twin, mirrors[i].array, mirrors[i].memory);
    const double contacts = ncon;
    assert_mirrored(twin, "ncon", &contacts);
    if (out->terminated[0]) break;
  }
  // Refused values change nothing, not even the memory.
  const double before = qpos[0];
  qpos[0] = NAN;
  assert_refused(MJENV_E_VALUE, mjenv_simulate(env, 0, (double[3]){0}, 3, 1), "qpos[0]");
  assert_true(qpos[0] == before);
  // Nor is another array written then.
  const double angle = qpos[2];
  xpos[0] += 1, qpos[2] += 0.25;
  assert_refused(MJENV_E_NAME, mjenv_simulate(env, 0, (double[3]){0}, 3, 1), "xpos", "computes");
  assert_mirrored(twin, "xpos", xpos);
  qpos[2] = NAN;
  assert_refused(MJENV_E_VALUE, mjenv_simulate(env, 0, (double[3]){0}, 3, 1), "qpos[2]");
  assert_true(qpos[2] == angle);
  assert_mirrored(twin, "qpos", qpos);
  // Other memory, or none, in place of the first.
  double other[6];
  assert_ok(mjenv_mirror(env, 0, "qpos", other, sizeof other));
  assert_ok(mjenv_mirror(env, 0, "xpos", NULL, 0));
  memset(qpos, 0, sizeof qpos), memset(xpos, 0, sizeof xpos);
  assert_ok(mjenv_simulate(env, 0, (double[3]){0}, 3, 1));
  assert_mirrored(env, "qpos", other);
  assert_true(qpos[1] == 0 && xpos[5] == 0 && other[1] != 0);
  // A draw gets more parameters than the memory has room for, which then keeps the old ones.
  double bounds[3] = {0, 0, 7};
  assert_ok(mjenv_randomize(env, "{\"randomize\": {\"body_mass\": {\"low\": 1, \"high\": 2}}}"));
  assert_ok(mjenv_mirror(env, 0, "draws[0]", bounds, 2 * sizeof *bounds));
  assert_ok(mjenv_randomize(env,
                            "{\"randomize\": {\"body_mass\": {\"distribution\": \"truncated_normal\", \"mean\": 3, "
                            "\"std\": 1, \"low\": 2, \"high\": 4}}}"));
  assert_true(bounds[0] == 1 && bounds[1] == 2 && bounds[2] == 7);
  assert_ok(mjenv_mirror(env, 0, "act", other, 0));  // an empty array
  assert_refused(MJENV_E_SIZE, mjenv_mirror(env, 0, "qpos", other, 8), "bytes");
  assert_refused(MJENV_E_NAME, mjenv_mirror(env, 0, "qqpos", other, 8), "qqpos");
  assert_refused(MJENV_E_VALUE, mjenv_mirror(env, 1, "qpos", other, sizeof other), "row 1");
  outputs_free(out), outputs_free(of_twin);
  mjenv_destroy(env), mjenv_destroy(twin);
}

// The elements that are not in use are 0, also after contacts have ended. What is written in the others is refused.
static void test_mirrors_of_contacts(void** state) {
  (void)state;
  mjenv_env *env = env_of_id("Hopper-v5", 1), *twin = env_of_id("Hopper-v5", 1);
  static const char* const arrays[] = {"contact.dist", "contact.frame", "efc_force"};
  double* memory[COUNT(arrays)];
  int64_t count[COUNT(arrays)], ncon = 0, ended = 0;
  for (size_t i = 0; i < COUNT(arrays); ++i) {
    memory[i] = read_array(env, 0, arrays[i], &count[i]);
    assert_ok(mjenv_mirror(env, 0, arrays[i], memory[i], count[i] * (int64_t)sizeof(double)));
  }
  for (int step = 0; step < 80; ++step) {
    const double qpos[6] = {0, step % 3 == 1 ? 2 : 1.25, 0, 0, 0, 0}, qvel[6] = {0, -2};
    for (int each = 0; each < 2; ++each) {
      mjenv_env* const one = each == 0 ? env : twin;
      if (step % 4 == 0) assert_ok(mjenv_set_state(one, 0, qpos, 6, qvel, 6));
      assert_ok(mjenv_simulate(one, 0, (double[3]){0}, 3, 3));
    }
    for (size_t i = 0; i < COUNT(arrays); ++i) assert_mirrored(twin, arrays[i], memory[i]);
    double contacts;
    int64_t one;
    assert_ok(mjenv_read(twin, 0, "ncon", &contacts, 1, &one));
    ended += contacts < ncon, ncon = (int64_t)contacts;
    if (ncon == 0) continue;
    memory[1][9 * ncon - 1] = 7;
    assert_refused(MJENV_E_NAME, mjenv_simulate(env, 0, (double[3]){0}, 3, 1), "contact.frame", "computes");
    assert_mirrored(twin, "contact.frame", memory[1]);
  }
  assert_true(ended > 3);
  mjenv_destroy(env), mjenv_destroy(twin);
  for (size_t i = 0; i < COUNT(arrays); ++i) free(memory[i]);
}

// ---- Random streams ----

static void test_streams(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("HalfCheetah-v5", 2);
  struct outputs* out = outputs_of(env);
  uint64_t words[4];
  // PCG64(42) as tests/golden/random.txt has it: state low, high, increment low, high.
  const uint64_t want[4] = {0xacbc7c9d68860ac8, 0xcea44f6798798f2a, 0x66caf2e28d25abff, 0xfa505436c9a8416e};
  seed_rows(env, 42);
  assert_ok(mjenv_get_stream(env, 0, words, 4));
  assert_memory_equal(words, want, sizeof words);
  // Draws of all rows, as default_rng(42) and default_rng(43) of NumPy 2.2.6 give them.
  uint64_t all[2][6] = {{0}}, begun[2][6];
  double drawn[2];
  assert_ok(mjenv_seed(env, NULL, (const uint64_t[]){42, 43}, 2));
  assert_ok(mjenv_get_stream(env, MJENV_ALL_ROWS, begun[0], 12));
  const struct {
    mjenv_distribution kind;
    double low, high, want[2];
  } draws[] = {{MJENV_DISTRIBUTION_UNIFORM, 0, 1, {0.7739560485559633, 0.6522992627009107}},
               {MJENV_DISTRIBUTION_UNIFORM, -2, 3, {1.8697802427798167, 1.2614963135045532}},
               {MJENV_DISTRIBUTION_NORMAL, 0, 0, {0.30471707975443135, 0.24422950667176005}},
               {MJENV_DISTRIBUTION_INTEGERS, 0, 10, {0, 5}}};
  for (size_t i = 0; i < sizeof draws / sizeof *draws; ++i) {
    memcpy(all, begun, sizeof all);
    assert_ok(mjenv_draw(all[0], 2, draws[i].kind, draws[i].low, draws[i].high, drawn, 2));
    assert_same_bits("drawn", drawn, draws[i].want, 2);
  }
  assert_refused(MJENV_E_SIZE, mjenv_draw(all[0], 2, 0, 0, 1, drawn, 1), "count is 1");
  assert_refused(MJENV_E_VALUE, mjenv_draw(all[0], 0, 0, 0, 1, drawn, 1), "streams is 0");
  assert_refused(MJENV_E_VALUE, mjenv_draw(all[0], 2, 0, 1, 0, drawn, 2), "high - low");
  assert_refused(MJENV_E_VALUE, mjenv_draw(all[0], 2, 2, 0.5, 3, drawn, 2), "integers");
  assert_refused(MJENV_E_ARGUMENT, mjenv_draw(all[0], 2, 3, 0, 1, drawn, 2), "kind is 3");
  // Zeros leave a row as it is; a bad word changes no row.
  all[0][2] = all[1][2] = 1, all[1][2] = 2;
  assert_refused(MJENV_E_VALUE, mjenv_set_stream(env, MJENV_ALL_ROWS, all[0], 12), "odd");
  memset(all, 0, sizeof all);
  assert_ok(mjenv_set_stream(env, MJENV_ALL_ROWS, all[0], 12));
  assert_ok(mjenv_get_stream(env, MJENV_ALL_ROWS, all[0], 12));
  assert_memory_equal(all, begun, sizeof all);
  assert_refused(MJENV_E_SIZE, mjenv_get_stream(env, MJENV_ALL_ROWS, all[0], 6), "count");
  assert_refused(MJENV_E_VALUE, mjenv_draw((uint64_t[6]){0}, 1, 0, 0, 1, drawn, 1), "stream 0");
  seed_rows(env, 42);
  // The second row follows the first one's stream.
  assert_ok(mjenv_set_stream(env, 1, words, 4));
  for (int reset = 0; reset < 3; ++reset) {
    assert_ok(mjenv_reset(env, NULL, &out->batch));
    assert_same_bits("obs", out->obs + out->obs_count, out->obs, (size_t)out->obs_count);
  }
  // Words make the same stream as the number that they are, leading zeros or not, in the rows of the mask alone.
  const uint64_t seeds[2][3] = {{7, 7, 7}, {42, 0, 0}};
  const uint8_t second[] = {0, 1};
  for (int64_t count = 1; count <= 3; ++count) {
    const uint64_t* given = &seeds[1][0] - count;
    assert_ok(mjenv_seed(env, second, given, 2 * count));
    assert_ok(mjenv_get_stream(env, 1, words, 4));
    assert_memory_equal(words, want, sizeof words);
  }
  // default_rng(2**64 + 42).bit_generator.state of NumPy 2.2.6
  const uint64_t large[4] = {0x75ef2c2e09d03a59, 0x31588cf6217173a2, 0xcbef315b21966dff, 0x53e23a75742cae30};
  assert_ok(mjenv_seed(env, NULL, (const uint64_t[2][3]){{42, 1, 0}, {42, 1, 0}}[0], 6));
  for (int64_t row = 0; row < 2; ++row) {
    assert_ok(mjenv_get_stream(env, row, words, 4));
    assert_memory_equal(words, large, sizeof words);
  }
  assert_refused(MJENV_E_SIZE, mjenv_seed(env, NULL, large, 3), "3, no positive multiple of the 2 row(s)");
  assert_ok(mjenv_seed_row(env, 1, (const uint64_t[]){42, 0}, 2));
  for (int64_t row = 0; row < 2; ++row) {
    assert_ok(mjenv_get_stream(env, row, words, 4));
    assert_memory_equal(words, row == 0 ? large : want, sizeof words);
  }
  assert_refused(MJENV_E_VALUE, mjenv_seed_row(env, 2, want, 1), "row 2");
  outputs_free(out);
  mjenv_destroy(env);
}

int main(void) {
  const struct CMUnitTest others[] = {
      cmocka_unit_test(test_continue),          cmocka_unit_test(test_derived_arrays),
      cmocka_unit_test(test_condition_is_kept), cmocka_unit_test(test_step_count_is_kept),
      cmocka_unit_test(test_damaged),           cmocka_unit_test(test_forged),
      cmocka_unit_test(test_forged_history),    cmocka_unit_test(test_of_another),
      cmocka_unit_test(test_rounding),          cmocka_unit_test(test_math),
      cmocka_unit_test(test_size_of_image),     cmocka_unit_test(test_streams),
      cmocka_unit_test(test_mirrors),           cmocka_unit_test(test_mirrors_of_contacts),
  };
  char** paths = golden_list("state");
  int64_t count = 0;
  while (paths[count]) ++count;
  struct CMUnitTest tests[COUNT(others) + count];
  memcpy(tests, others, sizeof others);
  for (int64_t i = 0; i < count; ++i)
    tests[COUNT(others) + i] = (struct CMUnitTest){strrchr(paths[i], '/') + 1, test_recorded, NULL, NULL, paths[i]};
  const int failed = cmocka_run_group_tests(tests, NULL, NULL);
  golden_free_list(paths);
  return failed;
}
