/* mjenv.h - Gymnasium's MuJoCo environments behind a C interface.
 *
 * An environment (mjenv_env) holds one or many independent rows. A row is one copy of the robot, like one of the
 * environments in a Gymnasium vector environment: a simulation state, a random stream and a step count.
 *
 *     static double obs[16][105], reward[16];
 *     static float action[16][8];
 *     static const uint64_t seeds[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
 *     mjenv_batch out = MJENV_BATCH_INIT;
 *     out.rows = 16;
 *     out.obs_count = 105;
 *     out.obs = obs;
 *     out.reward = reward;
 *     mjenv_options *options;
 *     mjenv_env *env;
 *     mjenv_options_create("Ant-v5", &options);
 *     mjenv_create(options, 16, &env);           // 16 rows
 *     mjenv_seed(env, NULL, seeds, 16);
 *     mjenv_reset(env, NULL, &out);              // writes obs
 *     mjenv_step(env, NULL, action, 16 * 8, MJENV_DTYPE_FLOAT32, &out);
 *     mjenv_destroy(env);
 *     mjenv_options_destroy(options);
 *
 * For a given seed and list of actions, every output equals Gymnasium 1.4.0's on the same MuJoCo, bit for bit. There
 * is a build for MuJoCo 2.2.2 and one for 4.0 (mjenv_version); "(4.0: ...)" marks what differs in the latter. docs/c.md
 * describes the functions in detail. docs/abi.md has the rules for threads, forks, ownership and later versions.
 *
 * Arrays
 *   The caller owns all arrays that it passes, and the library keeps no pointer to them (except mjenv_mirror). Arrays
 *   are contiguous and row-major; shapes are written [rows][count]. Counts are of elements, unless the name ends in _bytes.
 * Masks
 *   A mask is uint8_t[rows]: the function acts on the rows whose element is not 0, and leaves the other rows and their
 *   outputs as they are. NULL selects all rows.
 * Errors
 *   A function that can fail returns MJENV_OK or a negative mjenv_status, and the handle stays usable. mjenv_last_error
 *   returns the reason. A call that fails changes nothing. But if single rows fail, the others are still computed, and
 *   mjenv_batch.status tells which rows have failed. Below, each function lists its own errors, without
 *   MJENV_E_. Any function may also return ARGUMENT, BUSY, MEMORY, INTERNAL, SIZE (a negative count), and PENDING and
 *   FORKED where it reads or changes rows.
 * Handles
 *   The caller must destroy each handle that it creates; *_destroy does nothing for NULL. Texts and bounds that a
 *   function returns live as long as their handle; those without a handle live as long as the library is loaded. Only
 *   one thread at a time may use a handle (BUSY); but functions that take a const handle, and mjenv_renderer_create,
 *   mjenv_window_create and mjenv_error_of, can be called at any time. Exception: a call that sets an option excludes
 *   all other calls with the same options (BUSY).
 */
#ifndef MJENV_MJENV_H
#define MJENV_MJENV_H

#include <stddef.h>
#include <stdint.h>

/* MJENV_API marks the library's functions, MJENV_EXPORT what the library looks up in a plug-in, and MJENV_HIDDEN
 * what mjenv/task.hpp defines anew in each program or shared object. */
#if !defined(_WIN32)
#define MJENV_API __attribute__((visibility("default")))
#define MJENV_EXPORT __attribute__((visibility("default"), used))
#define MJENV_HIDDEN __attribute__((visibility("hidden")))
#elif defined(MJENV_BUILDING)
#define MJENV_API __declspec(dllexport)
#define MJENV_EXPORT __declspec(dllexport)
#define MJENV_HIDDEN
#else
#define MJENV_API __declspec(dllimport)
#define MJENV_EXPORT __declspec(dllexport)
#define MJENV_HIDDEN
#endif

/* Not a number, without math.h. */
#if defined(__GNUC__)
#define MJENV_NAN __builtin_nan("")
#else
#define MJENV_NAN (-(1e300 * 1e300 * 0.0))
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* This number changes when compiled clients have to be built again. */
#define MJENV_ABI_VERSION 1

/* In mjenv_snapshot and mjenv_restore: all rows, in place of a row's number. */
#define MJENV_ALL_ROWS (-1)

/* The value of mjenv_render_settings.camera for the free camera, which does not follow the robot: lookat, distance,
 * azimuth and elevation describe it. */
#define MJENV_CAMERA_FREE (-1)

/* A value of camera_trackbodyid: Gymnasium sets no body for the camera to follow, so MuJoCo's default applies. */
#define MJENV_BODY_UNSET (-2)

/* Handles */
typedef struct mjenv_options mjenv_options;   /* the constructor options of one environment id */
typedef struct mjenv_env mjenv_env;           /* an environment of one or many rows */
typedef struct mjenv_renderer mjenv_renderer; /* draws pictures of an environment's rows */
typedef struct mjenv_window mjenv_window;     /* shows an environment's rows on a display */

/* What a function returns. */
typedef int32_t mjenv_status;
enum mjenv_status_value {
  MJENV_OK = 0,
  MJENV_DIVERGED = 1,         /* only in mjenv_batch.status: the row's state diverged */
  MJENV_E_ARGUMENT = -1,      /* a required pointer is NULL, a handle was destroyed, an enum's value is unknown, a
                                 struct_size is wrong, or the options belong to an environment */
  MJENV_E_NAME = -2,          /* no such id, option, array or object; the text lists the valid names */
  MJENV_E_TYPE = -3,          /* the option holds another kind of value */
  MJENV_E_VALUE = -4,         /* a value is out of its bounds, or not a finite number where one is needed */
  MJENV_E_SIZE = -5,          /* an array is too short, or has another length than needed */
  MJENV_E_NOT_RESET = -6,     /* the row was never reset; from mjenv_get_stream: it was neither reset nor seeded */
  MJENV_E_EPISODE_ENDED = -7, /* the row's episode has ended; reset the row first */
  MJENV_E_PENDING = -8,       /* rows are under way; receive them with mjenv_recv first */
  MJENV_E_NOT_PENDING = -9,   /* mjenv_recv was called while no rows are under way */
  MJENV_E_BUSY = -10,         /* another thread is inside a call with the same handle */
  MJENV_E_FORKED = -11,       /* this process is a forked child, and the environment's threads are in its parent */
  MJENV_E_FILE = -12,         /* the model file does not exist or cannot be read (4.0: or MuJoCo's library is missing,
                                 broken or of another version) */
  MJENV_E_MODEL = -13,        /* the model is malformed or refused, or lacks something that is needed */
  MJENV_E_PHYSICS = -14,      /* MuJoCo reported an error */
  MJENV_E_SNAPSHOT = -15,     /* the image is damaged, or is from another kind of environment */
  MJENV_E_RENDER = -16,       /* OpenGL is missing or failed; the text names what to install */
  MJENV_E_MEMORY = -17,       /* there is not enough memory */
  MJENV_E_INTERNAL = -18,     /* the library has a bug; please report it */
  MJENV_E_TASK = -19          /* a callback of a registered task failed, or a plug-in cannot be loaded (mjenv/task.h) */
};

