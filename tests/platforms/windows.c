// What differs on Windows: the names of files, the variables of the environment, threads with small stacks, plug-ins.
#include <windows.h>

#include "mjenv/task.h"
#include "support.h"

// ---- Files ----

// A folder whose name is not in the code page of any one country, and its name in UTF-8 with "/".
static wchar_t folder[MAX_PATH];
static char folder_utf8[3 * MAX_PATH];

static void join(wchar_t* to, const wchar_t* name) { swprintf(to, 2 * MAX_PATH, L"%ls/%ls", folder, name); }

static void write_file(const wchar_t* name, const char* text) {
  wchar_t path[2 * MAX_PATH];
  join(path, name);
  FILE* file = _wfopen(path, L"wb");
  assert_non_null(file);
  fputs(text, file);
  assert_int_equal(fclose(file), 0);
}

static void remove_file(const wchar_t* name) {
  wchar_t path[2 * MAX_PATH];
  join(path, name);
  assert_int_equal(_wremove(path), 0);
}

static int make_folder(void** state) {
  (void)state;
  wchar_t temporary[MAX_PATH / 2];
  if (!GetTempPathW(MAX_PATH / 2, temporary)) return 1;
  swprintf(folder, MAX_PATH, L"%lsmjenv-\u00e9\u65e5\u0416-%lu", temporary, GetCurrentProcessId());
  if (!CreateDirectoryW(folder, NULL)) return 1;
  if (!WideCharToMultiByte(CP_UTF8, 0, folder, -1, folder_utf8, sizeof folder_utf8, NULL, NULL)) return 1;
  for (char* c = folder_utf8; *c; ++c)
    if (*c == '\\') *c = '/';
  return 0;
}

static int remove_folder(void** state) {
  (void)state;
  return !RemoveDirectoryW(folder);
}

static const char model[] =
    "<mujoco><worldbody><body><joint name='hinge'/><geom size='1'/></body></worldbody>"
    "<actuator><motor joint='hinge' ctrllimited='true' ctrlrange='-1 1'/></actuator></mujoco>";

static mjenv_status create_from(const char* path, bool trusted) {
  mjenv_options* options = options_of_id("Model-v0");
  assert_ok(mjenv_options_set_string(options, "xml_file", path));
  assert_ok(mjenv_options_set_string(options, "trust_xml", trusted ? "yes" : "no"));
  mjenv_env* env = NULL;
  const mjenv_status status = mjenv_create(options, 1, &env);
  if (status == MJENV_OK) assert_true(action_count(env) == 1);
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return status;
}

static void test_names_in_utf8(void** state) {
  (void)state;
  static const char including[] = "<mujoco><include file='teil-\xc3\xbc.xml'/></mujoco>";
  char path[4 * MAX_PATH];
  write_file(L"teil-\u00fc.xml", model);
  write_file(L"\u6a21\u578b.xml", including);
  for (int trusted = 0; trusted < 2; ++trusted) {
    snprintf(path, sizeof path, "%s/\xe6\xa8\xa1\xe5\x9e\x8b.xml", folder_utf8);
    assert_ok(create_from(path, trusted));
    for (char* c = path; *c; ++c)
      if (*c == '/') *c = '\\';
    assert_ok(create_from(path, trusted));
  }
  write_file(L"\u00e9.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  write_file(L"mesh.xml",
             "<mujoco><asset><mesh name='m' file='\xc3\xa9.obj'/></asset><worldbody><body><joint name='hinge'/>"
             "<geom type='mesh' mesh='m'/></body></worldbody>"
             "<actuator><motor joint='hinge' ctrllimited='true' ctrlrange='-1 1'/></actuator></mujoco>");
  snprintf(path, sizeof path, "%s/mesh.xml", folder_utf8);
  assert_ok(create_from(path, false));
  remove_file(L"mesh.xml");
  remove_file(L"\u00e9.obj");
  snprintf(path, sizeof path, "%s/\xe6\xa8\xa1\xe5\x9e\x8b.xml", folder_utf8);
  remove_file(L"teil-\u00fc.xml");
  assert_refused(MJENV_E_MODEL, create_from(path, false), "teil-\xc3\xbc.xml", "No such file");
  remove_file(L"\u6a21\u578b.xml");
  assert_refused(MJENV_E_FILE, create_from(path, false), "\xe6\xa8\xa1\xe5\x9e\x8b.xml", "No such file");
}

static void test_models_that_are_no_files(void** state) {
  (void)state;
  char path[4 * MAX_PATH];
  assert_refused(MJENV_E_FILE, create_from(folder_utf8, false), "no regular file");
  snprintf(path, sizeof path, "%s/NUL", folder_utf8);
  assert_refused(MJENV_E_FILE, create_from(path, false), "NUL");
  assert_refused(MJENV_E_FILE, create_from("\\\\.\\NUL", true), "NUL");
}

