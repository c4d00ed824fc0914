/* mjenv.h - Gymnasium's MuJoCo environments behind a C interface.
 *
 * An environment (mjenv_env) holds one or many independent rows. A row is one episode of the robot's task: its
 * simulation state (200 bytes to 2 KB), its random stream and its step count. The threads that step rows own the
 * large MuJoCo work space, so rows are cheap. Results do not depend on the number of threads (option "num_threads").
 *
 *     mjenv_options *options;
 *     mjenv_env *env;
 *     mjenv_options_create("Ant-v5", &options);
 *     mjenv_create(options, 16, &env);           // 16 rows
 *     mjenv_seed(env, seeds, NULL);
 *     mjenv_reset(env, NULL, &batch);            // mjenv_batch names your arrays
 *     mjenv_step(env, NULL, action, 16 * 8, MJENV_DTYPE_FLOAT32, &batch);
 *     mjenv_destroy(env);
 *     mjenv_options_destroy(options);
 *
 * Numbers
 *   For a given seed and list of actions, every output equals Gymnasium 1.3.0's on MuJoCo 2.2.2, bit for bit. Calls
 *   compute in the default floating-point environment and leave the caller's as it was.
 * Arrays
 *   The caller owns all arrays that it passes. They are dense and row-major. Shapes are written [rows][count]. Sizes
 *   count elements, unless the parameter's name says bytes. The library keeps no pointer to them after a call.
 * Masks
 *   A mask is uint8_t[rows]. A function with a mask acts on the rows whose element is not 0, and neither changes the
 *   other rows nor writes their outputs. A NULL mask means all rows.
 * Errors
 *   A function that can fail returns MJENV_OK or a negative mjenv_status. The handle stays usable. mjenv_last_error
 *   and mjenv_error_of give the reason as text. The comments below list errors without their prefix MJENV_E_, and
 *   leave out those that any function may return:
 *     ARGUMENT  a required pointer is NULL, or a handle was destroyed
 *     BUSY      another thread is inside the same handle
 *     MEMORY    there is not enough memory
 *     INTERNAL  the library has a bug
 *   Functions that read or change rows also return PENDING while rows are under way between mjenv_send and mjenv_recv.
 *   Functions that need the environment's threads return FORKED in a forked child, which does not have them.
 * Ownership
 *   *_create gives the caller a handle, which the caller passes to *_destroy. *_destroy accepts NULL and cannot fail.
 *   It waits until calls that other threads made with the handle have returned; later calls return ARGUMENT. A
 *   `const char *` or `const double *` result belongs to the handle it came from and lives as long as that handle,
 *   unless its comment says otherwise. "Static" texts live as long as the library is loaded.
 * Threads
 *   Different handles can be used by different threads at the same time. If two threads call functions of one
 *   environment at the same time, the second call returns BUSY. Setting options while another thread uses them also
 *   returns BUSY. Functions that take a const mjenv_env * read only what never changes, and never return BUSY.
 * Compatibility
 *   The caller sets a struct's struct_size to its sizeof. Structs only ever grow at their end, so that programs run
 *   with later versions of the library. Clients must expect enumerators that they do not know. */
#ifndef MJENV_MJENV_H
#define MJENV_MJENV_H

#include <stddef.h>
#include <stdint.h>

#define MJENV_API __attribute__((visibility("default")))

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when compiled clients have to be rebuilt. */
#define MJENV_ABI_VERSION 1

/* As a row's number, means all rows (mjenv_snapshot, mjenv_restore). */
#define MJENV_ALL_ROWS (-1)

/* As a camera's number in mjenv_render_settings. */
#define MJENV_CAMERA_FREE (-1)    /* the camera that lookat, distance, azimuth and elevation describe */
#define MJENV_CAMERA_DEFAULT (-2) /* the model's camera "track" if it has one, else the free camera */

/* Handles */
typedef struct mjenv_options mjenv_options;   /* the constructor options of one environment id */
typedef struct mjenv_env mjenv_env;           /* an environment of one or many rows */
typedef struct mjenv_renderer mjenv_renderer; /* draws pictures of an environment's rows */
typedef struct mjenv_window mjenv_window;     /* shows an environment's rows on a display */

