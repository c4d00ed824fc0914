/* mjenv.h - Gymnasium's MuJoCo environments behind a C interface.
 *
 * Rows       An environment holds one or many independent rows. A row is one episode: 200 bytes to 2 KB of state.
 *            The threads that step rows own the MuJoCo work space, so rows are cheap, and their bits do not depend on
 *            the number of threads (the option "num_threads").
 * Numbers    For a seed and a list of actions every output equals Gymnasium 1.3.0 on MuJoCo 2.2.2, bit for bit.
 * Errors     A function that can fail returns MJENV_OK or a negative mjenv_status and leaves its outputs untouched.
 *            mjenv_last_error() gives the reason, for the calling thread. The handle stays usable.
 *            Any function may give MJENV_E_MEMORY, and MJENV_E_ARGUMENT for a handle that was destroyed; those that
 *            read or change rows MJENV_E_STATE while rows are under way (mjenv_send); those that need the environment's
 *            threads do so in a forked child, which lacks them.
 * Ownership  *_create hands the caller a handle to pass to the matching *_destroy, which accepts NULL and cannot fail.
 *            A const char * or const double * result is borrowed from the handle it came from.
 *            *_destroy waits for a call that is inside on another thread; later ones are refused.
 *            The library keeps no pointer that a caller passed in: when a call returns, its arrays may be freed.
 * Threads    Distinct handles are independent. Two threads in one environment at once: the later gets MJENV_E_BUSY. So
 *            does a thread that sets options that another is in.
 * Arrays     Row-major, dense, owned by the caller. Sizes count elements unless the name says bytes.
 * ABI        Structs start with struct_size, which the caller sets to sizeof; they only ever grow at their end. */
#ifndef MJENV_MJENV_H
#define MJENV_MJENV_H

#include <stddef.h>
#include <stdint.h>

#define MJENV_API __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when a compiled client would have to be rebuilt. */
#define MJENV_ABI_VERSION 1

/* Names all rows at once in mjenv_snapshot and mjenv_restore. */
#define MJENV_ALL_ROWS (-1)

typedef struct mjenv_options mjenv_options;   /* the constructor options of one environment id */
typedef struct mjenv_env mjenv_env;           /* an environment of one or many rows */
typedef struct mjenv_renderer mjenv_renderer; /* draws pictures of an environment's rows */
typedef struct mjenv_window mjenv_window;     /* shows an environment's rows on a display */

typedef int32_t mjenv_status;
enum mjenv_status_value {
  MJENV_OK = 0,
  MJENV_E_ARGUMENT = -1,  /* a null pointer, an unknown enum value, a struct_size that is too small */
  MJENV_E_NAME = -2,      /* no such id, option, array or object; the message lists the valid ones */
  MJENV_E_TYPE = -3,      /* the option holds another kind of value */
  MJENV_E_VALUE = -4,     /* a value outside its bounds, or a NaN where a number is needed */
  MJENV_E_SIZE = -5,      /* an array of another length than needed */
  MJENV_E_STATE = -6,     /* not now: before the first reset, after the end of the episode, while rows are under way */
  MJENV_E_BUSY = -7,      /* another thread is inside this environment */
  MJENV_E_MODEL = -8,     /* a model file that is missing, malformed or lacks what the task needs */
  MJENV_E_PHYSICS = -9,   /* MuJoCo reported an error, or a row diverged */
  MJENV_E_SNAPSHOT = -10, /* an image that is damaged or belongs to another environment */
  MJENV_E_MEMORY = -11,   /* out of memory */
  MJENV_E_INTERNAL = -12, /* a defect of this library; please report it */
  MJENV_E_RENDER = -13,   /* no OpenGL, or it failed; the message names what to install */
  MJENV_E_TASK = -14      /* a callback of a registered task failed, or a plug-in holds no tasks (mjenv/task.h) */
};

typedef int32_t mjenv_dtype;
enum mjenv_dtype_value { MJENV_DTYPE_FLOAT64 = 0, MJENV_DTYPE_FLOAT32 = 1 };

