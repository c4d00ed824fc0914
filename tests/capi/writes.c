// Rows with models and inputs of their own are as many environments of one row, which tests/live compares with
// Gymnasium; and what cannot be written is refused.
#include <math.h>

#include "golden.h"

enum { ROWS = 5, STEPS = 80 };

static double uniform(double low, double high) {
  static uint64_t state = 1;
  state = state * 6364136223846793005u + 1442695040888963407u;
  return low + (high - low) * (double)(state >> 11) * 0x1p-53;
}

static uint32_t mixed(uint32_t below) { return (uint32_t)uniform(0, below); }

// ---- Rows against environments of one row ----

// What is written: factor [low, high] times the old value, plus [-shift, shift].
struct written {
  const char* array;
  double low, high, shift;
};
static const struct written all[] = {
    {"body_mass", 0.5, 1.5, 0},    {"geom_friction", 0.5, 2, 0}, {"geom_size", 0.95, 1.05, 0},
    {"dof_damping", 0.5, 2, 0},    {"body_pos", 1, 1, 0.01},     {"actuator_gear", 0.5, 1.5, 0},
    {"opt.timestep", 0.9, 1.1, 0}, {"opt.gravity", 1, 1, 1},     {"geom_rgba", 0.5, 1, 0},
    {"qvel", 1, 1, 0.3},           {"xfrc_applied", 0, 0, 5},    {"qfrc_applied", 0, 0, 1},
    {"qpos0", 1, 1, 0.01},         {"geom_solref", 0.9, 1.1, 0}, {"geom_margin", 0, 0, 0},
};

static void write_both(mjenv_env* many, int row, mjenv_env* single) {
  const struct written* w = &all[mixed(COUNT(all))];
  int64_t count;
  double* values = read_array(single, 0, w->array, &count);
  for (int64_t i = 0; i < count; ++i) values[i] = values[i] * uniform(w->low, w->high) + uniform(-w->shift, w->shift);
  assert_ok(write_row(many, row, w->array, values, count));
  assert_ok(write_row(single, 0, w->array, values, count));
  free(values);
}

static void assert_same_array(mjenv_env* many, int row, mjenv_env* single, const char* array) {
  int64_t count, same_count;
  double *got = read_array(many, row, array, &count), *want = read_array(single, 0, array, &same_count);
  assert_int_equal(count, same_count);
  assert_same_bits(array, got, want, count);
  free(got);
  free(want);
}

static void assert_same_row(mjenv_env* many, struct outputs* out, int row, mjenv_env* single, struct outputs* one) {
  const size_t count = outputs_row_count(out);
  double *got = allocate(count * sizeof *got), *want = allocate(count * sizeof *want);
  outputs_row(many, out, MJENV_ROLE_INFO, row, got);
  outputs_row(single, one, MJENV_ROLE_INFO, 0, want);
  assert_same_bits("output", got, want, count);
  free(got);
  free(want);
}

static mjenv_env* env_with_threads(const char* id, int threads, int64_t rows) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  assert_ok(mjenv_options_set_string(options, "autoreset_mode", "next_step"));
  return env_of_options(options, rows);
}

// Moves a row's state through an image: to itself, or to another environment that was never written, and back.
static void through_an_image(mjenv_env* env, int row, mjenv_env* other) {
  int64_t size;
  unsigned char* image = image_of(env, row, &size);
  assert_ok(mjenv_restore(other, 1, image, size));
  assert_same_image(env, row, other, 1);
  free(image);
  image = image_of(other, 1, &size);
  assert_ok(mjenv_restore(env, row, image, size));
  free(image);
}

