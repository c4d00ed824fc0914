// Pictures on Windows: the picture that Gymnasium draws on Linux, threads, the caller's own OpenGL, and what is
// refused. An argument says that there is no OpenGL, and what the reason must contain.
#include <windows.h>
// After the header that it needs.
#include <GL/gl.h>

#include "support.h"

enum { WIDTH = 157, HEIGHT = 93, PIXELS = WIDTH * HEIGHT, THREADS = 4, STEPS = 10 };

struct picture {
  uint8_t rgb[PIXELS][3];
  float depth[PIXELS];
};

static mjenv_render_settings settings_of(const mjenv_env* env) {
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  assert_ok(mjenv_render_defaults(env, &settings));
  settings.width = WIDTH;
  settings.height = HEIGHT;
  return settings;
}

static mjenv_env* ready_env(void) {
  mjenv_env* env = env_of_id("Ant-v5", 1);
  seed_rows(env, 3);
  assert_ok(mjenv_reset(env, NULL, NULL));
  const float action[8] = {0};
  for (int i = 0; i < STEPS; ++i) assert_ok(mjenv_step(env, NULL, action, 8, MJENV_DTYPE_FLOAT32, NULL));
  return env;
}

static mjenv_status draw(mjenv_renderer* renderer, struct picture* picture) {
  return mjenv_render(renderer, 0, picture->rgb[0], sizeof picture->rgb, picture->depth, PIXELS);
}

// Draws with a renderer of its own, which it leaves to the caller.
struct painter {
  mjenv_env* env;
  mjenv_render_settings settings;
  mjenv_renderer* renderer;
  struct picture picture;
  mjenv_status status;
};

static DWORD WINAPI paint(void* argument) {
  struct painter* p = argument;
  p->status = mjenv_renderer_create(p->env, &p->settings, &p->renderer);
  for (int i = 0; i < 3 && !p->status; ++i) p->status = draw(p->renderer, &p->picture);
  return 0;
}

static HANDLE start(struct painter* painter) {
  HANDLE thread = CreateThread(NULL, 0, paint, painter, 0, NULL);
  assert_non_null(thread);
  return thread;
}

static void join(HANDLE thread) {
  assert_int_equal(WaitForSingleObject(thread, INFINITE), WAIT_OBJECT_0);
  CloseHandle(thread);
}

// ---- Tests ----

// That of tests/pictures/record. With the same Mesa under both OpenGLs every bit is equal.
static void test_gymnasiums_picture(void** state) {
  (void)state;
  static struct picture picture;
  size_t size;
  char* file = read_file(PROJECT_FOLDER "/build/pictures/Ant-v5", &size);
  const char* pixels = strchr(file, '\n') + 1;
  assert_memory_equal(file, "Ant-v5 3 157 93 10\n", pixels - file);
  assert_int_equal(file + size - pixels, 7 * PIXELS);
  mjenv_env* env = ready_env();
  const mjenv_render_settings settings = settings_of(env);
  mjenv_renderer* renderer = NULL;
  assert_ok(mjenv_renderer_create(env, &settings, &renderer));
  assert_memory_equal(mjenv_renderer_gl(renderer), "wgl, ", 5);
  assert_ok(draw(renderer, &picture));
  int other = 0;
  for (int i = 0; i < PIXELS; ++i)
    other += memcmp(picture.rgb[i], pixels + 3 * i, 3) || memcmp(&picture.depth[i], pixels + 3 * PIXELS + 4 * i, 4);
  print_message("%s: %d of %d pixels are not Gymnasium's\n", mjenv_renderer_gl(renderer), other, PIXELS);
  assert_int_equal(other, 0);
  mjenv_renderer_destroy(renderer);
  mjenv_destroy(env);
  free(file);
}

// Several threads draw at once. The renderers go on after the threads that made them have ended.
static void test_threads(void** state) {
  (void)state;
  static struct painter painters[THREADS];
  static struct picture after;
  HANDLE threads[THREADS];
  for (int i = 0; i < THREADS; ++i) {
    painters[i].env = ready_env();
    painters[i].settings = settings_of(painters[i].env);
  }
  for (int i = 0; i < THREADS; ++i) threads[i] = start(&painters[i]);
  for (int i = 0; i < THREADS; ++i) join(threads[i]);
  for (int i = 0; i < THREADS; ++i) {
    assert_ok(painters[i].status);
    assert_memory_equal(&painters[i].picture, &painters[0].picture, sizeof after);
    memset(&after, 0, sizeof after);
    assert_ok(draw(painters[i].renderer, &after));
    assert_memory_equal(&after, &painters[0].picture, sizeof after);
    mjenv_renderer_destroy(painters[i].renderer);
    mjenv_destroy(painters[i].env);
  }
}