/* What a function returns. */
typedef int32_t mjenv_status;
enum mjenv_status_value {
  MJENV_OK = 0,
  MJENV_E_ARGUMENT = -1,      /* a required pointer is NULL, a handle is dead, an enum's value or a size is unknown */
  MJENV_E_NAME = -2,          /* no such id, option, array or object; the text lists the valid names */
  MJENV_E_TYPE = -3,          /* the option holds another kind of value */
  MJENV_E_VALUE = -4,         /* a value is out of its bounds, or not a finite number where one is needed */
  MJENV_E_SIZE = -5,          /* an array has another length than needed */
  MJENV_E_NOT_RESET = -6,     /* the row was never reset (or never seeded, where its random stream is asked for) */
  MJENV_E_EPISODE_ENDED = -7, /* the row's episode has ended; reset the row first */
  MJENV_E_PENDING = -8,       /* rows are under way; receive them with mjenv_recv first */
  MJENV_E_NOT_PENDING = -9,   /* mjenv_recv, and no rows are under way */
  MJENV_E_BUSY = -10,         /* another thread is inside the handle */
  MJENV_E_FORKED = -11,       /* this process was forked, and the environment's threads stayed in its parent */
  MJENV_E_FILE = -12,         /* the model file does not exist or cannot be read */
  MJENV_E_MODEL = -13,        /* the model is malformed, is refused, or lacks what the call needs */
  MJENV_E_PHYSICS = -14,      /* MuJoCo reported an error, or a row's state diverged */
  MJENV_E_SNAPSHOT = -15,     /* the image is damaged or belongs to another environment */
  MJENV_E_RENDER = -16,       /* OpenGL is missing or failed; the text names what to install */
  MJENV_E_MEMORY = -17,       /* there is not enough memory */
  MJENV_E_INTERNAL = -18,     /* the library has a bug; please report it */
  MJENV_E_TASK = -19          /* a callback of a registered task failed, or a plug-in holds no tasks (mjenv/task.h) */
};

/* The type of the elements of an array that the caller passes as void *. */
typedef int32_t mjenv_dtype;
enum mjenv_dtype_value { MJENV_DTYPE_FLOAT64 = 0, MJENV_DTYPE_FLOAT32 = 1 };

/* What a list of fields describes (mjenv_field_at). */
typedef int32_t mjenv_role;
enum mjenv_role_value {
  MJENV_ROLE_OBSERVATION = 1, /* the parts of an observation, in order */
  MJENV_ROLE_ACTION = 2,      /* the actuators */
  MJENV_ROLE_INFO = 3,        /* the info of a step */
  MJENV_ROLE_RESET_INFO = 4,  /* the info of a reset */
  MJENV_ROLE_REWARD = 5,      /* the reward, as one field */
  MJENV_ROLE_STRUCTURE = 6,   /* Gymnasium's observation_structure: names and counts; empty where Gymnasium has none */
  MJENV_ROLE_DATA = 7,        /* the arrays of a row's mjData that mjenv_read can read */
  MJENV_ROLE_MODEL = 8,       /* the sizes, options and arrays of the mjModel that mjenv_read can read */
  MJENV_ROLE_ARRAYS = 9       /* the mjData arrays that the option "arrays" adds to each mjenv_batch */
};

/* What an option holds. */
typedef int32_t mjenv_kind;
enum mjenv_kind_value {
  MJENV_KIND_FLAG = 1,         /* an integer, 0 or 1 */
  MJENV_KIND_INTEGER = 2,      /* an integer */
  MJENV_KIND_REALS = 3,        /* one or more doubles */
  MJENV_KIND_STRING = 4,       /* UTF-8 text */
  MJENV_KIND_STRING_OR_INT = 5 /* a name as text, or an index as integer */
};

/* The type that Gymnasium gives a value. The library passes all values as doubles, which hold each of them exactly. */
typedef int32_t mjenv_type;
enum mjenv_type_value {
  MJENV_TYPE_FLOAT64 = 1,      /* np.float64 */
  MJENV_TYPE_ACTION = 2,       /* np.float32 when the action is float32, else np.float64 */
  MJENV_TYPE_NATIVE_FLOAT = 3, /* the language's own number: Python's float */
  MJENV_TYPE_NATIVE_INT = 4,   /* the language's own integer: Python's int */
  MJENV_TYPE_INT64 = 5,        /* np.int64 */
  MJENV_TYPE_FLOAT32 = 6,      /* np.float32: some mjModel arrays */
  MJENV_TYPE_INT32 = 7,        /* np.int32: some mjModel and mjData arrays */
  MJENV_TYPE_UINT8 = 8         /* np.uint8: flags and pixels in mjModel */
};

