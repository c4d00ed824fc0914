#include "golden.h"

#include <dirent.h>
#include <math.h>

// ---- Reading ----

static void bad_line(const char* path, const char* line) { fail_msg("%s: a line that makes no sense: %s", path, line); }

static size_t reals_of(char* text, double* values, size_t capacity) {
  size_t count = 0;
  char* end = text;
  for (double value = strtod(text, &end); end != text && count < capacity; value = strtod(text = end, &end))
    values[count++] = value;
  return count;
}

static bool read_option(struct golden_option* option, const char* line) {
  char value[256];
  if (sscanf(line, "option %63s %15s %255[^\n]", option->name, option->kind, value) != 3) return false;
  if (strcmp(option->kind, "reals") == 0) {
    option->count = reals_of(value, option->reals, COUNT(option->reals));
    return option->count > 0;
  }
  if (strcmp(option->kind, "integer") == 0) return sscanf(value, "%" SCNd64, &option->integer) == 1;
  return strcmp(option->kind, "string") == 0 && sscanf(value, "%63s", option->text) == 1;
}

static bool read_field(struct golden_field* field, const char* line) {
  return sscanf(line, "%*s %63s %" SCNd64 " %23s", field->name, &field->count, field->type) == 3;
}

static bool read_array_line(struct golden_array* array, const char* line) {
  array->columns = 1;
  return sscanf(line, "array %31s %2s %zu %zu", array->name, array->dtype, &array->rows, &array->columns) >= 3;
}

static bool starts(const char* line, const char* word) {
  const size_t length = strlen(word);
  return strncmp(line, word, length) == 0 && line[length] == ' ';
}

static bool read_line(struct golden* g, const char* line) {
  if (starts(line, "id")) return sscanf(line, "id %63s", g->id) == 1;
  if (starts(line, "seed")) return sscanf(line, "seed %" SCNu64, &g->seed) == 1;
  if (starts(line, "norm")) return sscanf(line, "norm %7s", g->norm) == 1;
  if (starts(line, "libm")) return sscanf(line, "libm %7s", g->libm) == 1;
  if (starts(line, "option"))
    return g->option_count < COUNT(g->options) && read_option(&g->options[g->option_count++], line);
  if (starts(line, "info")) return g->info_count < COUNT(g->info) && read_field(&g->info[g->info_count++], line);
  if (starts(line, "reset_info"))
    return g->reset_info_count < COUNT(g->reset_info) && read_field(&g->reset_info[g->reset_info_count++], line);
  if (starts(line, "array"))
    return g->array_count < COUNT(g->arrays) && read_array_line(&g->arrays[g->array_count++], line);
  return starts(line, "mjenv-golden") || starts(line, "gymnasium") || starts(line, "mujoco") || starts(line, "numpy") ||
         starts(line, "python") || starts(line, "cpu") || starts(line, "kernel");
}

// The kind of recording whose sin, cos and so on the library has: its own, or the C library's on this CPU.
static const char* libm_here(void) {
  if (strstr(mjenv_version(), "portable math")) return "fma";
  volatile double angle = 692;  // keeps the compiler from computing the sine
  const double sine = sin(angle);
  if (sine == 0x1.80869e3fad89ap-1) return "fma";
  if (sine == 0x1.80869e3fad899p-1) return "sse2";
  fail_msg("this C library's sin(692) is %a, which belongs to no recording", sine);
  return NULL;
}

const char* golden_in(const char* folder, const char* name, char path[512]) {
  snprintf(path, 512, "%s/%s/%s", folder, libm_here(), name);
  return path;
}

const char* golden_path(const char* name, char path[512]) { return golden_in(GOLDENS, name, path); }

struct golden* golden_read(const char* path) {
  struct golden* g = allocate(sizeof *g);
  *g = (struct golden){.parts = 1};
  size_t size = 0;
  char absolute[512];
  if (path[0] != '/') path = golden_path(path, absolute);
  g->bytes = read_file(path, &size);
  if (strncmp(g->bytes, "mjenv-golden 1\n", 15) != 0) fail_msg("%s is not a golden of version 1", path);
  char* line = g->bytes;
  while (strncmp(line, "data\n", 5) != 0) {
    char* end = strchr(line, '\n');
    if (!end) bad_line(path, line);
    *end = '\0';
    if (!read_line(g, line)) bad_line(path, line);
    line = end + 1;
  }
  const char* data = line + 5;
  for (size_t i = 0; i < g->array_count; ++i) {
    struct golden_array* array = &g->arrays[i];
    array->data = data;
    data += array->rows * array->columns * (size_t)(array->dtype[1] - '0');
  }
  if (data != g->bytes + size) fail_msg("%s: the arrays do not fill the file", path);
  if (strcmp(g->libm, libm_here()) != 0)
    fail_msg("%s was recorded with the C library's %s functions; the library here has %s", path, g->libm, libm_here());
  return g;
}

