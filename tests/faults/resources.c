// The system refuses threads, memory, room on the disk or open files; nothing is printed or written in any case.
#include <dirent.h>
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "golden.h"
#include "mjenv/task.h"

#define RECORDING "trajectories/Hopper-v5.golden"

// ---- A pthread_create that fails ----

static int creates_left = -1;  // until it fails; -1: it does not

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*), void* argument) {
  static int (*real)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
  if (!real) {
    void* found = dlsym(RTLD_NEXT, "pthread_create");
    memcpy(&real, &found, sizeof real);
  }
  if (creates_left == 0) return EAGAIN;
  if (creates_left > 0) --creates_left;
  return real(thread, attributes, start, argument);
}

// ---- A realpath after which a file or a folder becomes a link ----

static const char *swapped, *target;

char* realpath(const char* path, char* to) {
  static char* (*real)(const char*, char*);
  if (!real) {
    void* found = dlsym(RTLD_NEXT, "realpath");
    memcpy(&real, &found, sizeof real);
  }
  char* resolved = real(path, to);
  if (swapped && strstr(path, "part.xml") && (rename(swapped, "kept") != 0 || symlink(target, swapped) != 0)) abort();
  return resolved;
}

static int count_entries(const char* folder) {
  DIR* directory = opendir(folder);
  if (!directory) return -1;
  int count = 0;
  for (struct dirent* entry = readdir(directory); entry; entry = readdir(directory)) count += entry->d_name[0] != '.';
  closedir(directory);
  return count;
}

static int count_threads(void) { return count_entries("/proc/self/task"); }

static mjenv_options* options_with_threads(int64_t threads) {
  mjenv_options* options = options_of_id("Hopper-v5");
  assert_ok(mjenv_options_set_integer(options, "num_threads", threads));
  return options;
}

static void test_no_threads(void** state) {
  (void)state;
  enum { THREADS = 6 };
  mjenv_options* options = options_with_threads(THREADS);
  const int before = count_threads();
  for (int allowed = 0; allowed < THREADS - 1; ++allowed) {
    mjenv_env* env = NULL;
    creates_left = allowed;
    const mjenv_status status = mjenv_create(options, THREADS, &env);
    creates_left = -1;
    assert_refused(MJENV_E_MEMORY, status, "threads", "num_threads");
    assert_null(env);
    assert_int_equal(count_threads(), before);
  }
  mjenv_env* env = NULL;
  assert_ok(mjenv_create(options, THREADS, &env));
  assert_int_equal(count_threads(), before + THREADS - 1);
  mjenv_destroy(env);
  assert_int_equal(count_threads(), before);
  mjenv_options_destroy(options);
}

// ---- In a process of its own ----

// Runs body in a child in an empty folder, with standard output and error in a file. It has to end well, say nothing
// and leave the folder empty.
static void in_child(bool (*body)(void)) {
  char folder[] = P_tmpdir "/mjenv-faults-XXXXXX", said[64];
  assert_non_null(mkdtemp(folder));
  snprintf(said, sizeof said, "%s.said", folder);
  fflush(NULL);
  const pid_t child = fork();
  if (child == 0) {
    const int file = open(said, O_CREAT | O_RDWR | O_TRUNC, 0600), nothing = open("/dev/null", O_RDONLY);
    if (chdir(folder) != 0 || dup2(nothing, 0) < 0 || dup2(file, 1) < 0 || dup2(file, 2) < 0) _exit(2);
    alarm(120);
    const bool fine = body();
    if (!fine) fprintf(stderr, "%s\n", mjenv_last_error());
    fflush(NULL);
    _exit(fine ? 0 : 1);
  }
  int result = -1;
  assert_int_equal(waitpid(child, &result, 0), child);
  char* text = read_file(said, NULL);
  const int left = count_entries(folder);
  const bool silent = text[0] == '\0';
  if (!silent) print_error("it said: %s\n", text);
  free(text);
  unlink(said);
  const int removed = rmdir(folder);
  assert_int_equal(result, 0);
  assert_true(silent);
  assert_int_equal(left, 0);
  assert_int_equal(removed, 0);
}

