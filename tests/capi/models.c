// Models of the caller's own: where they are looked for, and what is said of those that will not do.
#include <fcntl.h>
#include <math.h>
#include <sys/stat.h>
#include <unistd.h>

#include "support.h"

#define CUSTOM PROJECT_FOLDER "/tests/golden/custom/"

static char folder[] = "/tmp/mjenv-models-XXXXXX";

// A folder of its own is the working directory and the home.
static int enter_folder(void** state) {
  (void)state;
  return !mkdtemp(folder) || chdir(folder) != 0 || setenv("HOME", folder, 1) != 0;
}

static int leave_folder(void** state) {
  (void)state;
  return chdir("/") != 0 || rmdir(folder) != 0;
}

static void write_file(const char* path, const char* text) {
  FILE* file = fopen(path, "wb");
  assert_non_null(file);
  fputs(text, file);
  assert_int_equal(fclose(file), 0);
}

static mjenv_options* options_with(const char* id, const char* name, const char* value) {
  mjenv_options* options = options_of_id(id);
  assert_ok(mjenv_options_set_string(options, name, value));
  return options;
}

static int64_t obs_count(const mjenv_env* env) {
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_OBSERVATION, &space));
  return space.count;
}

// Creating fails with this status and a message that has all words, and gives no environment.
#define assert_not_created(status, options, ...)                               \
  do {                                                                         \
    mjenv_env* none_ = NULL;                                                   \
    assert_refused((status), mjenv_create((options), 1, &none_), __VA_ARGS__); \
    assert_null(none_);                                                        \
  } while (0)
#define assert_no_model(options, ...) assert_not_created(MJENV_E_MODEL, options, __VA_ARGS__)
#define assert_no_file(options, ...) assert_not_created(MJENV_E_FILE, options, __VA_ARGS__)

// ---- Where a model comes from ----

static void test_built_in_names(void** state) {
  (void)state;
  static const char* const pairs[][2] = {
      {"Ant-v4", "ant.xml"},
      {"HalfCheetah-v5", "half_cheetah.xml"},
      {"Hopper-v5", "hopper.xml"},
      {"Humanoid-v5", "humanoid.xml"},
      {"HumanoidStandup-v5", "humanoidstandup.xml"},
      {"InvertedDoublePendulum-v5", "inverted_double_pendulum.xml"},
      {"InvertedPendulum-v5", "inverted_pendulum.xml"},
      {"Pusher-v5", "pusher.xml"},
      {"Pusher-v5", "pusher_v5.xml"},
      {"Reacher-v5", "reacher.xml"},
      {"Swimmer-v5", "swimmer.xml"},
      {"Walker2d-v5", "walker2d.xml"},
      {"Walker2d-v5", "walker2d_v5.xml"},
  };
  for (size_t i = 0; i < COUNT(pairs); ++i)
    mjenv_destroy(env_of_options(options_with(pairs[i][0], "xml_file", pairs[i][1]), 1));
  mjenv_options* options = options_with("Ant-v5", "xml_file", "aunt.xml");
  assert_no_file(options, "aunt.xml", "ant.xml", "walker2d_v5.xml", "~");
  // A file in the working directory is no built-in model: its name begins with "./".
  write_file("aunt.xml", "<mujoco/>");
  assert_no_file(options, "aunt.xml", "walker2d_v5.xml");
  assert_int_equal(remove("aunt.xml"), 0);
  mjenv_options_destroy(options);
}