/* What a list of fields describes. */
typedef int32_t mjenv_role;
enum mjenv_role_value {
  MJENV_ROLE_OBSERVATION = 1, /* the terms of an observation, in order */
  MJENV_ROLE_ACTION = 2,      /* the actuators */
  MJENV_ROLE_INFO = 3,        /* the info of a step */
  MJENV_ROLE_RESET_INFO = 4,  /* the info of a reset */
  MJENV_ROLE_REWARD = 5,      /* the reward: one field */
  MJENV_ROLE_STRUCTURE = 6,   /* Gymnasium's observation_structure: names and counts; empty where Gymnasium has none */
  MJENV_ROLE_DATA = 7,        /* arrays of a row's mjData, for mjenv_read */
  MJENV_ROLE_MODEL = 8,       /* sizes, options and arrays of the mjModel, for mjenv_read */
  MJENV_ROLE_ARRAYS = 9       /* the mjData arrays that the option "arrays" names, for mjenv_batch */
};

typedef int32_t mjenv_kind;
enum mjenv_kind_value {
  MJENV_KIND_FLAG = 1,         /* integer 0 or 1 */
  MJENV_KIND_INTEGER = 2,      /* integer */
  MJENV_KIND_REALS = 3,        /* one or more doubles */
  MJENV_KIND_STRING = 4,       /* UTF-8 text */
  MJENV_KIND_STRING_OR_INT = 5 /* a name or an index: text or integer */
};

/* The type that Gymnasium gives a value. All values are passed as doubles; each fits exactly. */
typedef int32_t mjenv_type;
enum mjenv_type_value {
  MJENV_TYPE_FLOAT64 = 1,      /* np.float64 */
  MJENV_TYPE_ACTION = 2,       /* np.float32 when the action is float32, else np.float64 */
  MJENV_TYPE_NATIVE_FLOAT = 3, /* float */
  MJENV_TYPE_NATIVE_INT = 4,   /* int */
  MJENV_TYPE_INT64 = 5,        /* np.int64 */
  MJENV_TYPE_FLOAT32 = 6,      /* np.float32: some mjModel arrays */
  MJENV_TYPE_INT32 = 7,        /* np.int32: mjModel and mjData arrays */
  MJENV_TYPE_UINT8 = 8         /* np.uint8: flags and pixels in mjModel */
};

/* One constructor option: its name is Gymnasium's, its bounds are closed. */
typedef struct mjenv_option {
  uint32_t struct_size;
  mjenv_kind kind;
  const char *name;
  const char *doc;
  double low, high;    /* of each number; infinite when unbounded; no meaning for text */
  int64_t count;       /* numbers held: 2 for a range */
  const char *choices; /* the valid texts separated by blanks, or NULL when any text may be tried */
} mjenv_option;

/* One named term of an observation, an action or an info; one readable array. */
typedef struct mjenv_field {
  uint32_t struct_size;
  int32_t ndim; /* 0 for a scalar */
  const char *name;
  const char *doc;  /* with the unit where there is one; "" when the name says it all */
  int64_t shape[4]; /* the first ndim are used */
  int64_t offset;   /* of the first element within one row's record */
  int64_t count;    /* elements: the product of the shape */
  mjenv_type type;
  int32_t reserved; /* 0 */
} mjenv_field;

/* A Box space. The bounds are borrowed from the environment: low[count], high[count]. */
typedef struct mjenv_space {
  uint32_t struct_size;
  mjenv_dtype dtype; /* as Gymnasium declares it: float64 observations, float32 actions */
  int64_t count;
  const double *low;
  const double *high;
} mjenv_space;

/* What an id promises before anything is built; its texts are static. */
typedef struct mjenv_spec {
  uint32_t struct_size;
  int32_t version; /* 4 or 5 */
  const char *id;
  const char *robot;         /* the id without its version */
  int64_t max_episode_steps; /* the default */
  double reward_threshold;   /* NaN where Gymnasium has none */
  /* Gymnasium's default_camera_config; NaN where it leaves a value to MuJoCo */
  double camera_distance;    /* m */
  double camera_elevation;   /* degrees */
  double camera_lookat[3];   /* m */
  double camera_trackbodyid; /* a whole number */
  const char *model_xml;     /* the MJCF text of the model; NULL where a registered task has it in a file */
} mjenv_spec;