/* Describes one constructor option. mjenv_options_at fills it. */
typedef struct mjenv_option {
  uint32_t struct_size;
  mjenv_kind kind;
  const char *name; /* Gymnasium's name */
  const char *doc;
  double low, high;    /* closed bounds of each number; infinite if there are none; meaningless for text */
  int64_t count;       /* how many numbers the option holds: 2 for a range */
  const char *choices; /* the valid texts, separated by blanks; NULL if every text may be tried */
} mjenv_option;

/* Describes one named part of an observation, an action or an info, or one readable array. mjenv_field_at fills it. */
typedef struct mjenv_field {
  uint32_t struct_size;
  int32_t ndim; /* how many dimensions; 0 for a scalar */
  const char *name;
  const char *doc;  /* the meaning, with its unit; "" where the name says it all */
  int64_t shape[4]; /* the first ndim elements are used */
  int64_t offset;   /* of the first element within the record of one row */
  int64_t count;    /* elements: the product of the shape, 1 for a scalar */
  mjenv_type type;
  int32_t reserved; /* 0 */
} mjenv_field;

/* Describes a Box space of one row. mjenv_space_of fills it. */
typedef struct mjenv_space {
  uint32_t struct_size;
  mjenv_dtype dtype;  /* as Gymnasium declares it: float64 for observations, float32 for actions */
  int64_t count;      /* elements */
  const double *low;  /* [count], owned by the environment */
  const double *high; /* [count], owned by the environment */
} mjenv_space;

/* Describes an id, before anything is built. mjenv_spec_of fills it; the texts are static. */
typedef struct mjenv_spec {
  uint32_t struct_size;
  int32_t version; /* 4 or 5 */
  const char *id;
  const char *robot;         /* the id without its version: "Ant" */
  int64_t max_episode_steps; /* the default of the option */
  double reward_threshold;   /* NaN where Gymnasium has none */
  /* Gymnasium's default_camera_config; NaN where Gymnasium leaves the value to MuJoCo. */
  double camera_distance;    /* m */
  double camera_elevation;   /* degrees */
  double camera_lookat[3];   /* m */
  double camera_trackbodyid; /* a whole number */
  const char *model_xml;     /* the MJCF text of the model; NULL where a registered task has it in a file */
} mjenv_spec;

/* Names the caller's arrays for the outputs of mjenv_reset, mjenv_step, mjenv_recv, mjenv_rollout and mjenv_observe.
 * One batch can serve all of them. Arrays that are NULL are not written. Row r writes element r of each array; field
 * f of an info is at offset f.offset * rows, as [rows][f.count]. mjenv_rollout writes rows * steps elements instead.
 * If a row fails (status), its other outputs mean nothing. */
typedef struct mjenv_batch {
  uint32_t struct_size;
  mjenv_dtype obs_dtype; /* of obs and final_obs: float64 as Gymnasium's, or float32, rounded to nearest */
  int64_t rows;          /* mjenv_rows; for mjenv_rollout, mjenv_rows * steps */
  /* Elements that one row has in the arrays. A count is only checked if its array is given. */
  int64_t obs_count;        /* the observation space's count */
  int64_t info_count;       /* the sum of the counts of MJENV_ROLE_INFO's fields */
  int64_t reset_info_count; /* the sum of the counts of MJENV_ROLE_RESET_INFO's fields */
  int64_t arrays_count;     /* the sum of the counts of MJENV_ROLE_ARRAYS's fields */
  /* Of the step. A reset writes 0 to reward, terminated, truncated and info. */
  void *obs;           /* [rows][obs_count] the observation; after a reset, the first one of the new episode */
  double *reward;      /* [rows] */
  uint8_t *terminated; /* [rows] 0 or 1 */
  uint8_t *truncated;  /* [rows] 0 or 1 */
  int32_t *status;     /* [rows] MJENV_OK; MJENV_E_PHYSICS if the row failed, or if its state diverged and MuJoCo
                          restarted it */
  double *info;        /* MJENV_ROLE_INFO's fields */
  /* Of a reset, by mjenv_reset or by the option "autoreset_mode". */
  uint8_t *was_reset; /* [rows] 1 if this call reset the row, else 0 */
  double *reset_info; /* MJENV_ROLE_RESET_INFO's fields; written only for rows that were reset */
  /* Of the episode that ended in this step; written only if "autoreset_mode" is same_step and the row was reset. */
  void *final_obs;    /* [rows][obs_count] its last observation */
  double *final_info; /* MJENV_ROLE_INFO's fields: the info of its last step; info is 0 then */
  double *arrays;     /* MJENV_ROLE_ARRAYS's fields */
} mjenv_batch;

