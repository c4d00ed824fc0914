// Ids, specs, spaces, fields and named objects, as Gymnasium declares them.
#include <math.h>

#include "schema.h"

static mjenv_field field_at(const mjenv_env* env, mjenv_role role, int64_t index) {
  mjenv_field field = MJENV_FIELD_INIT;
  assert_ok(mjenv_field_at(env, role, index, &field));
  return field;
}

// NaN is no number here, but the word for none.
static void assert_same_or_none(const double* got, const double* want, size_t count) {
  for (size_t i = 0; i < count; ++i) {
    assert_int_equal(isnan(got[i]), isnan(want[i]));
    if (!isnan(want[i])) assert_same_bits("spec", got + i, want + i, 1);
  }
}

static void assert_spec(const struct schema_id* id) {
  mjenv_spec spec = MJENV_SPEC_INIT;
  assert_ok(mjenv_spec_of(id->id, &spec));
  assert_string_equal(spec.id, id->id);
  assert_int_equal(spec.version, id->id[strlen(id->id) - 1] - '0');
  assert_true(strncmp(spec.robot, id->id, strlen(spec.robot)) == 0);
  assert_int_equal(strlen(spec.robot), strlen(id->id) - strlen("-v5"));
  assert_true(spec.max_episode_steps == id->max_episode_steps);
  assert_same_or_none(&spec.reward_threshold, &id->reward_threshold, 1);
  assert_same_or_none(&spec.camera_distance, &id->camera.distance, 1);
  assert_same_or_none(&spec.camera_elevation, &id->camera.elevation, 1);
  assert_same_or_none(spec.camera_lookat, id->camera.lookat, 3);
  const double body = id->camera.trackbodyid;
  assert_int_equal(spec.camera_trackbodyid, isnan(body) ? MJENV_BODY_UNSET : (int)body);
}

static void assert_space(const mjenv_env* env, mjenv_role role, const struct schema_space* want) {
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, role, &space));
  assert_int_equal(space.dtype, want->dtype);
  assert_true(space.count == want->count);
  for (int64_t i = 0; i < space.count; ++i) {
    assert_same_bits("low", space.low + i, &want->low[want->low_count == 1 ? 0 : i], 1);
    assert_same_bits("high", space.high + i, &want->high[want->high_count == 1 ? 0 : i], 1);
  }
}

static void assert_fields(const mjenv_env* env, mjenv_role role, const struct schema_field* want, size_t count) {
  assert_int_equal(mjenv_field_count(env, role), count);
  int64_t offset = 0;
  for (size_t i = 0; i < count; ++i) {
    const mjenv_field field = field_at(env, role, (int64_t)i);
    assert_string_equal(field.name, want[i].name);
    assert_true(role == MJENV_ROLE_ACTION || field.doc[0]);
    assert_true(field.count == want[i].count);
    if (want[i].type) {
      assert_int_equal(field.dtype, want[i].type);
      assert_int_equal(field.ndim, field.count == 1 ? 0 : 1);
      assert_true(field.ndim == 0 || field.shape[0] == field.count);
      assert_true(field.offset == offset);
    }
    offset += field.count;
  }
}

// The terms fill the observation, and are those of observation_structure that are not empty.
static void assert_observation_terms(const mjenv_env* env, const struct schema_id* id) {
  int64_t offset = 0, next = 0;
  for (int64_t i = 0; i < mjenv_field_count(env, MJENV_ROLE_OBSERVATION); ++i) {
    const mjenv_field field = field_at(env, MJENV_ROLE_OBSERVATION, i);
    assert_true(field.doc[0]);
    assert_true(field.offset == offset);
    assert_int_equal(field.dtype, MJENV_DTYPE_FLOAT64);
    offset += field.count;
    if (id->structure_count == 0) continue;
    while (id->structure[next].count == 0 || strcmp(id->structure[next].name, "skipped_qpos") == 0) ++next;
    assert_string_equal(field.name, id->structure[next].name);
    assert_true(field.count == id->structure[next].count);
    ++next;
  }
  assert_true(offset == id->observation.count);
}

