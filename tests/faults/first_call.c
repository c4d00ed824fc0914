// The library is loaded by dlopen, and a thread that existed before makes its first call when there is no memory left:
// then nothing can be allocated for the library's thread-local variables.
#define _GNU_SOURCE  // pthread_barrier_t
#include <dlfcn.h>
#include <pthread.h>

#include "allocator.h"
#include "support.h"

static struct {
  pthread_barrier_t loaded;
  mjenv_status (*spec_of)(const char*, mjenv_spec*);
  const char* (*last_error)(void);
  mjenv_status without_memory, with_memory, unknown;
  bool failed, told;
} s;

static void* call(void* unused) {
  (void)unused;
  pthread_barrier_wait(&s.loaded);
  mjenv_spec spec = MJENV_SPEC_INIT;
  allocator_arm(ALL, 0);
  s.without_memory = s.spec_of("Hopper-v5", &spec);
  s.told = strstr(s.last_error(), "memory") != NULL;
  s.failed = allocator_disarm();
  s.with_memory = s.spec_of("Hopper-v5", &spec);
  s.unknown = s.spec_of("Nothing-v5", &spec);
  s.told = s.told && strstr(s.last_error(), "Nothing-v5");
  return NULL;
}

static void test_first_call_without_memory(void** state) {
  (void)state;
  pthread_t thread;
  assert_int_equal(pthread_barrier_init(&s.loaded, NULL, 2), 0);
  assert_int_equal(pthread_create(&thread, NULL, call, NULL), 0);
  void* library = dlopen(LIBRARY_COPY, RTLD_NOW | RTLD_LOCAL);
  if (!library) fail_msg("%s", dlerror());
  *(void**)&s.spec_of = dlsym(library, "mjenv_spec_of");
  *(void**)&s.last_error = dlsym(library, "mjenv_last_error");
  pthread_barrier_wait(&s.loaded);
  pthread_join(thread, NULL);
  assert_true(s.failed);
  assert_int_equal(s.without_memory, MJENV_E_MEMORY);
  assert_int_equal(s.with_memory, MJENV_OK);
  assert_int_equal(s.unknown, MJENV_E_NAME);
  assert_true(s.told);
}

int main(void) {
  const struct CMUnitTest tests[] = {cmocka_unit_test(test_first_call_without_memory)};
  return cmocka_run_group_tests(tests, NULL, NULL);
}
