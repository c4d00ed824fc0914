/* mjenv.h - Gymnasium's MuJoCo environments behind a C interface.
 *
 * An environment (mjenv_env) holds one or many independent rows. A row is one copy of the robot, like one of the
 * environments in a Gymnasium vector environment: its simulation state (200 bytes to 2 KB), its random stream and its
 * step count. MuJoCo's large work space (mjData) belongs to the threads that step rows and not to the rows, so rows are
 * cheap. The option "num_threads" sets the number of threads. It does not change the results.
 *
 *     static double obs[16][105], reward[16];
 *     static float action[16][8];
 *     static const uint64_t seeds[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
 *     const mjenv_batch out = {.struct_size = sizeof out, .rows = 16, .obs_count = 105, .obs = obs, .reward = reward};
 *     mjenv_options *options;
 *     mjenv_env *env;
 *     mjenv_options_create("Ant-v5", &options);
 *     mjenv_create(options, 16, &env);           // 16 rows
 *     mjenv_seed(env, NULL, seeds, 1);
 *     mjenv_reset(env, NULL, &out);              // writes obs
 *     mjenv_step(env, NULL, action, 16 * 8, MJENV_DTYPE_FLOAT32, &out);
 *     mjenv_destroy(env);
 *     mjenv_options_destroy(options);
 *
 * Numbers
 *   There are two builds of the library: for MuJoCo 2.2.2, and for MuJoCo 4.0 (mjenv_version tells which). For a given
 *   seed and list of actions, every output equals Gymnasium 1.3.0's on MuJoCo 2.2.2 or 4.0.0, bit for bit.
 *   "(4.0: ...)" below marks what differs in the build for 4.0. Each call computes in the default floating-point
 *   environment and restores the caller's.
 * Arrays
 *   The caller owns all arrays that it passes. The library keeps no pointer to them after a call. Arrays are contiguous
 *   and row-major. Shapes are written [rows][count]. Sizes count elements, unless the parameter's name ends in _bytes.
 * Masks
 *   A mask is uint8_t[rows]. The function acts on the rows whose element is not 0. It leaves the other rows and their
 *   elements of the output arrays as they are. A NULL mask selects all rows.
 * Errors
 *   A function that can fail returns MJENV_OK (0) or a negative mjenv_status, and the handle stays usable.
 *   mjenv_last_error and mjenv_error_of return the reason as text. A call that fails changes and writes nothing, with
 *   one exception: if some rows fail (PHYSICS, TASK or MEMORY; also MODEL in mjenv_set_constants, and VALUE or MODEL in
 *   resets: see mjenv_randomize), the call still computes the other rows, writes their outputs, and then returns an
 *   error. Its text names the first rows that failed, and counts the others; mjenv_batch.status, which mjenv_observe does
 *   not write, tells all. If MuJoCo fails in a row, the row keeps the state that it had before the failed step or reset.
 *   The comments below list errors without their prefix MJENV_E_, and leave out those that any function may return:
 *     ARGUMENT  a required pointer is NULL, a handle was destroyed, an enum's value is unknown, a struct_size is too
 *               small, or the elements of an array of structs differ in it
 *     BUSY      another thread is inside a call with the same handle
 *     MEMORY    there is not enough memory
 *     INTERNAL  the library has a bug
 *   Functions that read or change rows also return PENDING while rows are under way between mjenv_send and mjenv_recv.
 *   Functions with FORKED among their errors return it in a forked child if the environment has more than one thread,
 *   because the child does not have these threads. There, functions that would return PENDING return FORKED, too.
 * Ownership
 *   *_create gives the caller a handle, which the caller passes to *_destroy. *_destroy does nothing for NULL and for
 *   destroyed handles, and cannot fail. It waits for the calls that other threads are making with the handle. Later
 *   calls with the handle return ARGUMENT. Functions that return no status return 0 or NULL instead.
 *   Texts end with a NUL and are UTF-8. The library copies those that it is given. Texts (const char *) and bounds
 *   (const double *) that it returns belong to the handle they came from and live as long as that handle, unless the
 *   comment says otherwise. "Static" texts live as long as the library is loaded.
 * Threads
 *   Different threads can use different handles at the same time. A handle can be used on any thread, by one thread at
 *   a time: while one thread is inside a call with a handle, a call with it on another thread returns BUSY.
 *   While mjenv_render or mjenv_window_draw reads the row, it counts as a call with the environment, too. Exceptions:
 *     - Functions whose mjenv_env *, mjenv_renderer * or mjenv_window * is const, and mjenv_renderer_create,
 *       mjenv_window_create and mjenv_error_of, can be called at any time, and never return BUSY.
 *     - Several threads can read the same options, or create environments from them, at the same time. BUSY means that
 *       one thread sets options while another uses them.
 *     - Windows belong to the main thread. Renderers of MJENV_GL_GLFW are created and destroyed on it.
 *   No function may be called from a signal handler.
 * Compatibility
 *   The caller sets each struct's struct_size to its sizeof before the call. Structs only ever grow at their end, so
 *   compiled programs run with later versions of the library. Programs must expect enumerators that they do not know.
 */
#ifndef MJENV_MJENV_H
#define MJENV_MJENV_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

/* MJENV_API marks the library's functions, MJENV_EXPORT what the library looks up in a plug-in, and MJENV_HIDDEN
 * what mjenv/task.hpp defines anew in each program or shared object. MJENV_BUILDING is defined while the library is
 * compiled. */
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

#ifdef __cplusplus
extern "C" {
#endif

/* Changes when compiled clients have to be rebuilt. */
#define MJENV_ABI_VERSION 1

/* Instead of a row's number: all rows. */
#define MJENV_ALL_ROWS (-1)

/* Instead of a camera's index in mjenv_render_settings. */
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
  MJENV_DIVERGED = 1,         /* only in mjenv_batch.status: the row's state diverged */
  MJENV_E_ARGUMENT = -1,      /* a required pointer is NULL, a handle was destroyed, an enum's value is unknown, a
                                 struct_size is too small, or the options belong to an environment */
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
  MJENV_E_SNAPSHOT = -15,     /* the image is damaged, or was made with another id, model, options, randomisation,
                                 perturbation, number of rows, revision of the task, version of MuJoCo, MJENV_MATH or
                                 version of the image's format */
  MJENV_E_RENDER = -16,       /* OpenGL is missing or failed; the text names what to install */
  MJENV_E_MEMORY = -17,       /* there is not enough memory */
  MJENV_E_INTERNAL = -18,     /* the library has a bug; please report it */
  MJENV_E_TASK = -19          /* a callback of a registered task failed, or a plug-in cannot be loaded (mjenv/task.h) */
};

