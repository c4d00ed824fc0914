// Renderers: refusals, threads, forks, a context that is lost, and that drawing leaves the simulation alone.
// That the pictures are Gymnasium's is compared in tests/pictures.
#define _GNU_SOURCE  // RTLD_DEFAULT
#include <dlfcn.h>
#include <math.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "support.h"

enum { WIDTH = 61, HEIGHT = 43, PIXELS = WIDTH * HEIGHT, ROWS = 8 };

// ---- Libraries that seem not to be installed ----

static const char* hidden = "";  // the beginnings of their names, separated by blanks

// Stands before the C library's for this whole program.
void* dlopen(const char* file, int mode) {
  void* (*real)(const char*, int);
  *(void**)&real = dlsym(RTLD_NEXT, "dlopen");
  for (const char* name = hidden; file && *name; name += strcspn(name, " "), name += strspn(name, " "))
    if (strncmp(file, name, strcspn(name, " ")) == 0) return real("/nowhere/that.so", mode);
  return real(file, mode);
}

#ifdef __SANITIZE_ADDRESS__
// Drivers stay: what they hold to the end would be taken for a leak once they are gone.
int dlclose(void* library) {
  (void)library;
  return 0;
}
#endif

// ---- Pictures ----

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

static mjenv_renderer* renderer_of(mjenv_env* env) {
  const mjenv_render_settings settings = settings_of(env);
  mjenv_renderer* renderer = NULL;
  assert_ok(mjenv_renderer_create(env, &settings, &renderer));
  return renderer;
}

static mjenv_status draw(mjenv_renderer* renderer, int64_t row, struct picture* picture) {
  return mjenv_render(renderer, row, picture->rgb[0], sizeof picture->rgb, picture->depth, PIXELS);
}

static mjenv_env* ready_env(const char* id, int64_t rows) {
  mjenv_env* env = env_of_id(id, rows);
  seed_rows(env, 5);
  assert_ok(mjenv_reset(env, NULL, NULL));
  return env;
}

static void step_env(mjenv_env* env, const mjenv_batch* out) {
  float action[64];
  const size_t count = (size_t)(rows_of(env) * action_count(env));
  assert_true(count <= COUNT(action));
  assert_ok(mjenv_sample_actions(env, action, count));
  assert_ok(mjenv_step(env, NULL, action, count, MJENV_DTYPE_FLOAT32, out));
}

// Everything there is to say of an environment, to be freed.
static void* snapshot_of(mjenv_env* env, int64_t* size) {
  assert_ok(mjenv_snapshot(env, MJENV_ALL_ROWS, NULL, 0, size));
  void* image = allocate(*size);
  assert_ok(mjenv_snapshot(env, MJENV_ALL_ROWS, image, *size, size));
  return image;
}

// ---- Tests, the first ones before this process has used OpenGL ----

// What a child returns: 0, or the line that went wrong.
#define CHECK(condition)                     \
  do {                                       \
    if (!(condition)) return __LINE__ % 256; \
  } while (0)

static int exit_code_of(pid_t child) {
  int status;
  assert_int_equal(waitpid(child, &status, 0), child);
  assert_true(WIFEXITED(status));
  return WEXITSTATUS(status);
}

static bool said(const char* word) { return strstr(mjenv_last_error(), word) != NULL; }

// In a process of its own, as each of these spoils OpenGL for good.
static void in_child(int (*body)(mjenv_env*)) {
  mjenv_env* env = ready_env("Hopper-v5", 1);
  const pid_t child = fork();
  assert_true(child >= 0);
  if (child == 0) _exit(body(env));
  assert_int_equal(exit_code_of(child), 0);
  mjenv_destroy(env);
}

static int without_libraries(mjenv_env* env) {
  mjenv_renderer* renderer = NULL;
  hidden = "libEGL libOSMesa libglfw";
  unsetenv("MUJOCO_GL");
  CHECK(mjenv_renderer_create(env, NULL, &renderer) == MJENV_E_RENDER);
  CHECK(said("libegl1") && said("libosmesa6") && said("libglfw3"));
  const char* names[][2] = {{"egl", "libegl1 libgl1-mesa-dri"}, {"osmesa", "libosmesa6"}, {"glfw", "libglfw3"}};
  for (size_t i = 0; i < COUNT(names); ++i) {
    setenv("MUJOCO_GL", names[i][0], 1);
    CHECK(mjenv_renderer_create(env, NULL, &renderer) == MJENV_E_RENDER && said(names[i][1]));
  }
  CHECK(!renderer);
  float action[3] = {0};
  CHECK(mjenv_step(env, NULL, action, 3, MJENV_DTYPE_FLOAT32, NULL) == MJENV_OK);
  hidden = "";  // installed in the meantime
  setenv("MUJOCO_GL", "egl", 1);
  CHECK(mjenv_renderer_create(env, NULL, &renderer) == MJENV_OK);
  mjenv_renderer_destroy(renderer);
  return 0;
}