static bool works(int64_t threads) {
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  const double action[12] = {0};
  bool fine = mjenv_options_create("Hopper-v5", &options) == MJENV_OK &&
              mjenv_options_set_integer(options, "num_threads", threads) == MJENV_OK &&
              mjenv_create(options, 4, &env) == MJENV_OK && mjenv_reset(env, NULL, NULL) == MJENV_OK &&
              mjenv_step(env, NULL, action, 12, MJENV_DTYPE_FLOAT64, NULL) == MJENV_OK;
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return fine;
}

// A user, other than root, may have no more processes.
static bool no_more_processes(void) {
  enum { NOBODY = 65534 };
  const struct rlimit limit = {1, 1};
  if (getuid() == 0 && (setgid(NOBODY) != 0 || setuid(NOBODY) != 0)) return false;
  if (setrlimit(RLIMIT_NPROC, &limit) != 0) return false;
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  if (mjenv_options_create("Hopper-v5", &options) != MJENV_OK) return false;
  if (mjenv_options_set_integer(options, "num_threads", 4) != MJENV_OK) return false;
  const bool refused = mjenv_create(options, 4, &env) == MJENV_E_MEMORY && !env;
  mjenv_options_destroy(options);
  return refused && works(1);
}

static void test_no_more_processes(void** state) {
  (void)state;
  in_child(no_more_processes);
}

// The bytes of the address space that are in use, and those of them that have memory.
static bool use_of_memory(rlim_t* space, rlim_t* resident) {
  unsigned long pages[2];
  FILE* file = fopen("/proc/self/statm", "r");
  const bool found = file && fscanf(file, "%lu %lu", &pages[0], &pages[1]) == 2;
  if (file) fclose(file);
  const rlim_t size = (rlim_t)sysconf(_SC_PAGESIZE);
  *space = found ? pages[0] * size : 0;
  *resident = found ? pages[1] * size : 0;
  return found;
}

// Creates Humanoid-v5 with so many stacked observations. Returns how much memory it has taken after a reset, in MB; 0 if
// it is refused.
static double memory_of_history(int64_t frames) {
  rlim_t space, before, after;
  mjenv_options* options = options_of_id("Humanoid-v5");
  mjenv_env* env = NULL;
  assert_ok(mjenv_options_set_integer(options, "history", frames));
  assert_ok(mjenv_options_set_integer(options, "num_threads", 1));
  malloc_trim(0);  // or memory that was freed before would be taken again, uncounted
  assert_true(use_of_memory(&space, &before));
  const bool fits = mjenv_create(options, 2, &env) == MJENV_OK;
  if (fits) assert_ok(mjenv_reset(env, NULL, NULL));
  assert_true(use_of_memory(&space, &after));
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return fits ? (double)(after - before) / 1e6 : 0;
}

// What a refused history says that it needs is what one takes that fits.
static void test_memory_of_history(void** state) {
  (void)state;
  enum { FEW = 4000, MORE = 24000, TOO_MANY = 100000000 };
  double needed = 0;
  assert_true(memory_of_history(TOO_MANY) == 0);
  assert_int_equal(sscanf(mjenv_last_error(), "2 row(s) with the option \"history\" need %lf MB", &needed), 1);
  needed *= (double)(MORE - FEW) / TOO_MANY;
  const double taken = memory_of_history(MORE) - memory_of_history(FEW);
  assert_true(0.8 * needed < taken && taken < 1.1 * needed);
}

static rlim_t address_space(void) {
  rlim_t space, resident;
  return use_of_memory(&space, &resident) ? space : 0;
}

