// leg GOLDEN FIRST END IN OUT THREADS: plays steps [FIRST, END) of a recording in the last of three rows, from the
// image IN (from the start where FIRST is 0), compares every bit, and leaves the image of that row in OUT.
#include "golden.h"

static const char* const* words;

static void restore(mjenv_env* env, int64_t row, const char* path) {
  size_t size;
  char* image = read_file(path, &size);
  assert_ok(mjenv_restore(env, row, image, (int64_t)size));
  free(image);
}

static void save(mjenv_env* env, int64_t row, const char* path) {
  int64_t size;
  assert_ok(mjenv_snapshot(env, row, NULL, 0, &size));
  char* image = allocate(size);
  assert_ok(mjenv_snapshot(env, row, image, size, &size));
  FILE* file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(image, 1, size, file), size);
  assert_int_equal(fclose(file), 0);
  free(image);
}

static void set(struct golden* golden, const char* name, int64_t value) {
  struct golden_option option = {.kind = "integer", .integer = value};
  strcpy(option.name, name);
  golden->options[golden->option_count++] = option;
}

// golden_replay plays an environment of one row; the image goes through the last row of three that have threads.
static void test_leg(void** state) {
  (void)state;
  struct golden* golden = golden_read(words[1]);
  const size_t first = strtoul(words[2], NULL, 10), end = strtoul(words[3], NULL, 10);
  char why[512];
  set(golden, "strict", 0);  // as in the other languages, whose other rows may end
  mjenv_env* env = golden_create(golden, 1);
  if (first > 0) restore(env, 0, words[4]);
  if (!golden_replay(golden, env, first, end, why, sizeof why)) fail_msg("%s", why);
  save(env, 0, words[5]);
  mjenv_destroy(env);

  set(golden, "num_threads", atoi(words[6]));
  mjenv_env* many = golden_create(golden, 3);
  restore(many, 2, words[5]);
  save(many, 2, words[5]);
  mjenv_destroy(many);
  golden_free(golden);
}

int main(int argc, char** argv) {
  if (argc != 7) return 2;
  words = (const char* const*)argv;
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_leg)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
