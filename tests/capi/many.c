// What acts on many rows at once: rollouts, send and receive, copies, images of all rows, exported arrays. Rows alone,
// whose steps the recordings prove, are the measure.
#include <math.h>

#include "support.h"

enum { ROWS = 4 };

static mjenv_env* env_with(const char* id, int64_t rows, int64_t threads, const char* arrays) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  assert_ok(mjenv_options_set_string(options, "arrays", arrays));
  return env_of_options(options, rows);
}

// rows environments of one row, seeded and reset like the rows of env.
static void twins_of(mjenv_env* env, const char* id, mjenv_env** twins, uint64_t seed) {
  seed_rows(env, seed);
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int row = 0; row < ROWS; ++row) {
    twins[row] = env_of_id(id, 1);
    seed_rows(twins[row], seed + (uint64_t)row);
    assert_ok(mjenv_reset(twins[row], NULL, NULL));
  }
}

static void fill_actions(float* action, int64_t count, int salt) {
  for (int64_t i = 0; i < count; ++i) action[i] = (float)((i * 37 + (size_t)salt * 101) % 201) / 100 - 1;
}

// The info of row `row` of `rows` in field order.
static void gather_info(const mjenv_env* env, const double* info, int64_t rows, int64_t row, double* to) {
  for (int64_t i = 0; i < mjenv_field_count(env, MJENV_ROLE_INFO); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(env, MJENV_ROLE_INFO, i, &field));
    memcpy(to + field.offset, info + field.offset * rows + row * field.count, (size_t)field.count * sizeof *to);
  }
}

// ---- Rollout ----

struct rollout_case {
  const char* id;
  int64_t threads;
};

static void test_rollout(void** state) {
  const struct rollout_case* c = *state;
  enum { STEPS = 60 };
  mjenv_env *env = env_with(c->id, ROWS, c->threads, ""), *twins[ROWS];
  twins_of(env, c->id, twins, 3);
  struct outputs* one = outputs_of(twins[0]);
  const size_t nu = (size_t)action_count(env), n = (size_t)one->obs_count, k = (size_t)one->info_count;
  float* action = allocate(ROWS * STEPS * nu * sizeof *action);
  double *obs = allocate(ROWS * STEPS * n * sizeof *obs), *info = allocate(ROWS * STEPS * k * sizeof *info);
  double reward[ROWS * STEPS], *gathered = allocate(k * sizeof *gathered);
  uint8_t terminated[ROWS * STEPS], truncated[ROWS * STEPS];
  const mjenv_batch batch = {.struct_size = sizeof batch,
                             .obs_dtype = MJENV_DTYPE_FLOAT64,
                             .rows = ROWS * STEPS,
                             .obs_count = one->obs_count,
                             .info_count = one->info_count,
                             .obs = obs,
                             .reward = reward,
                             .terminated = terminated,
                             .truncated = truncated,
                             .info = info};
  fill_actions(action, ROWS * STEPS * nu, 1);
  assert_ok(mjenv_rollout(env, action, ROWS * STEPS * nu, MJENV_DTYPE_FLOAT32, STEPS, &batch));
  for (int row = 0; row < ROWS; ++row) {
    bool ended = false;
    for (int t = 0; t < STEPS; ++t) {
      const int at = row * STEPS + t;
      gather_info(env, info, ROWS * STEPS, at, gathered);
      if (ended) {
        assert_true(reward[at] == 0);
        for (size_t i = 0; i < k; ++i) assert_true(gathered[i] == 0);
      } else {
        assert_ok(mjenv_step(twins[row], NULL, action + (size_t)at * nu, nu, MJENV_DTYPE_FLOAT32, &one->batch));
        assert_same_bits("reward", reward + at, one->reward, 1);
        assert_same_bits("info", gathered, one->info, k);
      }
      assert_same_bits("obs", obs + (size_t)at * n, one->obs, n);
      assert_int_equal(terminated[at], *one->terminated);
      assert_int_equal(truncated[at], *one->truncated);
      ended = terminated[at] || truncated[at];
    }
    assert_same_image(env, row, twins[row], 0);
    mjenv_destroy(twins[row]);
  }
  const mjenv_batch rows_of_a_step = {.struct_size = sizeof batch, .rows = ROWS};
  assert_refused(MJENV_E_SIZE, mjenv_rollout(env, action, ROWS * nu, MJENV_DTYPE_FLOAT32, STEPS, NULL), "count");
  assert_refused(MJENV_E_SIZE,
                 mjenv_rollout(env, action, ROWS * STEPS * nu, MJENV_DTYPE_FLOAT32, STEPS, &rows_of_a_step), "rows");
  assert_int_not_equal(mjenv_rollout(env, action, 0, MJENV_DTYPE_FLOAT32, -1, NULL), MJENV_OK);
  free(action);
  free(obs);
  free(info);
  free(gathered);
  outputs_free(one);
  mjenv_destroy(env);
}