void golden_free(struct golden* golden) {
  free(golden->bytes);
  free(golden);
}

static const struct golden_array* find(const struct golden* golden, const char* name) {
  for (size_t i = 0; i < golden->array_count; ++i)
    if (strcmp(golden->arrays[i].name, name) == 0) return &golden->arrays[i];
  return NULL;
}

const struct golden_array* golden_array(const struct golden* golden, const char* name, const char* dtype) {
  const struct golden_array* array = find(golden, name);
  if (!array || strcmp(array->dtype, dtype) != 0) fail_msg("%s: no array %s of %s", golden->id, name, dtype);
  return array;
}

static int by_text(const void* a, const void* b) { return strcmp(*(char* const*)a, *(char* const*)b); }

char** golden_list(const char* folder) {
  char path[512];
  golden_path(folder, path);
  DIR* dir = opendir(path);
  if (!dir) fail_msg("cannot open %s", path);
  enum { MOST = 200 };
  char** paths = allocate((MOST + 1) * sizeof *paths);
  size_t count = 0;
  for (struct dirent* entry = readdir(dir); entry; entry = readdir(dir)) {
    const char* dot = strrchr(entry->d_name, '.');
    if (!dot || strcmp(dot, ".golden") != 0) continue;
    if (count == MOST) fail_msg("more than %d files in %s", MOST, path);
    paths[count] = allocate(strlen(path) + strlen(entry->d_name) + 2);
    sprintf(paths[count++], "%s/%s", path, entry->d_name);
  }
  closedir(dir);
  qsort(paths, count, sizeof *paths, by_text);
  paths[count] = NULL;
  return paths;
}

void golden_free_list(char** paths) {
  for (size_t i = 0; paths[i]; ++i) free(paths[i]);
  free(paths);
}

// ---- Replaying ----

mjenv_env* golden_create(const struct golden* golden, int64_t rows) {
  mjenv_options* options = options_of_id(golden->id);
  assert_ok(mjenv_options_set_string(options, "norm", golden->norm));
  for (size_t i = 0; i < golden->option_count; ++i) {
    const struct golden_option* option = &golden->options[i];
    if (strcmp(option->kind, "integer") == 0)
      assert_ok(mjenv_options_set_integer(options, option->name, option->integer));
    else if (strcmp(option->kind, "reals") == 0)
      assert_ok(mjenv_options_set_reals(options, option->name, option->reals, option->count));
    else
      assert_ok(mjenv_options_set_string(options, option->name, option->text));
  }
  return env_of_options(options, rows);
}

size_t golden_steps(const struct golden* golden) { return golden_array(golden, "reward", "f8")->rows; }

const double* golden_row(const struct golden* golden, const char* name, size_t row, double* buffer) {
  const struct golden_array* array = golden_array(golden, name, "f8");
  memcpy(buffer, (const char*)array->data + row * array->columns * sizeof *buffer, array->columns * sizeof *buffer);
  return buffer;
}

static uint64_t hash_of(const double* values, size_t count) {
  uint64_t hash = 0xcbf29ce484222325;
  for (size_t i = 0; i < count; ++i) {
    uint64_t word;
    memcpy(&word, values + i, sizeof word);
    hash = (hash ^ word) * 0x100000001b3;
    hash ^= hash >> 32;
  }
  return hash;
}

bool golden_same(const struct golden* golden, const char* name, size_t part, const double* got, size_t count, char* why,
                 size_t size) {
  const struct golden_array* array = find(golden, name);
  const bool is_hashed = array && strcmp(array->dtype, "u8") == 0;
  const size_t width = is_hashed ? 1 : count;
  if (!array || array->columns != golden->parts * width || part >= array->rows * golden->parts) {
    snprintf(why, size, "%s is not recorded, or of another size", name);
    return false;
  }
  double want[1000];
  if (count > COUNT(want)) fail_msg("%s has too many numbers", name);
  memcpy(want, (const char*)array->data + part * width * sizeof *want, width * sizeof *want);
  if (!is_hashed) return same_bits(name, got, want, count, why, size);
  const uint64_t hash = hash_of(got, count);
  if (memcmp(&hash, want, sizeof hash) == 0) return true;
  snprintf(why, size, "%s has another hash than the recorded numbers", name);
  return false;
}