// The address space is bounded at more and more above what is in use, until an environment fits whose rows are more
// than the 64 MB that an arena of the C library may still hold. Each thread's arena takes up to 128 MB.
static bool little_address_space(void) {
  enum { STEP = 1 << 20, MOST = 1000 };
  const rlim_t used = address_space();
  bool fine = used > 0, fits = false;
  int refused = 0;
  for (int more = 0; fine && !fits && more < MOST; more += 1 + more / 8) {
    const struct rlimit limit = {used + (rlim_t)more * STEP, RLIM_INFINITY};
    if (setrlimit(RLIMIT_AS, &limit) != 0) return false;
    mjenv_options* options = NULL;
    mjenv_env* env = NULL;
    mjenv_status status = mjenv_options_create("Humanoid-v5", &options);
    if (status == MJENV_OK) status = mjenv_options_set_integer(options, "num_threads", 4);
    if (status == MJENV_OK) status = mjenv_create(options, 60000, &env);
    if (status == MJENV_OK) status = mjenv_reset(env, NULL, NULL);
    // MuJoCo reports what its parser could not store as a fault of the file
    fine = status == MJENV_OK || status == MJENV_E_MEMORY || status == MJENV_E_MODEL;
    fits = status == MJENV_OK;
    refused += !fits;
    mjenv_destroy(env);
    mjenv_options_destroy(options);
  }
  const struct rlimit none = {RLIM_INFINITY, RLIM_INFINITY};
  return fine && fits && refused > 3 && setrlimit(RLIMIT_AS, &none) == 0 && works(2);
}

static void test_little_address_space(void** state) {
  (void)state;
  in_child(little_address_space);
}

// Newton's method in lanes needs a matrix of nv x nv numbers for each lane, which is given only when it is written to.
// So too little memory for it is found when the environment is created, not when the system ends the process.
static bool too_many_dofs(void) {
  // There is room for the model and one mjData, whose stack is as large as one such matrix.
  enum { DOFS = 3000, LANES = 2, MATRICES = LANES * DOFS * DOFS * 8, ROOM = MATRICES / 6 * 5 };
  static const char head[] =
      "<mujoco><compiler inertiafromgeom='false'/><option jacobian='dense' solver='Newton'/>"
      "<size njmax='1' nconmax='1' nstack='9200000'/><worldbody><body><inertial pos='0 0 0' mass='1' diaginertia='1 1 "
      "1'/>"
      "<joint type='slide'/></body>";
  static const char body[] = "<body><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/><joint type='slide'/></body>";
  static const char tail[] = "</worldbody></mujoco>";
  char* text = malloc(sizeof head + DOFS * sizeof body + sizeof tail);
  if (!text) return false;
  char* end = text + sprintf(text, "%s", head);
  for (int i = 1; i < DOFS; ++i) end += sprintf(end, "%s", body);
  sprintf(end, "%s", tail);
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  bool fine = mjenv_options_create("Model-v0", &options) == MJENV_OK;
  fine = fine && mjenv_options_set_string(options, "xml_string", text) == MJENV_OK;
  fine = fine && mjenv_options_set_string(options, "trust_xml", "yes") == MJENV_OK;
  free(text);
  if (fine && mjenv_options_set_integer(options, "lanes", LANES) != MJENV_OK) return false;
  mjenv_status status = mjenv_create(options, LANES, &env);
  if (status == MJENV_E_VALUE) return works(1);  // no lanes here
  fine = fine && status == MJENV_OK;
  mjenv_destroy(env);
  env = NULL;
  const struct rlimit limit = {address_space() + ROOM, RLIM_INFINITY};
  fine = fine && setrlimit(RLIMIT_AS, &limit) == 0;
  status = mjenv_create(options, LANES, &env);
  fine = fine && status == MJENV_E_MEMORY && !env && strstr(mjenv_last_error(), "1 thread(s) need");
  if (!fine) printf("%s: %s\n", mjenv_status_name(status), mjenv_last_error());
  const struct rlimit none = {RLIM_INFINITY, RLIM_INFINITY};
  mjenv_options_destroy(options);
  return fine && setrlimit(RLIMIT_AS, &none) == 0 && works(2);
}

static void test_too_many_dofs(void** state) {
  (void)state;
  in_child(too_many_dofs);
}

// ---- Own arrays of rows that were never written ----

enum { SIDE = 256, HEIGHTS = SIDE * SIDE };

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  (void)user;
  *self = NULL;
  mjenv_build_current(builder);
  mjenv_build_own(builder, "hfield_data");
  mjenv_build_parameter(builder, "height");
  return 0;
}

static int32_t reset(const void* self, mjenv_start* start) {
  (void)self;
  if (start->parameters[0] > 0)
    for (int i = 0; i < HEIGHTS; ++i) start->own[0][i] = start->parameters[0];
  return 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* to) {
  (void)self;
  to[0] = sim->qpos[0];
  return 0;
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self;
  if (sim->parameters[0] > 0.5) outcome->own[0][HEIGHTS - 1] = 0.5;
  return 0;
}