static void test_no_library(void** state) {
  (void)state;
  in_child(without_libraries);
}

static int without_driver(mjenv_env* env) {
  mjenv_renderer* renderer = NULL;
  setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere/vendor.json", 1);
  setenv("MUJOCO_GL", "egl", 1);
  CHECK(mjenv_renderer_create(env, NULL, &renderer) == MJENV_E_RENDER && said("libgl1-mesa-dri"));
  setenv("MUJOCO_EGL_DEVICE_ID", "77", 1);
  CHECK(mjenv_renderer_create(env, NULL, &renderer) == MJENV_E_VALUE && said("MUJOCO_EGL_DEVICE_ID"));
  float action[3] = {0};
  CHECK(mjenv_step(env, NULL, action, 3, MJENV_DTYPE_FLOAT32, NULL) == MJENV_OK);
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  unsetenv("MUJOCO_GL");
  CHECK(mjenv_renderer_create(env, NULL, &renderer) == MJENV_OK);  // the first that works
  CHECK(strncmp(mjenv_renderer_gl(renderer), "osmesa, ", 8) == 0);
  static uint8_t rgb[480 * 480 * 3];
  CHECK(mjenv_render(renderer, 0, rgb, sizeof rgb, NULL, 0) == MJENV_OK);
  mjenv_renderer_destroy(renderer);
  return 0;
}

static void test_no_driver(void** state) {
  (void)state;
  in_child(without_driver);
}

static int with_osmesa(mjenv_env* env) {
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  mjenv_renderer *renderer = NULL, *other = NULL;
  CHECK(mjenv_render_defaults(env, &settings) == MJENV_OK);
  settings.width = WIDTH;
  settings.height = HEIGHT;
  settings.gl = MJENV_GL_OSMESA;
  CHECK(mjenv_renderer_create(env, &settings, &renderer) == MJENV_OK);
  CHECK(strncmp(mjenv_renderer_gl(renderer), "osmesa, ", 8) == 0);
  settings.gl = MJENV_GL_EGL;
  CHECK(mjenv_renderer_create(env, &settings, &other) == MJENV_E_RENDER && said("already"));
  settings.gl = MJENV_GL_OSMESA;
  settings.width = settings.height = 30000;
  CHECK(mjenv_renderer_create(env, &settings, &other) == MJENV_E_VALUE && said("this OpenGL"));
  struct rusage usage;
  CHECK(getrusage(RUSAGE_SELF, &usage) == 0 && usage.ru_maxrss < 1000 * 1000);  // kB: refused before it is allocated
  settings.width = WIDTH;
  settings.height = HEIGHT;
  settings.gl = MJENV_GL_AUTO;
  setenv("MUJOCO_GL", "osmesa", 1);
  CHECK(mjenv_renderer_create(env, &settings, &other) == MJENV_OK);
  static struct picture pictures[2];
  CHECK(draw(renderer, 0, &pictures[0]) == MJENV_OK && draw(other, 0, &pictures[1]) == MJENV_OK);
  CHECK(memcmp(&pictures[0], &pictures[1], sizeof pictures[0]) == 0);
  mjenv_renderer_destroy(renderer);
  mjenv_renderer_destroy(other);
  return 0;
}

static void test_osmesa(void** state) {
  (void)state;
  in_child(with_osmesa);
}