/* Where reset, step, recv, rollout and observe write. One batch serves all of them. A null array is skipped. The counts
 * guard the sizes of the arrays that are given. Info arrays hold one block for each field: field f starts at element
 * f.offset * rows and is [rows][f.count]. */
typedef struct mjenv_batch {
  uint32_t struct_size;
  mjenv_dtype obs_dtype;    /* of obs and final_obs: float64 as Gymnasium's, or float32, rounded to nearest */
  int64_t rows;             /* mjenv_rows(env); in a rollout mjenv_rows(env) * steps */
  int64_t obs_count;        /* elements of one row of obs: the observation space's count */
  int64_t info_count;       /* elements of one row of info: the sum of the counts of MJENV_ROLE_INFO's fields */
  int64_t reset_info_count; /* elements of one row of reset_info: the same for MJENV_ROLE_RESET_INFO */
  int64_t arrays_count;     /* elements of one row of arrays: the same for MJENV_ROLE_ARRAYS */
  void *obs;                /* [rows][obs_count] */
  double *reward;           /* [rows]; 0 for a row that was reset */
  uint8_t *terminated;      /* [rows] 0 or 1; 0 for a row that was reset */
  uint8_t *truncated;       /* [rows] 0 or 1; 0 for a row that was reset */
  int32_t *status;    /* [rows] MJENV_OK, or MJENV_E_PHYSICS where MuJoCo found the state diverged and restarted it,
                         or where the row failed */
  double *info;       /* MJENV_ROLE_INFO's fields; 0 for a row that was reset */
  uint8_t *was_reset; /* [rows] 1 where this call began an episode, so that reset_info holds, else 0 */
  double *reset_info; /* MJENV_ROLE_RESET_INFO's fields; written for the rows that were reset */
  /* autoreset_mode "same_step", for rows that ended and were reset in the same step: */
  void *final_obs;    /* [rows][obs_count] the last observation of the episode that ended */
  double *final_info; /* MJENV_ROLE_INFO's fields of that last step */
  double *arrays;     /* MJENV_ROLE_ARRAYS's fields */
} mjenv_batch;

/* What provides OpenGL. */
typedef int32_t mjenv_gl;
enum mjenv_gl_value {
  MJENV_GL_AUTO = 0, /* the one that the environment variable MUJOCO_GL names (egl, osmesa or glfw); unset: the first
                        of egl, glfw and osmesa that works */
  MJENV_GL_EGL = 1,  /* without a display; Debian: libegl1 libgl1-mesa-dri. MUJOCO_EGL_DEVICE_ID chooses a device */
  MJENV_GL_OSMESA =
      2,            /* without a display or a graphics driver; Debian: libosmesa6. Excludes the others in a process */
  MJENV_GL_GLFW = 3 /* an invisible window on a display; Debian: libglfw3. Created on the main thread only */
};

/* What to make visible beside the geoms: MuJoCo's mjtVisFlag. */
typedef int32_t mjenv_visual;
enum mjenv_visual_value {
  MJENV_VISUAL_CONVEXHULL = 0,
  MJENV_VISUAL_TEXTURE = 1,
  MJENV_VISUAL_JOINT = 2,
  MJENV_VISUAL_CAMERA = 3,
  MJENV_VISUAL_ACTUATOR = 4,
  MJENV_VISUAL_ACTIVATION = 5,
  MJENV_VISUAL_LIGHT = 6,
  MJENV_VISUAL_TENDON = 7,
  MJENV_VISUAL_RANGEFINDER = 8,
  MJENV_VISUAL_CONSTRAINT = 9,
  MJENV_VISUAL_INERTIA = 10,
  MJENV_VISUAL_SCLINERTIA = 11,
  MJENV_VISUAL_PERTFORCE = 12,
  MJENV_VISUAL_PERTOBJ = 13,
  MJENV_VISUAL_CONTACTPOINT = 14,
  MJENV_VISUAL_CONTACTFORCE = 15,
  MJENV_VISUAL_CONTACTSPLIT = 16,
  MJENV_VISUAL_TRANSPARENT = 17,
  MJENV_VISUAL_AUTOCONNECT = 18,
  MJENV_VISUAL_COM = 19,
  MJENV_VISUAL_SELECT = 20,
  MJENV_VISUAL_STATIC = 21,
  MJENV_VISUAL_SKIN = 22
};