static mjenv_env* large_fields(int64_t rows) {
  static const mjenv_task_option height = {
      .struct_size = sizeof height, .kind = MJENV_KIND_REALS, .name = "height", .low = 0, .high = 1, .live = 1};
  static const mjenv_task_field z = {.struct_size = sizeof z, .name = "z", .role = MJENV_ROLE_OBSERVATION};
  static const mjenv_task task = {
      .struct_size = sizeof task,
      .id = "tests/LargeFields-v0",
      .model_text =
          "<mujoco><asset><hfield name='ground' nrow='256' ncol='256' size='9 9 1 .1'/></asset><worldbody>"
          "<geom type='hfield' hfield='ground'/><body pos='0 0 3'><joint type='slide' axis='0 0 1'/><geom size='.2'/>"
          "</body></worldbody></mujoco>",
      .frame_skip = 1,
      .options = &height,
      .option_count = 1,
      .fields = &z,
      .field_count = 1,
      .build = build,
      .reset = reset,
      .observe = observe,
      .step = step};
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  if (mjenv_register_task(&task) == MJENV_OK && mjenv_options_create(task.id, &options) == MJENV_OK)
    mjenv_create(options, rows, &env);
  mjenv_options_destroy(options);
  return env;
}

// The heights of all rows would be 256 MB, and those with which they were computed as many. Only written rows have memory.
static bool unwritten_rows(void) {
  enum { ROWS = 1024, WRITTEN = 700, COPY = 9, STEP_WRITES = 3, MOST = 64 << 20 };
  static double heights[HEIGHTS];
  static unsigned char image[HEIGHTS * 16];
  rlim_t space, before, after;
  if (!use_of_memory(&space, &before)) return false;
  mjenv_env* env = large_fields(ROWS);
  if (!env) return false;
  uint8_t mask[ROWS] = {0}, copied[ROWS] = {0};
  mask[WRITTEN] = mask[STEP_WRITES] = copied[COPY] = copied[COPY + 1] = 1;
  const double low = 0.25, high = 0.75;
  int64_t count = 0, size = 0;
  bool fine =
      mjenv_reset(env, NULL, NULL) == MJENV_OK && mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, NULL) == MJENV_OK;
  fine = fine && mjenv_write(env, mask, "parameters.height", &low, 1) == MJENV_OK;
  fine = fine && mjenv_reset(env, mask, NULL) == MJENV_OK && mjenv_copy_row(env, copied, WRITTEN) == MJENV_OK;
  mask[WRITTEN] = 0;
  fine = fine && mjenv_write(env, mask, "parameters.height", &high, 1) == MJENV_OK;
  fine = fine && mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, NULL) == MJENV_OK;
  // Row COPY + 1 gets the model's heights back.
  fine = fine && mjenv_snapshot(env, 0, image, sizeof image, &size) == MJENV_OK;
  fine = fine && mjenv_restore(env, COPY + 1, image, size) == MJENV_OK;
  fine = fine && mjenv_step(env, NULL, NULL, 0, MJENV_DTYPE_FLOAT64, NULL) == MJENV_OK;
  for (int64_t row = 0; fine && row < ROWS; ++row) {
    fine = mjenv_read(env, row, "hfield_data", heights, HEIGHTS, &count) == MJENV_OK && count == HEIGHTS;
    const double wanted = row == WRITTEN || row == COPY || row == STEP_WRITES ? low : 0;
    for (int i = 0; fine && i < HEIGHTS; ++i)
      fine = heights[i] == (row == STEP_WRITES && i == HEIGHTS - 1 ? 0.5 : wanted);
    if (!fine) printf("row %d has other heights\n", (int)row);
  }
  if (fine && !use_of_memory(&space, &after)) fine = false;
  if (fine && after > before + MOST) {
    printf("%d MB\n", (int)((after - before) >> 20));
    fine = false;
  }
  mjenv_destroy(env);
  return fine;
}

static void test_unwritten_rows(void** state) {
  (void)state;
  in_child(unwritten_rows);
}