static void assert_actions(const mjenv_env* env, const struct schema_id* id) {
  assert_true(mjenv_field_count(env, MJENV_ROLE_ACTION) == id->action.count);
  for (int64_t i = 0; i < id->action.count; ++i) {
    const mjenv_field field = field_at(env, MJENV_ROLE_ACTION, i);
    assert_true(field.offset == i && field.count == 1 && field.ndim == 0);
    assert_int_equal(field.dtype, MJENV_DTYPE_ACTION);
    assert_true(field.name[0] != '\0');
  }
}

static void assert_time(mjenv_env* env, const struct schema_id* id) {
  double* timestep = read_array(env, 0, "opt.timestep", NULL);
  const double dt = *timestep * (double)frame_skip_of(env);
  assert_true(frame_skip_of(env) == id->frame_skip);
  assert_same_bits("dt", &dt, &id->dt, 1);
  assert_true((int64_t)nearbyint(1 / dt) == id->render_fps);
  free(timestep);
}

static void assert_arrays(mjenv_env* env, mjenv_role role) {
  assert_true(mjenv_field_count(env, role) > 50);
  for (int64_t i = 0; i < mjenv_field_count(env, role); ++i) {
    const mjenv_field field = field_at(env, role, i);
    int64_t count = 0;
    free(read_array(env, 0, field.name, &count));
    assert_int_equal(count, field.count);
    int64_t product = 1;
    for (int32_t k = 0; k < field.ndim; ++k) product *= field.shape[k];
    assert_true(product == field.count);
  }
}

static void test_id(void** state) {
  const struct schema_id* id = *state;
  assert_spec(id);
  mjenv_env* env = env_of_id(id->id, 1);
  assert_space(env, MJENV_ROLE_OBSERVATION, &id->observation);
  assert_space(env, MJENV_ROLE_ACTION, &id->action);
  assert_fields(env, MJENV_ROLE_INFO, id->info, id->info_count);
  assert_fields(env, MJENV_ROLE_RESET_INFO, id->reset_info, id->reset_info_count);
  assert_fields(env, MJENV_ROLE_STRUCTURE, id->structure, id->structure_count);
  assert_observation_terms(env, id);
  assert_actions(env, id);
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_REWARD), 1);
  assert_int_equal(field_at(env, MJENV_ROLE_REWARD, 0).dtype, id->reward);
  assert_time(env, id);
  assert_arrays(env, MJENV_ROLE_DATA);
  assert_arrays(env, MJENV_ROLE_MODEL);
  mjenv_destroy(env);
}

// ---- Spaces and fields of observations with time and history ----

static mjenv_env* env_with_frames(const char* terms, int64_t frames) {
  mjenv_options* options = options_of_id("HalfCheetah-v5");
  assert_ok(mjenv_options_set_integer(options, "time_aware", 1));
  if (terms)
    assert_ok(mjenv_options_set_string(options, "history", terms));
  else
    assert_ok(mjenv_options_set_integer(options, "history", frames));
  return env_of_options(options, 1);
}

static void assert_field(const mjenv_env* env, int64_t index, const char* name, int32_t ndim, int64_t first,
                         int64_t offset, int64_t count) {
  const mjenv_field field = field_at(env, MJENV_ROLE_OBSERVATION, index);
  assert_string_equal(field.name, name);
  assert_int_equal(field.ndim, ndim);
  assert_int_equal(field.shape[0], first);
  assert_int_equal(field.offset, offset);
  assert_int_equal(field.count, count);
}