#define MJENV_CAMERA_FREE (-1)
#define MJENV_CAMERA_DEFAULT (-2)

/* How a renderer draws: Gymnasium's arguments of the same names. mjenv_render_defaults fills it. */
typedef struct mjenv_render_settings {
  uint32_t struct_size;
  mjenv_gl gl;
  int32_t width;           /* pixels, 480 */
  int32_t height;          /* pixels, 480 */
  int32_t camera;          /* the index of a camera of the model, MJENV_CAMERA_FREE, or MJENV_CAMERA_DEFAULT: the one
                              called "track" if the model has it, else the free one */
  int32_t max_geom;        /* geoms drawn at most, 1000 */
  int32_t samples;         /* a pixel, at most 64: the model's offsamples (4); 0: no multisampling */
  int32_t shadows;         /* 0 or 1; with samples 0 and shadows 0 drawing is fastest */
  int32_t reflections;     /* 0 or 1 */
  int32_t reserved;        /* 0 */
  const char *camera_name; /* a camera of the model, instead of its index; NULL: none */
  /* The free camera: Gymnasium's default_camera_config. It does not move. */
  double lookat[3];   /* m; NaN: the median of the geoms' positions in the first state drawn */
  double distance;    /* m; NaN: the model's extent */
  double azimuth;     /* degrees; NaN: 90 */
  double elevation;   /* degrees; NaN: -45 */
  uint8_t visual[32]; /* visual_options: 0 or 1 for each mjenv_visual, the others unused */
} mjenv_render_settings;

/* ---- Library ---- */

/* MJENV_ABI_VERSION of the library that was loaded. */
MJENV_API uint32_t mjenv_abi_version(void);

/* "major.minor.patch (MuJoCo x.y.z)"; static. */
MJENV_API const char *mjenv_version(void);

/* The version as one number: 1000000 * major + 1000 * minor + patch. */
MJENV_API uint32_t mjenv_version_number(void);

/* The enumerator's name, "MJENV_E_VALUE" for instance; static; "unknown status" for any other number. */
MJENV_API const char *mjenv_status_name(mjenv_status status);

/* Why the last failing call on this thread failed; "" if none has. Valid until the next failing call on this thread. */
MJENV_API const char *mjenv_last_error(void);

/* ---- Ids ---- */

/* How many environment ids there are. */
MJENV_API int64_t mjenv_id_count(void);

/* The id at 0 <= index < mjenv_id_count(), sorted; static; NULL outside. */
MJENV_API const char *mjenv_id_at(int64_t index);

/* Fills spec for an id. Errors: ARGUMENT, NAME. */
MJENV_API mjenv_status mjenv_spec_of(const char *id, mjenv_spec *spec);

/* ---- Options ---- */

/* The options of an id at their defaults. The caller destroys them; mjenv_create copies them.
 * Errors: ARGUMENT, NAME, MEMORY. */
MJENV_API mjenv_status mjenv_options_create(const char *id, mjenv_options **options);

MJENV_API void mjenv_options_destroy(mjenv_options *options);

/* How many options the id has; 0 for NULL. */
MJENV_API int64_t mjenv_options_count(const mjenv_options *options);

/* Describes the option at an index; strings are borrowed from the options. Errors: ARGUMENT, VALUE (index). */
MJENV_API mjenv_status mjenv_options_at(const mjenv_options *options, int64_t index, mjenv_option *option);

/* Sets a flag or an integer. An integer given to a single real is stored as that real; an info or a reward that
 * Gymnasium would then return as an int is described so. Errors: ARGUMENT, NAME, TYPE, VALUE. */
