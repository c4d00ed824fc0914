// What the tests of the C interface share: assertions, outputs with guards, environments.
#ifndef MJENV_TESTS_SUPPORT_H
#define MJENV_TESTS_SUPPORT_H

#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// After the headers that it needs.
#include <cmocka.h>

#include "mjenv/mjenv.h"

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

// The call succeeds; else the test fails with the library's message.
#define assert_ok(call) support_status(MJENV_OK, (call), #call, __FILE__, __LINE__, (const char*)NULL)

// The call fails with that status and a message that contains each of the words given.
#define assert_refused(status, call, ...) \
  support_status((status), (call), #call, __FILE__, __LINE__, __VA_ARGS__, (const char*)NULL)

// Equal in every bit: 0.0 is not -0.0.
#define assert_same_bits(what, got, want, count) support_same_bits(what, got, want, count, __FILE__, __LINE__)

void support_status(mjenv_status wanted, mjenv_status got, const char* call, const char* file, int line, ...);
void support_same_bits(const char* what, const double* got, const double* want, size_t count, const char* file,
                       int line);

// False when some bits differ; the first difference goes into why, with what and the index. For threads, too.
bool same_bits(const char* what, const double* got, const double* want, size_t count, char* why, size_t size);

// Sets a variable of the environment, or removes it if the value is NULL.
void set_variable(const char* name, const char* value);

// malloc that ends the test when there is no memory.
void* allocate(size_t bytes);

// The whole file with a zero behind it, to be freed; size may be NULL.
char* read_file(const char* path, size_t* size);

// ---- Environments ----

mjenv_options* options_of_id(const char* id);
mjenv_env* env_of_id(const char* id, int64_t rows);
// The option "lanes": a number, or AUTO_LANES or MAX_LANES for "auto" or "max".
enum { AUTO_LANES = -1, MAX_LANES = -2 };
void set_lanes(mjenv_options* options, int64_t lanes);
// Destroys the options.
mjenv_env* env_of_options(mjenv_options* options, int64_t rows);
mjenv_env* env_of_model(const char* xml);  // Model-v0, one row
// Seeds row i with seed + i.
void seed_rows(mjenv_env* env, uint64_t seed);
// Of mjenv_info; 0 if mjenv_info_of fails. const, for functions that only describe an environment.
int64_t rows_of(const mjenv_env* env);
int64_t frame_skip_of(const mjenv_env* env);
// The calls for one row, or MJENV_ALL_ROWS.
mjenv_status write_row(mjenv_env* env, int64_t row, const char* array, const double* values, int64_t count);
mjenv_status set_constants(mjenv_env* env, int64_t row);

int64_t action_count(const mjenv_env* env);
// The sum of the counts of a role's fields.
int64_t role_count(const mjenv_env* env, mjenv_role role);
// The array by mjenv_read, to be freed.
double* read_array(mjenv_env* env, int64_t row, const char* array, int64_t* count);

// ---- Images ----

// The image of a row, or of MJENV_ALL_ROWS, to be freed.
unsigned char* image_of(mjenv_env* env, int64_t row, int64_t* size);
// Two rows, which may be of different environments, have the same image.
void assert_same_image(mjenv_env* env, int64_t row, mjenv_env* other, int64_t other_row);
// A part of an image of one row, by its name. size: receives its bytes.
unsigned char* image_part(unsigned char* image, const char* name, size_t* size);
// Gives an image that was changed the checksum that fits.
void image_seal(unsigned char* image, size_t size);

// ---- Outputs ----

// Buffers for all that a step or a reset writes, filled with a pattern.
struct outputs {
  mjenv_batch batch;
  int64_t rows, obs_count, info_count, reset_info_count;
  double *obs, *reward, *info, *reset_info;
  uint8_t *terminated, *truncated;
  int32_t* status;
};

struct outputs* outputs_of(const mjenv_env* env);
void outputs_free(struct outputs* out);
// Fills all buffers with the pattern again.
void outputs_soil(struct outputs* out);
// Whether every byte still is the pattern.
bool outputs_untouched(const struct outputs* out);
// All outputs of a row; to be compared as a whole. Gathers info from the arrays of its fields.
void outputs_row(const mjenv_env* env, const struct outputs* out, mjenv_role info_role, int64_t row, double* record);
// How many numbers that are.
size_t outputs_row_count(const struct outputs* out);

#endif
