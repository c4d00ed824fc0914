// Options: the list that Gymnasium has, reading back what was set, and every refusal.
#include <math.h>

#include "schema.h"

static struct schema* schema;

static mjenv_option option_at(const mjenv_options* options, int64_t index) {
  mjenv_option option = MJENV_OPTION_INIT;
  assert_ok(mjenv_options_at(options, index, &option));
  return option;
}

static bool has_option(const mjenv_options* options, const char* name) {
  for (int64_t i = 0; i < mjenv_options_count(options); ++i)
    if (strcmp(option_at(options, i).name, name) == 0) return true;
  return false;
}

static void assert_text(const mjenv_options* options, const char* name, const char* want) {
  const char* text = NULL;
  assert_ok(mjenv_options_get_string(options, name, &text));
  assert_string_equal(text, want);
}

static void assert_integer(const mjenv_options* options, const char* name, int64_t want) {
  int64_t value = -99;
  assert_ok(mjenv_options_get_integer(options, name, &value));
  assert_true(value == want);
}

static void assert_reals(const mjenv_options* options, const char* name, const double* want, int64_t count) {
  double values[8];
  int64_t got = 0;
  assert_ok(mjenv_options_get_reals(options, name, NULL, 0, &got));
  assert_int_equal(got, count);
  assert_ok(mjenv_options_get_reals(options, name, values, COUNT(values), &got));
  assert_same_bits(name, values, want, count);
}

// ---- Against Gymnasium ----

static void assert_default(const mjenv_options* options, const struct schema_option* want) {
  switch (want->kind) {
    case MJENV_KIND_STRING: assert_text(options, want->name, want->text); break;
    case MJENV_KIND_REALS: assert_reals(options, want->name, want->reals, want->count); break;
    default: assert_integer(options, want->name, want->integer);
  }
}

static void test_schema(void** state) {
  const struct schema_id* id = *state;
  mjenv_options* options = options_of_id(id->id);
  assert_true(mjenv_options_count(options) >= (int64_t)id->option_count);
  for (size_t i = 0; i < id->option_count; ++i) {
    const mjenv_option option = option_at(options, (int64_t)i);
    assert_string_equal(option.name, id->options[i].name);
    assert_int_equal(option.kind, id->options[i].kind);
    assert_int_equal(option.count, id->options[i].count);
    assert_default(options, &id->options[i]);
  }
  assert_integer(options, "max_episode_steps", id->max_episode_steps);
  assert_integer(options, "strict", 1);
  assert_text(options, "norm", "auto");
  assert_int_equal(has_option(options, "xml_string"), has_option(options, "xml_file"));
  for (int64_t i = 0; i < mjenv_options_count(options); ++i) {
    const mjenv_option option = option_at(options, i);
    assert_true(option.doc[0] != '\0');
    assert_true(option.kind == MJENV_KIND_STRING || option.low <= option.high);
    for (int64_t k = 0; k < i; ++k) assert_string_not_equal(option.name, option_at(options, k).name);
  }
  mjenv_options_destroy(options);
}

// ---- Reading back ----

// Three numbers inside the bounds, the bounds themselves among them.
static void set_reals_and_read(mjenv_options* options, const mjenv_option* option) {
  const double low = isinf(option->low) ? -1e300 : option->low, high = isinf(option->high) ? 1e300 : option->high;
  const double middle = low < 0.1 && 0.1 < high ? 0.1 : low;
  for (int side = 0; side < 3; ++side) {
    double values[8];
    for (int64_t i = 0; i < option->count; ++i) values[i] = side == 0 ? low : side == 1 ? high : middle + (double)i;
    assert_ok(mjenv_options_set_reals(options, option->name, values, (size_t)option->count));
    assert_reals(options, option->name, values, (size_t)option->count);
  }
}