MJENV_API mjenv_status mjenv_options_set_integer(mjenv_options *options, const char *name, int64_t value);

/* Sets all numbers of an option. Errors: ARGUMENT, NAME, TYPE, VALUE, SIZE. */
MJENV_API mjenv_status mjenv_options_set_reals(mjenv_options *options, const char *name, const double *values,
                                               size_t count);

/* Sets a text. Errors: ARGUMENT, NAME, TYPE, VALUE. */
MJENV_API mjenv_status mjenv_options_set_string(mjenv_options *options, const char *name, const char *value);

/* Reads a flag, an integer, or the index in a STRING_OR_INT. Errors: ARGUMENT, NAME, TYPE. */
MJENV_API mjenv_status mjenv_options_get_integer(const mjenv_options *options, const char *name, int64_t *value);

/* Reads the numbers of an option. count receives how many there are; values may be NULL when capacity is 0, to ask
 * for the count alone. Errors: ARGUMENT, NAME, TYPE, SIZE (0 < capacity < count). */
MJENV_API mjenv_status mjenv_options_get_reals(const mjenv_options *options, const char *name, double *values,
                                               size_t capacity, size_t *count);

/* Reads a text; borrowed until the option is set again. Errors: ARGUMENT, NAME, TYPE. */
MJENV_API mjenv_status mjenv_options_get_string(const mjenv_options *options, const char *name, const char **value);

/* ---- Environment ---- */

/* Builds an environment of rows >= 1 rows. Errors: ARGUMENT, NAME (in the option "arrays"), VALUE, MODEL, MEMORY, BUSY
 * (another thread sets the options). */
MJENV_API mjenv_status mjenv_create(const mjenv_options *options, int64_t rows, mjenv_env **env);

MJENV_API void mjenv_destroy(mjenv_env *env);

/* The number of rows; 0 for NULL. */
MJENV_API int64_t mjenv_rows(const mjenv_env *env);

/* How many mj_steps make a step; 0 for NULL. */
MJENV_API int64_t mjenv_frame_skip(const mjenv_env *env);

/* The options the environment was built with, borrowed from it; NULL for NULL. */
MJENV_API const mjenv_options *mjenv_options_of(const mjenv_env *env);

/* The space of MJENV_ROLE_OBSERVATION or MJENV_ROLE_ACTION, of one row. Errors: ARGUMENT. */
MJENV_API mjenv_status mjenv_space_of(const mjenv_env *env, mjenv_role role, mjenv_space *space);

/* How many fields a role has; 0 for NULL or an unknown role. */
MJENV_API int64_t mjenv_field_count(const mjenv_env *env, mjenv_role role);

/* Describes a field; strings are borrowed from the environment. Errors: ARGUMENT, VALUE (index). */
MJENV_API mjenv_status mjenv_field_at(const mjenv_env *env, mjenv_role role, int64_t index, mjenv_field *field);

/* Gives rows new random streams, each from its own seed: seeds[rows], read where mask[rows] is not 0 (a null mask: all
 * rows). A stream is NumPy's default_rng(seed). A row that is never seeded takes entropy from the system.
 * Errors: ARGUMENT, BUSY. */
MJENV_API mjenv_status mjenv_seed(mjenv_env *env, const uint64_t *seeds, const uint8_t *mask);

/* Seeds one row from an integer of any size: its 32-bit digits, least significant first, count >= 1.
 * Errors: ARGUMENT, VALUE (row), SIZE, BUSY. */
MJENV_API mjenv_status mjenv_seed_digits(mjenv_env *env, int64_t row, const uint32_t *digits, size_t count);

/* Begins a new episode in the rows that the mask names; each row goes on with its own random stream.
 * mask   [rows] 0 leaves the row alone; NULL: all rows
 * out    receives the outputs of those rows; NULL: none
 * Errors: ARGUMENT, SIZE, PHYSICS, BUSY. */
MJENV_API mjenv_status mjenv_reset(mjenv_env *env, const uint8_t *mask, const mjenv_batch *out);

