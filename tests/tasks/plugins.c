// Shared objects that hold tasks, and those that do not.
#include <link.h>
#include <pthread.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "mjenv/task.h"
#include "support.h"

static bool is_listed(const char* id) {
  for (int64_t i = 0; i < mjenv_id_count(); ++i)
    if (strcmp(mjenv_id_at(i), id) == 0) return true;
  return false;
}

static void test_refused(void** state) {
  (void)state;
  const int64_t before = mjenv_id_count();
  assert_refused(MJENV_E_TASK, mjenv_load_tasks("/nowhere/libx.so"), "/nowhere/libx.so", "No such file");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(""), "No such file");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PROJECT_FOLDER "/README.md"), "README.md");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PROJECT_FOLDER), "plug-in");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PLUGINS "/libno_entry.so"), "mjenv_tasks", "MJENV_PLUGIN");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PLUGINS "/libother_abi.so"), "999", "ABI");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PLUGINS "/libno_tasks.so"), "no task");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PLUGINS "/librefuses.so"), "it lacks the licence");
  assert_refused(MJENV_E_TASK, mjenv_load_tasks(PLUGINS "/libsays_nothing.so"), "gave no reason");
  assert_refused(MJENV_E_VALUE, mjenv_load_tasks(PLUGINS "/libtwice.so"), "libtwice.so", "Bad-v0", "already");
  assert_int_equal(mjenv_id_count(), before);
  assert_false(is_listed("Good-v0"));
}

static void test_loaded(void** state) {
  (void)state;
  const int64_t before = mjenv_id_count();
  assert_ok(mjenv_load_tasks(PLUGINS "/libhopper_c.so"));
  assert_int_equal(mjenv_id_count(), before + 1);
  assert_ok(mjenv_load_tasks(PLUGINS "/libhopper_c.so"));
  assert_ok(mjenv_load_tasks(PLUGINS "/../tasks/./libhopper_c.so"));
  assert_int_equal(mjenv_id_count(), before + 1);
  assert_ok(mjenv_load_tasks(PLUGINS "/libhopper_cpp.so"));
  assert_ok(mjenv_load_tasks(PLUGINS "/libant_cpp.so"));
  assert_int_equal(mjenv_id_count(), before + 3);
  for (int64_t i = 1; i < mjenv_id_count(); ++i) assert_true(strcmp(mjenv_id_at(i - 1), mjenv_id_at(i)) < 0);
  assert_null(mjenv_id_at(mjenv_id_count()));
  assert_null(mjenv_id_at(-1));
  mjenv_destroy(env_of_id("CppHopper-v5", 1));
}

static void test_names_alike(void** state) {
  (void)state;
  assert_ok(mjenv_load_tasks(PLUGINS "/libdoubles.so"));
  static const char* const ids[][2] = {{"TwoFields-v0", "\"speed\""}, {"TwoTerms-v0", "\"qpos\""}};
  for (size_t i = 0; i < COUNT(ids); ++i) {
    mjenv_options* options = options_of_id(ids[i][0]);
    mjenv_env* env = NULL;
    assert_refused(MJENV_E_TASK, mjenv_create(options, 1, &env), ids[i][0], "two", ids[i][1]);
    mjenv_options_destroy(options);
  }
}

// ---- Files that are no plug-ins ----