/* The types of numbers. Arrays that a caller passes as void * are of FLOAT64 or FLOAT32. A field's type is the one that
 * its values have in Gymnasium; the library passes them as doubles, which hold all of these values exactly. */
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
  MJENV_ROLE_ACTION = 2,      /* the actuators, one number each */
  MJENV_ROLE_INFO = 3,        /* the info of a step */
  MJENV_ROLE_RESET_INFO = 4,  /* the info of a reset */
  MJENV_ROLE_REWARD = 5,      /* the reward, as one field */
  MJENV_ROLE_STRUCTURE = 6,   /* Gymnasium's observation_structure: names and counts; empty where Gymnasium has none */
  MJENV_ROLE_DATA = 7,        /* the arrays of a row's mjData that mjenv_read can read */
  MJENV_ROLE_MODEL = 8,       /* the sizes, options and arrays of the mjModel that mjenv_read can read */
  MJENV_ROLE_ARRAYS = 9       /* the mjData arrays that the option "arrays" names, for mjenv_batch.arrays */
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
#define MJENV_OPTION_INIT \
  { sizeof(mjenv_option), 0, NULL, NULL, 0, 0, 0, NULL }

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
#define MJENV_FIELD_INIT \
  { sizeof(mjenv_field), 0, NULL, NULL, {0, 0, 0, 0}, 0, 0, 0, 0 }

/* Describes the observation space or the action space of one row: a Gymnasium Box. mjenv_space_of fills it. */
typedef struct mjenv_space {
  uint32_t struct_size;
  mjenv_dtype dtype;  /* as Gymnasium declares it: float64 for observations, float32 for actions */
  int64_t count;      /* the number of elements */
  const double *low;  /* [count], owned by the environment */
  const double *high; /* [count], owned by the environment */
} mjenv_space;
#define MJENV_SPACE_INIT \
  { sizeof(mjenv_space), 0, 0, NULL, NULL }

/* Describes an environment. mjenv_info_of fills it. */
typedef struct mjenv_info {
  uint32_t struct_size;
  int32_t threads; /* how many threads step rows */
  int64_t rows;
  int64_t frame_skip;       /* how many times one step calls mj_step */
  int64_t lanes;            /* how many rows each thread steps together, in the lanes of the CPU's vector unit, which
                               takes less time and gives the same results; 0: each row is stepped alone */
  const char *lanes_reason; /* why rows are stepped alone; "" if none is. It lives until the next mjenv_info_of */
} mjenv_info;
#define MJENV_INFO_INIT \
  { sizeof(mjenv_info), 0, 0, 0, 0, NULL }

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
  int32_t camera_trackbodyid; /* the index of a body; -1 where Gymnasium leaves it to MuJoCo */
  int32_t reserved;           /* 0 */
  const char *model_xml;      /* the MJCF text of the default model; NULL if a registered task has it in a file, and for
                                "Model-v0" */
} mjenv_spec;
#define MJENV_SPEC_INIT \
  { sizeof(mjenv_spec), 0, NULL, NULL, 0, 0, 0, 0, {0, 0, 0}, 0, 0, NULL }

/* The caller's arrays for the outputs of mjenv_reset, mjenv_step, mjenv_recv, mjenv_rollout and mjenv_observe. Arrays
 * that are NULL are not written. Row r's outputs are element r of each array. info, final_info, reset_info and arrays
 * have one block for each field of their role: the block of field f begins at f.offset * rows and is [rows][f.count].
 * For mjenv_rollout, [rows] is rows * steps. One batch can serve all other functions. */