static void test_callers_context(void** state) {
  (void)state;
  HWND window = CreateWindowW(L"STATIC", L"", WS_POPUP, 0, 0, 8, 8, NULL, NULL, NULL, NULL);
  assert_non_null(window);
  HDC device = GetDC(window);
  const PIXELFORMATDESCRIPTOR wanted = {
      .nSize = sizeof wanted, .nVersion = 1, .dwFlags = PFD_DRAW_TO_WINDOW | PFD_SUPPORT_OPENGL, .cColorBits = 24};
  assert_true(SetPixelFormat(device, ChoosePixelFormat(device, &wanted), &wanted));
  HGLRC context = wglCreateContext(device);
  assert_true(wglMakeCurrent(device, context));
  glClearColor(0.25F, 0.5F, 0.75F, 1);

  static struct picture picture;
  mjenv_env* env = ready_env();
  const mjenv_render_settings settings = settings_of(env);
  mjenv_renderer* renderer = NULL;
  assert_ok(mjenv_renderer_create(env, &settings, &renderer));
  assert_ok(draw(renderer, &picture));
  assert_ptr_equal(wglGetCurrentContext(), context);
  assert_ptr_equal(wglGetCurrentDC(), device);
  mjenv_renderer_destroy(renderer);
  assert_ptr_equal(wglGetCurrentContext(), context);
  float colour[4] = {0};
  glGetFloatv(GL_COLOR_CLEAR_VALUE, colour);
  assert_true(colour[0] == 0.25F && colour[1] == 0.5F && colour[2] == 0.75F);

  assert_true(wglMakeCurrent(NULL, NULL));
  assert_true(wglDeleteContext(context));
  ReleaseDC(window, device);
  DestroyWindow(window);
  mjenv_destroy(env);
}

// Each renderer has a window and a thread; none stays behind.
static void test_nothing_left(void** state) {
  (void)state;
  mjenv_env* env = ready_env();
  const mjenv_render_settings settings = settings_of(env);
  DWORD handles[2] = {0, 0};
  for (int i = 0; i < 20; ++i) {
    mjenv_renderer* renderer = NULL;
    assert_ok(mjenv_renderer_create(env, &settings, &renderer));
    assert_non_null(FindWindowW(L"mjenv", NULL));
    mjenv_renderer_destroy(renderer);
    assert_true(GetProcessHandleCount(GetCurrentProcess(), &handles[i > 9]));
    assert_null(FindWindowW(L"mjenv", NULL));
  }
  assert_true(handles[1] <= handles[0]);
  mjenv_destroy(env);
}

static void test_refused(void** state) {
  (void)state;
  mjenv_env* env = ready_env();
  mjenv_render_settings settings = settings_of(env);
  mjenv_renderer* renderer = NULL;
  mjenv_window* window = NULL;
  const mjenv_gl others[] = {MJENV_GL_EGL, MJENV_GL_GLFW, MJENV_GL_OSMESA};
  for (size_t i = 0; i < COUNT(others); ++i) {
    settings.gl = others[i];
    assert_refused(MJENV_E_RENDER, mjenv_renderer_create(env, &settings, &renderer), "but with wgl");
  }
  settings = settings_of(env);
  settings.width = 65536;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &settings, &renderer), "65536 x 93", "this OpenGL");
  settings = settings_of(env);
  assert_refused(MJENV_E_RENDER, mjenv_window_create(env, &settings, &window), "no windows", "renderer");
  set_variable("MUJOCO_GL", "egl");
  assert_refused(MJENV_E_RENDER, mjenv_renderer_create(env, &settings, &renderer), "egl", "wgl");
  set_variable("MUJOCO_GL", "opengl");
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &settings, &renderer), "MUJOCO_GL", "opengl", "wgl");
  assert_null(renderer);
  assert_null(window);
  set_variable("MUJOCO_GL", "wgl");
  assert_ok(mjenv_renderer_create(env, &settings, &renderer));
  mjenv_renderer_destroy(renderer);
  set_variable("MUJOCO_GL", NULL);
  mjenv_destroy(env);
}

static const char* reason;

static void test_no_opengl(void** state) {
  (void)state;
  mjenv_env* env = ready_env();
  mjenv_renderer* renderer = NULL;
  for (int i = 0; i < 2; ++i) assert_refused(MJENV_E_RENDER, mjenv_renderer_create(env, NULL, &renderer), reason);
  print_message("%s\n", mjenv_last_error());
  assert_null(renderer);
  const float action[8] = {0};
  assert_ok(mjenv_step(env, NULL, action, 8, MJENV_DTYPE_FLOAT32, NULL));
  mjenv_destroy(env);
}

int main(int argc, char** argv) {
  if (argc > 1) {
    reason = argv[1];
    const struct CMUnitTest without[] = {cmocka_unit_test(test_no_opengl)};
    return cmocka_run_group_tests(without, NULL, NULL);
  }
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_gymnasiums_picture), cmocka_unit_test(test_threads), cmocka_unit_test(test_callers_context),
      cmocka_unit_test(test_nothing_left),       cmocka_unit_test(test_refused),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