static int result_of(pid_t pid) {
  int status = 0;
  assert_int_equal(waitpid(pid, &status, 0), pid);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

enum { LOADED = 20, REFUSED = 21, OTHER_REASON = 22 };

// What loading the file gives, in a child that a signal may end.
static int loaded_in_child(const char* path, const char* reason) {
  const pid_t pid = fork();
  if (pid == 0) {
    alarm(10);  // ends a child that waits
    if (mjenv_load_tasks(path) == MJENV_OK) _exit(LOADED);
    _exit(strstr(mjenv_last_error(), path) && strstr(mjenv_last_error(), reason) ? REFUSED : OTHER_REASON);
  }
  return result_of(pid);
}

static void write_file(const char* path, const char* bytes, size_t count) {
  FILE* file = fopen(path, "wb");
  assert_non_null(file);
  assert_int_equal(fwrite(bytes, 1, count, file), count);
  assert_int_equal(fclose(file), 0);
}

// How many bytes of a shared object the loader needs: section headers and symbols for debuggers are behind them.
static size_t needed_bytes(const char* whole) {
  ElfW(Ehdr) head;
  memcpy(&head, whole, sizeof head);
  size_t needed = head.e_phoff + head.e_phnum * sizeof(ElfW(Phdr));
  for (int i = 0; i < head.e_phnum; ++i) {
    ElfW(Phdr) segment;
    memcpy(&segment, whole + head.e_phoff + (size_t)i * sizeof segment, sizeof segment);
    if (segment.p_offset + segment.p_filesz > needed) needed = segment.p_offset + segment.p_filesz;
  }
  return needed;
}

static void test_cut_off(void** state) {
  (void)state;
  char path[] = "/tmp/mjenv-cut-off-XXXXXX";
  const int file = mkstemp(path);
  assert_true(file >= 0);
  close(file);
  static const char ends[] = "it ends before what its headers describe";
  static const char* const plugins[] = {PLUGINS "/libhopper_c.so", PLUGINS "/libhopper_cpp.so"};
  for (size_t i = 0; i < COUNT(plugins); ++i) {
    size_t size = 0;
    char* whole = read_file(plugins[i], &size);
    const size_t needed = needed_bytes(whole);
    assert_true(needed < size);
    for (size_t part = 0; part < 16; ++part) {
      const size_t length = size * part / 16;
      write_file(path, whole, length);
      const int result = loaded_in_child(path, part == 0 ? "" : ends);
      if (result != (length < needed ? REFUSED : LOADED)) fail_msg("%s, %zu/16: %d", plugins[i], part, result);
    }
    write_file(path, whole, needed - 1);
    assert_int_equal(loaded_in_child(path, ends), REFUSED);
    write_file(path, whole, needed);
    assert_int_equal(loaded_in_child(path, ""), LOADED);
    const size_t first = sizeof(ElfW(Ehdr));
    write_file(path, whole, first + 1);
    assert_int_equal(loaded_in_child(path, ends), REFUSED);
    ElfW(Phdr) segment;
    memcpy(&segment, whole + first, sizeof segment);
    segment.p_offset = (size_t)-1;  // the end overflows
    segment.p_filesz = 2;
    memcpy(whole + first, &segment, sizeof segment);
    write_file(path, whole, size);
    assert_int_equal(loaded_in_child(path, ends), REFUSED);
    free(whole);
  }
  unlink(path);
}

static void test_pipe(void** state) {
  (void)state;
  char folder[] = "/tmp/mjenv-pipe-XXXXXX", path[64];
  assert_non_null(mkdtemp(folder));
  snprintf(path, sizeof path, "%s/pipe.so", folder);
  assert_int_equal(mkfifo(path, 0600), 0);
  assert_int_equal(loaded_in_child(path, "it is not a regular file"), REFUSED);
  unlink(path);
  rmdir(folder);
}

// ---- Threads ----

enum { THREADS = 8, ROUNDS = 10 };

static pthread_barrier_t together;

static void* load_slow(void* unused) {
  (void)unused;
  pthread_barrier_wait(&together);
  const bool loaded = mjenv_load_tasks(PLUGINS "/libslow.so") == MJENV_OK;
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  const bool built = mjenv_options_create("SlowThree-v0", &options) == MJENV_OK &&
                     mjenv_create(options, 1, &env) == MJENV_OK && mjenv_reset(env, NULL, NULL) == MJENV_OK;
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return loaded && built ? NULL : &together;
}

// Looks up ids and builds environments meanwhile.
static void* use_others(void* unused) {
  (void)unused;
  pthread_barrier_wait(&together);
  for (int i = 0; i < 3; ++i) {
    mjenv_options* options = NULL;
    mjenv_env* env = NULL;
    const bool built = is_listed("Reacher-v5") && mjenv_options_create("InvertedPendulum-v5", &options) == MJENV_OK &&
                       mjenv_create(options, 1, &env) == MJENV_OK && mjenv_reset(env, NULL, NULL) == MJENV_OK;
    mjenv_destroy(env);
    mjenv_options_destroy(options);
    if (!built) return &together;
  }
  return NULL;
}

// Whether threads that load one plug-in, and others that use the library meanwhile, all succeed.
static bool threads_succeed(void) {
  pthread_t threads[THREADS];
  bool fine = pthread_barrier_init(&together, NULL, THREADS) == 0;
  for (int i = 0; i < THREADS; ++i)
    if (pthread_create(&threads[i], NULL, i % 4 == 3 ? use_others : load_slow, NULL) != 0) abort();
  for (int i = 0; i < THREADS; ++i) {
    void* failed = NULL;
    pthread_join(threads[i], &failed);
    fine = fine && !failed;
  }
  return fine && is_listed("SlowOne-v0") && is_listed("SlowTwo-v0") && is_listed("SlowThree-v0");
}

// ---- MJENV_TASKS ----

static const char* program;

// What a child that starts with MJENV_TASKS=paths gives back: it runs this program with an argument.
static int child(const char* argument, const char* paths) {
  const pid_t pid = fork();
  if (pid == 0) {
    setenv("MJENV_TASKS", paths, 1);
    execl(program, program, argument, (char*)NULL);
    _exit(99);
  }
  return result_of(pid);
}

enum { CHILD_HAS_BOTH = 10, CHILD_HAS_ONE = 11 };

static int as_child(void) {
  mjenv_options* options = NULL;
  const bool c = mjenv_options_create("OwnHopper-v5", &options) == MJENV_OK;
  mjenv_options_destroy(options);
  if (c && is_listed("CppHopper-v5") && mjenv_load_tasks(NULL) == MJENV_OK) return CHILD_HAS_BOTH;
  // The built-in ones are there in any case; an id that is missing, and a call that asks, say what went wrong.
  const bool built_in = mjenv_options_create("Ant-v5", &options) == MJENV_OK;
  mjenv_options_destroy(options);
  const bool told = mjenv_options_create("Nothing-v0", &options) == MJENV_E_NAME &&
                    strstr(mjenv_last_error(), "MJENV_TASKS") && strstr(mjenv_last_error(), "libnowhere.so");
  const bool asked = mjenv_load_tasks(NULL) == MJENV_E_TASK && strstr(mjenv_last_error(), "libnowhere.so");
  return c && built_in && told && asked ? CHILD_HAS_ONE : 1;
}

static void test_environment(void** state) {
  (void)state;
  assert_int_equal(child("one thread", PLUGINS "/libhopper_c.so:" PLUGINS "/libhopper_cpp.so"), CHILD_HAS_BOTH);
  assert_int_equal(child("one thread", PLUGINS "/libhopper_c.so::" PLUGINS "/libnowhere.so"), CHILD_HAS_ONE);
}

// In a process that has loaded nothing yet; also while the first lookup of an id loads the same plug-in.
static void test_threads(void** state) {
  (void)state;
  for (int round = 0; round < ROUNDS; ++round) {
    assert_int_equal(child("threads", ""), 0);
    assert_int_equal(child("threads", PLUGINS "/libhopper_c.so:" PLUGINS "/libslow.so"), 0);
  }
}

static void test_no_environment(void** state) {
  (void)state;
  assert_ok(mjenv_load_tasks(NULL));
}

int main(int count, char** arguments) {
  if (count > 1) {
    alarm(60);  // ends a child that waits
    return strcmp(arguments[1], "threads") == 0 ? !threads_succeed() : as_child();
  }
  program = arguments[0];
  unsetenv("MJENV_TASKS");
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_refused),     cmocka_unit_test(test_cut_off),        cmocka_unit_test(test_pipe),
      cmocka_unit_test(test_threads),     cmocka_unit_test(test_loaded),         cmocka_unit_test(test_names_alike),
      cmocka_unit_test(test_environment), cmocka_unit_test(test_no_environment),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