/* Steps the rows that the mask names.
 * mask    [rows] 0 leaves the row, its element of action and its outputs alone; NULL: all rows
 * action  [rows][action count], count elements in all; their dtype takes part in the arithmetic as it does in NumPy
 * out     receives the outputs of those rows; NULL: none
 * Without the option "strict", non-finite actions and finished rows are stepped as Gymnasium steps them. With the
 * option "autoreset_mode", finished rows are reset as Gymnasium's vector environments do: in their next step, whose
 * action is ignored (next_step), or at once (same_step). When MuJoCo fails in a row, that row keeps its state and the
 * others are stepped. Errors: ARGUMENT, SIZE, STATE, VALUE (a non-finite action), PHYSICS, BUSY. */
MJENV_API mjenv_status mjenv_step(mjenv_env *env, const uint8_t *mask, const void *action, size_t count,
                                  mjenv_dtype dtype, const mjenv_batch *out);

/* Begins a step of some rows and returns without waiting for it.
 * rows    [row_count] the rows to step, each at most once; NULL: all rows
 * action  [row_count][action count], count elements in all; copied
 * The library keeps the outputs until mjenv_recv reports the row; the first call allocates room for the outputs of all
 * rows. While rows are under way, only mjenv_send of other rows, mjenv_recv and mjenv_destroy are allowed.
 * Errors: as mjenv_step; STATE for a row that is under way already. */
MJENV_API mjenv_status mjenv_send(mjenv_env *env, const int64_t *rows, size_t row_count, const void *action,
                                  size_t count, mjenv_dtype dtype);

/* Waits for rows that were sent, and reports all that are done. Each row is reported once.
 * least    return when at least so many rows are done; 0: do not wait. An environment with one thread steps one row in
 *          this call even so, as no other thread would
 * timeout  seconds after which the call returns with the rows that are done, even if they are less; negative: never
 * rows     [capacity] receives the numbers of the rows
 * count    receives how many there are
 * out      receives the outputs of those rows, each at the row's own place; NULL: none
 * Errors: ARGUMENT, SIZE (capacity < least, or least > rows under way), STATE (no rows are under way), VALUE (timeout
 * is NaN), PHYSICS (as in mjenv_step; the rows are reported), BUSY. */
MJENV_API mjenv_status mjenv_recv(mjenv_env *env, size_t least, double timeout, int64_t *rows, size_t capacity,
                                  size_t *count, const mjenv_batch *out);

/* Plays action[rows][steps][action count] open-loop from the rows' present states and leaves the rows at their ends.
 * out is laid out for rows * steps: out->rows is that product, element row * steps + t belongs to step t of the row.
 * A row that ends stays there: what follows in its flags repeats, its rewards and info are 0. No row is reset.
 * Errors: as mjenv_step. */
MJENV_API mjenv_status mjenv_rollout(mjenv_env *env, const void *action, size_t count, mjenv_dtype dtype, int64_t steps,
                                     const mjenv_batch *out);

/* A row's random stream as NumPy's PCG64 has it: state low and high, increment low and high, and with count = 6 also
 * has_uint32 and uinteger, which only integers that a registered task draws set; else count = 4. Errors: ARGUMENT,
 * VALUE (row), SIZE, STATE (never seeded), BUSY. */
MJENV_API mjenv_status mjenv_get_stream(mjenv_env *env, int64_t row, uint64_t *words, size_t count);

/* Replaces a row's random stream; the increment is odd; count as in mjenv_get_stream. Errors: ARGUMENT, VALUE (row, an
 * even increment), SIZE, BUSY.
 */
MJENV_API mjenv_status mjenv_set_stream(mjenv_env *env, int64_t row, const uint64_t *words, size_t count);

/* Seeds the stream of mjenv_sample_actions. Errors: ARGUMENT, BUSY. */
MJENV_API mjenv_status mjenv_seed_actions(mjenv_env *env, uint64_t seed);