static void test_defaults(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Hopper-v5", 1);
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  assert_ok(mjenv_render_defaults(env, &settings));
  assert_int_equal(settings.struct_size, sizeof settings);
  assert_int_equal(settings.gl, MJENV_GL_AUTO);
  assert_int_equal(settings.width, 480);
  assert_int_equal(settings.height, 480);
  assert_int_equal(settings.camera, MJENV_CAMERA_FREE);
  assert_null(settings.camera_name);
  assert_int_equal(settings.max_geom, 1000);
  assert_int_equal(settings.samples, 4);
  assert_int_equal(settings.shadows, 1);
  assert_int_equal(settings.reflections, 1);
  const double camera[] = {0, 0, 1.15, 3, -20}, got[] = {settings.lookat[0], settings.lookat[1], settings.lookat[2],
                                                         settings.distance, settings.elevation};
  assert_same_bits("camera", got, camera, COUNT(camera));
  assert_true(isnan(settings.azimuth));
  for (int i = 0; i < 32; ++i) {
    const bool on = i == MJENV_VISUAL_TEXTURE || i == MJENV_VISUAL_TENDON || i == MJENV_VISUAL_RANGEFINDER ||
                    i == MJENV_VISUAL_PERTOBJ || i == MJENV_VISUAL_STATIC || i == MJENV_VISUAL_SKIN;
    assert_int_equal(settings.visual[i], on);
  }
  const uint8_t groups[6] = {1, 1, 1, 0, 0, 0};  // mjv_defaultOption's
  assert_memory_equal(settings.geomgroup, groups, sizeof groups);
  assert_memory_equal(settings.sitegroup, groups, sizeof groups);
  assert_memory_equal(settings.jointgroup, groups, sizeof groups);
  assert_memory_equal(settings.tendongroup, groups, sizeof groups);
  assert_memory_equal(settings.actuatorgroup, groups, sizeof groups);
  assert_memory_equal(settings.skingroup, groups, sizeof groups);
  const int32_t drawn[] = {settings.label,  settings.frame, settings.wireframe, settings.additive,
                           settings.skybox, settings.fog,   settings.haze,      settings.cull_face};
  const int32_t mujocos[] = {MJENV_LABEL_NONE, MJENV_FRAME_NONE, 0, 0, 1, 0, 1, 1};  // mjv_makeScene's
  assert_memory_equal(drawn, mujocos, sizeof drawn);
  mjenv_destroy(env);
}

static void test_refused_settings(void** state) {
  (void)state;
  mjenv_env* env = ready_env("Ant-v5", 1);
  mjenv_renderer* renderer = NULL;
  mjenv_render_settings good = settings_of(env), s;
  assert_refused(MJENV_E_ARGUMENT, mjenv_render_defaults(NULL, &good), "env");
  assert_refused(MJENV_E_ARGUMENT, mjenv_render_defaults(env, NULL), "settings");
  assert_refused(MJENV_E_ARGUMENT, mjenv_renderer_create(NULL, &good, &renderer), "env");
  assert_refused(MJENV_E_ARGUMENT, mjenv_renderer_create(env, &good, NULL), "renderer");
  s = (mjenv_render_settings){.struct_size = 8};
  assert_refused(MJENV_E_ARGUMENT, mjenv_render_defaults(env, &s), "struct_size");
  assert_refused(MJENV_E_ARGUMENT, mjenv_renderer_create(env, &s, &renderer), "struct_size");

  const int32_t sizes[] = {0, -1, INT32_MIN, 65537, INT32_MAX};
  for (size_t i = 0; i < COUNT(sizes); ++i) {
    s = good, s.width = sizes[i];
    assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "width", "1 to 65536");
    s = good, s.height = sizes[i];
    assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "height", "1 to 65536");
  }
  s = good, s.width = 65536;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "65536 x 43", "this OpenGL");
  const int32_t cameras[] = {1, 99, -3, INT32_MIN};
  for (size_t i = 0; i < COUNT(cameras); ++i) {
    s = good, s.camera = cameras[i];
    assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "camera", "-1 to 0");
  }
  s = good, s.camera_name = "front";
  assert_refused(MJENV_E_NAME, mjenv_renderer_create(env, &s, &renderer), "front", "track");
  s = good, s.camera_name = "track", s.camera = 0;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "both set", "camera_name");
  s = good, s.max_geom = -1;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "max_geom");
  s = good, s.max_geom = INT32_MAX;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "max_geom");
  s = good, s.samples = -1;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "samples");
  s = good, s.label = MJENV_LABEL_CONTACTFORCE + 1;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "label", "0 to 13");
  s = good, s.frame = -1;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "frame", "0 to 7");
  s = good, s.gl = 9;
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &s, &renderer), "9");
  s = good, s.gl = MJENV_GL_WGL;
  assert_refused(MJENV_E_RENDER, mjenv_renderer_create(env, &s, &renderer), "wgl", "egl or glfw or osmesa");
  setenv("MUJOCO_GL", "vulkan", 1);
  assert_refused(MJENV_E_VALUE, mjenv_renderer_create(env, &good, &renderer), "MUJOCO_GL", "vulkan", "egl");
  setenv("MUJOCO_GL", "osmesa", 1);
  assert_refused(MJENV_E_RENDER, mjenv_renderer_create(env, &good, &renderer), "egl already");
  unsetenv("MUJOCO_GL");
  assert_null(renderer);
  step_env(env, NULL);
  mjenv_destroy(env);
}