/* What provides OpenGL. */
typedef int32_t mjenv_gl;
enum mjenv_gl_value {
  /* The one that the environment variable MUJOCO_GL names (egl, osmesa or glfw). If it is unset, the first of egl, glfw
     and osmesa that works. */
  MJENV_GL_AUTO = 0,
  /* Draws without a display. Debian: libegl1 libgl1-mesa-dri. MUJOCO_EGL_DEVICE_ID chooses a device. */
  MJENV_GL_EGL = 1,
  /* Draws without a display and without a graphics driver. Debian: libosmesa6. A process that uses it cannot use the
     others. */
  MJENV_GL_OSMESA = 2,
  /* Draws into an invisible window on a display. Debian: libglfw3. Only the main thread can create it. */
  MJENV_GL_GLFW = 3
};

/* What to make visible beside the geoms: MuJoCo's mjtVisFlag. An index of mjenv_render_settings.visual. */
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

/* How a renderer draws: Gymnasium's arguments of the same names. mjenv_render_defaults fills it. */
typedef struct mjenv_render_settings {
  uint32_t struct_size;
  mjenv_gl gl;
  int32_t width;           /* pixels; default 480 */
  int32_t height;          /* pixels; default 480 */
  int32_t camera;          /* the index of a camera of the model, MJENV_CAMERA_FREE or MJENV_CAMERA_DEFAULT (default) */
  int32_t max_geom;        /* the most geoms that are drawn; default 1000 */
  int32_t samples;         /* multisampling: samples per pixel, 0 to 64; default: the model's offsamples (4) */
  int32_t shadows;         /* 0 or 1; drawing is fastest with samples 0 and shadows 0 */
  int32_t reflections;     /* 0 or 1 */
  int32_t reserved;        /* 0 */
  const char *camera_name; /* a camera of the model, instead of its index; NULL: use the index */
  /* The free camera: Gymnasium's default_camera_config. It does not move. */
  double lookat[3];   /* m; NaN: the median of the geoms' positions in the first state drawn */
  double distance;    /* m; NaN: the model's extent */
  double azimuth;     /* degrees; NaN: 90 */
  double elevation;   /* degrees; NaN: -45 */
  uint8_t visual[32]; /* Gymnasium's visual_options: 0 or 1 for each mjenv_visual; the rest is unused */
} mjenv_render_settings;

/* ---- Library ---- */

/* Returns the MJENV_ABI_VERSION of the loaded library. A program that loads the library by itself compares it with its
 * own. */
MJENV_API uint32_t mjenv_abi_version(void);

/* Returns "major.minor.patch (MuJoCo x.y.z)"; static. */
MJENV_API const char *mjenv_version(void);

/* Returns the version as a number that grows: 1000000 * major + 1000 * minor + patch. */
MJENV_API uint32_t mjenv_version_number(void);

/* Returns the name of a status, such as "MJENV_E_VALUE"; "unknown status" for other numbers; static. */
MJENV_API const char *mjenv_status_name(mjenv_status status);

/* Returns the reason of the last call on this thread that failed; "" if none did. The next failing call on this thread
 * overwrites the text. Programs whose calls move between threads use mjenv_error_of instead. */
MJENV_API const char *mjenv_last_error(void);

/* Copies the reason of the last call with a handle that failed, on whichever thread that was.
 *   handle    an mjenv_options, mjenv_env, mjenv_renderer or mjenv_window. A *_create that fails leaves its reason
 *             with the handle that it was given: mjenv_create with options, mjenv_renderer_create and
 *             mjenv_window_create with env.
 *   text      [capacity] receives as much of the text as fits, always ended by a NUL; may be NULL if capacity is 0
 *   size      receives the bytes that the whole text needs, the NUL included; 1 if no call has failed
 * BUSY, and ARGUMENT for a dead handle, leave no reason with the handle. */
MJENV_API mjenv_status mjenv_error_of(const void *handle, char *text, size_t capacity, size_t *size);

/* ---- Ids ---- */

/* Returns the number of environment ids. */
MJENV_API int64_t mjenv_id_count(void);

/* Returns the id at 0 <= index < mjenv_id_count(), in sorted order; static. NULL for other indices. */
MJENV_API const char *mjenv_id_at(int64_t index);

