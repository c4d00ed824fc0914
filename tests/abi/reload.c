// The library is loaded, used and unloaded again and again: nothing of it stays.
#include <dlfcn.h>
#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

// After the headers that it needs.
#include <cmocka.h>

#include "mjenv/mjenv.h"

// POSIX lets a function be found as an object pointer; C does not let it be cast to one.
#define FIND(library, function)                        \
  do {                                                 \
    void* found_ = dlsym((library), #function);        \
    assert_non_null(found_);                           \
    memcpy(&function##_, &found_, sizeof function##_); \
  } while (0)

static void use(void* library) {
  mjenv_status (*mjenv_options_create_)(const char*, mjenv_options**);
  mjenv_status (*mjenv_create_)(const mjenv_options*, int64_t, mjenv_env**);
  mjenv_status (*mjenv_reset_)(mjenv_env*, const uint8_t*, const mjenv_batch*);
  mjenv_status (*mjenv_step_)(mjenv_env*, const uint8_t*, const void*, size_t, mjenv_dtype, const mjenv_batch*);
  const char* (*mjenv_last_error_)(void);
  void (*mjenv_options_destroy_)(mjenv_options*);
  void (*mjenv_destroy_)(mjenv_env*);
  FIND(library, mjenv_options_create);
  FIND(library, mjenv_create);
  FIND(library, mjenv_reset);
  FIND(library, mjenv_step);
  FIND(library, mjenv_last_error);
  FIND(library, mjenv_options_destroy);
  FIND(library, mjenv_destroy);
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  const float action[2] = {0.1f, -0.1f};
  assert_int_equal(mjenv_options_create_("Nothing-v4", &options), MJENV_E_NAME);
  assert_non_null(strstr(mjenv_last_error_(), "mjenv_id_at"));
  assert_int_equal(mjenv_options_create_("Reacher-v5", &options), MJENV_OK);
  assert_int_equal(mjenv_create_(options, 1, &env), MJENV_OK);
  mjenv_options_destroy_(options);
  assert_int_equal(mjenv_reset_(env, NULL, NULL), MJENV_OK);
  assert_int_equal(mjenv_step_(env, NULL, action, 2, MJENV_DTYPE_FLOAT32, NULL), MJENV_OK);
  mjenv_destroy_(env);
}

// The loader keeps some notes of its own.
static void test_reload(void** state) {
  (void)state;
  enum { WARM_UP = 100, TIMES = 300, NOTES = 100 /* bytes a time */ };
  size_t before = 0;
  for (int i = 0; i < TIMES; ++i) {
    if (i == WARM_UP) before = mallinfo2().uordblks;
    void* library = dlopen(LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (!library) fail_msg("%s", dlerror());
    use(library);
    assert_int_equal(dlclose(library), 0);
    assert_null(dlopen(LIBRARY, RTLD_NOW | RTLD_NOLOAD));
  }
  assert_in_range(mallinfo2().uordblks, 0, before + (TIMES - WARM_UP) * NOTES);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_reload)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