static void test_rows(void** state) {
  char id[64];
  int threads;
  assert_int_equal(sscanf(*state, "%63s with %d", id, &threads), 2);
  mjenv_env *many = env_with_threads(id, threads, ROWS), *other = env_with_threads(id, 1, 2), *single[ROWS];
  struct outputs *out = outputs_of(many), *one[ROWS];
  const size_t nu = (size_t)action_count(many);
  seed_rows(many, 3);
  assert_ok(mjenv_reset(many, NULL, &out->batch));
  for (int row = 0; row < ROWS; ++row) {
    single[row] = env_with_threads(id, 1, 1);
    one[row] = outputs_of(single[row]);
    seed_rows(single[row], 3 + (uint64_t)row);
    assert_ok(mjenv_reset(single[row], NULL, &one[row]->batch));
  }
  double* action = allocate(ROWS * nu * sizeof *action);
  for (int t = 0; t < STEPS; ++t) {
    if (mixed(2) == 0) {
      const int row = (int)mixed(ROWS);
      write_both(many, row, single[row]);
    }
    const int row = (int)mixed(ROWS);
    switch (mixed(8)) {
      case 0: through_an_image(many, row, other); break;
      case 1: {
        int64_t nq, nv;
        double* values = read_array(single[row], 0, "qpos", &nq);
        double* speeds = read_array(single[row], 0, "qvel", &nv);
        for (int64_t i = 0; i < nv; ++i) speeds[i] *= 0.5;
        assert_ok(mjenv_set_state(many, row, values, nq, speeds, nv));
        assert_ok(mjenv_set_state(single[row], 0, values, nq, speeds, nv));
        free(values);
        free(speeds);
        break;
      }
      case 2: {
        uint8_t mask[ROWS] = {0};
        mask[row] = 1;
        assert_ok(mjenv_reset(many, mask, NULL));
        assert_ok(mjenv_reset(single[row], NULL, NULL));
        break;
      }
      case 3:
        for (size_t i = 0; i < 5; ++i)
          assert_same_array(many, row, single[row],
                            ((const char*[]){"xpos", "cfrc_ext", "geom_xpos", "body_mass", "xfrc_applied"})[i]);
        break;
      default: break;
    }
    assert_same_image(many, row, single[row], 0);
    for (size_t i = 0; i < ROWS * nu; ++i) action[i] = uniform(-1, 1);
    assert_ok(mjenv_step(many, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT64, &out->batch));
    for (int i = 0; i < ROWS; ++i) {
      assert_ok(mjenv_step(single[i], NULL, action + (size_t)i * nu, nu, MJENV_DTYPE_FLOAT64, &one[i]->batch));
      assert_same_row(many, out, i, single[i], one[i]);
    }
  }
  // A copied row goes on like the one that it was copied from.
  write_both(many, 0, single[0]);
  uint8_t mask[ROWS] = {0, 1, 1, 0, 0};
  assert_ok(mjenv_copy_row(many, mask, 0));
  for (int row = 0; row < 3; ++row) assert_same_image(many, row, single[0], 0);
  for (int t = 0; t < 5; ++t) {
    for (size_t i = 0; i < ROWS * nu; ++i) action[i] = uniform(-1, 1);
    memcpy(action + nu, action, nu * sizeof *action);
    memcpy(action + 2 * nu, action, nu * sizeof *action);
    assert_ok(mjenv_step(many, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT64, &out->batch));
    assert_ok(mjenv_step(single[0], NULL, action, nu, MJENV_DTYPE_FLOAT64, &one[0]->batch));
    for (int row = 0; row < 3; ++row) assert_same_row(many, out, row, single[0], one[0]);
  }
  // A rollout, and rows that are sent, use each row's own values, too.
  uint8_t was_reset[ROWS];
  out->batch.was_reset = was_reset;
  for (size_t i = 0; i < ROWS * nu; ++i) action[i] = uniform(-1, 1);
  int64_t size;
  unsigned char* image = image_of(many, MJENV_ALL_ROWS, &size);
  assert_ok(mjenv_step(many, NULL, action, ROWS * nu, MJENV_DTYPE_FLOAT64, &out->batch));
  double rewards[ROWS], again[ROWS];
  memcpy(rewards, out->reward, sizeof rewards);
  assert_ok(mjenv_restore(many, MJENV_ALL_ROWS, image, size));
  assert_ok(mjenv_send(many, NULL, 0, action, ROWS * nu, MJENV_DTYPE_FLOAT64));
  assert_refused(MJENV_E_PENDING, write_row(many, 0, "opt.timestep", action, 1), "under way");
  assert_refused(MJENV_E_PENDING, mjenv_snapshot(many, 0, NULL, 0, &size), "under way");
  int64_t received[ROWS];
  int64_t count;
  assert_ok(mjenv_recv(many, ROWS, -1, received, ROWS, &count, &out->batch));
  assert_int_equal(count, ROWS);
  assert_same_bits("sent", out->reward, rewards, ROWS);
  assert_ok(mjenv_restore(many, MJENV_ALL_ROWS, image, size));
  mjenv_batch batch = {.struct_size = sizeof batch, .rows = ROWS, .reward = again};
  assert_ok(mjenv_rollout(many, action, ROWS * nu, MJENV_DTYPE_FLOAT64, 1, &batch));
  for (int row = 0; row < ROWS; ++row)
    if (!was_reset[row])  // a rollout resets no row
      assert_same_bits("rolled out", &again[row], &rewards[row], 1);
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

// ---- What is written can be read ----

static void test_read_back(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Ant-v5", 3);
  int64_t count;
  double* mass = read_array(env, 1, "body_mass", &count);
  double* rows = allocate(3 * count * sizeof *rows);
  for (int64_t i = 0; i < 3 * count; ++i) rows[i] = mass[i % count] * (1 + (double)i);
  const uint8_t mask[3] = {1, 0, 1};
  assert_ok(mjenv_write(env, mask, "body_mass", rows, 3 * count));
  for (int row = 0; row < 3; ++row) {
    double* read = read_array(env, row, "body_mass", &count);
    assert_same_bits("body_mass", read, row == 1 ? mass : rows + (size_t)row * count, count);
    free(read);
  }
  const double timestep = 0.002, affinity = 3;
  assert_ok(write_row(env, MJENV_ALL_ROWS, "opt.timestep", &timestep, 1));
  double* contype = read_array(env, 0, "geom_contype", &count);
  contype[1] = affinity;
  assert_ok(write_row(env, 2, "geom_contype", contype, count));
  double* read = read_array(env, 2, "geom_contype", &count);
  assert_same_bits("geom_contype", read, contype, count);
  free(read);
  read = read_array(env, 0, "opt.timestep", &count);
  assert_true(count == 1 && *read == timestep);
  free(read);
  free(contype);
  free(mass);
  free(rows);
  mjenv_destroy(env);
}

// ---- What is refused ----

static void test_refusals(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Ant-v5", 2);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  int64_t count, quats;
  double* mass = read_array(env, 0, "body_mass", &count);
  double* quat = read_array(env, 0, "body_quat", &quats);
  double* rows = allocate(2 * count * sizeof *rows);
  memcpy(rows, mass, count * sizeof *rows);
  memcpy(rows + count, mass, count * sizeof *rows);
  assert_refused(MJENV_E_NAME, write_row(env, 0, "mass", mass, count), "mass", "cannot be written");
  assert_refused(MJENV_E_NAME, write_row(env, 0, "xpos", mass, count), "xpos", "MuJoCo computes it");
  assert_refused(MJENV_E_NAME, write_row(env, 0, "gravity", mass, 3), "mjModel has opt.gravity");
  assert_refused(MJENV_E_NAME, write_row(env, 0, "nq", mass, 1), "nq", "structure");
  assert_refused(MJENV_E_NAME, write_row(env, 0, "body_parentid", mass, count), "structure");
  assert_refused(MJENV_E_NAME, write_row(env, 0, "mesh_vert", mass, 0), "mesh_vert", "shared");
  assert_refused(MJENV_E_ARGUMENT, write_row(env, 0, NULL, mass, count), "array");
  assert_refused(MJENV_E_ARGUMENT, write_row(env, 0, "body_mass", NULL, count), "values");
  assert_refused(MJENV_E_SIZE, write_row(env, 0, "body_mass", mass, count - 1), "body_mass");
  assert_refused(MJENV_E_SIZE, mjenv_write(env, NULL, "body_mass", mass, 2 * count - 1), "body_mass");
  assert_refused(MJENV_E_SIZE, mjenv_write(env, NULL, "qpos", mass, 2), "qpos");
  assert_refused(MJENV_E_SIZE, write_row(env, 1, "body_mass", rows, 2 * count), "body_mass");
  assert_refused(MJENV_E_VALUE, write_row(env, 2, "body_mass", mass, count), "row 2", "0..1");
  assert_refused(MJENV_E_VALUE, set_constants(env, 2), "row 2", "0..1");
  assert_refused(MJENV_E_SIZE, mjenv_write(env, NULL, "body_mass", mass, 3 * count), "body_mass");
  const double bad[] = {NAN, INFINITY, -1, 0};
  for (size_t i = 0; i < COUNT(bad); ++i) {
    rows[count + 3] = bad[i];
    assert_refused(MJENV_E_VALUE, mjenv_write(env, NULL, "body_mass", rows, 2 * count), "row 1", "body_mass[3]");
  }
  const double zero = 0, half = 0.5, nan = NAN;
  assert_refused(MJENV_E_VALUE, write_row(env, 0, "opt.timestep", &zero, 1), "positive");
  assert_refused(MJENV_E_VALUE, write_row(env, 0, "opt.iterations", &half, 1), "integer");
  assert_refused(MJENV_E_VALUE, write_row(env, MJENV_ALL_ROWS, "time", &nan, 1), "time[0]");
  memset(quat + 4, 0, 4 * sizeof *quat);
  assert_refused(MJENV_E_VALUE, write_row(env, 0, "body_quat", quat, quats), "quaternion");
  // Nothing of all this was written.
  for (int row = 0; row < 2; ++row) {
    double* read = read_array(env, row, "body_mass", &count);
    assert_same_bits("body_mass", read, mass, count);
    free(read);
  }
  free(mass);
  free(quat);
  free(rows);
  mjenv_destroy(env);
}

// A value that makes the physics diverge is data.
static void test_divergence(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 2);
  struct outputs* out = outputs_of(env);
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  double force[36] = {0}, action[6] = {0};
  int64_t count;
  free(read_array(env, 1, "qfrc_applied", &count));
  force[1] = 1e12;
  assert_ok(write_row(env, 1, "qfrc_applied", force, count));
  assert_ok(mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, &out->batch));
  assert_int_equal(out->status[0], MJENV_OK);
  assert_int_equal(out->status[1], MJENV_DIVERGED);
  // MuJoCo has reset the row, and with it the force.
  double* left = read_array(env, 1, "qfrc_applied", &count);
  for (int64_t i = 0; i < count; ++i) assert_true(left[i] == 0);
  free(left);
  outputs_free(out);
  mjenv_destroy(env);
}