/* Describes an id. Errors: NAME. */
MJENV_API mjenv_status mjenv_spec_of(const char *id, mjenv_spec *spec);

/* ---- Options ---- */

/* Creates the options of an id, set to their defaults. mjenv_create copies them, so they can be changed, used again or
 * destroyed after it. Errors: NAME. */
MJENV_API mjenv_status mjenv_options_create(const char *id, mjenv_options **options);

/* Copies options, also those of mjenv_options_of, so that the copy can be changed. */
MJENV_API mjenv_status mjenv_options_copy(const mjenv_options *options, mjenv_options **copy);

/* Destroys options. Does nothing for those of mjenv_options_of, which the environment destroys. */
MJENV_API void mjenv_options_destroy(mjenv_options *options);

/* Returns the number of options that the id has; 0 for NULL. */
MJENV_API int64_t mjenv_options_count(const mjenv_options *options);

/* Describes the option at 0 <= index < mjenv_options_count(). Errors: VALUE (index). */
MJENV_API mjenv_status mjenv_options_at(const mjenv_options *options, int64_t index, mjenv_option *option);

/* Sets a FLAG, an INTEGER, the index in a STRING_OR_INT, or a single real. A real that was set by an integer makes the
 * infos and rewards that are computed from it integers, as in Gymnasium (MJENV_TYPE_NATIVE_INT).
 * Errors: NAME, TYPE, VALUE. */
MJENV_API mjenv_status mjenv_options_set_integer(mjenv_options *options, const char *name, int64_t value);

/* Sets all numbers of a REALS option: values[count]. Errors: NAME, TYPE, VALUE, SIZE. */
MJENV_API mjenv_status mjenv_options_set_reals(mjenv_options *options, const char *name, const double *values,
                                               size_t count);

/* Sets a STRING, or the name in a STRING_OR_INT. The text is copied. Errors: NAME, TYPE, VALUE. */
MJENV_API mjenv_status mjenv_options_set_string(mjenv_options *options, const char *name, const char *value);

/* Reads a FLAG, an INTEGER, or the index in a STRING_OR_INT. Errors: NAME, TYPE. */
MJENV_API mjenv_status mjenv_options_get_integer(const mjenv_options *options, const char *name, int64_t *value);

/* Reads the numbers of a REALS option into values[capacity]. count receives how many there are. To ask for the count
 * alone, pass capacity 0 and values NULL. Errors: NAME, TYPE, SIZE (0 < capacity < count). */
MJENV_API mjenv_status mjenv_options_get_reals(const mjenv_options *options, const char *name, double *values,
                                               size_t capacity, size_t *count);

/* Reads a STRING, or the name in a STRING_OR_INT. The text belongs to the options and lives until the option is set
 * again. Errors: NAME, TYPE. */
MJENV_API mjenv_status mjenv_options_get_string(const mjenv_options *options, const char *name, const char **value);

/* ---- Environment ---- */

/* Builds an environment: reads the model, allocates rows >= 1 rows and starts the threads.
 * Errors: NAME (in the option "arrays"), VALUE, FILE, MODEL. */
MJENV_API mjenv_status mjenv_create(const mjenv_options *options, int64_t rows, mjenv_env **env);

/* Destroys an environment and its threads. Rows that are under way are dropped. */
MJENV_API void mjenv_destroy(mjenv_env *env);

/* Returns the number of rows; 0 for NULL. */
MJENV_API int64_t mjenv_rows(const mjenv_env *env);

/* Returns how many times a step calls mj_step; 0 for NULL. */
MJENV_API int64_t mjenv_frame_skip(const mjenv_env *env);

/* Returns the options that the environment was built with; NULL for NULL. They belong to the environment and cannot be
 * changed. */
MJENV_API const mjenv_options *mjenv_options_of(const mjenv_env *env);

/* Describes the space of MJENV_ROLE_OBSERVATION or MJENV_ROLE_ACTION. */
MJENV_API mjenv_status mjenv_space_of(const mjenv_env *env, mjenv_role role, mjenv_space *space);

/* Returns the number of fields of a role; 0 for NULL and for unknown roles. */
MJENV_API int64_t mjenv_field_count(const mjenv_env *env, mjenv_role role);

/* Describes the field at 0 <= index < mjenv_field_count(). Errors: VALUE (index). */
MJENV_API mjenv_status mjenv_field_at(const mjenv_env *env, mjenv_role role, int64_t index, mjenv_field *field);

