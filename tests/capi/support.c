#include "support.h"

enum { PATTERN = 0xa5 };

void support_status(mjenv_status wanted, mjenv_status got, const char* call, const char* file, int line, ...) {
  const char* message = got == MJENV_OK ? "" : mjenv_last_error();
  bool fine = got == wanted;
  va_list words;
  va_start(words, line);
  for (const char* word = va_arg(words, const char*); word; word = va_arg(words, const char*)) {
    if (strstr(message, word)) continue;
    fine = false;
    print_error("the message does not say: %s\n", word);
  }
  va_end(words);
  if (fine) return;
  print_error("%s\n  gave %s, wanted %s\n  message: %s\n", call, mjenv_status_name(got), mjenv_status_name(wanted),
              message);
  _fail(file, line);
}

bool same_bits(const char* what, const double* got, const double* want, size_t count, char* why, size_t size) {
  for (size_t i = 0; i < count; ++i) {
    if (memcmp(got + i, want + i, sizeof(double)) == 0) continue;
    snprintf(why, size, "%s[%zu] is %a (%.17g), wanted %a (%.17g)", what, i, got[i], got[i], want[i], want[i]);
    return false;
  }
  return true;
}

void support_same_bits(const char* what, const double* got, const double* want, size_t count, const char* file,
                       int line) {
  char why[256];
  if (same_bits(what, got, want, count, why, sizeof why)) return;
  print_error("%s\n", why);
  _fail(file, line);
}

void set_variable(const char* name, const char* value) {
#if defined(_WIN32)
  assert_int_equal(_putenv_s(name, value ? value : ""), 0);
#else
  assert_int_equal(value ? setenv(name, value, 1) : unsetenv(name), 0);
#endif
}

void* allocate(size_t bytes) {
  void* memory = malloc(bytes ? bytes : 1);
  if (!memory) fail_msg("no memory for %zu bytes", bytes);
  return memory;
}

char* read_file(const char* path, size_t* size) {
  FILE* file = fopen(path, "rb");
  if (!file) fail_msg("cannot open %s", path);
  fseek(file, 0, SEEK_END);
  const size_t length = (size_t)ftell(file);
  rewind(file);
  char* text = allocate(length + 1);
  const size_t got = fread(text, 1, length, file);
  fclose(file);
  if (got != length) fail_msg("cannot read %s", path);
  text[length] = '\0';
  if (size) *size = length;
  return text;
}

// ---- Environments ----

mjenv_options* options_of_id(const char* id) {
  mjenv_options* options = NULL;
  assert_ok(mjenv_options_create(id, &options));
  return options;
}

mjenv_env* env_of_options(mjenv_options* options, int64_t rows) {
  mjenv_env* env = NULL;
  assert_ok(mjenv_create(options, rows, &env));
  mjenv_options_destroy(options);
  return env;
}

void set_lanes(mjenv_options* options, int64_t lanes) {
  if (lanes >= 0)
    assert_ok(mjenv_options_set_integer(options, "lanes", lanes));
  else
    assert_ok(mjenv_options_set_string(options, "lanes", lanes == AUTO_LANES ? "auto" : "max"));
}

mjenv_env* env_of_id(const char* id, int64_t rows) { return env_of_options(options_of_id(id), rows); }

void seed_rows(mjenv_env* env, uint64_t seed) {
  const int64_t rows = rows_of(env);
  uint64_t* seeds = allocate((size_t)rows * sizeof *seeds);
  for (int64_t row = 0; row < rows; ++row) seeds[row] = seed + (uint64_t)row;
  assert_ok(mjenv_seed(env, NULL, seeds, rows));
  free(seeds);
}

static mjenv_info info_of(const mjenv_env* env) {
  mjenv_info info = MJENV_INFO_INIT;
  mjenv_info_of((mjenv_env*)env, &info);
  return info;
}

int64_t rows_of(const mjenv_env* env) { return info_of(env).rows; }

