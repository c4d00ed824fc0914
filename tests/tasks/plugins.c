// Shared objects that hold tasks, and those that do not.
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

// What a child that starts with MJENV_TASKS=paths gives back: it runs this program with an argument.
static int child(const char* program, const char* paths) {
  const pid_t pid = fork();
  if (pid == 0) {
    setenv("MJENV_TASKS", paths, 1);
    execl(program, program, "child", (char*)NULL);
    _exit(99);
  }
  int status = 0;
  assert_int_equal(waitpid(pid, &status, 0), pid);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
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

static const char* program;

static void test_environment(void** state) {
  (void)state;
  assert_int_equal(child(program, PLUGINS "/libhopper_c.so:" PLUGINS "/libhopper_cpp.so"), CHILD_HAS_BOTH);
  assert_int_equal(child(program, PLUGINS "/libhopper_c.so::" PLUGINS "/libnowhere.so"), CHILD_HAS_ONE);
}

static void test_no_environment(void** state) {
  (void)state;
  assert_ok(mjenv_load_tasks(NULL));
}

int main(int count, char** arguments) {
  if (count > 1) return as_child();
  program = arguments[0];
  unsetenv("MJENV_TASKS");
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_refused),     cmocka_unit_test(test_loaded),         cmocka_unit_test(test_names_alike),
      cmocka_unit_test(test_environment), cmocka_unit_test(test_no_environment),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
