// Every recording of Gymnasium, bit for bit.
#include <unistd.h>

#include "golden.h"
#include "schema.h"

static void assert_fields(const mjenv_env* env, mjenv_role role, const struct golden_field* want, size_t count) {
  assert_int_equal(mjenv_field_count(env, role), count);
  for (size_t i = 0; i < count; ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(env, role, (int64_t)i, &field));
    assert_string_equal(field.name, want[i].name);
    assert_true(field.count == want[i].count);
    assert_int_equal(field.dtype, type_of_name(want[i].type));
  }
}

static void replay(void** state) {
  struct golden* golden = golden_read(*state);
  mjenv_env* env = golden_create(golden, 1);
  char why[512];
  assert_fields(env, MJENV_ROLE_INFO, golden->info, golden->info_count);
  assert_fields(env, MJENV_ROLE_RESET_INFO, golden->reset_info, golden->reset_info_count);
  golden_assert_plays(golden, env);
  if (!golden_replay_narrow(golden, env, why, sizeof why)) fail_msg("float32: %s", why);
  mjenv_destroy(env);
  env = golden_create(golden, 5);  // rows that are stepped together, and one that is left over
  if (!golden_replay_in_rows(golden, env, why, sizeof why)) fail_msg("rows: %s", why);
  mjenv_destroy(env);
  golden_free(golden);
}

int main(void) {
  // The recordings of own models name them relative to this folder.
  char folder[512];
  if (chdir(golden_path("custom", folder)) != 0) return 1;
  char **paths = golden_list("trajectories"), **custom = golden_list("custom");
  size_t count = 0, more = 0;
  while (paths[count]) ++count;
  while (custom[more]) ++more;
  struct CMUnitTest tests[count + more];
  for (size_t i = 0; i < count + more; ++i) {
    char* path = i < count ? paths[i] : custom[i - count];
    tests[i] = (struct CMUnitTest){strrchr(path, '/') + 1, replay, NULL, NULL, path};
  }
  const int failed = cmocka_run_group_tests(tests, NULL, NULL);
  golden_free_list(paths);
  golden_free_list(custom);
  return failed;
}