static bool write_text(const char* path, const char* text) {
  FILE* file = fopen(path, "w");
  return file && fputs(text, file) >= 0 && fclose(file) == 0;
}

// A stranger's model includes a file of its folder. While it is loaded, the file, or the folder that contains it, becomes
// a link to another folder.
static bool swapped_files(void) {
  static const char* const part = "<x><worldbody><geom size='1'/></worldbody></x>";
  static const char* const swaps[][2] = {{"model/in/part.xml", "../../secret/part.xml"}, {"model/in", "../secret"}};
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  bool fine = mkdir("secret", 0700) == 0 && mkdir("model", 0700) == 0 && mkdir("model/in", 0700) == 0 &&
              write_text("secret/part.xml", part) && write_text("model/in/part.xml", part) &&
              write_text("model/m.xml", "<mujoco><include file='in/part.xml'/></mujoco>") &&
              mjenv_options_create("Model-v0", &options) == MJENV_OK &&
              mjenv_options_set_string(options, "xml_file", "./model/m.xml") == MJENV_OK &&
              mjenv_options_set_string(options, "trust_xml", "no") == MJENV_OK;
  fine = fine && mjenv_create(options, 1, &env) == MJENV_OK;
  mjenv_destroy(env);
  for (size_t i = 0; fine && i < COUNT(swaps); ++i) {
    swapped = swaps[i][0];
    target = swaps[i][1];
    fine = mjenv_create(options, 1, &env) == MJENV_E_MODEL && strstr(mjenv_last_error(), "cannot be read");
    swapped = NULL;
    fine = fine && unlink(swaps[i][0]) == 0 && rename("kept", swaps[i][0]) == 0;
  }
  mjenv_options_destroy(options);
  static const char* const made[] = {"secret/part.xml", "model/in/part.xml", "model/in", "model/m.xml", "model",
                                     "secret"};
  for (size_t i = 0; i < COUNT(made); ++i) fine = remove(made[i]) == 0 && fine;
  return fine;
}

// A mesh of half the size is in the file as soon as the first one has been loaded.
static bool edited_files(void) {
  static const char* const sizes[] = {"2", "1"};
  mjenv_options* options = NULL;
  bool fine = write_text("m.xml",
                         "<mujoco><asset><mesh name='m' file='m.obj'/></asset><worldbody><body><joint/>"
                         "<geom type='mesh' mesh='m'/></body></worldbody></mujoco>") &&
              mjenv_options_create("Model-v0", &options) == MJENV_OK &&
              mjenv_options_set_string(options, "xml_file", "./m.xml") == MJENV_OK;
  double mass[2][2] = {{0}};
  for (int i = 0; fine && i < 2; ++i) {
    char text[200];
    mjenv_env* env = NULL;
    int64_t count;
    snprintf(text, sizeof text, "v 0 0 0\nv %s 0 0\nv 0 %s 0\nv 0 0 %s\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n", sizes[i],
             sizes[i], sizes[i]);
    fine = write_text("m.obj", text) && mjenv_create(options, 1, &env) == MJENV_OK &&
           mjenv_read(env, 0, "body_mass", mass[i], 2, &count) == MJENV_OK;
    mjenv_destroy(env);
  }
  mjenv_options_destroy(options);
  return remove("m.xml") == 0 && remove("m.obj") == 0 && fine && mass[0][1] == 8 * mass[1][1];
}

static void test_edited_files(void** state) {
  (void)state;
  in_child(edited_files);
}

static void test_swapped_files(void** state) {
  (void)state;
  in_child(swapped_files);
}