int64_t frame_skip_of(const mjenv_env* env) { return info_of(env).frame_skip; }

mjenv_status write_row(mjenv_env* env, int64_t row, const char* array, const double* values, int64_t count) {
  return row == MJENV_ALL_ROWS ? mjenv_write(env, NULL, array, values, count)
                               : mjenv_write_row(env, row, array, values, count);
}

mjenv_status set_constants(mjenv_env* env, int64_t row) {
  return row == MJENV_ALL_ROWS ? mjenv_set_constants(env, NULL) : mjenv_set_constants_row(env, row);
}

int64_t action_count(const mjenv_env* env) {
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_ACTION, &space));
  return space.count;
}

int64_t role_count(const mjenv_env* env, mjenv_role role) {
  int64_t total = 0;
  for (int64_t i = 0; i < mjenv_field_count(env, role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(env, role, i, &field));
    total += field.count;
  }
  return total;
}

double* read_array(mjenv_env* env, int64_t row, const char* array, int64_t* count) {
  int64_t length = 0;
  assert_ok(mjenv_read(env, row, array, NULL, 0, &length));
  double* values = allocate((size_t)length * sizeof *values);
  if (length > 0) assert_ok(mjenv_read(env, row, array, values, length, &length));
  if (count) *count = length;
  return values;
}

// ---- Images ----

unsigned char* image_of(mjenv_env* env, int64_t row, int64_t* size) {
  assert_ok(mjenv_snapshot(env, row, NULL, 0, size));
  unsigned char* image = allocate((size_t)*size);
  int64_t written = 0;
  assert_ok(mjenv_snapshot(env, row, image, *size, &written));
  assert_int_equal(written, *size);
  return image;
}

void assert_same_image(mjenv_env* env, int64_t row, mjenv_env* other, int64_t other_row) {
  int64_t got_size, want_size;
  unsigned char *got = image_of(env, row, &got_size), *want = image_of(other, other_row, &want_size);
  assert_int_equal(got_size, want_size);
  assert_memory_equal(got, want, want_size);
  free(got);
  free(want);
}

// The layout of an image, as core/env/image.cpp describes it.
enum { IMAGE_PARTS = 48, IMAGE_ARRAYS = 52, IMAGE_CHECKSUM = 56, IMAGE_HEADER = 64, IMAGE_NAME = 40, IMAGE_ENTRY = 48 };

unsigned char* image_part(unsigned char* image, const char* name, size_t* size) {
  uint32_t parts, arrays;
  memcpy(&parts, image + IMAGE_PARTS, sizeof parts);
  memcpy(&arrays, image + IMAGE_ARRAYS, sizeof arrays);
  unsigned char *entry = image + IMAGE_HEADER, *part = entry + (size_t)(parts + arrays) * IMAGE_ENTRY;
  for (uint32_t i = 0; i < parts; ++i, entry += IMAGE_ENTRY) {
    uint64_t bytes;
    memcpy(&bytes, entry + IMAGE_NAME, sizeof bytes);
    *size = (size_t)bytes;
    if (strcmp((const char*)entry, name) == 0) return part;
    part += bytes;
  }
  fail_msg("the image has no part \"%s\"", name);
  return NULL;
}

void image_seal(unsigned char* image, size_t size) {
  uint64_t sum = 0xcbf29ce484222325;  // FNV-1a
  for (size_t i = IMAGE_HEADER; i < size; ++i) sum = (sum ^ image[i]) * 0x100000001b3;
  memcpy(image + IMAGE_CHECKSUM, &sum, sizeof sum);
}

// ---- Outputs ----