// ---- Send and receive ----

static void test_send_and_receive(void** state) {
  const struct rollout_case* c = *state;
  enum { STEPS = 50 };
  mjenv_env *env = env_with(c->id, ROWS, c->threads, ""), *twins[ROWS];
  twins_of(env, c->id, twins, 9);
  struct outputs *out = outputs_of(env), *one = outputs_of(twins[0]);
  const size_t nu = (size_t)action_count(env), k = (size_t)out->info_count;
  double* gathered = allocate(k * sizeof *gathered);
  float action[ROWS * 32];
  for (int step = 0; step < STEPS; ++step) {
    // In two parts, and in another order than the rows have.
    const int64_t order[ROWS] = {2, 0, 3, 1};
    fill_actions(action, ROWS * nu, step);
    assert_ok(mjenv_send(env, order, 3, action, 3 * nu, MJENV_DTYPE_FLOAT32));
    assert_ok(mjenv_send(env, order + 3, 1, action + 3 * nu, nu, MJENV_DTYPE_FLOAT32));
    bool reported[ROWS] = {false};
    for (size_t done = 0; done < ROWS;) {
      int64_t rows[ROWS];
      int64_t count = 0;
      assert_ok(mjenv_recv(env, 1, -1, rows, ROWS, &count, &out->batch));
      assert_true(count >= 1 && done + count <= ROWS);
      for (int64_t i = 0; i < count; ++i) {
        assert_false(reported[rows[i]]);
        reported[rows[i]] = true;
      }
      done += count;
    }
    uint8_t ended[ROWS];
    for (int i = 0; i < ROWS; ++i) {
      const int64_t row = order[i];
      assert_ok(mjenv_step(twins[row], NULL, action + (size_t)i * nu, nu, MJENV_DTYPE_FLOAT32, &one->batch));
      gather_info(env, out->info, ROWS, row, gathered);
      assert_same_bits("obs", out->obs + row * out->obs_count, one->obs, (size_t)out->obs_count);
      assert_same_bits("reward", out->reward + row, one->reward, 1);
      assert_same_bits("info", gathered, one->info, k);
      ended[row] = *one->terminated || *one->truncated;
      assert_int_equal(ended[row], out->terminated[row] || out->truncated[row]);
      if (ended[row]) assert_ok(mjenv_reset(twins[row], NULL, NULL));
    }
    assert_ok(mjenv_reset(env, ended, NULL));
  }
  for (int row = 0; row < ROWS; ++row) {
    assert_same_image(env, row, twins[row], 0);
    mjenv_destroy(twins[row]);
  }
  free(gathered);
  outputs_free(out);
  outputs_free(one);
  mjenv_destroy(env);
}

// A step leaves the rows outside of its mask alone, their outputs too.
static void test_step_mask(void** state) {
  const char* id = *state;
  mjenv_env *env = env_with(id, ROWS, 2, ""), *twins[ROWS];
  twins_of(env, id, twins, 5);
  struct outputs *out = outputs_of(env), *one = outputs_of(twins[0]);
  const size_t nu = (size_t)action_count(env);
  float action[ROWS * 32];
  for (int step = 0; step < 20; ++step) {
    uint8_t mask[ROWS];
    fill_actions(action, ROWS * nu, step);
    for (int row = 0; row < ROWS; ++row) {
      mask[row] = (step + row) % 3 == 0;
      if (!mask[row]) action[(size_t)row * nu] = NAN;  // not looked at
    }
    outputs_soil(out);
    const struct outputs untouched = *out;
    double* obs = allocate(ROWS * (size_t)out->obs_count * sizeof *obs);
    memcpy(obs, untouched.obs, ROWS * (size_t)out->obs_count * sizeof *obs);
    assert_ok(mjenv_step(env, mask, action, ROWS * nu, MJENV_DTYPE_FLOAT32, &out->batch));
    for (int row = 0; row < ROWS; ++row) {
      const size_t count = (size_t)out->obs_count;
      if (mask[row])
        assert_ok(mjenv_step(twins[row], NULL, action + (size_t)row * nu, nu, MJENV_DTYPE_FLOAT32, &one->batch));
      const double* wanted = mask[row] ? one->obs : obs + (size_t)row * count;
      assert_memory_equal(out->obs + (size_t)row * count, wanted, count * sizeof *wanted);
      if (mask[row]) assert_same_bits("reward", out->reward + row, one->reward, 1);
      assert_same_image(env, row, twins[row], 0);
    }
    free(obs);
  }
  for (int row = 0; row < ROWS; ++row) mjenv_destroy(twins[row]);
  outputs_free(out);
  outputs_free(one);
  mjenv_destroy(env);
}

