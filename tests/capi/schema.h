// What Gymnasium declares for each id: tests/golden/schema.txt, in which record.py describes its lines.
#ifndef MJENV_TESTS_SCHEMA_H
#define MJENV_TESTS_SCHEMA_H

#include "support.h"

struct schema_option {
  char name[64];
  mjenv_kind kind;
  int64_t integer;  // a flag, an integer, or an index
  double reals[4];
  size_t count;
  char text[64];
};

struct schema_field {
  char name[64];
  int64_t count;
  mjenv_dtype type;  // 0 in the structure
};

struct schema_space {
  mjenv_dtype dtype;
  int64_t count;
  double low[32], high[32];
  size_t low_count, high_count;  // 1 when one number stands for all
};

// NaN where Gymnasium sets nothing.
struct schema_camera {
  double distance, elevation, lookat[3], trackbodyid;
};

struct schema_id {
  char id[64];
  int64_t max_episode_steps, render_fps, frame_skip;
  double reward_threshold, dt;  // the threshold is NaN where there is none
  mjenv_dtype reward;
  struct schema_option options[32];
  struct schema_field info[32], reset_info[32], structure[16];
  size_t option_count, info_count, reset_info_count, structure_count;
  struct schema_space observation, action;
  struct schema_camera camera;
};

struct schema {
  struct schema_id ids[32];
  size_t count;
};

struct schema* schema_read(void);
const struct schema_option* schema_option_of(const struct schema_id* id, const char* name);
mjenv_dtype type_of_name(const char* name);

#endif