// Inputs that were written before the first reset are cleared by it, on all threads at once.
static void test_before_the_first_reset(void** state) {
  (void)state;
  enum { MANY = 64 };
  mjenv_env* env = env_with_threads("Hopper-v5", 5, MANY);
  int64_t count;
  double* force = read_array(env, 0, "xfrc_applied", &count);
  for (int64_t i = 0; i < count; ++i) force[i] = 1;
  assert_ok(write_row(env, MJENV_ALL_ROWS, "xfrc_applied", force, count));
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  memset(force, 0, count * sizeof *force);
  for (int row = 0; row < MANY; ++row) {
    double* read = read_array(env, row, "xfrc_applied", &count);
    assert_same_bits("xfrc_applied", read, force, count);
    free(read);
  }
  free(force);
  mjenv_destroy(env);
}

// Arrays that the model has no elements of; MuJoCo steps with geom pairs that the library has listed.
static void test_empty_arrays(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  const double none = 0, action[3] = {0};
  seed_rows(env, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  const char* const arrays[] = {
      "pair_margin", "pair_friction", "tendon_stiffness", "mocap_pos", "mocap_quat", "userdata", "act"};
  for (size_t i = 0; i < COUNT(arrays); ++i) {
    assert_ok(write_row(env, 0, arrays[i], &none, 0));
    assert_refused(MJENV_E_SIZE, write_row(env, 0, arrays[i], &none, 1), arrays[i],
                   "this array is empty in this model");
  }
  assert_ok(mjenv_step(env, NULL, action, 3, MJENV_DTYPE_FLOAT64, NULL));
  mjenv_destroy(env);
}

// Parts of the state that the model has no elements of.
static void test_empty_state(void** state) {
  (void)state;
  mjenv_env* env = env_of_model("<mujoco><worldbody><geom size='.1'/></worldbody></mujoco>");
  const double none = 0;
  const char* const arrays[] = {"qpos", "qvel", "act", "ctrl", "qacc_warmstart", "mocap_quat"};
  for (size_t i = 0; i < COUNT(arrays); ++i) {
    assert_ok(write_row(env, 0, arrays[i], &none, 0));
    assert_refused(MJENV_E_SIZE, write_row(env, 0, arrays[i], &none, 1), arrays[i],
                   "this array is empty in this model");
  }
  mjenv_destroy(env);
}

// A row that diverges leaves the inputs of others alone, also while the other is computed in the same work space.
static void test_divergence_of_another(void** state) {
  (void)state;
  mjenv_env *env = env_of_id("Hopper-v5", 2), *alone = env_of_id("Hopper-v5", 1);
  seed_rows(env, 1);
  seed_rows(alone, 1);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_reset(alone, NULL, NULL));
  double force[36] = {0}, action[6] = {0};
  int64_t count, nq, nv;
  free(read_array(env, 1, "qfrc_applied", &count));
  force[1] = 1e12;
  assert_ok(write_row(env, 1, "qfrc_applied", force, count));
  assert_ok(mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, NULL));
  assert_ok(mjenv_step(alone, NULL, action, 3, MJENV_DTYPE_FLOAT64, NULL));
  force[1] = 2;
  assert_ok(write_row(env, 0, "qfrc_applied", force, count));
  assert_ok(write_row(alone, 0, "qfrc_applied", force, count));
  assert_same_array(env, 0, alone, "xpos");
  double *qpos = read_array(env, 0, "qpos", &nq), *qvel = read_array(env, 0, "qvel", &nv);
  assert_ok(mjenv_set_state(env, 0, qpos, nq, qvel, nv));
  assert_ok(mjenv_set_state(alone, 0, qpos, nq, qvel, nv));
  assert_same_array(env, 0, alone, "qfrc_applied");
  assert_ok(mjenv_step(env, (const uint8_t[]){1, 0}, action, 6, MJENV_DTYPE_FLOAT64, NULL));
  assert_ok(mjenv_step(alone, NULL, action, 3, MJENV_DTYPE_FLOAT64, NULL));
  assert_same_array(env, 0, alone, "qpos");
  // The row that diverged is computed again after the other one: it ends where its step had left it.
  double* before = read_array(env, 1, "qpos", &nq);
  assert_ok(mjenv_step(env, (const uint8_t[]){1, 0}, action, 6, MJENV_DTYPE_FLOAT64, NULL));
  double* after = read_array(env, 1, "qpos", &nq);
  assert_same_bits("qpos", after, before, nq);
  free(before);
  free(after);
  free(qpos);
  free(qvel);
  mjenv_destroy(env);
  mjenv_destroy(alone);
}