static void test_paths(void** state) {
  (void)state;
  char *xml = read_file(CUSTOM "spider.xml", NULL), absolute[64], above[64];
  write_file("spider.xml", xml);
  snprintf(absolute, sizeof absolute, "%s/spider.xml", folder);
  snprintf(above, sizeof above, "..%s/spider.xml", strrchr(folder, '/'));
  const char* const paths[] = {"./spider.xml", absolute, "~/spider.xml", above};
  double first[512];
  for (size_t i = 0; i <= COUNT(paths); ++i) {
    mjenv_env* env = env_of_options(
        i < COUNT(paths) ? options_with("Ant-v5", "xml_file", paths[i]) : options_with("Ant-v5", "xml_string", xml), 1);
    struct outputs* out = outputs_of(env);
    seed_rows(env, 3);
    assert_ok(mjenv_reset(env, NULL, &out->batch));
    assert_true(out->obs_count == 23 + 22 - 2 + 6 * 25);
    assert_true(action_count(env) == 16);
    if (i == 0) memcpy(first, out->obs, (size_t)out->obs_count * sizeof(double));
    assert_same_bits("obs", out->obs, first, (size_t)out->obs_count);
    outputs_free(out);
    mjenv_destroy(env);
  }
  assert_int_equal(remove("spider.xml"), 0);
  free(xml);
}

// A model includes and refers to files beside it.
static void test_files_beside(void** state) {
  (void)state;
  char* xml = read_file(PROJECT_FOLDER "/assets/swimmer.xml", NULL);
  assert_int_equal(mkdir("parts", 0700), 0);
  write_file("parts/swimmer.xml", xml);
  write_file("parts/all.xml", "<mujoco><include file=\"swimmer.xml\"/></mujoco>");
  mjenv_env* env = env_of_options(options_with("Swimmer-v5", "xml_file", "./parts/all.xml"), 1);
  assert_true(action_count(env) == 2);
  mjenv_destroy(env);
  assert_int_equal(remove("parts/swimmer.xml"), 0);
  mjenv_options* options = options_with("Swimmer-v5", "xml_file", "./parts/all.xml");
  assert_no_model(options, "./parts/all.xml", "swimmer.xml");
  mjenv_options_destroy(options);
  assert_int_equal(remove("parts/all.xml"), 0);
  assert_int_equal(rmdir("parts"), 0);
  free(xml);
}

// A file may read any other, unless the caller says that a stranger wrote it. A text may read none.
static void test_trust(void** state) {
  (void)state;
  char* xml = read_file(PROJECT_FOLDER "/assets/swimmer.xml", NULL);
  static const char including[] = "<mujoco><include file=\"../swimmer.xml\"/></mujoco>";
  write_file("swimmer.xml", xml);
  assert_int_equal(mkdir("parts", 0700), 0);
  write_file("parts/all.xml", including);
  static const struct {
    const char *option, *trust;
    const char* says;  // NULL: it loads
  } cases[] = {
      {"xml_file", NULL, NULL},
      {"xml_file", "auto", NULL},
      {"xml_file", "yes", NULL},
      {"xml_file", "no", "outside of the model's folder"},
      {"xml_string", NULL, "from memory"},
      {"xml_string", "auto", "from memory"},
      {"xml_string", "yes", NULL},
      {"xml_string", "no", "from memory"},
  };
  for (size_t i = 0; i < COUNT(cases); ++i) {
    const bool is_file = strcmp(cases[i].option, "xml_file") == 0;
    mjenv_options* options = options_with("Swimmer-v5", cases[i].option, is_file ? "./parts/all.xml" : including);
    if (cases[i].trust) assert_ok(mjenv_options_set_string(options, "trust_xml", cases[i].trust));
    // A text's files are looked for in the working directory.
    if (!is_file) assert_int_equal(chdir("parts"), 0);
    if (cases[i].says) {
      assert_no_model(options, "swimmer.xml", cases[i].says, "\"trust_xml\" to \"yes\"");
      mjenv_options_destroy(options);
    } else {
      mjenv_destroy(env_of_options(options, 1));
    }
    if (!is_file) assert_int_equal(chdir(".."), 0);
  }
  mjenv_options* options = options_of_id("Swimmer-v5");
  assert_refused(MJENV_E_VALUE, mjenv_options_set_string(options, "trust_xml", "1"), "trust_xml", "auto", "yes", "no");
  assert_refused(MJENV_E_TYPE, mjenv_options_set_integer(options, "trust_xml", 1), "trust_xml");
  mjenv_options_destroy(options);
  assert_int_equal(remove("parts/all.xml"), 0);
  assert_int_equal(rmdir("parts"), 0);
  assert_int_equal(remove("swimmer.xml"), 0);
  free(xml);
}