/* ---- Random streams ---- */

/* Gives rows new random streams, each NumPy's default_rng of its own seed. A row that is never seeded takes entropy
 * from the system at its first reset.
 *   seeds     [rows]; read where the mask is not 0 */
MJENV_API mjenv_status mjenv_seed(mjenv_env *env, const uint64_t *seeds, const uint8_t *mask);

/* Seeds one row from an integer of any size.
 *   digits    [count] its 32-bit digits, the least significant first; count >= 1
 * Errors: VALUE (row), SIZE. */
MJENV_API mjenv_status mjenv_seed_digits(mjenv_env *env, int64_t row, const uint32_t *digits, size_t count);

/* Reads a row's random stream as NumPy's PCG64 has it.
 *   words     [count], count = 4: state low and high, increment low and high. count = 6: also has_uint32 and uinteger,
 *             which differ from 0 only after a registered task has drawn 32-bit integers
 * Errors: VALUE (row), SIZE, NOT_RESET (the row was neither seeded nor reset). */
MJENV_API mjenv_status mjenv_get_stream(mjenv_env *env, int64_t row, uint64_t *words, size_t count);

/* Replaces a row's random stream by words[count] of mjenv_get_stream. Errors: VALUE (row, an even increment), SIZE. */
MJENV_API mjenv_status mjenv_set_stream(mjenv_env *env, int64_t row, const uint64_t *words, size_t count);

/* Seeds the stream of mjenv_sample_actions, as action_space.seed() does. */
MJENV_API mjenv_status mjenv_seed_actions(mjenv_env *env, uint64_t seed);

/* Draws one action for each row, as action_space.sample() does, row by row from one stream.
 *   action    [rows][actuators]; count = rows * actuators
 * Errors: SIZE, MODEL (an actuator has no bounds). */
MJENV_API mjenv_status mjenv_sample_actions(mjenv_env *env, float *action, size_t count);

/* ---- Episodes ---- */

/* Begins new episodes. Each row goes on with its random stream.
 *   out       receives the outputs; may be NULL
 * Errors: SIZE, PHYSICS, FORKED. */
MJENV_API mjenv_status mjenv_reset(mjenv_env *env, const uint8_t *mask, const mjenv_batch *out);

/* Steps rows.
 *   action    [rows][actuators], elements of dtype; count = rows * actuators. Rows outside the mask have their place,
 *             too, but it is not read. The dtype matters: arithmetic with the action is float32 or float64, as in
 *             NumPy.
 *   out       receives the outputs; may be NULL
 * If the option "strict" is 0, non-finite actions and finished rows are stepped as Gymnasium steps them. With the
 * option "autoreset_mode" finished rows are reset as Gymnasium's vector environments do: in their next step, whose
 * action is ignored (next_step), or at the end of the same step (same_step). If MuJoCo fails in a row, that row keeps
 * its state, and the other rows are stepped.
 * Errors: SIZE, VALUE (non-finite action), NOT_RESET, EPISODE_ENDED, PHYSICS, FORKED. */
MJENV_API mjenv_status mjenv_step(mjenv_env *env, const uint8_t *mask, const void *action, size_t count,
                                  mjenv_dtype dtype, const mjenv_batch *out);

/* Starts a step of some rows and returns without waiting for it. Until all rows are received, only mjenv_send of other
 * rows, mjenv_recv and mjenv_destroy may be called. With num_threads 1, mjenv_recv does the work.
 *   rows      [row_count] the rows to step; NULL: all rows, and row_count is ignored
 *   action    [row_count][actuators], elements of dtype; count = row_count * actuators; copied
 * Errors: as mjenv_step; PENDING (a row is under way already), VALUE (no such row). */
MJENV_API mjenv_status mjenv_send(mjenv_env *env, const int64_t *rows, size_t row_count, const void *action,
                                  size_t count, mjenv_dtype dtype);

/* Waits for rows that were sent, and reports those that are done. Each is reported once.
 *   least     waits until this many rows are done; 0: does not wait
 *   timeout   the most seconds to wait; a negative number: no limit. When the time has passed, the call succeeds with
 *             the rows that are done, which may be fewer than `least`
 *   rows      [capacity] receives the numbers of the rows; capacity >= least, and >= 1
 *   count     receives how many rows are reported
 *   out       receives the outputs of the reported rows at their own places, and is laid out as for mjenv_step; may be
 *             NULL
 * With num_threads 1, a call with least 0 or a timeout of 0 steps one row, so that polling makes progress.
 * Errors: SIZE (capacity, or least > rows under way), VALUE (timeout is NaN), NOT_PENDING, PHYSICS (as mjenv_step; the
 * rows are reported), FORKED. */