static void test_frames(void** state) {
  (void)state;
  mjenv_env* env = env_with_frames(NULL, 2);
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  assert_int_equal(space.count, 2 * 18);
  assert_int_equal(space.ndim, 2);
  assert_true(space.shape[0] == 2 && space.shape[1] == 18);
  for (int64_t i = 0; i < space.count; ++i) {
    assert_true(space.low[i] == (i % 18 == 17 ? 0 : -INFINITY));
    assert_true(space.high[i] == (i % 18 == 17 ? 1 : INFINITY));
  }
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_OBSERVATION), 6);
  assert_field(env, 0, "qpos[-1]", 1, 8, 0, 8);
  assert_field(env, 2, "time[-1]", 1, 1, 17, 1);
  assert_field(env, 4, "qvel", 1, 9, 26, 9);
  mjenv_destroy(env);

  env = env_with_frames(" time=3  qpos=2 ", 0);
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  assert_int_equal(space.count, 2 * 8 + 9 + 3);
  assert_int_equal(space.ndim, 1);
  assert_true(space.shape[0] == space.count);
  for (int64_t i = 0; i < space.count; ++i) assert_true(space.high[i] == (i < 25 ? INFINITY : 1));
  assert_int_equal(mjenv_field_count(env, MJENV_ROLE_OBSERVATION), 3);
  assert_field(env, 0, "qpos", 2, 2, 0, 16);
  assert_field(env, 1, "qvel", 1, 9, 16, 9);
  assert_field(env, 2, "time", 2, 3, 25, 3);
  mjenv_destroy(env);
}

static void test_list_of_ids(void** state) {
  const struct schema* schema = *state;
  assert_int_equal(mjenv_id_count(), schema->count);
  for (size_t i = 0; i < schema->count; ++i) assert_string_equal(mjenv_id_at((int64_t)i), schema->ids[i].id);
  assert_null(mjenv_id_at(-1));
  assert_null(mjenv_id_at((int64_t)schema->count));
}

static void test_objects(void** state) {
  (void)state;
  mjenv_env* env = env_of_id("Pusher-v5", 1);
  const char* const types[] = {"body",   "joint",   "geom",     "site",    "camera", "actuator", "tendon",
                               "sensor", "light",   "mesh",     "skin",    "hfield", "texture",  "material",
                               "pair",   "exclude", "equality", "numeric", "text",   "tuple",    "key"};
  const char* const counts[] = {"nbody",   "njnt",     "ngeom", "nsite",    "ncam",    "nu",     "ntendon",
                                "nsensor", "nlight",   "nmesh", "nskin",    "nhfield", "ntex",   "nmat",
                                "npair",   "nexclude", "neq",   "nnumeric", "ntext",   "ntuple", "nkey"};
  for (size_t i = 0; i < COUNT(types); ++i) {
    double* count = read_array(env, 0, counts[i], NULL);
    int64_t counted = -1;
    assert_ok(mjenv_object_count(env, types[i], &counted));
    assert_true((double)counted == *count);
    for (int64_t k = 0; k < (int64_t)*count; ++k) {
      const char* name = NULL;
      int64_t index = -1;
      assert_ok(mjenv_object_name(env, types[i], k, &name));
      if (name[0] == '\0') continue;
      assert_ok(mjenv_object_index(env, types[i], name, &index));
      assert_true(index == k);
    }
    free(count);
  }
  int64_t index = -1;
  assert_ok(mjenv_object_index(env, "body", "world", &index));
  assert_true(index == 0);
  mjenv_destroy(env);
}

int main(void) {
  struct schema* schema = schema_read();
  struct CMUnitTest tests[schema->count + 3];
  tests[0] = (struct CMUnitTest){"list_of_ids", test_list_of_ids, NULL, NULL, schema};
  tests[1] = (struct CMUnitTest)cmocka_unit_test(test_objects);
  tests[2] = (struct CMUnitTest)cmocka_unit_test(test_frames);
  for (size_t i = 0; i < schema->count; ++i)
    tests[i + 3] = (struct CMUnitTest){schema->ids[i].id, test_id, NULL, NULL, &schema->ids[i]};
  const int failed = cmocka_run_group_tests(tests, NULL, NULL);
  free(schema);
  return failed;
}