static void test_missing_files(void** state) {
  (void)state;
  static const char* const paths[] = {"./none.xml", "/nowhere/none.xml", "~/none.xml", "../none/none.xml", ".", "/"};
  for (size_t i = 0; i < COUNT(paths); ++i) {
    mjenv_options* options = options_with("HalfCheetah-v5", "xml_file", paths[i]);
    assert_no_file(options, paths[i][0] == '~' ? "none.xml" : paths[i]);
    mjenv_options_destroy(options);
  }
  char* home = getenv("HOME");
  mjenv_options* options = options_with("HalfCheetah-v5", "xml_file", "~/none.xml");
  assert_no_file(options, home);
  mjenv_options_destroy(options);
}

static void test_xml_string(void** state) {
  (void)state;
  char* xml = read_file(CUSTOM "tailed_cheetah.xml", NULL);
  // It wins over xml_file; empty it counts as none.
  mjenv_options* options = options_with("HalfCheetah-v5", "xml_string", xml);
  assert_ok(mjenv_options_set_string(options, "xml_file", "./not/looked/for.xml"));
  mjenv_env* env = env_of_options(options, 1);
  assert_true(obs_count(env) == 11 + 11 - 1);
  const char* text = NULL;
  assert_ok(mjenv_options_get_string(mjenv_options_of(env), "xml_string", &text));
  assert_string_equal(text, xml);
  mjenv_destroy(env);
  options = options_with("HalfCheetah-v5", "xml_string", xml);
  assert_ok(mjenv_options_set_string(options, "xml_string", ""));
  env = env_of_options(options, 1);
  assert_true(obs_count(env) == 17);
  mjenv_destroy(env);
  free(xml);
}

// ---- What will not do ----

#define WORLD(inside, rest) "<mujoco><worldbody>" inside "</worldbody>" rest "</mujoco>"
#define SLIDE(name) "<joint name='" name "' type='slide' axis='1 0 0'/>"
#define BALL "<geom size='0.1' mass='1'/>"
#define MOTOR(joint) "<actuator><motor joint='" joint "' ctrlrange='-1 1' ctrllimited='true'/></actuator>"

static void test_malformed(void** state) {
  (void)state;
  static const struct {
    const char *xml, *says;
  } models[] = {
      {"no XML at all", "XML"},
      {"<mujoco><worldbody>", "XML"},
      {"<html/>", "html"},
      {"<mujoco><world/></mujoco>", "world"},
      {WORLD("<body><geom size='-1'/></body>", ""), "size"},
      {WORLD("<body><joint type='hinge'/></body>", ""), "mass"},
      {WORLD("<body name='a'>" SLIDE("x") BALL "</body>", "<actuator><motor joint='y'/></actuator>"), "y"},
      {WORLD("<body name='a'>" SLIDE("x") BALL "</body><body name='a'>" BALL "</body>", ""), "a"},
      {WORLD("<body><geom type='mesh' mesh='m'/></body>", "<asset><mesh name='m' file='gone.stl'/></asset>"),
       "gone.stl"},
      {WORLD("<body><geom size='wide'/></body>", ""), "size"},
  };
  for (size_t i = 0; i < COUNT(models); ++i) {
    mjenv_options* options = options_with("HalfCheetah-v5", "xml_string", models[i].xml);
    assert_no_model(options, "xml_string", models[i].says);
    assert_ok(mjenv_options_set_string(options, "xml_string", ""));
    write_file("bad.xml", models[i].xml);
    assert_ok(mjenv_options_set_string(options, "xml_file", "./bad.xml"));
    assert_no_model(options, "./bad.xml", models[i].says);
    assert_int_equal(remove("bad.xml"), 0);
    mjenv_options_destroy(options);
  }
}