MJENV_API mjenv_status mjenv_recv(mjenv_env *env, size_t least, double timeout, int64_t *rows, size_t capacity,
                                  size_t *count, const mjenv_batch *out);

/* Plays given actions from the rows' present states, and leaves the rows at the end. Rows are never reset. If a row's
 * episode ends, the row stays there: its flags repeat, and its rewards and infos are 0.
 *   action    [rows][steps][actuators], elements of dtype; count = rows * steps * actuators
 *   steps     >= 1
 *   out       is laid out for rows * steps rows: step t of row r is element r * steps + t. May be NULL
 * Errors: as mjenv_step; VALUE (steps). */
MJENV_API mjenv_status mjenv_rollout(mjenv_env *env, const void *action, size_t count, mjenv_dtype dtype, int64_t steps,
                                     const mjenv_batch *out);

/* Writes obs and arrays of all rows as they are, without a step: after mjenv_restore or mjenv_copy_row, for instance.
 * Errors: SIZE, PHYSICS, FORKED. */
MJENV_API mjenv_status mjenv_observe(mjenv_env *env, const mjenv_batch *out);

/* ---- State of one row ---- */

/* Reads an array of a row's mjData or of the mjModel into values[capacity], as doubles. mjData is as Gymnasium's
 * env.unwrapped.data after the last step; MuJoCo's scratch (efc_* beyond nefc, efc_AR, qH) may hold anything.
 *   array     its MuJoCo name: "xpos", "body_mass", "nq", "opt.timestep"
 *   count     receives the length. To ask for the length alone, pass capacity 0 and values NULL
 * Errors: NAME, VALUE (row), SIZE (0 < capacity < count), PHYSICS. */
MJENV_API mjenv_status mjenv_read(mjenv_env *env, int64_t row, const char *array, double *values, size_t capacity,
                                  size_t *count);

/* Counts the model's objects of a type: "body", "joint", "geom", "site", "camera", "actuator", "tendon", "sensor" or
 * "light". Errors: NAME (type). */
MJENV_API mjenv_status mjenv_object_count(const mjenv_env *env, const char *type, int64_t *count);

/* Finds the index of the object of that type and name. Errors: NAME. */
MJENV_API mjenv_status mjenv_object_index(const mjenv_env *env, const char *type, const char *name, int64_t *index);

/* Finds the name of an object; "" if it has none. Errors: NAME (type), VALUE (index). */
MJENV_API mjenv_status mjenv_object_name(const mjenv_env *env, const char *type, int64_t index, const char **name);

/* Sets qpos[nq] and qvel[nv] of a row and computes what follows from them, as Gymnasium's set_state does. The row's
 * step count stays. A row that was never reset, or whose episode has ended, can be stepped after it.
 * Errors: VALUE (row, a number that is not finite), SIZE, PHYSICS. */
MJENV_API mjenv_status mjenv_set_state(mjenv_env *env, int64_t row, const double *qpos, size_t nq, const double *qvel,
                                       size_t nv);

/* Calls mj_step `frames` times for a row with the controls ctrl[count], as Gymnasium's do_simulation does; count is
 * the number of actuators. The row's step count stays, and the task computes nothing.
 * Errors: VALUE (row, frames < 1), SIZE, PHYSICS. */
MJENV_API mjenv_status mjenv_simulate(mjenv_env *env, int64_t row, const double *ctrl, size_t count, int64_t frames);

/* Copies a row over others: simulation state, random stream and step count.
 *   to_mask   [rows] the rows to overwrite, where it is not 0; not NULL
 * Errors: VALUE (row). */
MJENV_API mjenv_status mjenv_copy_row(mjenv_env *env, int64_t from, const uint8_t *to_mask);

/* Writes a row, or MJENV_ALL_ROWS, as an image: simulation state, random stream and step count.
 *   image       [capacity_bytes] receives the image
 *   size_bytes  receives its size. To ask for the size alone, pass capacity_bytes 0 and image NULL
 * Errors: VALUE (row), SIZE (0 < capacity_bytes < size_bytes). */
MJENV_API mjenv_status mjenv_snapshot(mjenv_env *env, int64_t row, void *image, size_t capacity_bytes,
                                      size_t *size_bytes);

