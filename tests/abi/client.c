// A program of old: compiled with a recorded header, it runs with today's library and gets what Gymnasium gave.
#include "golden.h"

#define RECORDING "trajectories/Hopper-v5.options.golden"

enum { SOIL = 0x5a };

static void test_version(void** state) {
  (void)state;
  assert_int_equal(mjenv_abi_version(), MJENV_ABI_VERSION);
}

// Structs of today may be longer: nothing is written behind the ones of old.
#define GUARDED(type, name)         \
  struct {                          \
    type value;                     \
    unsigned char behind[256];      \
  } name;                           \
  memset(&name, SOIL, sizeof name); \
  name.value.struct_size = sizeof name.value

#define assert_guarded(name)                            \
  for (size_t i_ = 0; i_ < sizeof(name).behind; ++i_) { \
    assert_int_equal((name).behind[i_], SOIL);          \
  }                                                     \
  assert_int_equal((name).value.struct_size, sizeof(name).value)

static void test_structs(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  GUARDED(mjenv_spec, spec);
  GUARDED(mjenv_option, option);
  GUARDED(mjenv_field, field);
  GUARDED(mjenv_space, space);
  assert_ok(mjenv_spec_of("Hopper-v5", &spec.value));
  assert_string_equal(spec.value.robot, "Hopper");
  assert_int_equal(spec.value.max_episode_steps, 1000);
  assert_guarded(spec);
  assert_ok(mjenv_options_at(mjenv_options_of(env), 0, &option.value));
  assert_non_null(option.value.name);
  assert_guarded(option);
  assert_ok(mjenv_field_at(env, MJENV_ROLE_OBSERVATION, 0, &field.value));
  assert_true(field.value.offset == 0 && field.value.count > 0);
  assert_guarded(field);
  assert_ok(mjenv_space_of(env, MJENV_ROLE_ACTION, &space.value));
  assert_int_equal(space.value.count, 3);
  assert_true(space.value.low[0] == -1 && space.value.high[0] == 1);
  assert_guarded(space);
  mjenv_destroy(env);
}

static void test_replay(void** state) {
  (void)state;
  golden_assert_file_plays(RECORDING);
}

static void test_state(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Reacher-v5", 1);
  size_t size = 0, count = 0;
  double before[4], after[4];
  const double action[2] = {0.5, -0.5};
  seed_rows(env, 3);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_snapshot(env, 0, NULL, 0, &size));
  unsigned char* image = allocate(size);
  assert_ok(mjenv_snapshot(env, 0, image, size, &size));
  assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, NULL));
  assert_ok(mjenv_read(env, 0, "qpos", before, 4, &count));
  assert_ok(mjenv_restore(env, 0, image, size));
  assert_ok(mjenv_step(env, NULL, action, 2, MJENV_DTYPE_FLOAT64, NULL));
  assert_ok(mjenv_read(env, 0, "qpos", after, 4, &count));
  assert_int_equal(count, 4);
  assert_same_bits("qpos", after, before, 4);
  int64_t index = -1;
  assert_ok(mjenv_object_index(env, "body", "fingertip", &index));
  const char* name = NULL;
  assert_ok(mjenv_object_name(env, "body", index, &name));
  assert_string_equal(name, "fingertip");
  assert_refused(MJENV_E_SIZE, mjenv_step(env, NULL, action, 1, MJENV_DTYPE_FLOAT64, NULL), "count");
  free(image);
  mjenv_destroy(env);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_version), cmocka_unit_test(test_structs),
                                     cmocka_unit_test(test_replay), cmocka_unit_test(test_state)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