static void set_integer_and_read(mjenv_options* options, const mjenv_option* option) {
  const int64_t values[] = {(int64_t)option->low, (int64_t)option->low + 1};
  for (size_t i = 0; i < COUNT(values); ++i) {
    assert_ok(mjenv_options_set_integer(options, option->name, values[i]));
    assert_integer(options, option->name, values[i]);
  }
}

static void set_text_and_read(mjenv_options* options, const mjenv_option* option) {
  if (!option->choices) {
    assert_ok(mjenv_options_set_string(options, option->name, "some text, \xc3\xa4"));
    assert_text(options, option->name, "some text, \xc3\xa4");
    return;
  }
  char choices[256], *rest = choices;
  snprintf(choices, sizeof choices, "%s", option->choices);
  for (char* choice = strtok_r(rest, " ", &rest); choice; choice = strtok_r(NULL, " ", &rest)) {
    assert_ok(mjenv_options_set_string(options, option->name, choice));
    assert_text(options, option->name, choice);
  }
}

static void test_read_back(void** state) {
  const struct schema_id* id = *state;
  mjenv_options* options = options_of_id(id->id);
  for (int64_t i = 0; i < mjenv_options_count(options); ++i) {
    const mjenv_option option = option_at(options, i);
    switch (option.kind) {
      case MJENV_KIND_REALS:
        set_reals_and_read(options, &option);
        if (option.count > 1) break;
        const double real = 1;
        assert_ok(mjenv_options_set_integer(options, option.name, 1));
        assert_reals(options, option.name, &real, 1);
        break;
      case MJENV_KIND_STRING: set_text_and_read(options, &option); break;
      case MJENV_KIND_STRING_OR_INT:
        set_integer_and_read(options, &option);
        set_text_and_read(options, &option);
        set_integer_and_read(options, &option);
        break;
      default: set_integer_and_read(options, &option);
    }
  }
  mjenv_options_destroy(options);
}

static void test_environment_has_a_copy(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Hopper-v5");
  const double range[] = {-INFINITY, 3.5};
  assert_ok(mjenv_options_set_reals(options, "healthy_z_range", range, 2));
  assert_ok(mjenv_options_set_integer(options, "frame_skip", 2));
  assert_ok(mjenv_options_set_string(options, "norm", "plain"));
  mjenv_env* env = NULL;
  assert_ok(mjenv_create(options, 1, &env));
  assert_ok(mjenv_options_set_integer(options, "frame_skip", 3));
  const mjenv_options* own = mjenv_options_of(env);
  assert_int_equal(mjenv_options_count(own), mjenv_options_count(options));
  mjenv_options_destroy(options);
  assert_integer(own, "frame_skip", 2);
  assert_reals(own, "healthy_z_range", range, 2);
  assert_text(own, "norm", "plain");
  assert_true(frame_skip_of(env) == 2);
  mjenv_destroy(env);
}

// ---- Refusals ----