// Polling makes progress on one thread, and a timeout ends the wait.
static void test_polling(void** state) {
  (void)state;
  const float action[ROWS * 2] = {0};
  for (int threads = 1; threads <= 2; ++threads) {
    mjenv_env* env = env_with("Reacher-v5", ROWS, threads, "");
    assert_ok(mjenv_reset(env, NULL, NULL));
    int64_t rows[ROWS];
    int64_t count = 0, done = 0;
    assert_ok(mjenv_send(env, NULL, 0, action, COUNT(action), MJENV_DTYPE_FLOAT32));
    for (int polls = 0; done < ROWS && polls < 100000; ++polls) {
      assert_ok(mjenv_recv(env, 0, -1, rows, ROWS, &count, NULL));
      if (threads == 1) assert_true(count >= 1);
      done += count;
    }
    assert_int_equal(done, ROWS);
    assert_ok(mjenv_send(env, NULL, 0, action, COUNT(action), MJENV_DTYPE_FLOAT32));
    for (done = 0; done < ROWS; done += count) assert_ok(mjenv_recv(env, 1, 0, rows, ROWS, &count, NULL));
    assert_refused(MJENV_E_NOT_PENDING, mjenv_recv(env, 0, 0, rows, ROWS, &count, NULL), "send");
    assert_ok(mjenv_send(env, NULL, 0, action, COUNT(action), MJENV_DTYPE_FLOAT32));
    assert_refused(MJENV_E_VALUE, mjenv_recv(env, 1, NAN, rows, ROWS, &count, NULL), "timeout");
    mjenv_destroy(env);
  }
  // Many rows take longer than the timeout: the call returns with some of them.
  enum { MANY = 512 };
  static float still[MANY * 17];
  static int64_t all[MANY];
  mjenv_env* env = env_with("Humanoid-v5", MANY, 2, "");
  int64_t count = 0;
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_send(env, NULL, 0, still, COUNT(still), MJENV_DTYPE_FLOAT32));
  assert_ok(mjenv_recv(env, MANY, 0.001, all, MANY, &count, NULL));
  assert_true(count < MANY);
  mjenv_destroy(env);
}