/* What mjenv_draw draws. */
typedef int32_t mjenv_distribution;
enum mjenv_distribution_value {
  MJENV_DISTRIBUTION_UNIFORM = 0, /* uniform(low, high); 0 and 1: random() */
  MJENV_DISTRIBUTION_NORMAL = 1,  /* standard_normal() */
  MJENV_DISTRIBUTION_INTEGERS = 2 /* integers(low, high) */
};

/* The types of numbers. Arrays that are passed as void * are FLOAT64 or FLOAT32. The dtype of a field is the one that
 * Gymnasium returns; the library returns fields as doubles, which represent their values exactly, but observations as
 * floats if obs_dtype is FLOAT32. */
typedef int32_t mjenv_dtype;
enum mjenv_dtype_value {
  MJENV_DTYPE_FLOAT64 = 1,
  MJENV_DTYPE_FLOAT32 = 2,
  MJENV_DTYPE_INT64 = 3,
  MJENV_DTYPE_INT32 = 4,
  MJENV_DTYPE_UINT8 = 5,        /* flags, pixels and characters */
  MJENV_DTYPE_ACTION = 6,       /* float32 when the action is float32, else float64 */
  MJENV_DTYPE_NATIVE_FLOAT = 7, /* the language's own number: Python's float */
  MJENV_DTYPE_NATIVE_INT = 8    /* the language's own integer: Python's int */
};