struct outputs* outputs_of(const mjenv_env* env) {
  struct outputs* out = allocate(sizeof *out);
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  out->rows = rows_of(env);
  out->obs_count = space.count;
  out->info_count = role_count(env, MJENV_ROLE_INFO);
  out->reset_info_count = role_count(env, MJENV_ROLE_RESET_INFO);
  const size_t rows = (size_t)out->rows;
  out->obs = allocate(rows * (size_t)out->obs_count * sizeof(double));
  out->reward = allocate(rows * sizeof(double));
  out->info = allocate(rows * (size_t)out->info_count * sizeof(double));
  out->reset_info = allocate(rows * (size_t)out->reset_info_count * sizeof(double));
  out->terminated = allocate(rows);
  out->truncated = allocate(rows);
  out->status = allocate(rows * sizeof(int32_t));
  out->batch = (mjenv_batch){.struct_size = sizeof(mjenv_batch),
                             .obs_dtype = MJENV_DTYPE_FLOAT64,
                             .rows = out->rows,
                             .obs_count = out->obs_count,
                             .info_count = out->info_count,
                             .obs = out->obs,
                             .reward = out->reward,
                             .terminated = out->terminated,
                             .truncated = out->truncated,
                             .info = out->info,
                             .status = out->status,
                             .reset_info_count = out->reset_info_count,
                             .reset_info = out->reset_info};
  outputs_soil(out);
  return out;
}

void outputs_free(struct outputs* out) {
  free(out->obs);
  free(out->reward);
  free(out->info);
  free(out->reset_info);
  free(out->terminated);
  free(out->truncated);
  free(out->status);
  free(out);
}

// Calls visit for each buffer until one says false.
static bool each_buffer(const struct outputs* out, bool (*visit)(unsigned char* bytes, size_t count)) {
  const size_t rows = (size_t)out->rows;
  return visit((unsigned char*)out->obs, rows * (size_t)out->obs_count * sizeof(double)) &&
         visit((unsigned char*)out->reward, rows * sizeof(double)) &&
         visit((unsigned char*)out->info, rows * (size_t)out->info_count * sizeof(double)) &&
         visit((unsigned char*)out->reset_info, rows * (size_t)out->reset_info_count * sizeof(double)) &&
         visit(out->terminated, rows) && visit(out->truncated, rows) &&
         visit((unsigned char*)out->status, rows * sizeof(int32_t));
}

static bool soil(unsigned char* bytes, size_t count) {
  memset(bytes, PATTERN, count);
  return true;
}

static bool is_soiled(unsigned char* bytes, size_t count) {
  for (size_t i = 0; i < count; ++i)
    if (bytes[i] != PATTERN) return false;
  return true;
}

void outputs_soil(struct outputs* out) { each_buffer(out, soil); }

bool outputs_untouched(const struct outputs* out) { return each_buffer(out, is_soiled); }

size_t outputs_row_count(const struct outputs* out) {
  const int64_t info_count = out->info_count > out->reset_info_count ? out->info_count : out->reset_info_count;
  return (size_t)(out->obs_count + 4 + info_count);
}

void outputs_row(const mjenv_env* env, const struct outputs* out, mjenv_role info_role, int64_t row, double* record) {
  memset(record, 0, outputs_row_count(out) * sizeof *record);
  memcpy(record, out->obs + row * out->obs_count, (size_t)out->obs_count * sizeof(double));
  record += out->obs_count;
  *record++ = out->reward[row];
  *record++ = out->terminated[row];
  *record++ = out->truncated[row];
  *record++ = out->status[row];
  for (int64_t i = 0; i < mjenv_field_count(env, info_role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    assert_ok(mjenv_field_at(env, info_role, i, &field));
    const double* info = info_role == MJENV_ROLE_RESET_INFO ? out->reset_info : out->info;
    memcpy(record, info + field.offset * out->rows + row * field.count, (size_t)field.count * sizeof(double));
    record += field.count;
  }
}

mjenv_env* env_of_model(const char* xml) {
  mjenv_options* options = options_of_id("Model-v0");
  assert_ok(mjenv_options_set_string(options, "xml_string", xml));
  return env_of_options(options, 1);
}