// The image does not tell in which order arrays were written, what was written in between, or what other rows have.
static void test_one_image(void** state) {
  (void)state;
  static const double action[2 * 2] = {0.3, -0.2, 0.3, -0.2};
  mjenv_env *env = env_with_threads("Swimmer-v4", 1, 1), *other = env_with_threads("Swimmer-v4", 1, 2);
  static const uint64_t seeds[] = {8, 8};
  assert_ok(mjenv_seed(env, NULL, seeds, 1));
  assert_ok(mjenv_seed(other, NULL, seeds, 2));
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_reset(other, NULL, NULL));
  int64_t masses, gears, sizes;
  double *mass = read_array(env, 0, "body_mass", &masses), *gear = read_array(env, 0, "actuator_gear", &gears),
         *size = read_array(env, 0, "geom_size", &sizes);
  assert_ok(write_row(other, 0, "geom_size", size, sizes));  // the model's own values
  mass[1] *= 1.5, gear[0] *= 0.5;
  assert_ok(write_row(env, 0, "body_mass", mass, masses));
  assert_ok(write_row(env, 0, "actuator_gear", gear, gears));
  assert_ok(write_row(other, 0, "actuator_gear", gear, gears));
  mass[1] *= 2;
  assert_ok(write_row(other, MJENV_ALL_ROWS, "body_mass", mass, masses));
  mass[1] /= 2;
  assert_ok(write_row(other, 0, "body_mass", mass, masses));
  assert_same_image(env, 0, other, 0);
  assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, NULL));
  assert_ok(mjenv_step(other, NULL, action, 4, MJENV_DTYPE_FLOAT64, NULL));
  assert_same_image(env, 0, other, 0);
  assert_ok(set_constants(env, 0));
  assert_ok(set_constants(other, 0));
  assert_same_image(env, 0, other, 0);
  const uint8_t second[] = {0, 1};
  assert_ok(mjenv_copy_row(other, second, 0));
  assert_same_image(env, 0, other, 1);
  free(mass), free(gear), free(size);
  mjenv_destroy(env), mjenv_destroy(other);
}