typedef struct mjenv_batch {
  uint32_t struct_size;
  mjenv_dtype obs_dtype; /* of obs and final_obs: float64 as in Gymnasium, or float32, rounded to nearest */
  int64_t rows;          /* those of the environment; for mjenv_rollout, rows * steps */
  /* How many elements one row has. A count, and obs_dtype, is checked only if one of its arrays is given. */
  int64_t obs_count;        /* of obs and final_obs: the observation space's count */
  int64_t info_count;       /* of info and final_info: the sum of the counts of MJENV_ROLE_INFO's fields */
  int64_t reset_info_count; /* of reset_info: the sum of the counts of MJENV_ROLE_RESET_INFO's fields */
  int64_t arrays_count;     /* of arrays: the sum of the counts of MJENV_ROLE_ARRAYS's fields */
  /* The step. mjenv_reset, and a step that resets the row by "autoreset_mode" next_step, write 0 to reward, terminated,
   * truncated and info. A step that ends the episode and resets the row by same_step writes 0 to info only. */
  void *obs;           /* [rows][obs_count] the observation; if the row was reset, the first one of the new episode */
  double *reward;      /* [rows] */
  uint8_t *terminated; /* [rows] 0 or 1 */
  uint8_t *truncated;  /* [rows] 0 or 1 */
  int32_t *status;     /* [rows] MJENV_OK; MJENV_DIVERGED if MuJoCo found bad numbers in the row and reset its
                           simulation (4.0: unless the model disables that): the other outputs are valid; a negative
                           status if the row failed: they are undefined */
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
#define MJENV_BATCH_INIT                                                                                           \
  {                                                                                                                \
    sizeof(mjenv_batch), MJENV_DTYPE_FLOAT64, 0, 0, 0, 0, 0, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, NULL, \
        NULL, NULL                                                                                                 \
  }

/* From what a value is drawn (mjenv_randomize), by methods of NumPy's Generator. */
typedef int32_t mjenv_distribution;
enum mjenv_distribution_value {
  MJENV_DISTRIBUTION_UNIFORM = 1,          /* parameters low, high: uniform(low, high) */
  MJENV_DISTRIBUTION_LOG_UNIFORM = 2,      /* parameters low, high: exp(uniform(log(low), log(high))), 0 < low */
  MJENV_DISTRIBUTION_NORMAL = 3,           /* parameters mean, std: normal(mean, std) */
  MJENV_DISTRIBUTION_TRUNCATED_NORMAL = 4, /* parameters mean, std, low, high: normal(mean, std), drawn again until it
                                              lies in [low, high]. Refused if less than a thousandth of the draws
                                              would lie there */
  MJENV_DISTRIBUTION_CHOICE = 5            /* parameters: n values: values[integers(n)] */
};

/* What becomes of a value that is drawn. The model's own value is the one that was loaded with the model. */
typedef int32_t mjenv_effect;
enum mjenv_effect_value {
  MJENV_EFFECT_VALUE = 1, /* the value that is drawn */
  MJENV_EFFECT_SCALE = 2, /* the model's own value, times the one that is drawn */
  MJENV_EFFECT_OFFSET = 3 /* the model's own value, plus the one that is drawn */
};

/* What a reset draws for one array of the mjModel (mjenv_randomize). */
typedef struct mjenv_randomization {
  uint32_t struct_size;
  mjenv_distribution distribution;
  const char *array;        /* an array that mjenv_write can write: "geom_friction", "opt.gravity" */
  const int64_t *elements;  /* [element_count] the indices of its elements, in the order of the draws; NULL: all */
  int64_t element_count;    /* 0 if elements is NULL */
  const double *parameters; /* [parameter_count] of the distribution */
  int64_t parameter_count;
  mjenv_effect effect;
  int32_t shared;    /* 1: one draw for all elements; 0: one draw each */
  int32_t constants; /* 1: after all draws, mj_setConst(model, MjData(model)) computes the model's constants */
  int32_t reserved;  /* 0 */
} mjenv_randomization;
#define MJENV_RANDOMIZATION_INIT \
  { sizeof(mjenv_randomization), MJENV_DISTRIBUTION_UNIFORM, NULL, NULL, 0, NULL, 0, MJENV_EFFECT_VALUE, 0, 0, 0 }

/* A force that pushes a body now and then, for one step each time (mjenv_perturb). */
typedef struct mjenv_push {
  uint32_t struct_size;
  int32_t body; /* the index of a body; not 0, the world */
  /* From the reset, or from the last push, to the next push: integers(min_steps, max_steps + 1) steps, drawn each time.
   * 1 <= min_steps <= max_steps. */
  int64_t min_steps;
  int64_t max_steps;
  double low[6]; /* N and N m: the force and torque, uniform(low, high), as in xfrc_applied */
  double high[6];
} mjenv_push;
#define MJENV_PUSH_INIT                                                   \
  {                                                                       \
    sizeof(mjenv_push), 0, 1, 1, {0, 0, 0, 0, 0, 0}, { 0, 0, 0, 0, 0, 0 } \
  }

/* Noise, delays and pushes (mjenv_perturb). In a struct of zeros there are none. */
typedef struct mjenv_perturbation {
  uint32_t struct_size;
  int32_t reserved;                /* 0 */
  const double *action_noise;      /* [action_noise_count] standard deviations of what is added to the action */
  int64_t action_noise_count;      /* 0: no noise; 1: the same for all actuators; or one for each */
  const double *observation_noise; /* [observation_noise_count] the same for the observation */
  int64_t observation_noise_count; /* 0, 1, or the observation space's count */
  int64_t action_delay;            /* how many steps an action takes until it reaches the task */
  int64_t observation_delay;       /* how many steps an observation takes until it reaches the caller */
  const mjenv_push *pushes;        /* [push_count], each of another body */
  int64_t push_count;
} mjenv_perturbation;
#define MJENV_PERTURBATION_INIT \
  { sizeof(mjenv_perturbation), 0, NULL, 0, NULL, 0, 0, 0, NULL, 0 }

/* The library that provides OpenGL. */
typedef int32_t mjenv_gl;
enum mjenv_gl_value {
  /* The library that the environment variable MUJOCO_GL names (egl, glfw, osmesa or wgl). If it is not set, wgl on
     Windows, elsewhere the first of egl, glfw and osmesa that works. */
  MJENV_GL_AUTO = 0,
  /* Draws without a display. Debian: libegl1 libgl1-mesa-dri. MUJOCO_EGL_DEVICE_ID chooses a device. */
  MJENV_GL_EGL = 1,
  /* Draws without a display and without a graphics driver. Debian: libosmesa6. A process that uses it cannot use the
     others, and the other way round. */
  MJENV_GL_OSMESA = 2,
  /* Needs a display. Debian: libglfw3. Create and destroy such a renderer on the main thread. */
  MJENV_GL_GLFW = 3,
  /* The OpenGL of the display's driver, in an invisible window. It is on Windows alone, which has none of the others. */
  MJENV_GL_WGL = 4
};

/* What is drawn: the mjtVisFlag of MuJoCo 2.2.2, also in the build for 4.0. Each is an index into
 * mjenv_render_settings.visual. */
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

/* How a renderer draws. Call mjenv_render_defaults to fill it, then change what you want. Do not leave fields 0: for
 * most, 0 is valid but not the default. */
typedef struct mjenv_render_settings {
  uint32_t struct_size;
  mjenv_gl gl;
  int32_t width;           /* pixels; default 480 */
  int32_t height;          /* pixels; default 480 */
  int32_t camera;          /* the index of a camera of the model, MJENV_CAMERA_FREE or MJENV_CAMERA_DEFAULT (default) */
  int32_t max_geom;        /* how many geoms are drawn at most; default 1000 */
  int32_t samples;         /* multisampling: samples per pixel, 0 to 64; default: the model's offsamples (4) */
  int32_t shadows;         /* 0 or 1; default 1. Drawing is fastest with samples 0 and shadows 0 */
  int32_t reflections;     /* 0 or 1; default 1 */
  int32_t reserved;        /* 0 */
  const char *camera_name; /* a camera of the model; camera must then be MJENV_CAMERA_DEFAULT. NULL: camera is used */
  /* The free camera, which does not move. Default: Gymnasium's default_camera_config; NaN where that has no value. */
  double lookat[3];   /* m; NaN: the median of the geoms' positions in the first state drawn */
  double distance;    /* m; NaN: the model's extent */
  double azimuth;     /* degrees; NaN: 90 */
  double elevation;   /* degrees; NaN: -45 */
  uint8_t visual[32]; /* Gymnasium's visual_options: 0 or 1 for each mjenv_visual; default: MuJoCo's */
  /* mjvOption's arrays of these names: 0 or 1 for each of the groups 0 to 5, which models put their objects in. An object
   * is drawn only if its group is 1. Default, as in MuJoCo: 1 for the groups 0 to 2. */
  uint8_t geomgroup[6];
  uint8_t sitegroup[6];
  uint8_t jointgroup[6];
  uint8_t tendongroup[6];
  uint8_t actuatorgroup[6];
  uint8_t skingroup[6];
  uint8_t reserved_bytes[4]; /* 0 */
} mjenv_render_settings;
#define MJENV_RENDER_SETTINGS_INIT                                                                          \
  {                                                                                                         \
    sizeof(mjenv_render_settings), MJENV_GL_AUTO, 480, 480, MJENV_CAMERA_DEFAULT, 1000, 4, 1, 1, 0, NULL,   \
        {NAN, NAN, NAN}, NAN, NAN, NAN,                                                                     \
        {0, 1, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0},   \
        {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, {1, 1, 1, 0, 0, 0}, \
        {1, 1, 1, 0, 0, 0}, {                                                                               \
      0, 0, 0, 0                                                                                            \
    }                                                                                                       \
  }

/* ---- Library ---- */

/* Returns the MJENV_ABI_VERSION of the loaded library. A program that loads the library with dlopen should check that
 * it equals the MJENV_ABI_VERSION that the program was compiled with. */
MJENV_API uint32_t mjenv_abi_version(void);

/* Returns "major.minor.patch (MuJoCo x.y.z)". If the library was built with the CMake option MJENV_MATH=portable
 * (docs/platforms.md), "(MuJoCo x.y.z, portable math)"; with MJENV_ARCH=x86-64-v3, "(MuJoCo x.y.z, x86-64-v3)". */
MJENV_API const char *mjenv_version(void);

/* Returns the name of a status, such as "MJENV_E_VALUE"; "unknown status" for other numbers; static. */
MJENV_API const char *mjenv_status_name(mjenv_status status);

/* Returns the reason of the last call that failed on this thread; "" if none has failed. The text stays until the next
 * call fails on this thread, or the thread ends. If your calls move between threads (Go, Node), use mjenv_error_of. */
MJENV_API const char *mjenv_last_error(void);

/* Copies the reason of the last call that failed with this handle, on any thread. If mjenv_create fails, the reason is
 * with its options; if mjenv_renderer_create or mjenv_window_create fails, it is with its env.
 *   handle    an mjenv_options, mjenv_env, mjenv_renderer or mjenv_window
 *   text      [capacity] receives the text, cut off if it is too long, and a NUL; may be NULL if capacity is 0
 *   size      receives the size of the whole text in bytes, with its NUL; 1 if no call has failed
 * A call that is refused because its own handle is busy (BUSY) or destroyed (ARGUMENT) leaves no reason here. */
MJENV_API mjenv_status mjenv_error_of(const void *handle, char *text, int64_t capacity, int64_t *size);

/* ---- Ids ---- */

/* Returns the number of environment ids: the built-in robots and the registered tasks (mjenv/task.h). It does not count
 * "Model-v0", which can be used like the others. "Model-v0" steps a model without a task: it needs the option xml_file
 * or xml_string, observes qpos and qvel, has the reward 0 and terminates only by the option "on_divergence".
 *
 * A model of the option xml_file is the user's own: it may read any file and be of any size. One of xml_string may come
 * from anywhere: it reads no file, and its size is limited. The option trust_xml says otherwise: "no" confines a file
 * that a stranger wrote to its folder and to the same sizes, "yes" gives a text what a file has, and "auto" is the
 * default. */
MJENV_API int64_t mjenv_id_count(void);

/* Returns the id at 0 <= index < mjenv_id_count(), in sorted order; static. NULL for other indices. Registering a task
 * changes the indices. */
MJENV_API const char *mjenv_id_at(int64_t index);

/* Describes an id. Errors: NAME. */
MJENV_API mjenv_status mjenv_spec_of(const char *id, mjenv_spec *spec);

/* ---- Options ---- */

/* Creates the options of an id, with their default values. mjenv_create copies them, so you can change, reuse or
 * destroy them afterwards. Errors: NAME. */
MJENV_API mjenv_status mjenv_options_create(const char *id, mjenv_options **options);

/* Creates a copy of options. The copy of an environment's options (mjenv_options_of) can be changed. */
MJENV_API mjenv_status mjenv_options_copy(const mjenv_options *options, mjenv_options **copy);

/* Destroys options. Does nothing for an environment's options (mjenv_options_of). */
MJENV_API void mjenv_options_destroy(mjenv_options *options);

/* Returns the number of options; 0 for NULL (mjenv_last_error then has the reason). */
MJENV_API int64_t mjenv_options_count(const mjenv_options *options);

/* Describes the option at 0 <= index < mjenv_options_count(). Errors: VALUE (index). */
MJENV_API mjenv_status mjenv_options_at(const mjenv_options *options, int64_t index, mjenv_option *option);

/* Sets a FLAG, an INTEGER, a STRING_OR_INT (to an index), or a REALS option that holds one number. In Gymnasium, infos
 * and rewards computed from a real option have another type if it is 1 than if it is 1.0. mjenv_field.dtype tells this
 * type: after this call, the one for the integer. Errors: NAME, TYPE, VALUE. */
MJENV_API mjenv_status mjenv_options_set_integer(mjenv_options *options, const char *name, int64_t value);

/* Sets a REALS option to values[count]. Errors: NAME, TYPE, VALUE (out of bounds, or NaN), SIZE (another count). */
MJENV_API mjenv_status mjenv_options_set_reals(mjenv_options *options, const char *name, const double *values,
                                               int64_t count);

/* Sets a STRING, or a STRING_OR_INT to a name. Errors: NAME, TYPE, VALUE (not one of the choices). */
MJENV_API mjenv_status mjenv_options_set_string(mjenv_options *options, const char *name, const char *value);

/* Reads a FLAG, an INTEGER, or a STRING_OR_INT that holds an index. Errors: NAME, TYPE (also: it holds a name). */
MJENV_API mjenv_status mjenv_options_get_integer(const mjenv_options *options, const char *name, int64_t *value);

/* Reads a REALS option into values[capacity]. count receives how many numbers there are. To get the count alone, pass
 * values NULL and capacity 0. Errors: NAME, TYPE, SIZE (capacity is too small, and not 0; count is not written). */
MJENV_API mjenv_status mjenv_options_get_reals(const mjenv_options *options, const char *name, double *values,
                                               int64_t capacity, int64_t *count);

/* Reads a STRING, or a STRING_OR_INT that holds a name. The text belongs to the options and lives until this option is
 * set again. Errors: NAME, TYPE (also: it holds an index). */
MJENV_API mjenv_status mjenv_options_get_string(const mjenv_options *options, const char *name, const char **value);

/* ---- Environment ---- */

/* Creates an environment: reads the model, allocates the rows and starts the threads.
 *   rows      how many; >= 1
 * Errors: NAME (the option "arrays" names an array that does not exist), VALUE (rows, or an option), FILE, MODEL,
 * PHYSICS (in a trial step), TASK. */
MJENV_API mjenv_status mjenv_create(const mjenv_options *options, int64_t rows, mjenv_env **env);

/* Destroys an environment and ends its threads. The results of rows that are under way are lost. */
MJENV_API void mjenv_destroy(mjenv_env *env);

/* Describes an environment. Lanes that mjenv_create refuses stay off: by the option "lanes" or the variable MJENV_LANES,
 * the library, the model, or too few rows for a thread. Otherwise the answer may change in each call that changes rows.
 * After mjenv_write, mjenv_randomize, mjenv_set_constants or mjenv_restore has given rows values of their own in an
 * array of the mjModel that lanes do not compute with, lanes stay off. A row with forces in qfrc_applied or xfrc_applied
 * is stepped alone as long as one of them is not 0: until 0 is written, a reset clears them, or a push (mjenv_perturb)
 * has ended. While rows are under way, forces do not count. */
MJENV_API mjenv_status mjenv_info_of(mjenv_env *env, mjenv_info *info);

/* Returns the options that the environment was built with; NULL for NULL. They belong to the environment and cannot be
 * changed. */
MJENV_API const mjenv_options *mjenv_options_of(const mjenv_env *env);

/* Describes the space of MJENV_ROLE_OBSERVATION or MJENV_ROLE_ACTION. Errors: ARGUMENT (another role). */
MJENV_API mjenv_status mjenv_space_of(const mjenv_env *env, mjenv_role role, mjenv_space *space);

/* Returns the number of fields of a role; 0 if env is NULL or the role is unknown (mjenv_last_error then has the
 * reason). */
MJENV_API int64_t mjenv_field_count(const mjenv_env *env, mjenv_role role);

/* Describes the field at 0 <= index < mjenv_field_count(). Errors: VALUE (index). */
MJENV_API mjenv_status mjenv_field_at(const mjenv_env *env, mjenv_role role, int64_t index, mjenv_field *field);

/* ---- Random streams ---- */

/* Gives rows new random streams: NumPy's default_rng(seed), as Gymnasium's reset(seed=seed) does. It does not reset the
 * rows. A row that was never seeded is seeded from the system's entropy at its first reset.
 *   seeds     [rows][words]: row r's seed is the integer whose 64-bit words these are, the least significant first.
 *             Those of rows outside the mask are not read
 *   words     >= 1; 1 for usual seeds
 * Errors: SIZE (words). */
MJENV_API mjenv_status mjenv_seed(mjenv_env *env, const uint8_t *mask, const uint64_t *seeds, int64_t words);

/* Reads a row's random stream: the state of NumPy's PCG64.
 *   words     [count] receives the low and high 64 bits of state, then those of inc; if count is 6, also has_uint32 and
 *             uinteger, which keep the half of a 64-bit draw that is not used yet. They are 0 unless integers from a
 *             range of at most 2^32 were drawn (by a registered task, MJENV_DISTRIBUTION_CHOICE or a push), or
 *             mjenv_set_stream has set them
 *   count     4 or 6
 * Errors: VALUE (row), SIZE, NOT_RESET (the row was neither seeded nor reset). */
MJENV_API mjenv_status mjenv_get_stream(mjenv_env *env, int64_t row, uint64_t *words, int64_t count);

/* Sets a row's random stream to words[count], which are laid out as in mjenv_get_stream; count is 4 or 6. With 4,
 * has_uint32 and uinteger become 0. Errors: VALUE (row, or inc is even), SIZE. */
MJENV_API mjenv_status mjenv_set_stream(mjenv_env *env, int64_t row, const uint64_t *words, int64_t count);

/* Seeds the random stream of mjenv_sample_actions, as action_space.seed(seed) does. The environment has one such stream
 * for all rows, apart from the rows' own streams. If it was never seeded, it is seeded from the system's entropy. */
MJENV_API mjenv_status mjenv_seed_actions(mjenv_env *env, uint64_t seed);

/* Draws one action for each row, in the order of the rows, as action_space.sample() does.
 *   action    [rows][actuators] receives the actions; count = rows * actuators
 * Errors: SIZE, MODEL (an actuator has infinite bounds). */
MJENV_API mjenv_status mjenv_sample_actions(mjenv_env *env, float *action, int64_t count);

/* ---- Episodes ---- */

/* Begins new episodes. A row draws its initial state from its random stream, which continues from episode to episode.
 *   out       receives the outputs; may be NULL
 * Errors: SIZE, PHYSICS, TASK, VALUE and MODEL (see mjenv_randomize), FORKED. */
MJENV_API mjenv_status mjenv_reset(mjenv_env *env, const uint8_t *mask, const mjenv_batch *out);

/* Steps rows.
 *   action    [rows][actuators] of type dtype; count = rows * actuators. The actions of rows outside the mask are not
 *             read. dtype changes results: the library computes with the action in float32 or float64, as NumPy does
 *   out       receives the outputs; may be NULL
 * The option "autoreset_mode" resets rows whose episode has ended as Gymnasium's vector environments do: next_step
 * resets them in their next step, whose action is ignored; same_step resets them at the end of the step that ends the
 * episode. The default, disabled, leaves it to the caller.
 * If the option "strict" is 1 (the default), actions must be finite, and without autoreset, rows whose episode has
 * ended must be reset first; a call with a row that violates this steps no row. With "strict" 0, such rows are stepped
 * as in Gymnasium.
 * A state that diverges is no error of the call: see mjenv_batch.status and the option "on_divergence".
 * If rows fail in the step, the others are stepped all the same, and out is written: the reward and flags of a row that
 * failed are 0, and its other outputs are undefined.
 * Errors: SIZE, VALUE (an action is not finite), NOT_RESET, EPISODE_ENDED, PHYSICS, TASK, FORKED; VALUE and MODEL also
 * if a reset by "autoreset_mode" failed (mjenv_randomize). */
MJENV_API mjenv_status mjenv_step(mjenv_env *env, const uint8_t *mask, const void *action, int64_t count,
                                  mjenv_dtype dtype, const mjenv_batch *out);

/* Starts a step of some rows and returns without waiting for it. The rows are under way until mjenv_recv has reported
 * them. Meanwhile, other rows can be sent, and functions that read or change rows return PENDING. If the environment
 * has one thread only, the rows are stepped in mjenv_recv. It has one if num_threads is 1, if there is one row, if
 * num_threads is 0 and the process may use one CPU, or if a registered task asks for the caller's thread.
 *   rows      [row_count] the rows to step, each at most once; NULL: all rows, as if row_count were their number
 *   action    [row_count][actuators] of type dtype: element i is rows[i]'s. count = row_count * actuators. Copied
 * Errors: SIZE, VALUE (no such row, or an action is not finite), NOT_RESET, EPISODE_ENDED, PENDING (a row is under way
 * already, or listed twice), FORKED. After an error, no row was sent. */
MJENV_API mjenv_status mjenv_send(mjenv_env *env, const int64_t *rows, int64_t row_count, const void *action,
                                  int64_t count, mjenv_dtype dtype);

/* Waits for rows that were sent, and reports those that are done. Each is reported once, in the order in which they
 * finish.
 *   least     how many rows to wait for; 0: does not wait
 *   timeout   how many seconds to wait at most; a negative number: no limit. If the time is up, the call succeeds and
 *             reports the rows that are done, which may be none
 *   rows      [capacity] receives the numbers of the rows; capacity >= least and >= 1. Rows that do not fit are
 *             reported by the next call
 *   count     receives how many rows are reported
 *   out       as for mjenv_step: the outputs of row r are element r. The other elements stay as they are. May be NULL
 * If the environment has one thread only, each call reports at least one row, even with least 0 or timeout 0, so that
 * polling makes progress.
 * Errors: SIZE (capacity is too small, or fewer than `least` rows are under way), VALUE (timeout is NaN), NOT_PENDING,
 * FORKED; and, if rows failed, what mjenv_step returns then: rows, count and out are written all the same. */
MJENV_API mjenv_status mjenv_recv(mjenv_env *env, int64_t least, double timeout, int64_t *rows, int64_t capacity,
                                  int64_t *count, const mjenv_batch *out);

/* Plays a list of actions in each row, beginning with the row's present state. The rows stay in the states that they
 * reach. Rows are never reset, whatever "autoreset_mode" is: if a row's episode ends, the row stays there, its
 * observation and flags repeat, and its rewards and infos are 0.
 *   action    [rows][steps][actuators] of type dtype; count = rows * steps * actuators
 *   steps     >= 1
 *   out       has rows * steps rows: step t of row r is element r * steps + t. reset_info, final_obs and
 *             final_info are not written. May be NULL
 * If a row fails in step t, status of step t has the reason. Nothing is written for its later steps, not even status.
 * Errors: as mjenv_step, and VALUE (steps). */
MJENV_API mjenv_status mjenv_rollout(mjenv_env *env, const void *action, int64_t count, mjenv_dtype dtype,
                                     int64_t steps, const mjenv_batch *out);

/* Writes mjenv_batch.obs and mjenv_batch.arrays of all rows for their present states, without a step; for instance
 * after mjenv_restore. It writes no other member's array. out must not be NULL. Errors: SIZE, PHYSICS, TASK, FORKED. */
MJENV_API mjenv_status mjenv_observe(mjenv_env *env, const mjenv_batch *out);

/* ---- State of one row ---- */

/* Reads an array of a row's mjData, or of the mjModel, as doubles. mjData has the values of Gymnasium's
 * env.unwrapped.data after the last step. Elements that the state does not fill are 0: efc_* beyond the constraints, wrap_*
 * beyond the paths of the tendons, contact.* beyond ncon. The contents of MuJoCo's scratch arrays (efc_AR, qH, qDeriv, qLU) are
 * undefined.
 *   row       the row to read. If mjenv_write gave it values of its own in this array, those are read
 *   array     its name in MuJoCo: "xpos", "body_mass", "nq", "opt.timestep" (mjenv_field_at lists them: MJENV_ROLE_DATA
 *             and MJENV_ROLE_MODEL)
 *   values    [capacity] receives the elements
 *   count     receives the number of elements. To get it alone, pass values NULL and capacity 0
 * Errors: NAME, VALUE (row), SIZE (capacity is too small, and not 0; count is not written), PHYSICS. */
MJENV_API mjenv_status mjenv_read(mjenv_env *env, int64_t row, const char *array, double *values, int64_t capacity,
                                  int64_t *count);

/* Counts the model's objects of a type: "body", "joint", "geom", "site", "camera", "actuator", "tendon", "sensor" or
 * "light". Errors: NAME (type). */
MJENV_API mjenv_status mjenv_object_count(const mjenv_env *env, const char *type, int64_t *count);

/* Finds the index of the object with this type and name. Errors: NAME (type, or name). */
MJENV_API mjenv_status mjenv_object_index(const mjenv_env *env, const char *type, const char *name, int64_t *index);

/* Finds the name of the object at 0 <= index < the number of objects; "" if it has none. Errors: NAME (type), VALUE
 * (index). */
MJENV_API mjenv_status mjenv_object_name(const mjenv_env *env, const char *type, int64_t index, const char **name);

/* Sets qpos[nq] and qvel[nv] of a row and calls mj_forward, as Gymnasium's set_state does. The row's step count and
 * random stream stay. Afterwards the row can be stepped, even if it was never reset or its episode had ended.
 * Errors: VALUE (row, or a number is not finite), SIZE, PHYSICS, TASK. */
MJENV_API mjenv_status mjenv_set_state(mjenv_env *env, int64_t row, const double *qpos, int64_t nq, const double *qvel,
                                       int64_t nv);

/* ---- Rows that differ ----
 * Each row can have values of its own in the arrays of its mjModel, and inputs in its mjData. Writing has the effect
 * that the same assignment to Gymnasium's env.unwrapped.model or env.unwrapped.data would have at that moment, bit for
 * bit. Values take effect at the next mj_step or mj_forward. Those of the mjModel stay after resets; a reset clears the
 * inputs. What a task took from the model when it was built stays as it was: spaces, the positions that episodes start
 * from. An environment gives all rows memory for an array when it is first written. Images (mjenv_snapshot) contain
 * these values, too. */

/* Writes an array of rows.
 *   array     its name in MuJoCo. Of the mjModel: every array and option of real numbers ("body_mass",
 *             "geom_friction", "opt.timestep"), except those of meshes, textures, skins and flexes, wrap_prm and (4.0)
 *             eq_data, bvh_* and oct_*; and the integers eq_active (4.0: eq_active0), jnt_limited, tendon_limited,
 *             actuator_ctrllimited, actuator_forcelimited, geom_contype, geom_conaffinity, opt.iterations,
 *             opt.noslip_iterations and opt.mpr_iterations (4.0: opt.ccd_iterations, body_sameframe, geom_sameframe
 *             and site_sameframe, which mj_setConst computes). Of the mjData: time, qpos, qvel, act, qacc_warmstart,
 *             ctrl, qfrc_applied, xfrc_applied, mocap_pos, mocap_quat, userdata and (4.0) eq_active
 *   values    [count]. count is the number of the array's elements, which mjenv_read gives: all rows get the same
 *             values. Or it is rows * elements: each row gets its own, and those of rows outside the mask are not read
 * Nothing is written if any value is refused. The model's own value is never refused. Refused are:
 *   - a number that is not finite, that the array's type cannot hold, or an integer out of its range
 *   - a negative number where MuJoCo needs at least 0 (masses, sizes, frictions, armatures, the timestep, ...), and 0
 *     for a number by which it divides, if the model's own is positive
 *   - a quaternion of body_quat, body_iquat, geom_quat, site_quat or cam_quat, or an axis of jnt_axis, whose squared
 *     length is less than 1e-15 (mjMINVAL), and a hfield_size above 1e10
 *   - (4.0) a number of actuator_dynprm, actuator_gainprm or actuator_biasprm whose sign differs from that of the
 *     model's own, because the sign tells what the actuator's state consists of
 * Errors: NAME (there is no such array, or it can't be written; the text says why), VALUE (a value), SIZE. */
MJENV_API mjenv_status mjenv_write(mjenv_env *env, const uint8_t *mask, const char *array, const double *values,
                                   int64_t count);

/* Calls mj_setConst for rows: MuJoCo computes anew what it computes from masses, sizes and qpos0 when it compiles a
 * model (body_subtreemass, dof_invweight0, actuator_acc0, stat.meaninertia, ...). mj_setConst leaves a row in the
 * position qpos_spring, for which it computes last: reset the row or set its state afterwards.
 * Errors: PHYSICS, MODEL (it would change what all rows share). */
MJENV_API mjenv_status mjenv_set_constants(mjenv_env *env, const uint8_t *mask);

/* Sets the controls ctrl[count] of a row and calls mj_step `frames` times, as Gymnasium's do_simulation does; count is
 * the number of actuators. It is not a step of the episode: there is no reward, and the row's step count stays.
 * Errors: VALUE (row, or frames < 1), SIZE, PHYSICS, TASK. */
MJENV_API mjenv_status mjenv_simulate(mjenv_env *env, int64_t row, const double *ctrl, int64_t count, int64_t frames);

/* Copies the row `from` to the rows of the mask: simulation state, random stream, step count, own arrays and inputs, and
 * whether the episode has ended. Errors: VALUE (from). */
MJENV_API mjenv_status mjenv_copy_row(mjenv_env *env, const uint8_t *mask, int64_t from);

/* Saves a row, or MJENV_ALL_ROWS, as an image: bytes that hold what mjenv_copy_row copies.
 *   image       [capacity_bytes] receives the image
 *   size_bytes  receives the size of the image. To get it alone, pass image NULL and capacity_bytes 0
 * Errors: VALUE (row), SIZE (capacity_bytes is too small, and not 0; size_bytes is not written). */
MJENV_API mjenv_status mjenv_snapshot(mjenv_env *env, int64_t row, void *image, int64_t capacity_bytes,
                                      int64_t *size_bytes);

/* Sets a row, or MJENV_ALL_ROWS, to the state in image[size_bytes]. An image of one row fits any row; an image of all
 * rows needs an environment with as many rows. The row continues bit for bit, also in another process and with another
 * number of threads. The environment must have the same id, model, options, randomisation, perturbation, version of
 * MuJoCo, MJENV_MATH and, for a registered task, revision as the one that made the image. "num_threads", "lanes",
 * "cpu_affinity", "arrays" and "trust_xml" may differ, and "norm" if it gives the same rounding here.
 * Errors: VALUE (row), SNAPSHOT. */
MJENV_API mjenv_status mjenv_restore(mjenv_env *env, int64_t row, const void *image, int64_t size_bytes);

/* ---- Randomisation ----
 * Resets can draw values of the mjModel. Actions and observations can get noise and delays, and bodies can be pushed.
 * All of this draws from each row's own random stream. The results are those of a wrapper around Gymnasium's
 * environment that draws from env.unwrapped.np_random, bit for bit (docs/randomisation.md has this wrapper). A
 * call of mjenv_randomize or mjenv_perturb takes effect in each row at the row's next reset. Until then a row keeps the
 * values that it has drawn, but mjenv_perturb ends the noise, delays and pushes of running episodes at once. The values
 * drawn can be read with mjenv_read. Images hold them, and fit only environments with the same randomisation, noise,
 * delays and pushes. */

/* Draws values of the mjModel at each reset of a row, also by "autoreset_mode": after the task's own draws, in the
 * order of the list. The first observation is still computed with the values from before the draw; the new ones take
 * effect in the first step. The elements of arrays that are not drawn keep what mjenv_write gave them. A row's reset
 * fails with VALUE if it draws a value that mjenv_write refuses, and with MODEL if mj_setConst would change what all
 * rows share. The row then stays as it is, except that its random stream has moved on.
 *   items     [count] replaces the environment's list
 *   count     0: resets draw nothing any more, and rows keep the values that they have
 * Errors: NAME (an array), VALUE (an element, a parameter, or a value that can be drawn), SIZE. */
MJENV_API mjenv_status mjenv_randomize(mjenv_env *env, const mjenv_randomization *items, int64_t count);

/* Perturbs what passes between the caller and the task. In a reset, after the draws of mjenv_randomize, each push draws
 * in how many steps it first comes; then the observation's noise is drawn. In a step:
 *   1. The action is delayed. In the first action_delay steps of an episode, 0 reaches the task.
 *   2. normal(0, std) is drawn for each actuator and added. The sum has the action's dtype and is not clipped.
 *   3. Forces of the last step's pushes become 0. Each push that is due in this step draws its 6 numbers, which are
 *      written to xfrc_applied. Then it draws in how many steps it comes again.
 *   4. The step takes place: the reward and info see the action as it is now.
 *   5. normal(0, std) is drawn for each element of the observation and added.
 *   6. The observation is delayed. The first observation_delay ones of an episode are 0, as with
 *      gymnasium.wrappers.DelayObservation.
 * final_obs is such an observation, too. mjenv_observe repeats the last observation of each row, unless its state was
 * set or written since: then it writes the task's, without noise and delay.
 *   perturbation  replaces the environment's; NULL: none
 * Errors: VALUE (a number in it, or too large a delay), SIZE (a count). */
MJENV_API mjenv_status mjenv_perturb(mjenv_env *env, const mjenv_perturbation *perturbation);

/* ---- Pictures ----
 * A picture of a row equals Gymnasium's render() after the last reset, step or set_state, pixel for pixel, if both draw
 * with the same OpenGL on the same machine. Drawing does not change the simulation. The library loads OpenGL when the
 * first renderer or window is created. */

/* Fills settings with the defaults for the environment, which draw as Gymnasium does. */
MJENV_API mjenv_status mjenv_render_defaults(const mjenv_env *env, mjenv_render_settings *settings);

/* Creates a renderer with an OpenGL context of its own. Several renderers of one environment can draw at the same time
 * on different threads. Calls restore the calling thread's current OpenGL context. The renderer may be destroyed before
 * or after the environment.
 *   settings  NULL: the defaults
 * Errors: NAME (camera_name), VALUE (a number out of its bounds, or an unknown gl), RENDER (no OpenGL; OpenGL was used
 * before this process was forked; a model that is not trusted has more than 2^25 vertices), MEMORY
 * (also: the model and the picture need more memory than is free). */
MJENV_API mjenv_status mjenv_renderer_create(mjenv_env *env, const mjenv_render_settings *settings,
                                             mjenv_renderer **renderer);

MJENV_API void mjenv_renderer_destroy(mjenv_renderer *renderer);

/* Returns the OpenGL that the renderer uses: its library, vendor, renderer and version, separated by ", ". NULL for
 * NULL. */
MJENV_API const char *mjenv_renderer_gl(const mjenv_renderer *renderer);

/* Draws a row. The top line of the picture comes first. One of rgb and depth may be NULL.
 *   rgb       [height][width][3] receives the colours; rgb_count >= height * width * 3
 *   depth     [height][width] receives the depth buffer, from 0 (near) to 1 (far); depth_count >= height * width. A
 *             depth d is near / (1 - d * (1 - near / far)) metres along the optical axis, where near and far are the
 *             model's vis.map.znear and vis.map.zfar times stat.extent
 * Errors: ARGUMENT (also: the environment was destroyed), BUSY (also: another thread is inside a call with the
 * environment), VALUE (row), SIZE, NOT_RESET, PHYSICS, RENDER (also: drawing processes more than 2^30 vertices
 * and shadow-map pixels in total, and the model is not trusted; each light that casts shadows draws everything
 * twice). */
MJENV_API mjenv_status mjenv_render(mjenv_renderer *renderer, int64_t row, uint8_t *rgb, int64_t rgb_count,
                                    float *depth, int64_t depth_count);

/* ---- Window ----
 * A window shows what Gymnasium's render mode "human" shows. The program calls mjenv_window_draw after every reset and
 * step. Create, use and destroy windows on the main thread. They need a display with OpenGL (Debian: libglfw3). The
 * mouse turns (left button), moves (right button) and zooms (wheel) the camera. The window lists its keys: Tab, Space,
 * right arrow, S, F, D, C, R, E, H, T (saves a PNG in the temporary folder) and 0 to 4. Escape closes it. */

/* Opens a window. It may be destroyed before or after the environment.
 *   settings  NULL: the defaults. camera, camera_name, gl and samples have no effect, but samples must be 0 to 64. The
 *             camera is free. In lookat, NaN means 0; in distance, NaN means 2
 * Errors: VALUE, RENDER. */
MJENV_API mjenv_status mjenv_window_create(mjenv_env *env, const mjenv_render_settings *settings,
                                           mjenv_window **window);

MJENV_API void mjenv_window_destroy(mjenv_window *window);

/* Returns 1 until the user closes the window; 0 for NULL. */
MJENV_API int32_t mjenv_window_is_open(const mjenv_window *window);

/* Draws a row, and handles the user's keys and mouse. It draws the row several times, or not at all, to keep the pace
 * of Gymnasium's window. While the user pauses, it does not return. If the window is closed, it draws nothing and
 * returns MJENV_OK. Errors: as mjenv_render. */
MJENV_API mjenv_status mjenv_window_draw(mjenv_window *window, int64_t row);

#ifdef __cplusplus
}
#endif

#endif