static void test_refused_pictures(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Ant-v5", 2);
  seed_rows(env, 5);
  mjenv_renderer* renderer = renderer_of(env);
  static struct picture picture, before;
  memset(&picture, 0x5a, sizeof picture);
  before = picture;
  assert_refused(MJENV_E_NOT_RESET, draw(renderer, 0, &picture), "row 0", "reset");
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_refused(MJENV_E_ARGUMENT, draw(NULL, 0, &picture), "renderer");
  assert_refused(MJENV_E_VALUE, draw(renderer, 2, &picture), "row 2");
  assert_refused(MJENV_E_VALUE, draw(renderer, -1, &picture), "row -1");
  assert_refused(MJENV_E_ARGUMENT, mjenv_render(renderer, 0, NULL, 0, NULL, 0), "NULL");
  assert_refused(MJENV_E_SIZE, mjenv_render(renderer, 0, picture.rgb[0], 3 * PIXELS - 1, NULL, 0), "rgb", "7869");
  assert_refused(MJENV_E_SIZE, mjenv_render(renderer, 0, picture.rgb[0], 3 * PIXELS, picture.depth, PIXELS - 1),
                 "depth", "2623");
  static int32_t objects[PIXELS][2];
  assert_refused(MJENV_E_ARGUMENT, mjenv_render_segmentation(renderer, 0, NULL, 0), "objects is NULL");
  assert_refused(MJENV_E_SIZE, mjenv_render_segmentation(renderer, 0, objects[0], 2 * PIXELS - 1), "objects", "5246");
  assert_refused(MJENV_E_VALUE, mjenv_render_segmentation(renderer, 2, objects[0], 2 * PIXELS), "row 2");
  assert_memory_equal(&picture, &before, sizeof picture);

  assert_null(mjenv_renderer_gl(NULL));
  assert_memory_equal(mjenv_renderer_gl(renderer), "egl, ", 5);
  mjenv_renderer_destroy(NULL);
  assert_ok(draw(renderer, 1, &picture));

  float action[16] = {0};
  const int64_t row = 1;
  const mjenv_batch out = {.struct_size = sizeof out, .rows = 2};
  int64_t done;
  int64_t count;
  assert_ok(mjenv_send(env, &row, 1, action, 8, MJENV_DTYPE_FLOAT32));
  assert_refused(MJENV_E_PENDING, draw(renderer, 0, &picture), "under way");
  assert_ok(mjenv_recv(env, 1, -1, &done, 1, &count, &out));

  mjenv_destroy(env);
  assert_refused(MJENV_E_ARGUMENT, draw(renderer, 0, &picture), "destroyed");
  mjenv_renderer_destroy(renderer);
}

// Colours and depth apart are those drawn together, and the fast way gives others.
static void test_parts(void** state) {
  (void)state;
  mjenv_env* env = ready_env("Walker2d-v4", 1);
  mjenv_renderer* renderer = renderer_of(env);
  static struct picture both, apart, fast;
  assert_ok(draw(renderer, 0, &both));
  assert_ok(mjenv_render(renderer, 0, apart.rgb[0], 3 * PIXELS, NULL, 0));
  assert_ok(mjenv_render(renderer, 0, NULL, 0, apart.depth, PIXELS));
  assert_memory_equal(&apart, &both, sizeof both);
  mjenv_render_settings settings = settings_of(env);
  settings.samples = settings.shadows = 0;
  mjenv_renderer* other = NULL;
  assert_ok(mjenv_renderer_create(env, &settings, &other));
  assert_ok(draw(other, 0, &fast));
  assert_memory_not_equal(fast.rgb, both.rgb, sizeof both.rgb);
  mjenv_renderer_destroy(other);
  mjenv_renderer_destroy(renderer);
  mjenv_destroy(env);
}