static void test_under_way(void** state) {
  (void)state;
  mjenv_env* env = env_with("HalfCheetah-v5", ROWS, 2, "");
  struct outputs *out = outputs_of(env), *other = outputs_of(env);
  const float action[ROWS * 6] = {0};
  int64_t rows[ROWS] = {0, 1, 2, 3};
  const int64_t wrong[2] = {0, ROWS}, twice[2] = {1, 1};
  static unsigned char image[10000];
  const uint8_t mask[ROWS] = {1, 1, 1, 1};
  const uint64_t seeds[ROWS] = {0};
  double values[64] = {0};
  int64_t count = 77, size = 0;
  assert_refused(MJENV_E_NOT_RESET, mjenv_send(env, NULL, 0, action, ROWS * 6, MJENV_DTYPE_FLOAT32), "reset");
  assert_refused(MJENV_E_NOT_PENDING, mjenv_recv(env, 1, -1, rows, ROWS, &count, &out->batch), "send");
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  // 2^61 rows of 8 numbers: their product is 0 in 64 bits.
  assert_refused(MJENV_E_SIZE, mjenv_send(env, rows, (size_t)1 << 61, action, 0, MJENV_DTYPE_FLOAT32), "row_count");
  assert_refused(MJENV_E_VALUE, mjenv_send(env, wrong, 2, action, 12, MJENV_DTYPE_FLOAT32), "row 4", "0..3");
  assert_refused(MJENV_E_PENDING, mjenv_send(env, twice, 2, action, 12, MJENV_DTYPE_FLOAT32), "row 1");
  assert_refused(MJENV_E_SIZE, mjenv_send(env, rows, 2, action, 11, MJENV_DTYPE_FLOAT32), "count", "11", "12");
  assert_refused(MJENV_E_NOT_PENDING, mjenv_recv(env, 1, -1, rows, ROWS, &count, &out->batch), "send");

  assert_ok(mjenv_send(env, rows, 2, action, 12, MJENV_DTYPE_FLOAT32));
  assert_refused(MJENV_E_PENDING, mjenv_send(env, rows, 1, action, 6, MJENV_DTYPE_FLOAT32), "row 0", "under way");
  assert_refused(MJENV_E_SIZE, mjenv_recv(env, 3, -1, rows, ROWS, &count, &out->batch), "3", "2");
  assert_refused(MJENV_E_SIZE, mjenv_recv(env, 2, -1, rows, 1, &count, &out->batch), "1", "2");
  assert_refused(MJENV_E_PENDING, mjenv_step(env, NULL, action, ROWS * 6, MJENV_DTYPE_FLOAT32, &other->batch),
                 "under way");
  assert_refused(MJENV_E_PENDING, mjenv_reset(env, NULL, &other->batch), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_observe(env, &other->batch), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_snapshot(env, 0, image, sizeof image, &size), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_restore(env, 0, image, sizeof image), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_copy_row(env, mask, 0), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_read(env, 0, "qpos", values, COUNT(values), &size), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_set_state(env, 0, values, 9, values, 9), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_simulate(env, 0, values, 6, 1), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_seed(env, NULL, seeds, 1), "under way");
  assert_true(count == 77 && size == 0);
  assert_true(outputs_untouched(other));
  assert_ok(mjenv_recv(env, 2, -1, rows, ROWS, &count, &out->batch));
  assert_true(count == 2);
  // Destroyed with rows under way.
  const int64_t all[ROWS] = {0, 1, 2, 3};
  assert_ok(mjenv_send(env, all, ROWS, action, ROWS * 6, MJENV_DTYPE_FLOAT32));
  mjenv_destroy(env);
  outputs_free(out);
  outputs_free(other);
}

// ---- Copies and images ----

static void test_copy_row(void** state) {
  (void)state;
  mjenv_env* env = env_with("Humanoid-v5", ROWS, 1, "");
  seed_rows(env, 5);
  assert_ok(mjenv_reset(env, NULL, NULL));
  float action[ROWS * 17];
  fill_actions(action, ROWS * 17, 0);
  for (int step = 0; step < 5; ++step) assert_ok(mjenv_step(env, NULL, action, ROWS * 17, MJENV_DTYPE_FLOAT32, NULL));
  int64_t size;
  unsigned char *kept = image_of(env, 1, &size), *then;
  const uint8_t mask[ROWS] = {1, 0, 1, 1};
  assert_refused(MJENV_E_VALUE, mjenv_copy_row(env, mask, ROWS), "row 4", "0..3");
  assert_refused(MJENV_E_VALUE, mjenv_copy_row(env, mask, -1), "row -1");
  assert_ok(mjenv_copy_row(env, mask, 2));
  for (int row = 0; row < ROWS; ++row)
    if (mask[row]) assert_same_image(env, row, env, 2);
  then = image_of(env, 1, &size);
  assert_memory_equal(then, kept, size);
  free(then);
  free(kept);
  mjenv_destroy(env);
}