const void* golden_action(const struct golden* golden, size_t row, void* buffer, mjenv_dtype* dtype, int64_t* count) {
  const struct golden_array* actions = find(golden, "action");
  const bool narrow = actions->dtype[1] == '4';
  const size_t width = actions->columns * (narrow ? sizeof(float) : sizeof(double));
  *dtype = narrow ? MJENV_DTYPE_FLOAT32 : MJENV_DTYPE_FLOAT64;
  *count = (int64_t)actions->columns;
  return memcpy(buffer, (const char*)actions->data + row * width, width);
}

static bool flag_of(const struct golden* golden, const char* name, size_t row) {
  return ((const uint8_t*)golden_array(golden, name, "u1")->data)[row] != 0;
}

// The index of the reset before a step, or -1.
static int64_t reset_before(const struct golden* golden, size_t step) {
  const struct golden_array* array = golden_array(golden, "reset_at", "i8");
  for (size_t i = 0; i < array->rows; ++i) {
    int64_t at;
    memcpy(&at, (const char*)array->data + i * sizeof at, sizeof at);
    if ((size_t)at == step) return (int64_t)i;
  }
  return -1;
}

struct replay {
  const struct golden* golden;
  mjenv_env* env;
  struct outputs* out;
  float* narrow;       // where observations go; NULL: into out, as float64
  const double* wide;  // the recorded observation, for one in narrow
  char* why;
  size_t size;
};

static mjenv_batch batch_of(const struct replay* r, const mjenv_batch* batch) {
  mjenv_batch with = *batch;
  if (!r->narrow) return with;
  with.obs = r->narrow;
  with.obs_dtype = MJENV_DTYPE_FLOAT32;
  return with;
}

static bool refused(const struct replay* r, mjenv_status status) {
  if (status == MJENV_OK) return false;
  snprintf(r->why, r->size, "%s: %s", mjenv_status_name(status), mjenv_last_error());
  return true;
}

static bool same(const struct replay* r, const char* array, size_t row, const double* got, size_t count) {
  return golden_same(r->golden, array, row, got, count, r->why, r->size);
}

static bool same_obs(const struct replay* r, const char* array, size_t row) {
  const size_t count = (size_t)r->out->obs_count;
  if (!r->narrow) return same(r, array, row, r->out->obs, count);
  for (size_t i = 0; i < count; ++i) {
    const float rounded = (float)r->wide[i];
    if (memcmp(&rounded, r->narrow + i, sizeof rounded) == 0) continue;
    snprintf(r->why, r->size, "%s[%zu] is %a, wanted %a", array, i, (double)r->narrow[i], (double)rounded);
    return false;
  }
  return true;
}

static bool same_read(const struct replay* r, const char* array, size_t step) {
  double values[64];
  int64_t count = 0;
  if (refused(r, mjenv_read(r->env, 0, array, values, COUNT(values), &count))) return false;
  return same(r, array, step, values, (size_t)count);
}

static bool replay_reset(const struct replay* r, size_t reset) {
  if (reset == 0 && refused(r, mjenv_seed(r->env, NULL, &r->golden->seed, 1))) return false;
  const mjenv_batch batch = batch_of(r, &r->out->batch);
  if (refused(r, mjenv_reset(r->env, NULL, &batch))) return false;
  return same_obs(r, "reset_obs", reset) &&
         same(r, "reset_info", reset, r->out->reset_info, (size_t)r->out->reset_info_count) && *r->out->reward == 0 &&
         !*r->out->terminated && !*r->out->truncated && *r->out->status == MJENV_OK;
}

static bool replay_step(const struct replay* r, size_t step) {
  double action[64];
  mjenv_dtype dtype;
  int64_t count;
  golden_action(r->golden, step, action, &dtype, &count);
  const mjenv_batch batch = batch_of(r, &r->out->batch);
  if (refused(r, mjenv_step(r->env, NULL, action, count, dtype, &batch))) return false;
  if (*r->out->terminated != flag_of(r->golden, "terminated", step) ||
      *r->out->truncated != flag_of(r->golden, "truncated", step)) {
    snprintf(r->why, r->size, "terminated %d, truncated %d", *r->out->terminated, *r->out->truncated);
    return false;
  }
  return same_obs(r, "obs", step) && same(r, "reward", step, r->out->reward, 1) &&
         same(r, "info", step, r->out->info, (size_t)r->out->info_count) && same_read(r, "qpos", step) &&
         same_read(r, "qvel", step);
}