static void test_unfit(void** state) {
  (void)state;
  static const char one_slide[] = WORLD("<body name='cart'>" SLIDE("x") BALL "</body>", MOTOR("x"));
  static const struct {
    const char *id, *says[3];
  } unfit[] = {
      {"Ant-v5", {"Ant-v5", "3 positions", "1 positions"}},
      {"Ant-v4", {"Ant-v4", "3 positions", "1 positions"}},
      {"Hopper-v5", {"Hopper-v5", "positions", "1 positions"}},
      {"Walker2d-v5", {"Walker2d-v5", "positions", "1 positions"}},
      {"Humanoid-v5", {"Humanoid-v5", "positions", "1 positions"}},
      {"HumanoidStandup-v5", {"HumanoidStandup-v5", "positions", "1 positions"}},
      {"Swimmer-v5", {"Swimmer-v5", "positions", "1 positions"}},
      {"InvertedPendulum-v5", {"InvertedPendulum-v5", "2 positions", "1 positions"}},
      {"InvertedDoublePendulum-v5", {"InvertedDoublePendulum-v5", "3 positions", "1 positions"}},
      {"Pusher-v5", {"Pusher-v5", "positions", "1 positions"}},
      {"Reacher-v5", {"Reacher-v5", "4 positions", "1 positions"}},
  };
  for (size_t i = 0; i < COUNT(unfit); ++i) {
    mjenv_options* options = options_with(unfit[i].id, "xml_string", one_slide);
    assert_no_model(options, "xml_string", unfit[i].says[0], unfit[i].says[1], unfit[i].says[2]);
    mjenv_options_destroy(options);
  }
}

#define FOUR_SLIDES SLIDE("a") SLIDE("b") SLIDE("c") SLIDE("d")
#define FOUR_SLIDES_MORE SLIDE("e") SLIDE("f") SLIDE("g") SLIDE("h")

static void test_missing_objects(void** state) {
  (void)state;
  static const struct {
    const char *id, *xml, *says[3];
  } models[] = {
      {"Ant-v4", WORLD("<body name='trunk'><freejoint/>" BALL "</body>", ""), {"Ant-v4", "torso", "trunk"}},
      {"Reacher-v5",
       WORLD("<body name='arm'>" FOUR_SLIDES BALL "</body>", MOTOR("a")),
       {"Reacher-v5", "fingertip", "arm"}},
      {"Reacher-v5",
       WORLD("<body name='fingertip'>" FOUR_SLIDES BALL "</body>", MOTOR("a")),
       {"Reacher-v5", "target", "fingertip"}},
      {"Pusher-v5",
       WORLD("<body name='tip'>" FOUR_SLIDES BALL "<body>" FOUR_SLIDES_MORE BALL "</body></body>", MOTOR("a")),
       {"Pusher-v5", "tips_arm", "tip"}},
      {"InvertedDoublePendulum-v5",
       WORLD("<body>" SLIDE("a") SLIDE("b") SLIDE("c") BALL "</body>", MOTOR("a")),
       {"InvertedDoublePendulum-v5", "site", "0"}},
  };
  for (size_t i = 0; i < COUNT(models); ++i) {
    mjenv_options* options = options_with(models[i].id, "xml_string", models[i].xml);
    assert_no_model(options, models[i].says[0], models[i].says[1], models[i].says[2]);
    mjenv_options_destroy(options);
  }
}

static void test_main_body(void** state) {
  (void)state;
  mjenv_options* options = options_of_id("Ant-v5");
  assert_ok(mjenv_options_set_string(options, "main_body", "tail"));
  assert_no_model(options, "Ant-v5", "tail", "torso");
  assert_ok(mjenv_options_set_integer(options, "main_body", 14));
  assert_no_model(options, "main_body", "14");
  assert_ok(mjenv_options_set_integer(options, "main_body", 13));
  mjenv_destroy(env_of_options(options, 1));
}

// An actuator without bounds: Gymnasium's space is what ctrlrange says, here [0, 0].
static void test_unbounded_actuator(void** state) {
  (void)state;
  static const char xml[] = WORLD("<body>" SLIDE("a") "<joint name='b' axis='0 1 0'/>" BALL "</body>",
                                  "<actuator><motor joint='a'/></actuator>");
  mjenv_env* env = env_of_options(options_with("InvertedPendulum-v5", "xml_string", xml), 1);
  mjenv_space space = MJENV_SPACE_INIT;
  assert_ok(mjenv_space_of(env, MJENV_ROLE_ACTION, &space));
  assert_true(space.count == 1 && space.low[0] == 0 && space.high[0] == 0);
  float action = 5;
  assert_ok(mjenv_sample_actions(env, &action, 1));
  assert_true(action == 0);
  mjenv_destroy(env);
}