// Outputs and state are those of an environment that is never drawn.
static void test_simulation_untouched(void** state) {
  (void)state;
  enum { FEW = 4, STEPS = 20 };
  mjenv_env* envs[2];
  struct outputs* outs[2];
  for (int i = 0; i < 2; ++i) {
    mjenv_options* options = options_of_id("Hopper-v5");
    assert_ok(mjenv_options_set_integer(options, "num_threads", i == 0 ? 1 : 3));
    assert_ok(mjenv_options_set_string(options, "autoreset_mode", "next_step"));
    envs[i] = env_of_options(options, FEW);
    seed_rows(envs[i], 11);
    assert_ok(mjenv_seed_actions(envs[i], 11));
    outs[i] = outputs_of(envs[i]);
    assert_ok(mjenv_reset(envs[i], NULL, &outs[i]->batch));
  }
  mjenv_renderer* renderer = renderer_of(envs[1]);
  const size_t count = outputs_row_count(outs[0]);
  double* records[2] = {allocate(count * sizeof(double)), allocate(count * sizeof(double))};
  static struct picture picture;
  for (int t = 0; t < STEPS; ++t) {
    for (int i = 0; i < 2; ++i) step_env(envs[i], &outs[i]->batch);
    assert_ok(draw(renderer, t % FEW, &picture));
    for (int64_t row = 0; row < FEW; ++row) {
      for (int i = 0; i < 2; ++i) outputs_row(envs[i], outs[i], MJENV_ROLE_INFO, row, records[i]);
      assert_same_bits("outputs", records[1], records[0], count);
    }
  }
  double* positions[2];
  for (int i = 0; i < 2; ++i) {
    int64_t length;
    positions[i] = read_array(envs[i], 1, "geom_xpos", &length);
    if (i == 1) assert_same_bits("geom_xpos", positions[1], positions[0], length);
  }
  int64_t size, size_after;
  void* image = snapshot_of(envs[1], &size);
  for (int row = 0; row < FEW; ++row) assert_ok(draw(renderer, row, &picture));
  void* after = snapshot_of(envs[1], &size_after);
  assert_int_equal(size, size_after);
  assert_memory_equal(image, after, size);
  for (int i = 0; i < 2; ++i) {
    free(positions[i]);
    free(records[i]);
    outputs_free(outs[i]);
    mjenv_destroy(envs[i]);
  }
  free(image);
  free(after);
  mjenv_renderer_destroy(renderer);
}

// ---- Threads ----

struct painter {
  pthread_t thread;
  mjenv_env* env;
  int64_t row;
  mjenv_renderer* renderer;  // made by the thread if null
  struct picture picture;
  mjenv_status status;
};

static void* paint(void* argument) {
  struct painter* p = argument;
  mjenv_renderer* own = NULL;
  if (!p->renderer) {
    mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
    mjenv_render_defaults(p->env, &settings);
    settings.width = WIDTH;
    settings.height = HEIGHT;
    p->status = mjenv_renderer_create(p->env, &settings, &own);
    if (p->status) return NULL;
  }
  for (int i = 0; i < 3 && !p->status; ++i) p->status = draw(p->renderer ? p->renderer : own, p->row, &p->picture);
  mjenv_renderer_destroy(own);
  return NULL;
}

static void test_threads(void** state) {
  (void)state;
  // Its free camera does not look at what a renderer sees first.
  mjenv_env* env = ready_env("Hopper-v5", ROWS);
  for (int t = 0; t < 5; ++t) step_env(env, NULL);
  mjenv_renderer* renderer = renderer_of(env);
  static struct picture alone[ROWS];
  static struct painter painters[ROWS];
  for (int row = 0; row < ROWS; ++row) assert_ok(draw(renderer, row, &alone[row]));
  for (int row = 1; row < ROWS; ++row) assert_memory_not_equal(&alone[row], &alone[0], sizeof alone[0]);
  for (int own = 0; own < 2; ++own) {
    for (int row = 0; row < ROWS; ++row) {
      painters[row] = (struct painter){.env = env, .row = row, .renderer = own ? NULL : renderer_of(env)};
      pthread_create(&painters[row].thread, NULL, paint, &painters[row]);
    }
    for (int row = 0; row < ROWS; ++row) {
      pthread_join(painters[row].thread, NULL);
      assert_int_equal(painters[row].status, MJENV_OK);
      assert_memory_equal(&painters[row].picture, &alone[row], sizeof alone[row]);
      mjenv_renderer_destroy(painters[row].renderer);
    }
  }
  mjenv_renderer_destroy(renderer);
  mjenv_destroy(env);
}