/* What a list of fields describes (mjenv_field_at). */
typedef int32_t mjenv_role;
enum mjenv_role_value {
  MJENV_ROLE_OBSERVATION = 1, /* the parts of an observation, in order */
  MJENV_ROLE_ACTION = 2,      /* the numbers of an action: one for each actuator, or those of mjenv_build_action */
  MJENV_ROLE_INFO = 3,        /* the info of a step */
  MJENV_ROLE_RESET_INFO = 4,  /* the info of a reset */
  MJENV_ROLE_REWARD = 5,      /* the reward, as one field */
  MJENV_ROLE_STRUCTURE = 6,   /* Gymnasium's observation_structure: names and counts; empty where Gymnasium has none */
  MJENV_ROLE_DATA = 7,        /* the arrays of a row's mjData that mjenv_read can read */
  MJENV_ROLE_MODEL = 8,       /* the sizes, options and arrays of the mjModel that mjenv_read can read */
  MJENV_ROLE_ARRAYS = 9,      /* the mjData arrays that the option "arrays" names, for mjenv_batch.arrays */
  MJENV_ROLE_PARAMETERS = 10, /* the live parameters of a task, which mjenv_read and mjenv_write know by these names */
  MJENV_ROLE_GROUPS = 11 /* the keys of an observation that is a Gymnasium Dict (the option "observation"): its groups,
                                 and its terms without a group. If there are no fields, the observation is a Box */
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

/* Describes one constructor option. mjenv_options_at fills it. */
typedef struct mjenv_option {
  uint32_t struct_size;
  mjenv_kind kind;
  const char *name;    /* Gymnasium's name, where Gymnasium has the option */
  const char *doc;     /* the meaning, in one line */
  double low, high;    /* closed bounds of each number; infinite if there are none; unused for STRING */
  int64_t count;       /* how many numbers REALS hold (2 for a range); 1 for the other kinds */
  const char *choices; /* the valid texts, separated by blanks; NULL if there is no such list */
} mjenv_option;

/* Describes one named part of an observation, an action or an info, or one readable array. mjenv_field_at fills it. */
typedef struct mjenv_field {
  uint32_t struct_size;
  int32_t ndim; /* how many dimensions; 0 for a scalar */
  const char *name;
  const char *doc;  /* the meaning, with its unit; "" if there is none */
  int64_t shape[4]; /* the first ndim elements are used */
  int64_t offset;   /* the sum of the counts of the role's earlier fields; 0 for MJENV_ROLE_DATA and MJENV_ROLE_MODEL */
  int64_t count;    /* the number of elements: the product of the shape, 1 for a scalar */
  mjenv_dtype dtype;
  int32_t reserved; /* 0 */
} mjenv_field;

/* Describes the observation space or the action space of one row: a Gymnasium Box. mjenv_space_of fills it. */
typedef struct mjenv_space {
  uint32_t struct_size;
  mjenv_dtype dtype;  /* as Gymnasium declares it: float64 for observations, float32 for actions */
  int64_t count;      /* the number of elements */
  const double *low;  /* [count], owned by the environment */
  const double *high; /* [count], owned by the environment */
  int32_t ndim;       /* how many dimensions: 2 if the option "history" stacks whole observations of a Box, else 1 */
  int32_t reserved;   /* 0 */
  int64_t shape[4];   /* the first ndim elements are used; their product is count */
} mjenv_space;

/* Describes an environment. mjenv_info_of fills it. */
typedef struct mjenv_info {
  uint32_t struct_size;
  int32_t threads; /* how many threads step rows */
  int64_t rows;
  int64_t frame_skip;       /* how many times one step calls mj_step */
  int64_t lanes;            /* how many rows each thread steps together; 0: one by one. The results are the same */
  const char *lanes_reason; /* why lanes is 0; "" if it is not. The text belongs to the environment */
} mjenv_info;

/* Describes an id, without building its environment. mjenv_spec_of fills it. The texts are static. */
typedef struct mjenv_spec {
  uint32_t struct_size;
  int32_t version; /* the number in the id: 4 or 5 for built-in robots */
  const char *id;
  const char *robot;         /* the id without its version: "Ant" */
  int64_t max_episode_steps; /* the default of the option of this name */
  double reward_threshold;   /* NaN where Gymnasium has none */
  /* Gymnasium's default_camera_config; NaN where Gymnasium leaves the value to MuJoCo. */
  double camera_distance;     /* m */
  double camera_elevation;    /* degrees */
  double camera_lookat[3];    /* m */
  int32_t camera_trackbodyid; /* the index of a body, -1 for none, or MJENV_BODY_UNSET */
  int32_t revision;           /* of the task (mjenv_task.revision); 0 for built-in robots */
  const char *model_xml;      /* the default model in MJCF; NULL for "Model-v0" and tasks that have it in a file */
} mjenv_spec;

/* The caller's arrays for outputs; those that are NULL are not written. Row r's outputs are element r of each array.
 * info, final_info, reset_info and arrays have a block for each field of their role: that of field f begins at
 * f.offset * rows and is [rows][f.count]. In a rollout, [rows] is rows * steps. */
typedef struct mjenv_batch {
  uint32_t struct_size;
  mjenv_dtype obs_dtype; /* of obs and final_obs: float64 as in Gymnasium, or float32, rounded to nearest */
  int64_t rows;          /* those of the environment; for mjenv_rollout, rows * steps */
  /* How many elements one row has. The counts and obs_dtype are checked only for arrays that are not NULL. */
  int64_t obs_count;        /* of obs and final_obs: the observation space's count */
  int64_t info_count;       /* of info and final_info: the sum of the counts of MJENV_ROLE_INFO's fields */
  int64_t reset_info_count; /* of reset_info: the sum of the counts of MJENV_ROLE_RESET_INFO's fields */
  int64_t arrays_count;     /* of arrays: the sum of the counts of MJENV_ROLE_ARRAYS's fields */
  /* The step. If a reset takes the place of the step, reward, terminated, truncated and info are 0. */
  void *obs;           /* [rows][obs_count] the observation; if the row was reset, the first one of the new episode */
  double *reward;      /* [rows] */
  uint8_t *terminated; /* [rows] 0 or 1 */
  uint8_t *truncated;  /* [rows] 0 or 1 */
  int32_t *status;     /* [rows] MJENV_OK; why the row failed; or MJENV_DIVERGED: MuJoCo found bad numbers and reset the
                          row's simulation (4.0: unless the model disables that). The other outputs are then valid */
  double *info;        /* MJENV_ROLE_INFO's fields */
  /* The reset, by mjenv_reset or by the option "autoreset_mode". */
  uint8_t *was_reset; /* [rows] 1 if this call reset the row, else 0 */
  double *reset_info; /* MJENV_ROLE_RESET_INFO's fields; written only for rows that were reset */
  /* The end of the old episode; written only if "autoreset_mode" is same_step and the step reset the row. */
  void *final_obs;    /* [rows][obs_count] its last observation */
  double *final_info; /* MJENV_ROLE_INFO's fields of its last step; info must be given, too */
  /* The option "arrays". */
  double *arrays; /* MJENV_ROLE_ARRAYS's fields */
} mjenv_batch;

/* The library that provides OpenGL. */
typedef int32_t mjenv_gl;
enum mjenv_gl_value {
  MJENV_GL_AUTO = 0,   /* what the variable MUJOCO_GL names; else wgl on Windows, elsewhere egl, glfw or osmesa */
  MJENV_GL_EGL = 1,    /* without a display; MUJOCO_EGL_DEVICE_ID chooses a device. Debian: libegl1 libgl1-mesa-dri */
  MJENV_GL_OSMESA = 2, /* without a display or driver; a process that uses it can use no other. Debian: libosmesa6 */
  MJENV_GL_GLFW = 3,   /* on a display, and the main thread. Debian: libglfw3 */
  MJENV_GL_WGL = 4     /* the display's driver, in an invisible window; on Windows only */
};

/* What is drawn: MuJoCo 2.2.2's mjtVisFlag, also in the build for 4.0; indices into mjenv_render_settings.visual. */
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

/* Which objects have labels: MuJoCo 2.2.2's mjtLabel, also in the build for 4.0. */
typedef int32_t mjenv_label;
enum mjenv_label_value {
  MJENV_LABEL_NONE = 0,
  MJENV_LABEL_BODY = 1,
  MJENV_LABEL_JOINT = 2,
  MJENV_LABEL_GEOM = 3,
  MJENV_LABEL_SITE = 4,
  MJENV_LABEL_CAMERA = 5,
  MJENV_LABEL_LIGHT = 6,
  MJENV_LABEL_TENDON = 7,
  MJENV_LABEL_ACTUATOR = 8,
  MJENV_LABEL_CONSTRAINT = 9,
  MJENV_LABEL_SKIN = 10,
  MJENV_LABEL_SELECTION = 11,
  MJENV_LABEL_SELPNT = 12,
  MJENV_LABEL_CONTACTFORCE = 13
};

/* The objects whose coordinate frames are drawn: MuJoCo's mjtFrame. */
typedef int32_t mjenv_frame;
enum mjenv_frame_value {
  MJENV_FRAME_NONE = 0,
  MJENV_FRAME_BODY = 1,
  MJENV_FRAME_GEOM = 2,
  MJENV_FRAME_SITE = 3,
  MJENV_FRAME_CAMERA = 4,
  MJENV_FRAME_LIGHT = 5,
  MJENV_FRAME_CONTACT = 6,
  MJENV_FRAME_WORLD = 7
};

/* How a renderer draws. MJENV_RENDER_SETTINGS_INIT has MuJoCo's defaults, mjenv_render_defaults sets Gymnasium's. */
typedef struct mjenv_render_settings {
  uint32_t struct_size;
  mjenv_gl gl;
  int32_t width;           /* pixels; default 480 */
  int32_t height;          /* pixels; default 480 */
  int32_t camera;          /* the index of a camera of the model; default: MJENV_CAMERA_FREE */
  int32_t max_geom;        /* how many geoms are drawn at most; default 1000 */
  int32_t samples;         /* multisampling: samples per pixel, 0 to 64; default: the model's offsamples (4) */
  int32_t shadows;         /* 0 or 1; default 1. Drawing is fastest with samples 0 and shadows 0 */
  int32_t reflections;     /* 0 or 1; default 1 */
  int32_t reserved;        /* 0 */
  const char *camera_name; /* a camera of the model; camera must then be MJENV_CAMERA_FREE. NULL: camera is used */
  /* The free camera, which does not move. Default: Gymnasium's default_camera_config; NaN where that has no value. */
  double lookat[3];   /* m; NaN: the median of the geoms' positions in the first state drawn; in a window: 0 */
  double distance;    /* m; NaN: the model's extent; in a window: 2 */
  double azimuth;     /* degrees; NaN: 90 */
  double elevation;   /* degrees; NaN: -45 */
  uint8_t visual[32]; /* Gymnasium's visual_options: 0 or 1 for each mjenv_visual; default: MuJoCo's */
  /* mjvOption's arrays of these names: 1 for each of the groups 0 to 5 whose objects are drawn; default: 0 to 2. */
  uint8_t geomgroup[6];
  uint8_t sitegroup[6];
  uint8_t jointgroup[6];
  uint8_t tendongroup[6];
  uint8_t actuatorgroup[6];
  uint8_t skingroup[6];
  uint8_t reserved_bytes[4]; /* 0 */
  mjenv_label label;         /* default: MJENV_LABEL_NONE */
  mjenv_frame frame;         /* default: MJENV_FRAME_NONE */
  /* MuJoCo's mjtRndFlag of these names, 0 or 1; default: skybox, haze and cull_face */
  int32_t wireframe;
  int32_t additive;
  int32_t skybox;
  int32_t fog;
  int32_t haze;
  int32_t cull_face;
} mjenv_render_settings;

/* Initialisers, which set struct_size and valid values: mjenv_batch out = MJENV_BATCH_INIT; */
/* clang-format off */
#define MJENV_OPTION_INIT {sizeof(mjenv_option), 0, NULL, NULL, 0, 0, 0, NULL}
#define MJENV_FIELD_INIT {sizeof(mjenv_field), 0, NULL, NULL, {0, 0, 0, 0}, 0, 0, 0, 0}
#define MJENV_SPACE_INIT {sizeof(mjenv_space), 0, 0, NULL, NULL, 0, 0, {0, 0, 0, 0}}
#define MJENV_INFO_INIT {sizeof(mjenv_info), 0, 0, 0, 0, NULL}
#define MJENV_SPEC_INIT {sizeof(mjenv_spec), 0, NULL, NULL, 0, 0, 0, 0, {0, 0, 0}, 0, 0, NULL}
#define MJENV_BATCH_INIT \
  {sizeof(mjenv_batch), MJENV_DTYPE_FLOAT64, 0, 0, 0, 0, 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, \
   NULL, NULL}
#define MJENV_RENDER_SETTINGS_INIT \
  {sizeof(mjenv_render_settings), MJENV_GL_AUTO, 480, 480, MJENV_CAMERA_FREE, 1000, 4, 1, 1, 0, NULL, \
   {MJENV_NAN, MJENV_NAN, MJENV_NAN}, MJENV_NAN, MJENV_NAN, MJENV_NAN, \
   {0, 1, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0}, \
   {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, \
   {1, 1, 1, 0, 0, 0}, {0, 0, 0, 0}, \
   MJENV_LABEL_NONE, MJENV_FRAME_NONE, 0, 0, 1, 0, 1, 1}
/* clang-format on */

/* ---- Library ---- */

/* Returns the MJENV_ABI_VERSION of the loaded library. A program that uses dlopen compares it with its own. */
MJENV_API uint32_t mjenv_abi_version(void);

/* Returns "major.minor.patch (MuJoCo x.y.z)". ", portable math" and ", x86-64-v3" stand before the ")" if the library
 * was built with them. */
MJENV_API const char *mjenv_version(void);

/* Returns the name of a status, such as "MJENV_E_VALUE"; "unknown status" for other numbers. */
MJENV_API const char *mjenv_status_name(mjenv_status status);

/* Returns why the last failed call on this thread failed; "" if none has failed. The text is valid until the next call
 * fails. Use mjenv_error_of if your calls move between threads (Go, Node). */
MJENV_API const char *mjenv_last_error(void);

/* Copies why the last failed call with this handle failed, on any thread, into text[capacity], with a NUL. size
 * receives how many bytes the whole text needs, also if text is NULL and capacity 0. If a function that creates a
 * handle fails, pass the options or env that it was given. */
MJENV_API mjenv_status mjenv_error_of(const void *handle, char *text, int64_t capacity, int64_t *size);

/* ---- Ids ---- */

/* Returns the number of ids: built-in robots and registered tasks. Two ids are not counted, because they need the option
 * xml_file or xml_string: "Model-v0", which steps a model without a task, and "Batch-v0" (see mjenv_begin). */
MJENV_API int64_t mjenv_id_count(void);

/* Returns the id at 0 <= index < mjenv_id_count(), in sorted order; NULL for other indices. Registering a task changes
 * the indices of ids. */
MJENV_API const char *mjenv_id_at(int64_t index);

/* Describes an id. Errors: NAME. */
MJENV_API mjenv_status mjenv_spec_of(const char *id, mjenv_spec *spec);

/* ---- Options ---- */

/* Creates the options of an id, with their default values. Errors: NAME. */
MJENV_API mjenv_status mjenv_options_create(const char *id, mjenv_options **options);

/* Creates a copy of options. The copy can be changed even if `options` belong to an environment. */
MJENV_API mjenv_status mjenv_options_copy(const mjenv_options *options, mjenv_options **copy);

/* Destroys options. Does nothing for those of an environment (mjenv_options_of), which are destroyed with it. */
MJENV_API void mjenv_options_destroy(mjenv_options *options);

/* Returns the number of options; 0 if it fails. */
MJENV_API int64_t mjenv_options_count(const mjenv_options *options);

/* Describes the option at 0 <= index < mjenv_options_count(). Errors: VALUE (index). */
MJENV_API mjenv_status mjenv_options_at(const mjenv_options *options, int64_t index, mjenv_option *option);

/* Sets a FLAG, an INTEGER, a STRING_OR_INT to an index, or a REALS option of one number. As in Gymnasium, infos that
 * are computed from a REALS option have another dtype if it was set to an integer. Errors: NAME, TYPE, VALUE. */
MJENV_API mjenv_status mjenv_options_set_integer(mjenv_options *options, const char *name, int64_t value);

/* Sets a REALS option to values[count]. Errors: NAME, TYPE, VALUE (out of bounds, or NaN), SIZE. */
MJENV_API mjenv_status mjenv_options_set_reals(mjenv_options *options, const char *name, const double *values,
                                               int64_t count);

/* Sets a STRING, or a STRING_OR_INT to a name. Errors: NAME, TYPE, VALUE (not one of the choices). */
MJENV_API mjenv_status mjenv_options_set_string(mjenv_options *options, const char *name, const char *value);

/* Reads a FLAG, an INTEGER, or a STRING_OR_INT that holds an index. Errors: NAME, TYPE. */
MJENV_API mjenv_status mjenv_options_get_integer(const mjenv_options *options, const char *name, int64_t *value);

/* Reads a REALS option into values[capacity]. count receives how many numbers it has, also if values is NULL and
 * capacity 0. Errors: NAME, TYPE, SIZE (capacity). */
MJENV_API mjenv_status mjenv_options_get_reals(const mjenv_options *options, const char *name, double *values,
                                               int64_t capacity, int64_t *count);

/* Reads a STRING, or a STRING_OR_INT that holds a name. The text lives until the option is set. Errors: NAME, TYPE. */
MJENV_API mjenv_status mjenv_options_get_string(const mjenv_options *options, const char *name, const char **value);

/* ---- Environment ---- */

/* Creates an environment of rows >= 1 with a copy of the options. Reads the model and starts the threads. Errors: NAME
 * (in the option "arrays" or "history"), VALUE (rows, or an option), FILE, MODEL, PHYSICS (in a trial step), TASK; if
 * the task's callback build passes a wrong argument to a function of task.h, NAME, TYPE or VALUE. */
MJENV_API mjenv_status mjenv_create(const mjenv_options *options, int64_t rows, mjenv_env **env);

/* Destroys an environment and ends its threads. The results of rows under way are lost. */
MJENV_API void mjenv_destroy(mjenv_env *env);

/* Describes an environment. */
MJENV_API mjenv_status mjenv_info_of(mjenv_env *env, mjenv_info *info);

/* Returns how lanes compute each stage of a step of the environment's model, one line for each, even if the environment
 * has no lanes; NULL if it fails. A line is "STAGE: lanes", "STAGE: row by row: WHY", "STAGE: lanes; row by row: WHAT"
 * or "STAGE: absent". There are no lines if the library has no lane code. docs/lanes.md explains the stages. The text
 * belongs to the environment. */
MJENV_API const char *mjenv_lane_stages_of(mjenv_env *env);

/* Returns the options that the environment was built with; NULL if it fails. They cannot be changed. */
MJENV_API const mjenv_options *mjenv_options_of(const mjenv_env *env);

/* Describes the observation space (MJENV_ROLE_OBSERVATION) or the action space (MJENV_ROLE_ACTION). */
MJENV_API mjenv_status mjenv_space_of(const mjenv_env *env, mjenv_role role, mjenv_space *space);

/* Returns the number of fields of a role; 0 if it fails. */
MJENV_API int64_t mjenv_field_count(const mjenv_env *env, mjenv_role role);

/* Describes the field at 0 <= index < mjenv_field_count(). Errors: VALUE (index). */
MJENV_API mjenv_status mjenv_field_at(const mjenv_env *env, mjenv_role role, int64_t index, mjenv_field *field);

/* ---- Random streams ---- */

/* Sets the random streams of rows to NumPy's default_rng(seed), as reset(seed=seed) does, but without resetting the
 * rows. A row that is reset before it was seeded is seeded from the system's entropy.
 *   seeds     [rows][words]: row r's seed is the integer whose 64-bit words these are, the least significant first
 *   count     rows * words; rows for usual seeds, which have one word
 * Errors: SIZE (count). */
MJENV_API mjenv_status mjenv_seed(mjenv_env *env, const uint8_t *mask, const uint64_t *seeds, int64_t count);

/* Does the same for one row, whose seed has count >= 1 words. Errors: VALUE (row), SIZE (count). */
MJENV_API mjenv_status mjenv_seed_row(mjenv_env *env, int64_t row, const uint64_t *words, int64_t count);

/* Reads a row's random stream into words[count]: the low and high 64 bits of the state of NumPy's PCG64, those of inc,
 * and, if count is 6 instead of 4, has_uint32 and uinteger. Count 627 reads the stream of a task that draws from
 * RandomState (docs/c.md). With MJENV_ALL_ROWS, words[rows][6] receives those of all rows, count = rows * 6, and zeros of
 * rows that have none. Errors: VALUE (row), SIZE, NOT_RESET (neither seeded nor reset). */
MJENV_API mjenv_status mjenv_get_stream(mjenv_env *env, int64_t row, uint64_t *words, int64_t count);

/* Sets a row's random stream to words[count] of mjenv_get_stream. With MJENV_ALL_ROWS, words[rows][6]; zeros leave a row's
 * stream as it is. Errors: VALUE (row, or words that are no stream, such as an even inc), SIZE. */
MJENV_API mjenv_status mjenv_set_stream(mjenv_env *env, int64_t row, const uint64_t *words, int64_t count);

/* Draws from streams that mjenv_get_stream has read, as methods of NumPy's Generator of each, for tasks over all rows.
 *   words      [streams][6], which change
 *   low, high  of uniform and integers; 0 for normal
 *   values     [streams][n] for n numbers of each stream; count = streams * n
 * Errors: ARGUMENT (kind), VALUE (NumPy would refuse low and high, or an integer is not within 2^53; words that are no
 * stream), SIZE. If it fails, it changes nothing. */
MJENV_API mjenv_status mjenv_draw(uint64_t *words, int64_t streams, mjenv_distribution kind, double low, double high,
                                  double *values, int64_t count);

/* Seeds the stream of mjenv_sample_actions, which all rows share, as action_space.seed(seed) does. */
MJENV_API mjenv_status mjenv_seed_actions(mjenv_env *env, uint64_t seed);

/* Draws action[rows][n] as action_space.sample() does, for n numbers of an action. Errors: SIZE (count), MODEL
 * (infinite bounds). */
MJENV_API mjenv_status mjenv_sample_actions(mjenv_env *env, float *action, int64_t count);

/* ---- Episodes ---- */

/* Begins new episodes, which draw their initial states from the rows' random streams.
 *   out       receives the outputs; may be NULL
 * Errors: SIZE, PHYSICS, TASK, VALUE and MODEL (mjenv_randomize). */
MJENV_API mjenv_status mjenv_reset(mjenv_env *env, const uint8_t *mask, const mjenv_batch *out);

/* Steps rows. With the option "autoreset_mode" disabled, the default, a row whose episode has ended must be reset
 * first; in the other modes, steps reset it. Actions must be finite. Otherwise the call fails and steps no row, unless
 * the option "strict" is 0.
 *   action    [rows][n] of dtype, for n numbers of an action; count = rows * n. As in NumPy, results depend on the dtype
 *   out       receives the outputs; may be NULL
 * If rows fail in the step, the others are stepped all the same, and the reward and flags of a failed row are 0.
 * Errors: SIZE, VALUE (an action is not finite), NOT_RESET, EPISODE_ENDED, PHYSICS, TASK; those of resets. */
MJENV_API mjenv_status mjenv_step(mjenv_env *env, const uint8_t *mask, const void *action, int64_t count,
                                  mjenv_dtype dtype, const mjenv_batch *out);

/* Starts a step of some rows and returns without waiting. The rows are "under way" until mjenv_recv has reported them.
 * Meanwhile other rows can be sent, but functions that read or change rows return PENDING. If the environment has one
 * thread, mjenv_recv steps the rows.
 *   rows      [row_count] the rows to step, each at most once; NULL: all rows
 *   action    [row_count][n] of dtype, copied: element i is for rows[i]; count = row_count * n
 * Errors: SIZE, VALUE, NOT_RESET, EPISODE_ENDED, PENDING (a row is under way already, or listed twice). */
MJENV_API mjenv_status mjenv_send(mjenv_env *env, const int64_t *rows, int64_t row_count, const void *action,
                                  int64_t count, mjenv_dtype dtype);

/* Waits for rows that were sent, and reports the rows that have been stepped, each once, in the order in which they
 * finish.
 *   least     how many rows to wait for; 0: none
 *   timeout   how many seconds to wait at most; negative: no limit
 *   rows      [capacity] receives the rows; capacity >= least and >= 1. If more are done, a later call reports them
 *   count     receives how many rows are reported
 *   out       as for mjenv_step: the outputs of row r are element r. May be NULL
 * Errors: SIZE (capacity, or fewer than `least` rows are under way), VALUE (timeout is NaN), NOT_PENDING; and if rows
 * failed, what mjenv_step returns, with everything written. */
MJENV_API mjenv_status mjenv_recv(mjenv_env *env, int64_t least, double timeout, int64_t *rows, int64_t capacity,
                                  int64_t *count, const mjenv_batch *out);

/* Plays a list of actions in each row, from its present state. Rows are never reset: a row whose episode ends keeps its
 * state; for its remaining steps, observation and flags are repeated, and rewards and infos are 0. If a row fails, its
 * status at that step has the reason, and nothing is written for its later steps.
 *   action    [rows][steps][n] of dtype; count = rows * steps * n
 *   out       of rows * steps rows: step t of row r is element r * steps + t. May be NULL
 * Errors: as mjenv_step, and VALUE (steps < 1). */
MJENV_API mjenv_status mjenv_rollout(mjenv_env *env, const void *action, int64_t count, mjenv_dtype dtype,
                                     int64_t steps, const mjenv_batch *out);

/* Writes out->obs and out->arrays of all rows for their present states, without a step; for instance after
 * mjenv_restore. Errors: SIZE, PHYSICS, TASK. */
MJENV_API mjenv_status mjenv_observe(mjenv_env *env, const mjenv_batch *out);

/* The same for one row, in a time that does not depend on the number of rows. out has room for all rows; the other rows'
 * elements stay as they are. */
MJENV_API mjenv_status mjenv_observe_row(mjenv_env *env, int64_t row, const mjenv_batch *out);

/* ---- Resets and steps whose outputs the caller computes ----
 * For "Batch-v0", and tasks with physics_only (mjenv/task.h), the caller computes observations, rewards and infos: for
 * all rows at once, in any language, from the arrays of the option "arrays". The library does what it does for other
 * tasks: limits, automatic resets, final outputs, noise, delays, pushes, histories, images.
 *
 *     mjenv_begin(env, NULL, qpos, rows * nq, qvel, rows * nv, &out);     // out.arrays of the initial states
 *     mjenv_finish(env, NULL, &given, &out);                              // given.obs -> out.obs
 *     for (;;) {
 *       mjenv_advance(env, NULL, action, rows * nu, MJENV_DTYPE_FLOAT64, NULL, 0, &out);   // out.arrays after the step
 *       mjenv_finish(env, NULL, &given, &out);                            // given.reward, ... -> out.reward, ...
 *       ...  // begin and finish the rows with out.was_reset, if "autoreset_mode" is not disabled
 *     }
 *
 * A row that was begun or advanced is open until it is finished: meanwhile mjenv_read, mjenv_write, mjenv_get_stream
 * and mjenv_set_stream act on it, for the draws and kicks of the task; mjenv_advance, and functions that reset, step,
 * copy or save rows or set their state, return PENDING. Rows that fail are not open. All four functions return TASK for other
 * tasks. The task's carried numbers can be read and written as the array "carried"; images contain them. */

/* Begins new episodes, as mjenv_reset. Randomisation, noise and delays draw from the rows' streams after the caller.
 *   qpos      [rows][nq], of the rows of the mask; NULL: what the callback reset sets, or if there is none, the model's
 *   qvel      [rows][nv] the same for velocities. nq, nv: how many numbers these arrays have
 *   out       receives arrays, status, and 1 in was_reset; may be NULL
 * Errors: SIZE, PHYSICS, TASK (a number is not finite, unless "strict" is 0), VALUE and MODEL (mjenv_randomize). */
MJENV_API mjenv_status mjenv_begin(mjenv_env *env, const uint8_t *mask, const double *qpos, int64_t nq,
                                   const double *qvel, int64_t nv, const mjenv_batch *out);

/* Computes the actions that the task sees in the next step: transformed, delayed and with noise. Changes nothing: the
 * next mjenv_advance of the same action draws the same noise.
 *   action    as for mjenv_step
 *   seen      [rows][n] of dtype
 * Errors: as mjenv_advance. */
MJENV_API mjenv_status mjenv_act(mjenv_env *env, const uint8_t *mask, const void *action, int64_t count,
                                 mjenv_dtype dtype, void *seen);

/* Simulates a step. If "autoreset_mode" is not disabled, rows whose episode has ended before are not stepped: was_reset
 * is then 1, and the caller begins and finishes them.
 *   action    as for mjenv_step
 *   ctrl      [rows][nu] what the caller makes of the actions that the task sees; ctrl_count = rows * nu. NULL: ctrl is
 *             the action, which a task with mjenv_build_action must not use
 *   out       receives arrays, status, was_reset, and 0 in reward, terminated and truncated; may be NULL
 * Errors: as mjenv_step, TASK (a ctrl is not finite, unless "strict" is 0), PENDING (a row is open). */
MJENV_API mjenv_status mjenv_advance(mjenv_env *env, const uint8_t *mask, const void *action, int64_t count,
                                     mjenv_dtype dtype, const double *ctrl, int64_t ctrl_count, const mjenv_batch *out);

/* Ends the step or reset of rows.
 *   given     what the caller has computed, which is only read: obs (obs_count: that of the task's own observation,
 *             without time and history), reset_info of rows that were begun, and reward, terminated and info of rows
 *             that were advanced. Those that are NULL are 0. Its arrays can be those of out. NULL: gives up: the step
 *             counts, but has no outputs; a row that was begun must be begun again
 *   out       receives all but arrays; may be NULL. If "autoreset_mode" is same_step and a step has ended the episode,
 *             was_reset is 1: the caller begins and finishes the row, which then keeps reward and flags in out. Of rows
 *             that are not open, it receives obs alone, as from mjenv_observe
 * Errors: SIZE, TASK (a reward or an observation is NaN, unless "strict" is 0). If it fails, it changes nothing. */
MJENV_API mjenv_status mjenv_finish(mjenv_env *env, const uint8_t *mask, const mjenv_batch *given,
                                    const mjenv_batch *out);

/* Computes the rewards of pairs of goals by the task's compute_reward, for hindsight experience replay.
 *   achieved, desired  [reward_count][length of achieved_goal]; count: how many numbers each of the two arrays has
 *   rewards            [reward_count]
 * Errors: TASK (the task has no compute_reward, or it failed), SIZE (count is not reward_count times the length). */
MJENV_API mjenv_status mjenv_compute_reward(mjenv_env *env, const double *achieved, const double *desired,
                                            int64_t count, double *rewards, int64_t reward_count);

/* ---- State of one row ---- */

/* Reads an array of a row's mjData, or of its mjModel, by its MuJoCo name: "xpos", "body_mass", "nq",
 * "opt.timestep".
 *   row       the row, or MJENV_ALL_ROWS for [rows][elements]
 *   values    [capacity] receives the elements as doubles
 *   count     receives their number, also with values NULL and capacity 0
 * Errors: NAME, VALUE (row), SIZE (capacity), PHYSICS. */
MJENV_API mjenv_status mjenv_read(mjenv_env *env, int64_t row, const char *array, double *values, int64_t capacity,
                                  int64_t *count);

/* Keeps an array of a row in the caller's memory, in the type of its mjenv_field, until the environment is destroyed. So
 * a program reads and writes it without calls: every other function that reads or changes rows first takes over what the
 * program has written there, as mjenv_write_row does, and in the end brings the memory up to date, unless rows are under
 * way. If it refuses the values (NAME, VALUE, or PENDING while rows are under way), it does nothing else, and the memory
 * of this array is as before. It does not look at elements that are not in use, those behind the last contact for
 * instance. mjenv_render and mjenv_window_draw are such functions, too: while one draws on another thread, leave the
 * memory alone. Free it only after the call that ends its use.
 *   values    [bytes], aligned for the type, in place of earlier memory for this array; NULL: no longer
 * Errors: NAME, VALUE (row), SIZE (bytes), PHYSICS. */
MJENV_API mjenv_status mjenv_mirror(mjenv_env *env, int64_t row, const char *array, void *values, int64_t bytes);

/* Counts objects of a type by its name in MJCF: "body", "joint", "mesh", "key" and so on. Errors: NAME (lists all). */
MJENV_API mjenv_status mjenv_object_count(const mjenv_env *env, const char *type, int64_t *count);

/* Finds the index of the object with this type and name. Errors: NAME. */
MJENV_API mjenv_status mjenv_object_index(const mjenv_env *env, const char *type, const char *name, int64_t *index);

/* Finds the name of the object at an index; "" if it has none. Errors: NAME (type), VALUE (index). */
MJENV_API mjenv_status mjenv_object_name(const mjenv_env *env, const char *type, int64_t index, const char **name);

/* Sets qpos[nq] and qvel[nv] of a row, or with MJENV_ALL_ROWS [rows][nq] and [rows][nv], and calls mj_forward, as
 * Gymnasium's set_state does. Afterwards the row can be stepped, even if it was never reset. For all rows, nq and nv are
 * the counts of all numbers. Errors: VALUE (row, or a number is not finite: then no row changes), SIZE, PHYSICS, TASK. */
MJENV_API mjenv_status mjenv_set_state(mjenv_env *env, int64_t row, const double *qpos, int64_t nq, const double *qvel,
                                       int64_t nv);

/* Calls mj_resetData for rows: they get the model's initial state, and everything that MuJoCo computes is 0. It draws
 * nothing and leaves the rows' values of the model. Afterwards the rows can be stepped. */
MJENV_API mjenv_status mjenv_reset_data(mjenv_env *env, const uint8_t *mask);

/* ---- Rows that differ ----
 * Each row can have values of its own in the arrays of its mjModel, which stay after resets, and inputs in its mjData,
 * which a reset clears. */

/* Writes an array in rows, with the effect of the same assignment to Gymnasium's env.unwrapped.model or .data; or a
 * live parameter of the task ("parameters.speed"), which stays after resets; or the parameters from which resets draw
 * item 0 of mjenv_randomize ("draws[0]").
 *   array     its MuJoCo name; docs/c.md lists which can be written, and which values are refused
 *   values    [count]; count = elements of the array: all rows get these values; rows * elements: each row gets its own
 * Errors: NAME, VALUE (then nothing is written), SIZE. */
MJENV_API mjenv_status mjenv_write(mjenv_env *env, const uint8_t *mask, const char *array, const double *values,
                                   int64_t count);

/* Does the same in one row. Errors: as mjenv_write, and VALUE (row). */
MJENV_API mjenv_status mjenv_write_row(mjenv_env *env, int64_t row, const char *array, const double *values,
                                       int64_t count);

/* Calls mj_setConst for rows, which computes anew the numbers of the model that follow from masses, sizes and qpos0. It
 * leaves the row in the position qpos_spring, so reset the row or set its state afterwards. Errors: PHYSICS, MODEL
 * (mj_setConst would change an array that all rows share). */
MJENV_API mjenv_status mjenv_set_constants(mjenv_env *env, const uint8_t *mask);

/* Does the same for one row. Errors: as mjenv_set_constants, and VALUE (row). */
MJENV_API mjenv_status mjenv_set_constants_row(mjenv_env *env, int64_t row);

/* Sets ctrl[count] of a row and calls mj_step `frames` times, as Gymnasium's do_simulation does. This
 * computes no reward and counts no step. Errors: VALUE (row, or frames < 1), SIZE, PHYSICS, TASK. */
MJENV_API mjenv_status mjenv_simulate(mjenv_env *env, int64_t row, const double *ctrl, int64_t count, int64_t frames);

/* Copies the row `from` to the rows of the mask: state, random stream, step count, own arrays and inputs. Errors: VALUE
 * (from). */
MJENV_API mjenv_status mjenv_copy_row(mjenv_env *env, const uint8_t *mask, int64_t from);

/* Saves a row, or MJENV_ALL_ROWS, as an image: bytes that contain what mjenv_copy_row copies.
 *   size_bytes  receives the size, also with image NULL and capacity_bytes 0
 * Errors: VALUE (row), SIZE (capacity_bytes). */
MJENV_API mjenv_status mjenv_snapshot(mjenv_env *env, int64_t row, void *image, int64_t capacity_bytes,
                                      int64_t *size_bytes);

/* Sets a row, or MJENV_ALL_ROWS, to what an image contains. From there, the simulation continues bit for bit. An image
 * of one row fits any row of an environment with the same task, model, options and draws (docs/rows.md). Errors: VALUE
 * (row), SNAPSHOT. */
MJENV_API mjenv_status mjenv_restore(mjenv_env *env, int64_t row, const void *image, int64_t size_bytes);

/* ---- Randomisation ----
 * Resets draw values of the mjModel; actions and observations get noise and delays; bodies are pushed. All of this
 * draws from the row's own random stream, as a wrapper around Gymnasium's environment would (docs/randomisation.md). */

/* Replaces draws, noise, delays and pushes by those of a JSON document (docs/randomisation.md):
 *   {"randomize": {"body_mass": {"kind": "scale", "low": 0.8, "high": 1.2}},
 *    "noise": {"action": 0.02, "observation": 0.01},
 *    "delay": {"action": 1, "observation": [0, 2]},
 *    "push": [{"body": "torso", "force": [[-50, 50], [-50, 50], [0, 0]], "every": [100, 200]}]}
 * Parts that the document lacks stay, null removes a part, and NULL or an empty text all. Rows draw from their next
 * reset on. If the document has noise, delays or pushes, all present ones end at once, and begin again with each row's
 * next reset. Errors, which name the place in the document: NAME, TYPE, VALUE (also: it is no JSON), SIZE. */
MJENV_API mjenv_status mjenv_randomize(mjenv_env *env, const char *document);

/* Returns the document with all parts that are set, "{}" if none is. It is valid until the next mjenv_randomize. */
MJENV_API mjenv_status mjenv_randomization(mjenv_env *env, const char **document);

/* ---- Pictures ----
 * A picture equals Gymnasium's render() after the last reset, step or set_state, pixel for pixel, if both draw with the
 * same OpenGL. */

/* Fills settings with the environment's defaults, which draw as Gymnasium does. */
MJENV_API mjenv_status mjenv_render_defaults(const mjenv_env *env, mjenv_render_settings *settings);

/* Creates a renderer with an OpenGL context of its own. settings NULL: the environment's defaults. It may be
 * destroyed before or after the environment. Errors: NAME (camera_name), VALUE, RENDER (no OpenGL, or a model too
 * large). */
MJENV_API mjenv_status mjenv_renderer_create(mjenv_env *env, const mjenv_render_settings *settings,
                                             mjenv_renderer **renderer);

/* Destroys a renderer and its OpenGL context. */
MJENV_API void mjenv_renderer_destroy(mjenv_renderer *renderer);

/* Returns "library, vendor, renderer, version" of the renderer's OpenGL; NULL if it fails. */
MJENV_API const char *mjenv_renderer_gl(const mjenv_renderer *renderer);

/* Draws a row, and writes the outputs that are not NULL. The first line of a picture is the top one.
 *   rgb       [height][width][3]; rgb_count >= height * width * 3
 *   depth     [height][width] the depth buffer, 0 (near) to 1 (far); depth_count >= height * width
 * Errors: ARGUMENT (also: the environment was destroyed), BUSY (also: it is in use), VALUE (row), SIZE, NOT_RESET,
 * PHYSICS, RENDER. */
MJENV_API mjenv_status mjenv_render(mjenv_renderer *renderer, int64_t row, uint8_t *rgb, int64_t rgb_count,
                                    float *depth, int64_t depth_count);

/* Draws which object each pixel shows.
 *   objects   [height][width][2] the object's index in the model and its type, MuJoCo's mjtObj; -1, -1 for nothing;
 *             count >= height * width * 2
 * Errors: as mjenv_render. */
MJENV_API mjenv_status mjenv_render_segmentation(mjenv_renderer *renderer, int64_t row, int32_t *objects,
                                                 int64_t count);

/* ---- Window ----
 * A window shows what Gymnasium's render mode "human" shows, if you call mjenv_window_draw after each reset and step.
 * Only the main thread can use windows. */

/* Opens a window with a free camera, on the main thread. camera, camera_name and gl of settings have no effect.
 * Errors: VALUE, RENDER. */
MJENV_API mjenv_status mjenv_window_create(mjenv_env *env, const mjenv_render_settings *settings,
                                           mjenv_window **window);

/* Closes a window and destroys it, on the main thread. */
MJENV_API void mjenv_window_destroy(mjenv_window *window);

/* Returns 1 until the user closes the window; 0 if it fails. */
MJENV_API int32_t mjenv_window_is_open(const mjenv_window *window);

/* Draws a row at the pace of Gymnasium's window, and handles the user's keys and mouse. It does not return while the
 * user pauses, and does nothing when the window is closed. Errors: as mjenv_render. */
MJENV_API mjenv_status mjenv_window_draw(mjenv_window *window, int64_t row);

#ifdef __cplusplus
}
#endif

#endif