// A model from a stranger reads no device, stream, drive or share, and nothing outside of its folder.
static void test_names_from_strangers(void** state) {
  (void)state;
  static const char* const elements[] = {"<include file='%s'/>", "<asset><mesh name='m' file='%s'/></asset>"};
  static const char* const names[] = {"NUL",
                                      "nul.stl",
                                      "below/Con",
                                      "COM1",
                                      "com9.stl",
                                      "LPT\xc2\xb9.stl",
                                      "CONIN$",
                                      "aux .stl",
                                      "C:/mesh.stl",
                                      "C:mesh.stl",
                                      "mesh.stl:stream",
                                      "mesh.stl::$DATA",
                                      "//server/share/mesh.stl",
                                      "\\\\server\\share\\mesh.stl",
                                      "\\\\.\\pipe\\mesh.stl",
                                      "\\\\?\\C:\\mesh.stl",
                                      "/mesh.stl",
                                      "\\mesh.stl",
                                      "mesh.stl.",
                                      "mesh.stl ",
                                      "mesh*.stl"};
  char path[4 * MAX_PATH], element[200], text[400];
  snprintf(path, sizeof path, "%s/model.xml", folder_utf8);
  for (size_t i = 0; i < COUNT(names); ++i)
    for (size_t k = 0; k < COUNT(elements); ++k) {
      snprintf(element, sizeof element, elements[k], names[i]);
      snprintf(text, sizeof text, "<mujoco>%s</mujoco>", element);
      write_file(L"model.xml", text);
      if (k == 0)
        assert_refused(MJENV_E_MODEL, create_from(path, false), names[i], "device", "trust_xml");
      else  // some have no extension, which is said first
        assert_refused(MJENV_E_MODEL, create_from(path, false), names[i]);
    }
  wchar_t above[2 * MAX_PATH];
  swprintf(above, COUNT(above), L"%ls.xml", folder);
  FILE* file = _wfopen(above, L"wb");
  assert_non_null(file);
  assert_int_equal(fclose(file), 0);
  for (int backslash = 0; backslash < 2; ++backslash) {
    snprintf(text, sizeof text, "<mujoco><include file='..%c%s.xml'/></mujoco>", backslash ? '\\' : '/',
             strrchr(folder_utf8, '/') + 1);
    write_file(L"model.xml", text);
    assert_refused(MJENV_E_MODEL, create_from(path, false), "is outside of the model's folder", "trust_xml");
  }
  assert_int_equal(_wremove(above), 0);
  remove_file(L"model.xml");
}

// LINKS/inside holds model.xml, which includes the link.xml beside it, and that is a link to LINKS/outside.xml.
static void test_links(void** state) {
  (void)state;
  assert_refused(MJENV_E_MODEL, create_from(LINKS "/inside/model.xml", false), "is outside of the model's folder");
  assert_ok(create_from(LINKS "/inside/model.xml", true));
}

// ---- The process ----

// The library sees a variable that was set past its C library.
static void test_environment(void** state) {
  (void)state;
  mjenv_env* env = NULL;
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_true(SetEnvironmentVariableW(L"MJENV_LANES", L"3\u00e9"));
  assert_refused(MJENV_E_VALUE, mjenv_create(options, 64, &env), "MJENV_LANES", "3\xc3\xa9");
  assert_true(SetEnvironmentVariableW(L"MJENV_LANES", NULL));
  assert_ok(mjenv_create(options, 64, &env));
  mjenv_destroy(env);
  mjenv_options_destroy(options);
}

static DWORD WINAPI create_here(void* unused) {
  (void)unused;
  char xml[1200] = "<mujoco>";  // 60 levels need more stack than this thread has
  for (int i = 0; i < 60; ++i) strcat(xml, i == 0 ? "<worldbody>" : "<body>");
  strcat(xml, "<geom size='1'/>");
  for (int i = 0; i < 60; ++i) strcat(xml, i == 59 ? "</worldbody>" : "</body>");
  strcat(xml, "</mujoco>");
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  mjenv_status status = mjenv_options_create("Model-v0", &options);
  if (status == MJENV_OK) status = mjenv_options_set_string(options, "xml_string", xml);
  if (status == MJENV_OK) status = mjenv_create(options, 1, &env);
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return (DWORD)status;
}

static void test_small_stacks(void** state) {
  (void)state;
  HANDLE thread = CreateThread(NULL, 64 << 10, create_here, NULL, STACK_SIZE_PARAM_IS_A_RESERVATION, NULL);
  assert_non_null(thread);
  assert_int_equal(WaitForSingleObject(thread, INFINITE), WAIT_OBJECT_0);
  DWORD status = 1;
  assert_true(GetExitCodeThread(thread, &status));
  assert_int_equal((int)status, MJENV_OK);
  CloseHandle(thread);
}

// A host that was compiled by another compiler starts with another precision of the x87 unit.
static void test_precision_stays(void** state) {
  (void)state;
  unsigned short before = 0, after = 0;
  const unsigned short other = 0x027f;
  __asm__ volatile("fnstcw %0" : "=m"(before));
  __asm__ volatile("fldcw %0" : : "m"(other));
  mjenv_destroy(env_of_id("Hopper-v5", 1));
  __asm__ volatile("fnstcw %0" : "=m"(after));
  __asm__ volatile("fldcw %0" : : "m"(before));
  assert_int_equal(after, other);
}

static void test_plugins(void** state) {
  (void)state;
  assert_ok(mjenv_load_tasks(PLUGIN));
  mjenv_env* env = env_of_id("Typed-v7", 1);
  mjenv_destroy(env);
  assert_refused(MJENV_E_TASK, mjenv_load_tasks("./none.dll"), "none.dll", "No such file");
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_names_in_utf8),        cmocka_unit_test(test_models_that_are_no_files),
      cmocka_unit_test(test_names_from_strangers), cmocka_unit_test(test_links),
      cmocka_unit_test(test_environment),          cmocka_unit_test(test_small_stacks),
      cmocka_unit_test(test_precision_stays),      cmocka_unit_test(test_plugins),
  };
  return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
