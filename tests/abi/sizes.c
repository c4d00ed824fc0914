// Structs of callers that were compiled with the first header, and with one of the future.
#include "support.h"

enum { SOIL = 0x5a, BEHIND = 256 };

// A call that reads or writes one struct.
struct call {
  const char* name;
  uint32_t oldest;  // the struct's size in the first release, which must work for ever
  uint32_t now;
  mjenv_status (*call)(mjenv_env* env, void* given);
  bool reads;  // the struct, which the call has filled
};

static mjenv_status spec_of(mjenv_env* env, void* given) {
  (void)env;
  return mjenv_spec_of("Hopper-v5", given);
}

static mjenv_status option_of(mjenv_env* env, void* given) { return mjenv_options_at(mjenv_options_of(env), 0, given); }

static mjenv_status field_of(mjenv_env* env, void* given) {
  return mjenv_field_at(env, MJENV_ROLE_OBSERVATION, 0, given);
}

static mjenv_status space_of(mjenv_env* env, void* given) { return mjenv_space_of(env, MJENV_ROLE_ACTION, given); }

static mjenv_status info_of(mjenv_env* env, void* given) { return mjenv_info_of(env, given); }

static mjenv_status settings_of(mjenv_env* env, void* given) { return mjenv_render_defaults(env, given); }

// Reads the struct: behind its end there may be anything.
static mjenv_status reset_with(mjenv_env* env, void* given) {
  double reward;
  const mjenv_batch batch = {.struct_size = ((mjenv_batch*)given)->struct_size, .rows = 1, .reward = &reward};
  memcpy(given, &batch, batch.struct_size < sizeof batch ? batch.struct_size : sizeof batch);
  return mjenv_reset(env, NULL, given);
}

static const struct call calls[] = {
    {"spec", 96, sizeof(mjenv_spec), spec_of, false},
    {"option", 56, sizeof(mjenv_option), option_of, false},
    {"field", 80, sizeof(mjenv_field), field_of, false},
    {"space", 32, sizeof(mjenv_space), space_of, false},
    {"info", 40, sizeof(mjenv_info), info_of, false},
    {"out", 136, sizeof(mjenv_batch), reset_with, true},
    {"settings", 128, sizeof(mjenv_render_settings), settings_of, false},
};

// The struct, with guards behind the bytes that the caller knows.
static unsigned char memory[1024];

static mjenv_status made(const struct call* call, mjenv_env* env, uint32_t size) {
  memset(memory, SOIL, sizeof memory);
  memcpy(memory, &size, sizeof size);
  return call->call(env, memory);
}

static void assert_clean_from(size_t first) {
  for (size_t i = first; i < sizeof memory; ++i) assert_int_equal(memory[i], SOIL);
}

static void test_sizes(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  for (size_t i = 0; i < COUNT(calls); ++i) {
    const struct call* call = &calls[i];
    const uint32_t too_small[] = {0, 4, call->oldest - 8, call->oldest - 1};
    for (size_t k = 0; k < COUNT(too_small); ++k) {
      assert_refused(MJENV_E_ARGUMENT, made(call, env, too_small[k]), call->name, "->struct_size", "sizeof");
      if (!call->reads) assert_clean_from(sizeof(uint32_t));
    }
    // Exactly the first release's, one that ends inside of a field, today's, and one with fields of the future.
    const uint32_t sizes[] = {call->oldest, call->oldest + 4, call->now, call->now + BEHIND};
    for (size_t k = 0; k < COUNT(sizes); ++k) {
      assert_ok(made(call, env, sizes[k]));
      uint32_t kept;
      memcpy(&kept, memory, sizeof kept);
      assert_int_equal(kept, sizes[k]);
      const uint32_t known = sizes[k] < call->now ? sizes[k] / 8 * 8 : call->now;
      assert_clean_from(known);
    }
  }
  mjenv_destroy(env);
}

// What an initialiser gives is valid as it is.
static void test_initialisers(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  mjenv_batch batch = MJENV_BATCH_INIT;
  double obs[11];
  batch.rows = 1;
  batch.obs_count = 11;
  batch.obs = obs;
  assert_ok(mjenv_reset(env, NULL, &batch));
  mjenv_option option = MJENV_OPTION_INIT;
  mjenv_field field = MJENV_FIELD_INIT;
  mjenv_space space = MJENV_SPACE_INIT;
  mjenv_info info = MJENV_INFO_INIT;
  mjenv_spec spec = MJENV_SPEC_INIT;
  assert_ok(mjenv_options_at(mjenv_options_of(env), 0, &option));
  assert_ok(mjenv_field_at(env, MJENV_ROLE_OBSERVATION, 0, &field));
  assert_ok(mjenv_space_of(env, MJENV_ROLE_ACTION, &space));
  assert_ok(mjenv_info_of(env, &info));
  assert_ok(mjenv_spec_of("Hopper-v5", &spec));
  mjenv_destroy(env);
  // MuJoCo's defaults, which are those of an environment without a camera of its own.
  env = env_of_model("<mujoco><worldbody><geom size='.1'/></worldbody></mujoco>");
  const mjenv_render_settings wanted = MJENV_RENDER_SETTINGS_INIT;
  mjenv_render_settings settings = wanted;
  settings.width = 1;
  assert_ok(mjenv_render_defaults(env, &settings));
  assert_memory_equal(&settings, &wanted, sizeof wanted);
  mjenv_destroy(env);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_sizes), cmocka_unit_test(test_initialisers)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