static void test_refused_of_each_option(void** state) {
  const struct schema_id* id = *state;
  mjenv_options* options = options_of_id(id->id);
  for (int64_t i = 0; i < mjenv_options_count(options); ++i) {
    const mjenv_option option = option_at(options, i);
    const char *name = option.name, *text = NULL;
    const double nans[] = {NAN, NAN, NAN, NAN, NAN};
    const double below = nextafter(option.low, -INFINITY), above = nextafter(option.high, INFINITY);
    int64_t integer = -99;
    int64_t count = 99;
    if (option.kind == MJENV_KIND_REALS) {
      assert_refused(MJENV_E_TYPE, mjenv_options_set_string(options, name, "1"), name, id->id);
      assert_refused(MJENV_E_TYPE, mjenv_options_get_integer(options, name, &integer), name);
      assert_refused(MJENV_E_TYPE, mjenv_options_get_string(options, name, &text), name);
      assert_refused(MJENV_E_VALUE, mjenv_options_set_reals(options, name, nans, (size_t)option.count), name, "nan");
      assert_refused(MJENV_E_SIZE, mjenv_options_set_reals(options, name, nans, (size_t)option.count + 1), name);
      assert_refused(MJENV_E_SIZE, mjenv_options_set_reals(options, name, nans, 0), name);
      if (option.count == 1 && isfinite(option.low))
        assert_refused(MJENV_E_VALUE, mjenv_options_set_reals(options, name, &below, 1), name);
      if (option.count == 1 && isfinite(option.high))
        assert_refused(MJENV_E_VALUE, mjenv_options_set_reals(options, name, &above, 1), name);
      if (option.count > 1) assert_refused(MJENV_E_TYPE, mjenv_options_set_integer(options, name, 1), name, id->id);
    } else {
      assert_refused(MJENV_E_TYPE, mjenv_options_set_reals(options, name, nans, 1), name, id->id);
      assert_refused(MJENV_E_TYPE, mjenv_options_get_reals(options, name, NULL, 0, &count), name);
    }
    if (option.kind == MJENV_KIND_STRING) {
      assert_refused(MJENV_E_TYPE, mjenv_options_set_integer(options, name, 1), name, id->id);
      assert_refused(MJENV_E_TYPE, mjenv_options_get_integer(options, name, &integer), name);
      if (option.choices) {
        char first[32];
        sscanf(option.choices, "%31s", first);
        assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, name, "nonsense"), name, "nonsense", first);
        assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, name, ""), name, first);
        assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, name, option.choices), name, first);
      }
    }
    if (option.kind == MJENV_KIND_FLAG || option.kind == MJENV_KIND_INTEGER) {
      assert_refused(MJENV_E_TYPE, mjenv_options_set_string(options, name, "1"), name, id->id);
      assert_refused(MJENV_E_TYPE, mjenv_options_get_string(options, name, &text), name);
      const int64_t beyond = option.high < 0x1p53 ? (int64_t)option.high + 1 : INT64_MAX;
      assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, name, (int64_t)option.low - 1), name);
      assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, name, beyond), name);
      assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, name, INT64_MIN), name);
    }
    assert_true(integer == -99 && !text && count == 99);
  }
  for (size_t i = 0; i < id->option_count; ++i) assert_default(options, &id->options[i]);
  mjenv_env* env = NULL;
  assert_ok(mjenv_create(options, 1, &env));
  mjenv_destroy(env);
  mjenv_options_destroy(options);
}

static void test_refused_names(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("HalfCheetah-v4");
  const double real = 1;
  const char* text = NULL;
  int64_t integer = 0;
  int64_t count = 0;
  assert_refused(MJENV_E_NAME, mjenv_options_set_integer(options, "frame_skip", 5), "HalfCheetah-v4", "frame_skip",
                 "mjenv_options_at lists all");
  assert_refused(MJENV_E_NAME, mjenv_options_set_reals(options, "healthy_reward", &real, 1), "healthy_reward");
  assert_refused(MJENV_E_NAME, mjenv_options_set_string(options, "xml_file", "ant.xml"), "xml_file");
  assert_refused(MJENV_E_NAME, mjenv_options_get_integer(options, "", &integer), "\"\"");
  assert_refused(MJENV_E_NAME, mjenv_options_get_reals(options, "x", NULL, 0, &count), "\"x\"");
  assert_refused(MJENV_E_NAME, mjenv_options_get_string(options, "Norm", &text),
                 "\"Norm\"; nearest: norm; mjenv_options_at lists all");
  mjenv_options_destroy(options);

  mjenv_options* none = NULL;
  assert_refused(MJENV_E_NAME, mjenv_options_create("Ant-v3", &none),
                 "\"Ant-v3\"; nearest: Ant-v4, Ant-v5; mjenv_id_at lists all");
  assert_refused(MJENV_E_NAME, mjenv_options_create("", &none), "\"\"; mjenv_id_at lists all");
  assert_refused(MJENV_E_NAME, mjenv_options_create("ant-v5", &none), "Ant-v5");
  assert_null(none);
}

