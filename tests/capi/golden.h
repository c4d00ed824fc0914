// Recordings of Gymnasium: the files that tests/golden/record.py describes.
#ifndef MJENV_TESTS_GOLDEN_H
#define MJENV_TESTS_GOLDEN_H

#include "support.h"

struct golden_option {
  char name[64];
  char kind[16];  // integer, reals or string
  int64_t integer;
  double reals[4];
  size_t count;
  char text[64];
};

struct golden_field {
  char name[64];
  int64_t count;
  char type[24];
};

struct golden_array {
  char name[32];
  char dtype[3];
  size_t rows, columns;  // columns is 1 for a vector
  const void* data;
};

struct golden {
  char id[64], norm[8], libm[8];
  uint64_t seed;
  struct golden_option options[32];
  size_t option_count;
  struct golden_field info[32], reset_info[32];
  size_t info_count, reset_info_count;
  struct golden_array arrays[96];
  size_t array_count;
  size_t parts;  // in a line of an array: 1, or the environment's rows, which the caller then sets
  char* bytes;
};

// The recordings depend on which variants of sin, cos, exp, log1p and pow the C library chooses for the CPU; there is a
// folder for each class. Writes the path of `name` in the folder of this CPU's class into path, and returns it.
const char* golden_path(const char* name, char path[512]);
// The same for a folder of recordings elsewhere.
const char* golden_in(const char* folder, const char* name, char path[512]);
// A path that is not absolute is one in that folder. Fails the test when the file is not as described, or was recorded
// with other variants than this CPU's.
struct golden* golden_read(const char* path);
void golden_free(struct golden* golden);

// Fails the test when there is no such array of that dtype.
const struct golden_array* golden_array(const struct golden* golden, const char* name, const char* dtype);

// The environment as recorded, not yet seeded.
mjenv_env* golden_create(const struct golden* golden, int64_t rows);

// Steps the one row of env through steps [first, end) of a recording and compares each output. Resets where the
// recording did; step 0 seeds. False at the first difference, which why then tells. Asserts nothing, so that threads
// can use it.
bool golden_replay(const struct golden* golden, mjenv_env* env, size_t first, size_t end, char* why, size_t size);
// All steps of a recording; fails the test at the first difference. The second in an environment of its own.
void golden_assert_plays(const struct golden* golden, mjenv_env* env);
void golden_assert_file_plays(const char* path);
// The same as golden_replay with float32 observations, which are the recorded ones rounded to nearest.
bool golden_replay_narrow(const struct golden* golden, mjenv_env* env, char* why, size_t size);
// Steps all rows of env through the recording, and compares their observations, rewards and flags.
bool golden_replay_in_rows(const struct golden* golden, mjenv_env* env, char* why, size_t size);
size_t golden_steps(const struct golden* golden);

// Whether the numbers of a part of an array, counted over all its lines, are the recorded ones. The file has them or their
// hash. False with the reason in why.
bool golden_same(const struct golden* golden, const char* name, size_t part, const double* got, size_t count, char* why,
                 size_t size);
// Row `row` of a float64 array, copied into buffer: the arrays of a file are not aligned.
const double* golden_row(const struct golden* golden, const char* name, size_t row, double* buffer);
// Row `row` of the actions, copied into buffer, and its dtype and count.
const void* golden_action(const struct golden* golden, size_t row, void* buffer, mjenv_dtype* dtype, int64_t* count);

// Paths of all *.golden in a folder of this CPU's recordings, sorted; ends with NULL. To be freed by golden_free_list.
char** golden_list(const char* folder);
void golden_free_list(char** paths);

#endif