/* Sets a row, or MJENV_ALL_ROWS, to the state of an image[size_bytes]. The row continues bit for bit, also in another
 * process and with another number of threads. The environment must have the id, the model and the options of the one
 * that wrote the image; "num_threads", "cpu_affinity" and "arrays" may differ. An image of all rows needs as many
 * rows.
 * Errors: VALUE (row), SNAPSHOT. */
MJENV_API mjenv_status mjenv_restore(mjenv_env *env, int64_t row, const void *image, size_t size_bytes);

/* ---- Pictures ----
 * A picture shows a row as Gymnasium's render() shows it after the last reset, step or set_state: pixel for pixel,
 * with the same OpenGL on the same machine. Drawing does not change the simulation. The library loads OpenGL when the
 * first renderer is created. */

/* Fills settings with Gymnasium's defaults for the environment. */
MJENV_API mjenv_status mjenv_render_defaults(const mjenv_env *env, mjenv_render_settings *settings);

/* Creates a renderer, which has an OpenGL context of its own. Renderers of one environment can draw at the same time
 * on different threads. A renderer can be used on any thread, by one thread at a time. Calls leave the calling
 * thread's current OpenGL context as it was. The renderer may be destroyed before or after the environment.
 *   settings  NULL: the defaults
 * A process that is forked after it used OpenGL cannot use it (RENDER). What MuJoCo makes of the model for OpenGL
 * must fit into free memory (MEMORY). Unless the option "trust_xml" is 1, it must have at most 2^25 vertices (RENDER).
 * Errors: NAME (camera_name), VALUE, RENDER. */
MJENV_API mjenv_status mjenv_renderer_create(mjenv_env *env, const mjenv_render_settings *settings,
                                             mjenv_renderer **renderer);

MJENV_API void mjenv_renderer_destroy(mjenv_renderer *renderer);

/* Returns the OpenGL that the renderer uses, as "egl, VENDOR, RENDERER, VERSION"; NULL for NULL. */
MJENV_API const char *mjenv_renderer_gl(const mjenv_renderer *renderer);

/* Draws a row. The top line of the picture comes first.
 *   rgb       [height][width][3] receives the colours; rgb_count elements have room; may be NULL
 *   depth     [height][width] receives the depth buffer, from 0 (near) to 1 (far); depth_count elements have room;
 *             may be NULL. A depth d is z = near / (1 - d * (1 - near / far)) metres along the optical axis, where
 *             near and far are the model's vis.map.znear and vis.map.zfar times stat.extent
 * Unless the option "trust_xml" is 1, a picture may take at most 2^30 vertices and pixels of shadow maps; each light
 * that casts shadows draws everything twice.
 * Errors: ARGUMENT (the environment was destroyed), VALUE (row), SIZE, NOT_RESET, RENDER, PHYSICS; BUSY also while
 * another thread is inside the environment. */
MJENV_API mjenv_status mjenv_render(mjenv_renderer *renderer, int64_t row, uint8_t *rgb, size_t rgb_count, float *depth,
                                    size_t depth_count);

/* ---- Window ----
 * A window shows what Gymnasium's render mode "human" shows. The program calls mjenv_window_draw after every reset and
 * step. Windows work on the main thread only and need a display with OpenGL (Debian: libglfw3). The mouse turns (left
 * button), moves (right button) and zooms (wheel) the camera. The window lists its keys: Tab, Space, right arrow, S,
 * F, D, C, R, E, H, T (saves a PNG in the temporary folder), 0 to 4, and Escape, which closes it. */

/* Opens a window. It may be destroyed before or after the environment.
 *   settings  NULL: the defaults. camera, camera_name, gl and samples are ignored. The camera is free; NaN means 0 in
 *             lookat and 2 in distance
 * Errors: VALUE, RENDER. */
MJENV_API mjenv_status mjenv_window_create(mjenv_env *env, const mjenv_render_settings *settings,
                                           mjenv_window **window);

MJENV_API void mjenv_window_destroy(mjenv_window *window);

/* Returns 1 until the user closes the window; 0 for NULL. */
MJENV_API int32_t mjenv_window_is_open(const mjenv_window *window);

/* Draws a row, and handles the user's keys and mouse. While the user pauses, it does not return. Draws nothing once
 * the window is closed. Errors: as mjenv_render. */
MJENV_API mjenv_status mjenv_window_draw(mjenv_window *window, int64_t row);

#ifdef __cplusplus
}
#endif

#endif