static void test_refused_values(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Ant-v5");
  const struct {
    const char* name;
    double value;
    const char* says;
  } noises[] = {{"reset_noise_scale", -0.1, "-0.1"},
                {"reset_noise_scale", INFINITY, "inf"},
                {"reset_noise_scale", NAN, "nan"},
                {"healthy_reward", NAN, "nan"}};
  for (size_t i = 0; i < COUNT(noises); ++i)
    assert_refused(MJENV_E_VALUE, mjenv_options_set_reals(options, noises[i].name, &noises[i].value, 1), noises[i].name,
                   noises[i].says);
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "frame_skip", 0), "frame_skip", "[1, ", "not 0");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "frame_skip", -5), "frame_skip", "-5");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "strict", 2), "strict", "[0, 1]", "2");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "max_episode_steps", -1), "max_episode_steps");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "main_body", -1), "main_body");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_integer(options, "reset_noise_scale", -1), "reset_noise_scale");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, "norm", "exact"), "auto", "fused", "plain");
  const double half[] = {0.5, NAN};
  assert_refused(MJENV_E_VALUE, mjenv_options_set_reals(options, "healthy_z_range", half, 2), "healthy_z_range");
  const double want[] = {0.2, 1.0};
  assert_reals(options, "healthy_z_range", want, 2);
  mjenv_options_destroy(options);
}

static void test_refused_indices(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Reacher-v4");
  const int64_t count = mjenv_options_count(options);
  const int64_t indices[] = {-1, count, INT64_MIN, INT64_MAX};
  for (size_t i = 0; i < COUNT(indices); ++i) {
    mjenv_option option = {.struct_size = sizeof option, .kind = 77};
    assert_refused(MJENV_E_VALUE, mjenv_options_at(options, indices[i], &option), "option");
    assert_int_equal(option.kind, 77);
  }
  mjenv_options_destroy(options);
}

static void test_room_for_reals(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Ant-v5");
  double values[3] = {7, 7, 7};
  int64_t count = 99;
  assert_refused(MJENV_E_SIZE, mjenv_options_get_reals(options, "healthy_z_range", values, 1, &count), "1", "2");
  assert_true(count == 99 && values[0] == 7);
  assert_ok(mjenv_options_get_reals(options, "healthy_z_range", values, 3, &count));
  assert_true(count == 2 && values[0] == 0.2 && values[1] == 1.0 && values[2] == 7);
  mjenv_options_destroy(options);
}

int main(void) {
  schema = schema_read();
  const struct CMUnitTest others[] = {
      cmocka_unit_test(test_environment_has_a_copy), cmocka_unit_test(test_refused_names),
      cmocka_unit_test(test_refused_values),         cmocka_unit_test(test_refused_indices),
      cmocka_unit_test(test_room_for_reals),
  };
  const struct CMUnitTest of_each[] = {
      {"schema", test_schema, NULL, NULL, NULL},
      {"read_back", test_read_back, NULL, NULL, NULL},
      {"refused", test_refused_of_each_option, NULL, NULL, NULL},
  };
  struct CMUnitTest tests[COUNT(others) + COUNT(of_each) * schema->count];
  char names[COUNT(of_each) * schema->count][96];
  memcpy(tests, others, sizeof others);
  for (size_t i = 0; i < schema->count; ++i)
    for (size_t k = 0; k < COUNT(of_each); ++k) {
      const size_t at = i * COUNT(of_each) + k;
      snprintf(names[at], sizeof names[at], "%s of %s", of_each[k].name, schema->ids[i].id);
      tests[COUNT(others) + at] = of_each[k];
      tests[COUNT(others) + at].name = names[at];
      tests[COUNT(others) + at].initial_state = &schema->ids[i];
    }
  const int failed = cmocka_run_group_tests(tests, NULL, NULL);
  free(schema);
  return failed;
}