// Plays the steps with one environment after the other, each behind the one before.
static bool replay(const struct replay* replays, size_t count, size_t first, size_t end) {
  const struct golden* golden = replays->golden;
  char* why = replays->why;
  const size_t size = replays->size;
  snprintf(why, size, "an output is not as it should be");
  bool fine = true;
  for (size_t step = first; fine && step < end; ++step) {
    const int64_t reset = reset_before(golden, step);
    for (size_t i = 0; fine && reset >= 0 && i < count; ++i) fine = replay_reset(&replays[i], (size_t)reset);
    for (size_t i = 0; fine && i < count; ++i) fine = replay_step(&replays[i], step);
    if (!fine) snprintf(why + strlen(why), size - strlen(why), ", at step %zu of %s", step, golden->id);
  }
  return fine;
}

bool golden_replay(const struct golden* golden, mjenv_env* env, size_t first, size_t end, char* why, size_t size) {
  struct outputs* out = outputs_of(env);
  const bool fine = replay(&(struct replay){golden, env, out, NULL, NULL, why, size}, 1, first, end);
  outputs_free(out);
  return fine;
}

void golden_assert_plays(const struct golden* golden, mjenv_env* env) {
  char why[512];
  if (!golden_replay(golden, env, 0, golden_steps(golden), why, sizeof why)) fail_msg("%s", why);
}

void golden_assert_file_plays(const char* path) {
  struct golden* golden = golden_read(path);
  mjenv_env* env = golden_create(golden, 1);
  golden_assert_plays(golden, env);
  mjenv_destroy(env);
  golden_free(golden);
}

bool golden_replay_narrow(const struct golden* golden, mjenv_env* env, char* why, size_t size) {
  mjenv_env* other = golden_create(golden, 1);
  struct outputs *wide = outputs_of(other), *out = outputs_of(env);
  float* narrow = allocate((size_t)out->obs_count * sizeof *narrow);
  const struct replay both[] = {{golden, other, wide, NULL, NULL, why, size},
                                {golden, env, out, narrow, wide->obs, why, size}};
  const bool fine = replay(both, COUNT(both), 0, golden_steps(golden));
  free(narrow);
  outputs_free(out);
  outputs_free(wide);
  mjenv_destroy(other);
  return fine;
}

static bool same_in_rows(const struct replay* r, const char* array, size_t at, const double* got, size_t count) {
  for (size_t row = 0; row < (size_t)r->out->rows; ++row)
    if (!same(r, array, at, got + row * count, count)) return false;
  return true;
}

static bool reset_rows(const struct replay* r, size_t reset) {
  uint64_t seeds[64];
  assert_true((size_t)r->out->rows <= COUNT(seeds));
  for (int64_t row = 0; row < r->out->rows; ++row) seeds[row] = r->golden->seed;
  if (reset == 0 && refused(r, mjenv_seed(r->env, NULL, seeds, r->out->rows))) return false;
  if (refused(r, mjenv_reset(r->env, NULL, &r->out->batch))) return false;
  return same_in_rows(r, "reset_obs", reset, r->out->obs, (size_t)r->out->obs_count);
}

static bool step_rows(const struct replay* r, size_t step) {
  const size_t rows = (size_t)r->out->rows;
  double action[64], repeated[64 * 16];
  mjenv_dtype dtype;
  int64_t count;
  golden_action(r->golden, step, action, &dtype, &count);
  const size_t size = count * (dtype == MJENV_DTYPE_FLOAT32 ? sizeof(float) : sizeof(double));
  assert_true(rows * size <= sizeof repeated);
  for (size_t row = 0; row < rows; ++row) memcpy((char*)repeated + row * size, action, size);
  if (refused(r, mjenv_step(r->env, NULL, repeated, rows * count, dtype, &r->out->batch))) return false;
  for (size_t row = 0; row < rows; ++row)
    if (r->out->terminated[row] != flag_of(r->golden, "terminated", step) ||
        r->out->truncated[row] != flag_of(r->golden, "truncated", step)) {
      snprintf(r->why, r->size, "terminated or truncated of row %zu", row);
      return false;
    }
  return same_in_rows(r, "obs", step, r->out->obs, (size_t)r->out->obs_count) &&
         same_in_rows(r, "reward", step, r->out->reward, 1);
}

bool golden_replay_in_rows(const struct golden* golden, mjenv_env* env, char* why, size_t size) {
  const struct replay r = {golden, env, outputs_of(env), NULL, NULL, why, size};
  bool fine = true;
  for (size_t step = 0; fine && step < golden_steps(golden); ++step) {
    const int64_t reset = reset_before(golden, step);
    fine = (reset < 0 || reset_rows(&r, (size_t)reset)) && step_rows(&r, step);
    if (!fine) snprintf(why + strlen(why), size - strlen(why), ", at step %zu of %s", step, golden->id);
  }
  outputs_free(r.out);
  return fine;
}
