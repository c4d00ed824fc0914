// Plays one model and says how it went, in one line: "works", or "refused STATUS REASON". For tests/hostile/run.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "mjenv/mjenv.h"

static int refused(mjenv_status status) {
  printf("refused %s %s\n", mjenv_status_name(status), mjenv_last_error());
  return 0;
}

// Ends the program with the reason, unless the call succeeded.
#define TRY(call)                                    \
  do {                                               \
    const mjenv_status status_ = (call);             \
    if (status_ != MJENV_OK) exit(refused(status_)); \
  } while (0)

static void read_all(mjenv_env* env) {
  static const char* const arrays[] = {"qpos",       "xpos",      "sensordata",    "cfrc_ext",
                                       "ten_length", "geom_xmat", "actuator_force"};
  for (size_t i = 0; i < sizeof arrays / sizeof *arrays; ++i) {
    int64_t count = 0;
    TRY(mjenv_read(env, 1, arrays[i], NULL, 0, &count));
    double* values = malloc(count * sizeof *values + 1);
    if (count > 0) TRY(mjenv_read(env, 1, arrays[i], values, count, &count));
    free(values);
  }
}

// A picture as Gymnasium takes it, and one with everything in it that MuJoCo can show. The second is drawn without shadows and
// multisampling, whose buffers take most of the time of most cases. is_brief: draws the second alone.
static void draw(mjenv_env* env, int is_brief) {
  enum { WIDTH = 48, HEIGHT = 32 };
  unsigned char rgb[WIDTH * HEIGHT * 3];
  float depth[WIDTH * HEIGHT];
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  for (int all = is_brief; all < 2; ++all) {
    mjenv_renderer* renderer = NULL;
    TRY(mjenv_render_defaults(env, &settings));
    settings.width = WIDTH;
    settings.height = HEIGHT;
    if (all) {
      settings.samples = settings.shadows = 0;
      memset(settings.visual, 1, sizeof settings.visual);
      memset(settings.geomgroup, 1, sizeof settings.geomgroup);
      memset(settings.sitegroup, 1, sizeof settings.sitegroup);
      memset(settings.jointgroup, 1, sizeof settings.jointgroup);
      memset(settings.tendongroup, 1, sizeof settings.tendongroup);
      memset(settings.actuatorgroup, 1, sizeof settings.actuatorgroup);
      memset(settings.skingroup, 1, sizeof settings.skingroup);
    }
    TRY(mjenv_renderer_create(env, &settings, &renderer));
    const mjenv_status status = mjenv_render(renderer, 1, rgb, sizeof rgb, depth, WIDTH * HEIGHT);
    mjenv_renderer_destroy(renderer);
    TRY(status);
  }
}

static void play(mjenv_env* env, int is_brief) {
  const size_t count = (size_t)mjenv_field_count(env, MJENV_ROLE_ACTION) * 2;
  float* action = calloc(count + 1, sizeof *action);
  const uint64_t seeds[2] = {1, 2};
  TRY(mjenv_seed(env, NULL, seeds, 2));
  TRY(mjenv_seed_actions(env, 3));
  TRY(mjenv_reset(env, NULL, NULL));
  for (int step = 0; step < 10; ++step) {
    if (mjenv_sample_actions(env, action, count) != MJENV_OK)
      for (size_t i = 0; i < count; ++i) action[i] = step % 2 ? 1e6F : -1e6F;
    TRY(mjenv_step(env, NULL, action, count, MJENV_DTYPE_FLOAT32, NULL));
  }
  read_all(env);
  draw(env, is_brief);
  int64_t size = 0;
  TRY(mjenv_snapshot(env, MJENV_ALL_ROWS, NULL, 0, &size));
  void* image = malloc(size);
  TRY(mjenv_snapshot(env, MJENV_ALL_ROWS, image, size, &size));
  TRY(mjenv_restore(env, MJENV_ALL_ROWS, image, size));
  free(image);
  free(action);
}

// The whole of a file, as a text.
static char* text_of(const char* path) {
  FILE* file = fopen(path, "rb");
  if (!file) return NULL;
  fseek(file, 0, SEEK_END);
  const long size = ftell(file);
  rewind(file);
  char* text = calloc((size_t)size + 1, 1);
  const size_t got = fread(text, 1, (size_t)size, file);
  fclose(file);
  text[got] = 0;
  return text;
}

// Arguments: ID PATH, and "text" for a model from memory, "own" for a file of the user's own. Without either, a
// stranger wrote the file. "brief" draws one picture instead of two.
int main(int argc, char** argv) {
  if (argc < 3) return 2;
  mjenv_options* options = NULL;
  TRY(mjenv_options_create(argv[1], &options));
  TRY(mjenv_options_set_integer(options, "strict", 0));
  TRY(mjenv_options_set_integer(options, "num_threads", 2));
  TRY(mjenv_options_set_string(options, "xml_file", argv[2]));
  int keeps_default = 0, is_brief = 0;
  for (int i = 3; i < argc; ++i) {
    if (strcmp(argv[i], "brief") == 0) {
      is_brief = 1;
      continue;
    }
    if (strcmp(argv[i], "text") == 0) {
      char* text = text_of(argv[2]);
      TRY(mjenv_options_set_string(options, "xml_string", text));
      free(text);
    }
    keeps_default = 1;  // trust_xml stays "auto"
  }
  if (!keeps_default) TRY(mjenv_options_set_string(options, "trust_xml", "no"));
  mjenv_env* env = NULL;
  const mjenv_status status = mjenv_create(options, 2, &env);
  mjenv_options_destroy(options);
  if (status != MJENV_OK) return refused(status);
  play(env, is_brief);
  mjenv_destroy(env);
  puts("works");
  return 0;
}