/* Draws one action a row, as Gymnasium's action_space.sample() does after action_space.seed(): float32, row by row
 * from one stream, into action[count], count = rows * action count. Errors: ARGUMENT, SIZE, STATE (an unbounded
 * actuator), BUSY. */
MJENV_API mjenv_status mjenv_sample_actions(mjenv_env *env, float *action, size_t count);

/* ---- State of one row ---- */

/* Reads an array of the row's mjData or of the mjModel, by its MuJoCo name ("xpos", "body_mass", "nq", "opt.timestep"),
 * as Gymnasium's env.unwrapped.data holds it after the last step; MuJoCo's scratch (efc_* beyond nefc, efc_AR, qH) may
 * hold anything. count receives the length; values may be NULL when capacity is 0, to ask for the length alone.
 * Errors: ARGUMENT, NAME, VALUE (row), SIZE, PHYSICS, BUSY. */
MJENV_API mjenv_status mjenv_read(mjenv_env *env, int64_t row, const char *array, double *values, size_t capacity,
                                  size_t *count);

/* How many objects of a type the model has: type is "body", "joint", "geom", "site", "camera", "actuator", "tendon",
 * "sensor" or "light". Errors: ARGUMENT, NAME. */
MJENV_API mjenv_status mjenv_object_count(const mjenv_env *env, const char *type, int64_t *count);

/* The index of a named object. Errors: ARGUMENT, NAME. */
MJENV_API mjenv_status mjenv_object_index(const mjenv_env *env, const char *type, const char *name, int64_t *index);

/* The name of an object, "" if it has none; borrowed. Errors: ARGUMENT, NAME (type), VALUE (index). */
MJENV_API mjenv_status mjenv_object_name(const mjenv_env *env, const char *type, int64_t index, const char **name);

/* Sets qpos[nq] and qvel[nv] of a row and computes what follows from them, as Gymnasium's set_state does. The step
 * count goes on; a row that was never reset, or had ended, may be stepped again.
 * Errors: ARGUMENT, VALUE (row, a non-finite number), SIZE, PHYSICS, BUSY. */
MJENV_API mjenv_status mjenv_set_state(mjenv_env *env, int64_t row, const double *qpos, size_t nq, const double *qvel,
                                       size_t nv);

/* frames times mj_step of a row under ctrl[count], count = the number of actuators, as Gymnasium's do_simulation does:
 * no step is counted and the task sees only the new state.
 * Errors: ARGUMENT, VALUE (row, frames < 1), SIZE, PHYSICS, BUSY. */
MJENV_API mjenv_status mjenv_simulate(mjenv_env *env, int64_t row, const double *ctrl, size_t count, int64_t frames);

/* Writes the observations of all rows as they are, without stepping: out's obs and arrays alone. Errors: ARGUMENT,
 * SIZE, PHYSICS, BUSY. */
MJENV_API mjenv_status mjenv_observe(mjenv_env *env, const mjenv_batch *out);

/* Makes the rows where to_mask[rows] is not 0 equal to the row from: simulation, random stream, counters.
 * Errors: ARGUMENT, VALUE (row), BUSY. */
MJENV_API mjenv_status mjenv_copy_row(mjenv_env *env, int64_t from, const uint8_t *to_mask);

/* Copies a row, or all, into an image: simulation, random stream, counters. size_bytes receives its size; image may be
 * NULL when capacity_bytes is 0, to ask for the size alone. Errors: ARGUMENT, VALUE (row), SIZE, BUSY. */
MJENV_API mjenv_status mjenv_snapshot(mjenv_env *env, int64_t row, void *image, size_t capacity_bytes,
                                      size_t *size_bytes);

/* Continues a row, or all, from an image, bit for bit, also in another process and with another number of threads. The
 * environment must have the id, the model and the options ("num_threads", "cpu_affinity", "arrays" aside) of the one
 * the image was taken from, and as many rows if the image is of all. Errors: ARGUMENT, VALUE (row), SNAPSHOT, BUSY. */
MJENV_API mjenv_status mjenv_restore(mjenv_env *env, int64_t row, const void *image, size_t size_bytes);