// Everything that MuJoCo itself reports by printing and by writing MUJOCO_LOG.TXT.
static bool complaints(void) {
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  const double wild[3] = {1e300, -1e300, 1e300}, qpos[6] = {1e200, 1e200, 1e200, 1e200, 1e200, 1e200}, qvel[6] = {0};
  if (mjenv_options_create("Hopper-v5", &options) != MJENV_OK) return false;
  // a file that is not there, one that is no model, a model that MuJoCo refuses, one whose work space is too small
  mjenv_options_set_string(options, "xml_file", "./nothing.xml");
  if (mjenv_create(options, 1, &env) != MJENV_E_FILE) return false;
  mjenv_options_set_string(options, "xml_file", "/proc/self/exe");
  mjenv_status status = mjenv_create(options, 1, &env);
  if (status != MJENV_E_MODEL && status != MJENV_E_FILE) return false;  // FILE: no more files can be opened
  mjenv_options_set_string(options, "xml_string", "<mujoco><worldbody><geom size='-1'/></worldbody></mujoco>");
  if (mjenv_create(options, 1, &env) != MJENV_E_MODEL) return false;
  static const char* const cramped =
      "<mujoco><size nstack='64'/><worldbody><geom type='plane' size='9 9 9'/><body name='torso' pos='0 0 .1'>"
      "<joint type='slide' axis='1 0 0'/><joint type='slide' axis='0 0 1'/><joint axis='0 1 0'/><geom size='.2'/>"
      "<body><joint axis='0 1 0'/><geom size='.2' pos='.3 0 0'/></body><body><joint axis='0 1 0'/>"
      "<geom size='.2' pos='-.3 0 0'/></body><body><joint axis='0 1 0'/><geom size='.2' pos='0 .3 0'/></body>"
      "</body></worldbody></mujoco>";
  mjenv_options_set_string(options, "xml_string", cramped);
  status = mjenv_create(options, 1, &env);
  if (status == MJENV_OK) {
    mjenv_destroy(env);
    env = NULL;
  }
  mjenv_options_destroy(options);
  // states that diverge
  if (mjenv_options_create("Hopper-v5", &options) != MJENV_OK) return false;
  mjenv_options_set_integer(options, "strict", 0);
  if (mjenv_create(options, 1, &env) != MJENV_OK || mjenv_reset(env, NULL, NULL) != MJENV_OK) return false;
  mjenv_set_state(env, 0, qpos, 6, qvel, 6);
  for (int i = 0; i < 50; ++i) mjenv_step(env, NULL, wild, 3, MJENV_DTYPE_FLOAT64, NULL);
  mjenv_simulate(env, 0, wild, 3, 50);
  mjenv_renderer* renderer = NULL;
  mjenv_render_settings settings = MJENV_RENDER_SETTINGS_INIT;
  mjenv_render_defaults(env, &settings);
  settings.width = 1 << 16;
  if (mjenv_renderer_create(env, &settings, &renderer) == MJENV_OK) return false;
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return works(1);
}

static void test_nothing_is_written(void** state) {
  (void)state;
  in_child(complaints);
}

static bool full_disk(void) {
  const int full = open("/dev/full", O_WRONLY);
  const struct rlimit limit = {0, 0};
  if (full < 0 || dup2(full, 1) < 0 || dup2(full, 2) < 0) return false;
  if (setrlimit(RLIMIT_FSIZE, &limit) != 0) return false;  // a write to a file would end the process by SIGXFSZ
  return complaints() && works(2);
}

static void test_full_disk(void** state) {
  (void)state;
  in_child(full_disk);
}

// Neither standard streams nor any file can be opened.
static bool no_files(void) {
  const struct rlimit limit = {0, 0};
  for (int file = 0; file < 64; ++file) close(file);
  return setrlimit(RLIMIT_NOFILE, &limit) == 0 && complaints() && works(2);
}

static void test_no_files(void** state) {
  (void)state;
  in_child(no_files);
}

static void test_as_good_as_new(void** state) {
  (void)state;
  golden_assert_file_plays(RECORDING);
}

int main(void) {
  const struct CMUnitTest tests[] = {
      cmocka_unit_test(test_no_threads),         cmocka_unit_test(test_no_more_processes),
      cmocka_unit_test(test_memory_of_history),  cmocka_unit_test(test_little_address_space),
      cmocka_unit_test(test_too_many_dofs),      cmocka_unit_test(test_unwritten_rows),
      cmocka_unit_test(test_swapped_files),      cmocka_unit_test(test_edited_files),
      cmocka_unit_test(test_nothing_is_written), cmocka_unit_test(test_full_disk),
      cmocka_unit_test(test_no_files),           cmocka_unit_test(test_as_good_as_new),
  };
  return cmocka_run_group_tests(tests, NULL, NULL);
}