static void test_no_actuator(void** state) {
  (void)state;
  static const char xml[] = WORLD("<body>" SLIDE("a") "<joint name='b' axis='0 1 0'/>" BALL "</body>", "");
  mjenv_env* env = env_of_options(options_with("InvertedPendulum-v5", "xml_string", xml), 1);
  assert_true(action_count(env) == 0);
  assert_ok(mjenv_reset(env, NULL, NULL));
  assert_ok(mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT32, NULL));
  mjenv_destroy(env);
}

// ---- Silence ----

// MuJoCo complains about all of this, to standard output and into a log; it must reach neither.
static void provoke(void) {
  mjenv_env* env = NULL;
  mjenv_options* options = options_of_id("Hopper-v5");
  mjenv_options_set_string(options, "xml_string", "<mujoco><nonsense/></mujoco>");
  mjenv_create(options, 1, &env);
  mjenv_options_set_string(options, "xml_string", "");
  mjenv_options_set_integer(options, "strict", 0);
  mjenv_create(options, 1, &env);
  const double nans[3] = {NAN, INFINITY, 1e300}, qpos[6] = {0, 1e11}, qvel[6] = {1e20};
  mjenv_reset(env, NULL, NULL);
  mjenv_step(env, NULL, nans, 3, MJENV_DTYPE_FLOAT64, NULL);
  mjenv_set_state(env, 0, qpos, 6, qvel, 6);
  mjenv_step(env, NULL, nans, 3, MJENV_DTYPE_FLOAT64, NULL);
  mjenv_destroy(env);
  // More contacts than there is room for.
  mjenv_options_set_string(
      options, "xml_string",
      "<mujoco><size nconmax='1' njmax='1'/><worldbody><geom type='plane' size='9 9 1'/>"
      "<body pos='0 0 .05'><joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 0 1'/>"
      "<joint axis='0 1 0'/><joint type='slide' axis='0 1 0'/><geom type='box' size='1 1 .1'/></body>"
      "</worldbody></mujoco>");
  env = NULL;
  mjenv_create(options, 1, &env);
  if (env) {
    mjenv_reset(env, NULL, NULL);
    mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, NULL);
  }
  mjenv_destroy(env);
  mjenv_options_destroy(options);
}

static void test_silence(void** state) {
  (void)state;
  fflush(stdout);
  const int out = dup(1), err = dup(2), file = open("printed", O_CREAT | O_RDWR | O_TRUNC, 0600);
  assert_true(out >= 0 && err >= 0 && file >= 0);
  dup2(file, 1);
  dup2(file, 2);
  provoke();
  fflush(stdout);
  dup2(out, 1);
  dup2(err, 2);
  close(out);
  close(err);
  close(file);
  size_t size = 0;
  char* printed = read_file("printed", &size);
  assert_string_equal(printed, "");
  free(printed);
  assert_int_equal(remove("printed"), 0);
}

static void test_no_log(void** state) {
  (void)state;
  assert_int_not_equal(access("MUJOCO_LOG.TXT", F_OK), 0);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_built_in_names),
      cmocka_unit_test(test_paths),
      cmocka_unit_test(test_files_beside),
      cmocka_unit_test(test_trust),
      cmocka_unit_test(test_missing_files),
      cmocka_unit_test(test_xml_string),
      cmocka_unit_test(test_malformed),
      cmocka_unit_test(test_unfit),
      cmocka_unit_test(test_missing_objects),
      cmocka_unit_test(test_main_body),
      cmocka_unit_test(test_unbounded_actuator),
      cmocka_unit_test(test_no_actuator),
      cmocka_unit_test(test_silence),
      cmocka_unit_test(test_no_log),
  };
  return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}