/* ---- Pictures ----
 * A picture shows a row as Gymnasium's render() shows it after the last reset, step or set_state: pixel for pixel, with
 * the same OpenGL on the same machine. Drawing changes nothing in the simulation. OpenGL is loaded when the first
 * renderer is made. */

/* Fills settings with Gymnasium's defaults for the environment. Errors: ARGUMENT. */
MJENV_API mjenv_status mjenv_render_defaults(const mjenv_env *env, mjenv_render_settings *settings);

/* Builds a renderer with an OpenGL context of its own; null settings: the defaults. The caller destroys it, before or
 * after the environment. Renderers of one environment draw at the same time on different threads; a renderer draws on
 * any thread, on one at a time. What the calling thread has current in OpenGL stays so. A process that was forked after
 * OpenGL was used cannot use it. What MuJoCo makes of the model for OpenGL must fit into free memory (MEMORY) and,
 * unless the option "trust_xml" is 1, have at most 2^25 vertices (RENDER). Errors: ARGUMENT, NAME (camera_name), VALUE,
 * RENDER, MEMORY. */
MJENV_API mjenv_status mjenv_renderer_create(mjenv_env *env, const mjenv_render_settings *settings,
                                             mjenv_renderer **renderer);

MJENV_API void mjenv_renderer_destroy(mjenv_renderer *renderer);

/* The OpenGL in use: "egl, VENDOR, RENDERER, VERSION"; borrowed; NULL for NULL. */
MJENV_API const char *mjenv_renderer_gl(const mjenv_renderer *renderer);

/* Draws a row: colours into rgb[height][width][3], and the depth buffer, 0 (near) to 1 (far), into
 * depth[height][width], the top row first. Either may be NULL; the counts say how many elements there is room for. A
 * depth d is z = near / (1 - d * (1 - near / far)) metres along the optical axis, near and far being the model's
 * vis.map.znear and vis.map.zfar times stat.extent. A picture of a model that is not trusted may take 2^30 vertices
 * and pixels of shadow maps, each light that casts shadows drawing all twice (RENDER). Errors: ARGUMENT, VALUE (row),
 * SIZE, STATE (never reset, under way, or the environment is gone), RENDER, MEMORY, PHYSICS, BUSY (another thread is
 * inside the renderer or steps the environment). */
MJENV_API mjenv_status mjenv_render(mjenv_renderer *renderer, int64_t row, uint8_t *rgb, size_t rgb_count, float *depth,
                                    size_t depth_count);

/* ---- Window ----
 * What Gymnasium's render mode "human" shows: a window drawn in every reset and step, by calls of mjenv_window_draw. It
 * is for the main thread, and for a display with OpenGL (Debian: libglfw3). The mouse turns (left button), moves
 * (right) and zooms (wheel) the camera; the keys stand in the window: Tab, Space, right arrow, S, F, D, C, R, E, H, T
 * (which saves a PNG in the temporary folder), 0 to 4, and Escape, which closes it. */

/* Opens a window. Of the settings camera, camera_name, gl and samples mean nothing here: the camera is free, its NaNs
 * are lookat 0 and distance 2. Null settings: the defaults. The caller destroys it, before or after the environment.
 * Errors: ARGUMENT, VALUE, RENDER, MEMORY. */
MJENV_API mjenv_status mjenv_window_create(mjenv_env *env, const mjenv_render_settings *settings,
                                           mjenv_window **window);

MJENV_API void mjenv_window_destroy(mjenv_window *window);

/* 1 until the user closes the window; 0 for NULL. */
MJENV_API int32_t mjenv_window_is_open(const mjenv_window *window);

/* Draws a row and does what the user asks for with keys and mouse. Returns when the user does not pause: at once, or
 * after a key. Draws nothing once the window is closed. Errors: ARGUMENT, VALUE (row), STATE (as mjenv_render), RENDER,
 * MEMORY, PHYSICS, BUSY. */
MJENV_API mjenv_status mjenv_window_draw(mjenv_window *window, int64_t row);

#ifdef __cplusplus
}
#endif

#endif