static void test_image_of_all_rows(void** state) {
  (void)state;
  mjenv_env *first = env_with("HalfCheetah-v5", ROWS, 1, ""), *second = env_with("HalfCheetah-v5", ROWS, 3, "");
  mjenv_env* shorter = env_with("HalfCheetah-v5", ROWS - 1, 1, "");
  struct outputs *out = outputs_of(first), *again = outputs_of(second);
  float action[ROWS * 6];
  seed_rows(first, 5);
  assert_ok(mjenv_reset(first, NULL, NULL));
  for (int step = 0; step < 5; ++step) {
    fill_actions(action, COUNT(action), step);
    assert_ok(mjenv_step(first, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, NULL));
  }
  int64_t size;
  unsigned char* image = image_of(first, MJENV_ALL_ROWS, &size);
  assert_ok(mjenv_restore(second, MJENV_ALL_ROWS, image, size));
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(shorter, MJENV_ALL_ROWS, image, size), "image");
  assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(second, 0, image, size), "image");
  for (int step = 0; step < 5; ++step) {
    fill_actions(action, COUNT(action), 50 + step);
    assert_ok(mjenv_step(first, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &out->batch));
    assert_ok(mjenv_step(second, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &again->batch));
    assert_same_bits("obs", again->obs, out->obs, (size_t)(ROWS * out->obs_count));
    assert_same_bits("reward", again->reward, out->reward, ROWS);
  }
  for (int64_t i = 0; i < size; i += 7) {
    image[i] ^= 1;
    assert_refused(MJENV_E_SNAPSHOT, mjenv_restore(second, MJENV_ALL_ROWS, image, size), "image");
    image[i] ^= 1;
  }
  free(image);
  outputs_free(out);
  outputs_free(again);
  mjenv_destroy(first);
  mjenv_destroy(second);
  mjenv_destroy(shorter);
}

// ---- Arrays with each step ----

static void test_arrays(void** state) {
  (void)state;
  mjenv_env* env = env_with("Ant-v5", ROWS, 2, "xpos cfrc_ext time");
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_ARRAYS), 3);
  const int64_t count = role_count(env, MJENV_ROLE_ARRAYS);
  assert_true(count == 42 + 84 + 1);
  double* arrays = allocate((size_t)(ROWS * count) * sizeof *arrays);
  mjenv_batch batch = {.struct_size = sizeof batch, .rows = ROWS, .arrays_count = count, .arrays = arrays};
  float action[ROWS * 8];
  seed_rows(env, 5);
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int step = 0; step < 20; ++step) {
    fill_actions(action, COUNT(action), step);
    assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT32, &batch));
    for (int64_t i = 0; i < 3; ++i) {
      mjenv_field field = MJENV_FIELD_INIT;
      assert_ok(mjenv_field_at(env, MJENV_ROLE_ARRAYS, i, &field));
      for (int row = 0; row < ROWS; ++row) {
        double* want = read_array(env, row, field.name, NULL);
        assert_same_bits(field.name, arrays + field.offset * ROWS + row * field.count, want, (size_t)field.count);
        free(want);
      }
    }
  }
  free(arrays);
  mjenv_destroy(env);

  mjenv_options* options = options_of_id("Ant-v5");
  mjenv_env* none = NULL;
  assert_ok(mjenv_options_set_string(options, "arrays", "xpos x_pos"));
  assert_int_not_equal(mjenv_create(options, 1, &none), MJENV_OK);
  assert_non_null(strstr(mjenv_last_error(), "x_pos"));
  assert_null(none);
  mjenv_options_destroy(options);
}

int main(void) {
  static struct rollout_case cases[] = {{"Hopper-v5", 1}, {"Ant-v4", 1}, {"Reacher-v5", 3}, {"Humanoid-v5", 2}};
  const struct CMUnitTest tests[] = {
      {"rollout of Hopper-v5", test_rollout, NULL, NULL, &cases[0]},
      {"rollout of Ant-v4", test_rollout, NULL, NULL, &cases[1]},
      {"rollout of Reacher-v5, 3 threads", test_rollout, NULL, NULL, &cases[2]},
      {"rollout of Humanoid-v5, 2 threads", test_rollout, NULL, NULL, &cases[3]},
      {"send and receive of Hopper-v5", test_send_and_receive, NULL, NULL, &cases[0]},
      {"send and receive of Reacher-v5, 3 threads", test_send_and_receive, NULL, NULL, &cases[2]},
      {"send and receive of Humanoid-v5, 2 threads", test_send_and_receive, NULL, NULL, &cases[3]},
      cmocka_unit_test_prestate(test_step_mask, "Hopper-v5"),
      cmocka_unit_test_prestate(test_step_mask, "Ant-v5"),
      cmocka_unit_test(test_polling),
      cmocka_unit_test(test_under_way),
      cmocka_unit_test(test_copy_row),
      cmocka_unit_test(test_image_of_all_rows),
      cmocka_unit_test(test_arrays),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