// An image has the state that set_state set and that was written since: a copy of the restored row has it, too.
static void test_copy_of_a_restored_row(void** state) {
  (void)state;
  static const double action[2 * 6] = {0.3, -0.2, 0.1};
  mjenv_env *env = env_with_threads("HalfCheetah-v5", 1, 1), *other = env_with_threads("HalfCheetah-v5", 1, 2);
  seed_rows(env, 4);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, NULL));
  int64_t nq, nv, count;
  double *qpos = read_array(env, 0, "qpos", &nq), *qvel = read_array(env, 0, "qvel", &nv);
  qpos[2] += 0.1;
  assert_ok(mjenv_set_state(env, 0, qpos, nq, qvel, nv));
  double* derived = read_array(env, 0, "cvel", &count);  // before qvel is written, and not changed by that
  qvel[0] += 1;
  assert_ok(write_row(env, 0, "qvel", qvel, nv));
  int64_t size;
  assert_ok(mjenv_snapshot(env, 0, NULL, 0, &size));
  unsigned char* image = allocate(size + 1);
  assert_ok(mjenv_snapshot(env, 0, image + 1, size, &size));  // an image may lie at any address
  assert_ok(mjenv_restore(other, 0, image + 1, size));
  assert_ok(mjenv_copy_row(other, (const uint8_t[]){0, 1}, 0));
  for (int row = 0; row < 2; ++row) {
    double* got = read_array(other, row, "cvel", &count);
    assert_same_bits("cvel", got, derived, count);
    free(got);
  }
  free(image);
  free(derived);
  free(qpos);
  free(qvel);
  mjenv_destroy(env);
  mjenv_destroy(other);
}