// The later of two threads in one renderer is told so.
static void test_busy(void** state) {
  (void)state;
  mjenv_env* env = ready_env("Ant-v5", 1);
  static struct painter painters[2];
  mjenv_renderer* renderer = renderer_of(env);
  static struct picture picture;
  assert_ok(draw(renderer, 0, &picture));
  bool met = false;
  for (int attempt = 0; attempt < 100 && !met; ++attempt) {
    for (int i = 0; i < 2; ++i) {
      painters[i] = (struct painter){.env = env, .renderer = renderer};
      pthread_create(&painters[i].thread, NULL, paint, &painters[i]);
    }
    for (int i = 0; i < 2; ++i) {
      pthread_join(painters[i].thread, NULL);
      if (painters[i].status == MJENV_E_BUSY) met = true;
      if (painters[i].status == MJENV_OK) assert_memory_equal(&painters[i].picture, &picture, sizeof picture);
      assert_true(painters[i].status == MJENV_OK || painters[i].status == MJENV_E_BUSY);
    }
  }
  assert_true(met);
  mjenv_renderer_destroy(renderer);
  mjenv_destroy(env);
}

// ---- Contexts that are lost ----

static void test_fork(void** state) {
  (void)state;
  mjenv_env* env = ready_env("Hopper-v4", 1);
  mjenv_renderer* renderer = renderer_of(env);
  static struct picture before, after;
  assert_ok(draw(renderer, 0, &before));
  const pid_t child = fork();
  assert_true(child >= 0);
  if (child == 0) {
    mjenv_renderer* other = NULL;
    if (draw(renderer, 0, &after) != MJENV_E_RENDER || !said("fork")) _exit(1);
    if (mjenv_renderer_create(env, NULL, &other) != MJENV_E_RENDER || !said("fork")) _exit(2);
    float action[3] = {0};
    if (mjenv_step(env, NULL, action, 3, MJENV_DTYPE_FLOAT32, NULL) != MJENV_OK) _exit(3);
    mjenv_renderer_destroy(renderer);
    mjenv_destroy(env);
    _exit(0);
  }
  assert_int_equal(exit_code_of(child), 0);
  assert_ok(draw(renderer, 0, &after));
  assert_memory_equal(&after, &before, sizeof before);
  mjenv_renderer_destroy(renderer);
  mjenv_destroy(env);
}

// Another part of the program ends EGL.
static void test_terminated(void** state) {
  (void)state;
  mjenv_env* env = ready_env("Hopper-v4", 1);
  mjenv_renderer* renderer = renderer_of(env);
  static struct picture before, after;
  assert_ok(draw(renderer, 0, &before));

  enum { PLATFORM_DEVICE = 0x313F, MOST = 8 };
  void* (*function)(const char*);
  unsigned (*query_devices)(int32_t, void**, int32_t*);
  void* (*display_of)(unsigned, void*, const int32_t*);
  unsigned (*terminate)(void*);
  *(void**)&function = dlsym(RTLD_DEFAULT, "eglGetProcAddress");
  *(void**)&query_devices = function("eglQueryDevicesEXT");
  *(void**)&display_of = function("eglGetPlatformDisplayEXT");
  *(void**)&terminate = function("eglTerminate");
  void* devices[MOST];
  int32_t count = 0;
  query_devices(MOST, devices, &count);
  for (int i = 0; i < count; ++i) terminate(display_of(PLATFORM_DEVICE, devices[i], NULL));

  assert_refused(MJENV_E_RENDER, draw(renderer, 0, &after), "lost");
  step_env(env, NULL);
  assert_ok(mjenv_reset(env, NULL, NULL));
  mjenv_renderer* fresh = renderer_of(env);
  assert_refused(MJENV_E_RENDER, draw(renderer, 0, &after), "lost");
  mjenv_renderer_destroy(renderer);
  assert_ok(mjenv_seed(env, NULL, (const uint64_t[]){5}, 1));
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(draw(fresh, 0, &after));
  assert_memory_equal(&after, &before, sizeof before);
  mjenv_renderer_destroy(fresh);
  mjenv_destroy(env);
}

int main(void) {
  unsetenv("MUJOCO_GL");
  unsetenv("MUJOCO_EGL_DEVICE_ID");
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_no_library),
      cmocka_unit_test(test_no_driver),
      cmocka_unit_test(test_osmesa),
      cmocka_unit_test(test_defaults),
      cmocka_unit_test(test_refused_settings),
      cmocka_unit_test(test_refused_pictures),
      cmocka_unit_test(test_parts),
      cmocka_unit_test(test_simulation_untouched),
      cmocka_unit_test(test_threads),
      cmocka_unit_test(test_busy),
      cmocka_unit_test(test_fork),
      cmocka_unit_test(test_terminated),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
