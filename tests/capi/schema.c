#include "schema.h"

#include <math.h>

mjenv_dtype type_of_name(const char* name) {
  static const struct {
    const char* name;
    mjenv_dtype type;
  } types[] = {{"numpy_float64", MJENV_DTYPE_FLOAT64},
               {"action_dtype", MJENV_DTYPE_ACTION},
               {"python_float", MJENV_DTYPE_NATIVE_FLOAT},
               {"python_int", MJENV_DTYPE_NATIVE_INT},
               {"numpy_int64", MJENV_DTYPE_INT64}};
  for (size_t i = 0; i < COUNT(types); ++i)
    if (strcmp(types[i].name, name) == 0) return types[i].type;
  fail_msg("no type %s", name);
  return MJENV_DTYPE_FLOAT64;
}

static size_t reals_of(const char* text, double* values, size_t capacity) {
  size_t count = 0;
  char* end = NULL;
  for (double value = strtod(text, &end); end != text && count < capacity; value = strtod(text, &end)) {
    values[count++] = value;
    text = end;
  }
  return count;
}

static bool read_option(struct schema_option* option, const char* line) {
  char kind[16], value[256];
  if (sscanf(line, "option %63s %15s %255[^\n]", option->name, kind, value) != 3) return false;
  if (strcmp(kind, "reals") == 0) {
    option->kind = MJENV_KIND_REALS;
    option->count = reals_of(value, option->reals, COUNT(option->reals));
    return option->count > 0;
  }
  option->count = 1;
  if (strcmp(kind, "string") == 0) {
    option->kind = MJENV_KIND_STRING;
    return sscanf(value, "%63s", option->text) == 1;
  }
  option->kind = strcmp(kind, "flag") == 0      ? MJENV_KIND_FLAG
                 : strcmp(kind, "integer") == 0 ? MJENV_KIND_INTEGER
                                                : MJENV_KIND_STRING_OR_INT;
  return sscanf(value, "%" SCNd64, &option->integer) == 1;
}

static bool read_field(struct schema_field* field, const char* line) {
  char type[24] = "";
  const int got = sscanf(line, "%*s %63s %" SCNd64 " %23s", field->name, &field->count, type);
  if (got == 3) field->type = type_of_name(type);
  return got >= 2;
}

static bool read_space_line(struct schema_id* id, const char* line) {
  char word[8], role[16], rest[512];
  if (sscanf(line, "%7s %15s %511[^\n]", word, role, rest) != 3) return false;
  struct schema_space* space = strcmp(role, "action") == 0 ? &id->action : &id->observation;
  if (strcmp(word, "low") == 0) return (space->low_count = reals_of(rest, space->low, COUNT(space->low))) > 0;
  if (strcmp(word, "high") == 0) return (space->high_count = reals_of(rest, space->high, COUNT(space->high))) > 0;
  space->dtype = strncmp(rest, "float32", 7) == 0 ? MJENV_DTYPE_FLOAT32 : MJENV_DTYPE_FLOAT64;
  return sscanf(rest, "%*s %" SCNd64, &space->count) == 1;
}

static bool read_camera(struct schema_camera* camera, const char* line) {
  char name[32], values[256];
  if (sscanf(line, "camera %31s %255[^\n]", name, values) != 2) return false;
  if (strcmp(name, "lookat") == 0) return reals_of(values, camera->lookat, 3) == 3;
  double* value = strcmp(name, "distance") == 0      ? &camera->distance
                  : strcmp(name, "elevation") == 0   ? &camera->elevation
                  : strcmp(name, "trackbodyid") == 0 ? &camera->trackbodyid
                                                     : NULL;
  return value && reals_of(values, value, 1) == 1;
}

static bool read_line(struct schema_id* id, const char* word, const char* line) {
  char text[64] = "";
  sscanf(line, "%*s %63s", text);
  if (strcmp(word, "max_episode_steps") == 0) return sscanf(text, "%" SCNd64, &id->max_episode_steps) == 1;
  if (strcmp(word, "render_fps") == 0) return sscanf(text, "%" SCNd64, &id->render_fps) == 1;
  if (strcmp(word, "frame_skip") == 0) return sscanf(text, "%" SCNd64, &id->frame_skip) == 1;
  if (strcmp(word, "reward") == 0) return (id->reward = type_of_name(text)) != 0;
  if (strcmp(word, "dt") == 0) return reals_of(text, &id->dt, 1) == 1;
  if (strcmp(word, "reward_threshold") == 0) {
    id->reward_threshold = NAN;
    return strcmp(text, "none") == 0 || reals_of(text, &id->reward_threshold, 1) == 1;
  }
  if (strcmp(word, "option") == 0) return read_option(&id->options[id->option_count++], line);
  if (strcmp(word, "info") == 0) return read_field(&id->info[id->info_count++], line);
  if (strcmp(word, "reset_info") == 0) return read_field(&id->reset_info[id->reset_info_count++], line);
  if (strcmp(word, "structure") == 0) return read_field(&id->structure[id->structure_count++], line);
  if (strcmp(word, "camera") == 0) return read_camera(&id->camera, line);
  return (strcmp(word, "space") == 0 || strcmp(word, "low") == 0 || strcmp(word, "high") == 0) &&
         read_space_line(id, line);
}

struct schema* schema_read(void) {
  struct schema* schema = allocate(sizeof *schema);
  memset(schema, 0, sizeof *schema);
  char* text = read_file(GOLDENS "/schema.txt", NULL);
  struct schema_id* id = NULL;
  for (char* line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
    char word[32] = "", name[64] = "";
    sscanf(line, "%31s %63s", word, name);
    if (strcmp(word, "id") == 0) {
      assert_true(schema->count < COUNT(schema->ids));
      id = &schema->ids[schema->count++];
      strcpy(id->id, name);
      id->camera = (struct schema_camera){NAN, NAN, {NAN, NAN, NAN}, NAN};
    } else if (id && !read_line(id, word, line)) {
      fail_msg("schema.txt: a line that makes no sense: %s", line);
    }
  }
  free(text);
  return schema;
}

const struct schema_option* schema_option_of(const struct schema_id* id, const char* name) {
  for (size_t i = 0; i < id->option_count; ++i)
    if (strcmp(id->options[i].name, name) == 0) return &id->options[i];
  return NULL;
}