// Of row 0: the inertia depends on the masses, the forces on gravity.
static void scale_model(mjenv_env* env, double factor) {
  static const char* const arrays[] = {"body_mass", "opt.gravity"};
  for (size_t k = 0; k < COUNT(arrays); ++k) {
    int64_t count;
    double* values = read_array(env, 0, arrays[k], &count);
    for (int64_t i = 0; i < count; ++i) values[i] *= factor;
    assert_ok(write_row(env, 0, arrays[k], values, count));
    free(values);
  }
}

// Through an image to row 0 of another environment, and from there to row 1.
static void assert_same_in_image(mjenv_env* env, mjenv_env* other, const char* array, const double* want) {
  int64_t size, count;
  unsigned char* image = image_of(env, 0, &size);
  assert_ok(mjenv_restore(other, 0, image, size));
  assert_ok(mjenv_copy_row(other, (const uint8_t[]){0, 1}, 0));
  for (int row = 0; row < 2; ++row) {
    double* got = read_array(other, row, array, &count);
    assert_same_bits(array, got, want, count);
    free(got);
  }
  free(image);
}

// Three versions of the own values count at once: the last step's forces are those of the first, the arrays that
// set_state has computed are those of the second, and the third was written since. Images and copies have all of them.
static void test_older_values(void** state) {
  (void)state;
  static const double action[6] = {0.3, -0.2, 0.1};
  mjenv_env *env = env_with_threads("HalfCheetah-v5", 1, 1), *other = env_with_threads("HalfCheetah-v5", 1, 2);
  int64_t nq, nv, count;
  seed_rows(env, 4);
  assert_ok(mjenv_reset(env, NULL, NULL));
  scale_model(env, 1.2);
  assert_ok(mjenv_step(env, NULL, action, 6, MJENV_DTYPE_FLOAT64, NULL));
  double *forces = read_array(env, 0, "cfrc_int", &count), *qpos = read_array(env, 0, "qpos", &nq);
  double* qvel = read_array(env, 0, "qvel", &nv);
  scale_model(env, 1.5);
  assert_same_in_image(env, other, "cfrc_int", forces);
  assert_ok(mjenv_set_state(env, 0, qpos, nq, qvel, nv));
  double* inertia = read_array(env, 0, "qLDiagInv", &count);
  scale_model(env, 2);
  assert_same_in_image(env, other, "cfrc_int", forces);
  assert_same_in_image(env, other, "qLDiagInv", inertia);
  free(forces);
  free(inertia);
  free(qpos);
  free(qvel);
  mjenv_destroy(env);
  mjenv_destroy(other);
}

// mj_setConst computes no forces: those of the last step stay, also where the row's last step has to be repeated
// because the work space has computed another row since.
static void test_forces_before_constants(void** state) {
  (void)state;
  static const double action[2 * 3] = {0};
  mjenv_env* env = env_with_threads("Hopper-v5", 1, 2);
  seed_rows(env, 4);
  assert_ok(mjenv_reset(env, NULL, NULL));
  scale_model(env, 1.5);
  double size = 0;
  for (int i = 0; i < 100 && size == 0; ++i) {  // until the foot stands on the ground
    assert_ok(mjenv_step(env, NULL, action, COUNT(action), MJENV_DTYPE_FLOAT64, NULL));
    int64_t count;
    double* forces = read_array(env, 0, "qfrc_constraint", &count);
    for (int64_t k = 0; k < count; ++k) size += fabs(forces[k]);
    if (size > 0) {
      assert_ok(set_constants(env, 0));
      free(read_array(env, 1, "qfrc_constraint", &count));
      double* again = read_array(env, 0, "qfrc_constraint", &count);
      assert_same_bits("qfrc_constraint", again, forces, count);
      free(again);
    }
    free(forces);
  }
  assert_true(size > 0);
  mjenv_destroy(env);
}

// An image has what mj_setConst left in the row's mjData, also if the model's values were written since.
static void test_image_with_constants(void** state) {
  (void)state;
  static const char* const arrays[] = {"qpos", "xpos", "subtree_com", "qLDiagInv", "ten_length", "dof_M0", "body_mass"};
  static const double action[8] = {0.3, -0.2, 0.1};
  mjenv_env *env = env_with_threads("Ant-v5", 1, 1), *other = env_with_threads("Ant-v5", 1, 2);
  seed_rows(env, 4);
  assert_ok(mjenv_reset(env, NULL, NULL));
  for (int i = 0; i < 9; ++i) assert_ok(mjenv_step(env, NULL, action, 8, MJENV_DTYPE_FLOAT64, NULL));
  int64_t size;
  scale_model(env, 1.5);
  assert_ok(set_constants(env, 0));
  scale_model(env, 1.5);
  unsigned char* image = image_of(env, 0, &size);
  assert_ok(mjenv_restore(other, 1, image, size));
  for (size_t i = 0; i < COUNT(arrays); ++i) assert_same_array(other, 1, env, arrays[i]);
  free(image);
  mjenv_destroy(env);
  mjenv_destroy(other);
}

int main(int argc, char** argv) {
  (void)argc, (void)argv;
#define WITH(id, threads) \
  { id " with " #threads, test_rows, NULL, NULL, id " with " #threads }
  const struct CMUnitTest tests[] = {
      WITH("Ant-v5", 1),
      WITH("Ant-v5", 2),
      WITH("Humanoid-v5", 5),
      WITH("HalfCheetah-v4", 2),
      WITH("Hopper-v5", 5),
      WITH("Pusher-v5", 1),
      WITH("Reacher-v5", 2),
      WITH("InvertedDoublePendulum-v5", 5),
      WITH("Walker2d-v5", 2),
      WITH("Swimmer-v4", 1),
      cmocka_unit_test(test_read_back),
      cmocka_unit_test(test_refusals),
      cmocka_unit_test(test_divergence),
      cmocka_unit_test(test_before_the_first_reset),
      cmocka_unit_test(test_empty_arrays),
      cmocka_unit_test(test_empty_state),
      cmocka_unit_test(test_divergence_of_another),
      cmocka_unit_test(test_one_image),
      cmocka_unit_test(test_copy_of_a_restored_row),
      cmocka_unit_test(test_older_values),
      cmocka_unit_test(test_image_with_constants),
      cmocka_unit_test(test_forces_before_constants),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
