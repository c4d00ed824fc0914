/* task.h - Defines your own robots and tasks, which then work like the built-in ones.
 *
 * Task
 *   A task is a struct mjenv_task: a description and callbacks. mjenv_register_task adds its id to the ids that
 *   mjenv_options_create and the other functions of mjenv.h know.
 * Plug-in
 *   A plug-in is a shared object that exports tasks (MJENV_PLUGIN). mjenv_load_tasks loads it in any language.
 *   A plug-in needs only this header and does not link with libmjenv.
 * Threads
 *   build and destroy run on the thread that creates or destroys the environment. The other callbacks run on the
 *   threads that step the rows; if the task asks for it (caller_thread), only on the thread that calls the library.
 *   One call concerns one row, and calls for different rows run at the same time. So a callback must not change
 *   anything but the memory that it is given to write. Numbers that a task needs to remember from step to step are
 *   "carried" by the row (carry_count): snapshots save them, and mjenv_copy_row copies them. Images of rows can come
 *   from strangers, so a task bounds the numbers that it uses as indices or sizes (mjenv_build_carry_bounds).
 * Errors
 *   A callback returns 0, or fails with `return mjenv_task_fail(api, "the reason")`. Any number but 0 is a failure. The
 *   function of mjenv.h that the program called then returns MJENV_E_TASK with a message that names the id, the
 *   callback and, if the call concerns several rows, the row; the other rows are computed. A row whose reset, step or
 *   carry fails keeps its state, but a reset that fails in carry has drawn from the random stream. If observe or
 *   reset_info fails, the row has been stepped or reset. A callback that lacks memory returns MJENV_E_MEMORY. If the
 *   task cannot use the model, build calls mjenv_task_fail and returns MJENV_E_MODEL. The function of mjenv.h returns
 *   these two statuses instead of MJENV_E_TASK. A callback need not check this header's functions for errors: if it
 *   passes them an unknown name, an option of another kind or an impossible range, the library makes the callback fail.
 *   If a draw is refused, the status is MJENV_E_TASK (in build, a refused draw is no failure). If one of the functions
 *   for build (mjenv_build_...) fails, it is a status such as MJENV_E_NAME.
 * Forbidden
 *   A callback must not be left by longjmp or by a C++ exception, and must not fork or end its thread. It must not call
 *   functions with the environment that it runs for: most return MJENV_E_BUSY or MJENV_E_PENDING, the others have
 *   undefined effects, and mjenv_destroy would wait forever.
 * Numbers
 *   After a step, a callback sees mjData as mj_step leaves it, which is also what Gymnasium sees: qpos, qvel, act and
 *   time are new, but mj_step computes everything else before it integrates. So what it computes from them (xpos,
 *   contacts, ...) is one timestep older. With the integrator RK4, it belongs to the last of the four stages, which
 *   approximates the new state; only sensordata is one timestep older. After a reset, everything belongs to the same
 *   state, but cfrc_ext, cacc and cfrc_int are 0, as in Gymnasium, unless a sensor of the model needs them.
 * Compatibility
 *   As in mjenv.h. In an array of structs, all elements have the struct_size of the first. */
#ifndef MJENV_TASK_H
#define MJENV_TASK_H

#include <mjenv/mjenv.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mjenv_task_api mjenv_task_api; /* the library's functions for callbacks */
typedef struct mjenv_builder mjenv_builder;   /* the environment that the callback build prepares */
typedef struct mjenv_random mjenv_random;     /* a row's random stream: NumPy's default_rng */

/* ---- The description of a task ---- */

/* A constructor option of the task. Every task also has the options that all tasks share, whose names it cannot use:
 * xml_file, xml_string and trust_xml (unless fixed_model), frame_skip (unless fixed_frame_skip), max_episode_steps,
 * norm, strict, autoreset_mode, on_divergence, num_threads, lanes, cpu_affinity, arrays, time_aware, normalize_time,
 * history, history_padding, clip_actions and rescale_actions. */
typedef struct mjenv_task_option {
  uint32_t struct_size;
  mjenv_kind kind;
  const char *name;     /* without blanks and quotes; unique in the task */
  const char *doc;      /* one line of documentation; NULL: none */
  double value;         /* the default of a FLAG, an INTEGER, REALS with count 0, and STRING_OR_INT with text NULL */
  double low, high;     /* closed bounds of each number, also of the default; both 0: the kind's own (FLAG: 0 and
                           1; INTEGER: 2^53 - 1 either way; STRING_OR_INT: 0 to 2^31 - 1; REALS: infinite) */
  const double *values; /* [count] the defaults of REALS that hold several numbers */
  int64_t count;        /* how many numbers REALS hold; 0: one number, whose default is value */
  const char *text;     /* the default of a STRING (NULL: "") or of a STRING_OR_INT (NULL: value) */
  const char *choices;  /* the valid texts of a STRING, separated by blanks; NULL: any text is valid. Unused for other
                           kinds */
  int32_t live;         /* 1: a live parameter. Each row has numbers of its own, at first the option's, which callbacks
                           read in mjenv_sim.parameters (mjenv_build_parameter), and mjenv_write changes while the task
                           runs. Only for REALS */
  int32_t reserved;     /* 0 */
} mjenv_task_option;
#define MJENV_TASK_OPTION_INIT \
  { sizeof(mjenv_task_option), MJENV_KIND_REALS, NULL, NULL, 0, 0, 0, NULL, 0, NULL, NULL, 0, 0 }

/* One named part of the observation, the info, the reset info or the observation_structure. With the role REWARD, it
 * sets the type and the doc of the reward. A task has at most one such field; its ndim is 0, and its name has no
 * effect. With the role STRUCTURE, it is an entry of Gymnasium's observation_structure, which maps names to numbers:
 * ndim is 1 and shape[0] the number.
 * The fields of a role are stored one after the other, in the order in which they are described. */
typedef struct mjenv_task_field {
  uint32_t struct_size;
  mjenv_role role;   /* OBSERVATION, INFO, RESET_INFO, REWARD or STRUCTURE */
  const char *name;  /* without blanks and quotes; unique in its role */
  const char *doc;   /* one line of documentation with the unit; NULL: the library's own for a name that the built-in
                       robots use, such as "qpos" or "x_velocity", else none */
  mjenv_dtype dtype; /* the type in Python; 0: FLOAT64. An observation is always np.float64 */
  int32_t ndim;      /* 0 to 4 dimensions; 0: a scalar. A part of the observation has 1 (a vector) or 0 (which stands
                       for a vector of length 1) */
  int64_t shape[4];  /* the first ndim are used; -1: build sets the length (mjenv_build_field, mjenv_build_length).
                       The fields of a role have at most 16777216 elements together */
} mjenv_task_field;
#define MJENV_TASK_FIELD_INIT                                                                            \
  {                                                                                                      \
    sizeof(mjenv_task_field), MJENV_ROLE_OBSERVATION, NULL, NULL, MJENV_DTYPE_FLOAT64, 0, { 0, 0, 0, 0 } \
  }

/* Gymnasium's default_camera_config. NaN and MJENV_BODY_UNSET mean MuJoCo's default. */
typedef struct mjenv_task_camera {
  uint32_t struct_size;
  int32_t trackbodyid; /* the index of a body, -1 for none, or MJENV_BODY_UNSET */
  double distance;     /* m */
  double lookat[3];    /* m */
  double elevation;    /* degrees */
} mjenv_task_camera;
#define MJENV_TASK_CAMERA_INIT \
  { sizeof(mjenv_task_camera), MJENV_BODY_UNSET, MJENV_NAN, {MJENV_NAN, MJENV_NAN, MJENV_NAN}, MJENV_NAN }

/* ---- The data that callbacks read and write ---- */

/* A contact between two geoms. This struct never grows. */
typedef struct mjenv_contact {
  int32_t geom1, geom2; /* the indices of the geoms */
  double distance;      /* between the geoms, m; negative if they overlap */
  double position[3];   /* the point midway between the geoms, m */
  double frame[9];      /* the contact frame: one axis per row. The first is the normal, from geom1 to geom2 */
  double force[6];      /* the force (N), then the torque (N m), in the contact frame: mj_contactForce */
} mjenv_contact;

/* One row's simulation, which callbacks only read. The arrays have MuJoCo's names and meanings. Rows share a few such
 * structs, so read the members anew in each call. Their values differ by row, the timestep, dt and body_mass included,
 * because rows can have arrays of their own (mjenv_write, mjenv_randomize). Arrays marked "on demand" cost time in each
 * step, so they may be NULL unless build asked for them with mjenv_build_need. */
typedef struct mjenv_sim {
  uint32_t struct_size;
  mjenv_dtype action_dtype; /* of the caller's action in the callback step; undefined elsewhere */
  const mjenv_task_api *api;
  int32_t nq, nv, na, nu, nbody, njnt, ngeom, nsite, ntendon, nsensordata;
  int32_t contact_count; /* 0 unless build asked for "contacts" */
  int32_t reserved;      /* 0 */
  double timestep;       /* of one mj_step, s */
  double dt;             /* of one step of the environment (frame_skip timesteps), s */
  const double *time;    /* [1] since the reset, s */
  const double *action;  /* [nu] the row's action in the callback step, 0 in build, NaN in the other callbacks */
  const double *carried; /* [carry_count] the numbers that the row carries for the task */

  /* The state. */
  const double *qpos; /* [nq] */
  const double *qvel; /* [nv] */
  const double *act;  /* [na] */
  const double *ctrl; /* [nu] */

  /* Computed from the state; after a step, from an older one (see Numbers above). */
  const double *qacc;              /* [nv] */
  const double *xpos;              /* [nbody][3] */
  const double *xquat;             /* [nbody][4] */
  const double *xmat;              /* [nbody][9] */
  const double *xipos;             /* [nbody][3] */
  const double *ximat;             /* [nbody][9] */
  const double *xanchor;           /* [njnt][3] */
  const double *xaxis;             /* [njnt][3] */
  const double *geom_xpos;         /* [ngeom][3] on demand */
  const double *geom_xmat;         /* [ngeom][9] on demand */
  const double *site_xpos;         /* [nsite][3] */
  const double *site_xmat;         /* [nsite][9] */
  const double *subtree_com;       /* [nbody][3] */
  const double *cinert;            /* [nbody][10] */
  const double *cvel;              /* [nbody][6] */
  const double *cfrc_ext;          /* [nbody][6] on demand */
  const double *sensordata;        /* [nsensordata] */
  const double *actuator_length;   /* [nu] */
  const double *actuator_velocity; /* [nu] */
  const double *actuator_force;    /* [nu] */
  const double *qfrc_actuator;     /* [nv] */
  const double *qfrc_passive;      /* [nv] */
  const double *qfrc_bias;         /* [nv] */
  const double *qfrc_constraint;   /* [nv] */
  const double *ten_length;        /* [ntendon] */
  const double *ten_velocity;      /* [ntendon] */
  const mjenv_contact *contacts;   /* [contact_count] on demand */

  /* The model. */
  const double *qpos0;     /* [nq] of the model when the environment was built */
  const double *body_mass; /* [nbody] the row's own, if it was written or drawn */

  const void *const *arrays; /* arrays[i] is the array for which mjenv_build_array returned i */

  const double *parameters; /* the row's live parameters; see mjenv_build_parameter */
} mjenv_sim;

/* The initial state of an episode, which the reset callback changes. The comments say what each member holds before the
 * call. */
typedef struct mjenv_start {
  uint32_t struct_size;
  int32_t reserved; /* 0 */
  const mjenv_task_api *api;
  mjenv_random *random;      /* the row's random stream */
  const double *qpos0;       /* [nq] the model's initial positions */
  double *qpos;              /* [nq] equal to qpos0 */
  double *qvel;              /* [nv] 0 */
  double *act;               /* [na] 0 */
  double *carried;           /* [carry_count] 0, or what the row has kept (mjenv_build_keep); carry and the first step
                                read these numbers in mjenv_sim.carried */
  const void *const *arrays; /* as in mjenv_sim, but only the arrays of mjModel are valid here */
  int32_t nq, nv, na;
  int32_t carry_count;
  const double *parameters; /* the row's live parameters */
} mjenv_start;

/* The result of a step, which the step callback writes. The comments say what each member holds before the call. */
typedef struct mjenv_outcome {
  uint32_t struct_size;
  int32_t terminated;   /* 0. Any other number terminates the episode */
  double reward;        /* 0 */
  double *info;         /* the INFO fields, one after the other; all NaN */
  double *carried;      /* [carry_count] the numbers that the row carried into the step; the memory that
                           mjenv_sim.carried points to */
  mjenv_random *random; /* the row's random stream */
} mjenv_outcome;

/* ---- The task ---- */

/* A task. In a step the library calls step, carry and observe, in this order; in a reset it calls reset, carry, observe
 * and reset_info. It leaves out observe and reset_info when the caller does not want their output. It calls them
 * always for rows of mjenv_send, because only mjenv_recv tells what the caller wants, and calls observe always for
 * noisy, delayed and stacked observations (mjenv_perturb, the option "history"). */
typedef struct mjenv_task {
  uint32_t struct_size;
  int32_t revision;       /* increase it when the task changes, so that snapshots of the old task are refused */
  const char *id;         /* "Cartpole-v0": letters, digits, "_", "." and "-", then "-v" and a number of at most 9
                             digits. It begins with a letter, a digit or "_" and has at most 100 bytes */
  const char *model;      /* the default of the option xml_file: a built-in model ("hopper.xml"), or a path that begins
                             with ".", "/" or "~". A path that begins with "." is looked up from the folder of the
                             shared object or program that contains the callback step, or build if step is NULL; if
                             both are NULL, from the current folder */
  const char *model_text; /* the text of an MJCF model. Exactly one of model and model_text must be given */
  int32_t frame_skip;     /* how many mj_steps make a step: at least 1 */
  int32_t has_reward_threshold;    /* 0: the task has no reward_threshold */
  double reward_threshold;         /* the return from which the task counts as solved */
  int64_t time_limit;              /* the number of steps after which an episode is truncated; 0: never */
  int64_t carry_count;             /* how many numbers a row carries for the task; build may replace it, and must bound
                                      those that are used as indices or sizes (mjenv_build_carry_bounds) */
  const mjenv_task_camera *camera; /* NULL: MuJoCo's default camera */
  const mjenv_task_option *options;
  int64_t option_count;
  const mjenv_task_field *fields;
  int64_t field_count;
  void *user; /* passed to build; if build is NULL, passed to the other callbacks as self */

  /* Prepares an environment, once, when mjenv_create makes it: looks up names in the model, reads options, and stores
   * in *self what the other callbacks need. If it returns another number than 0, it must first free what it
   * allocated, because destroy is then not called. NULL: nothing to prepare. */
  int32_t (*build)(mjenv_builder *builder, void *user, void **self);

  /* Frees self when the environment is destroyed, or when mjenv_create fails after build has returned 0. NULL: nothing
   * to free. */
  void (*destroy)(void *self);

  /* Draws the initial state of an episode. If qpos, qvel or act is not finite afterwards, the reset fails, unless
   * the option "strict" is 0. Required, unless physics_only is 1. */
  int32_t (*reset)(const void *self, mjenv_start *start);

  /* Writes the RESET_INFO fields, one after the other, into info. May be NULL if there are none, and must
   * be NULL if physics_only is 1. */
  int32_t (*reset_info)(const void *self, const mjenv_sim *sim, double *info);

  /* Writes into carried[carry_count] what the next step needs to know of the present state. carried is the memory that
   * sim->carried points to. Called in each reset and step, and after mjenv_set_state and mjenv_simulate.
   * Also called before a step or mjenv_simulate of a row that mjenv_write, mjenv_set_constants, the draws of
   * mjenv_randomize, or mjenv_perturb (when it ends a push) have changed. Numbers that it does not write keep their
   * values. NULL: nothing to write. */
  int32_t (*carry)(const void *self, const mjenv_sim *sim, double *carried);

  /* Writes the OBSERVATION fields, one after the other, into observation. Must depend on nothing but sim.
   * If the observation contains a NaN, the call fails, unless the option "strict" is 0. Required, unless physics_only
   * is 1. */
  int32_t (*observe)(const void *self, const mjenv_sim *sim, double *observation);

  /* Computes the reward, the info and whether the episode has terminated. Called once in each step, after the
   * simulation has advanced by frame_skip mj_steps. If the reward is NaN, the step fails, unless the option "strict" is
   * 0. Required, unless physics_only is 1. */
  int32_t (*step)(const void *self, const mjenv_sim *sim, mjenv_outcome *outcome);

  /* 1: the callbacks run only on the thread that calls the library, for languages whose runtime knows no other threads.
   * The option num_threads must then be 1, or 0, which means 1. mjenv_send queues rows, and mjenv_recv steps them.
   * 0: the callbacks run on all threads of an environment. */
  int32_t caller_thread;

  /* 1: the program itself computes initial states, observations, rewards and infos, from the arrays that the option
   * "arrays" exports. reset, reset_info, carry, observe and step must be NULL: a reset gives the model's initial state,
   * observations and rewards are 0, and infos NaN. 0: the callbacks compute them. */
  int32_t physics_only;

  int32_t fixed_model;      /* 1: the task has no options xml_file, xml_string and trust_xml */
  int32_t fixed_frame_skip; /* 1: the task has no option frame_skip */
} mjenv_task;
#define MJENV_TASK_INIT                                                                                           \
  {                                                                                                               \
    sizeof(mjenv_task), 0, NULL, NULL, NULL, 1, 0, 0, 0, 0, NULL, NULL, 0, NULL, 0, NULL, NULL, NULL, NULL, NULL, \
        NULL, NULL, NULL, 0, 0, 0, 0                                                                              \
  }

/* Registers a task for the rest of the process. Any thread may call it at any time.
 * task  is copied with all that it points to, except the code of the callbacks and what user points to, which must stay
 *       valid until the process ends
 * Errors: ARGUMENT (a required pointer, name or callback is missing; destroy is given without build; carry is given
 * without build while carry_count is 0; model and model_text are both given, or neither is; a callback is given that
 * physics_only excludes; there are RESET_INFO fields without reset_info and without physics_only; or there is neither
 * build nor an OBSERVATION field), VALUE (the id is malformed or already registered, a name is malformed or stands twice,
 * a default is not among its choices, or a number is out of its bounds), TYPE (a task cannot have this kind, type or role). */
MJENV_API mjenv_status mjenv_register_task(const mjenv_task *task);

/* ---- Plug-ins ---- */

/* The tasks of a plug-in. */
typedef struct mjenv_plugin {
  uint32_t struct_size;
  uint32_t abi_version; /* MJENV_ABI_VERSION */
  const mjenv_task *const *tasks;
  int64_t task_count; /* at least 1 */
} mjenv_plugin;
#define MJENV_PLUGIN_INIT \
  { sizeof(mjenv_plugin), MJENV_ABI_VERSION, NULL, 0 }

/* Loads a plug-in and registers its tasks: all of them, or none if one is refused. When they are registered, the
 * plug-in is never unloaded.
 * Loading it again does nothing. Any thread may call this at any time.
 * path  a shared object that exports the function "mjenv_tasks" (see MJENV_PLUGIN). NULL: the plug-ins that the
 *       environment variable MJENV_TASKS lists, separated by ":". The first function that looks up an id loads these by
 *       itself; a call with NULL also reports why one of them could not be loaded
 * Errors: TASK (the file does not exist, is not a plug-in, or was built for another ABI version), and those of
 * mjenv_register_task. With NULL, all are TASK. */
MJENV_API mjenv_status mjenv_load_tasks(const char *path);

/* ---- Functions for callbacks ----
 * Callbacks call the inline functions below. These call the library through the pointers in mjenv_task_api, which every
 * callback but destroy is given, so that a plug-in need not link with libmjenv. */

struct mjenv_task_api {
  uint32_t struct_size;
  uint32_t abi_version; /* of the library */
  int32_t (*fail_with)(const char *message);

  int64_t (*integer)(mjenv_builder *builder, const char *option);
  void (*reals)(mjenv_builder *builder, const char *option, double *values, int64_t count);
  int32_t (*is_integer)(mjenv_builder *builder, const char *option);
  const char *(*text)(mjenv_builder *builder, const char *option);
  int32_t (*index)(mjenv_builder *builder, const char *type, const char *name);
  int32_t (*option_index)(mjenv_builder *builder, const char *option, const char *type);
  int32_t (*norm_is_fused)(mjenv_builder *builder);
  void (*need)(mjenv_builder *builder, const char *array);
  int32_t (*array)(mjenv_builder *builder, const char *name, mjenv_field *field);
  void (*field)(mjenv_builder *builder, const mjenv_task_field *field);
  void (*carry)(mjenv_builder *builder, int64_t count);
  void (*carry_bounds)(mjenv_builder *builder, int64_t first, int64_t count, double low, double high);

  double (*random)(mjenv_random *random);
  double (*uniform)(mjenv_random *random, double low, double high);
  double (*normal)(mjenv_random *random);
  int64_t (*integers)(mjenv_random *random, int64_t low, int64_t high);
  int64_t (*choice)(mjenv_random *random, int64_t count, const double *p);
  void (*sample)(mjenv_random *random, int64_t count, int64_t size, int64_t *chosen);
  void (*permutation)(mjenv_random *random, int64_t count, int64_t *order);

  int64_t (*parameter)(mjenv_builder *builder, const char *option);
  void (*keep)(mjenv_builder *builder, int64_t first, int64_t count);
};

/* Returns the library's functions for callbacks, for languages that look them up before a callback runs. Static. */
MJENV_API const mjenv_task_api *mjenv_task_functions(void);

struct mjenv_builder {
  uint32_t struct_size;
  int32_t failed; /* 1 after a function for build has failed. Then they all do nothing */
  const mjenv_task_api *api;
  const mjenv_sim *sim; /* the model's initial state after mj_forward; valid until build returns */
  mjenv_random *random; /* for a build that calls the task's own functions, for instance to find out how many numbers
                           they write. No row uses this stream. A draw that NumPy refuses does not make build fail,
                           because such calls may draw with arguments that never occur in a row */
};

struct mjenv_random {
  uint32_t struct_size;
  int32_t reserved; /* 0 */
  const mjenv_task_api *api;
};

/* Stores the reason of a failure. Returns 1, which the callback can return; see Errors above for other numbers.
 * message  is copied; at most 1023 bytes of it are kept. NULL: "" */
static inline int32_t mjenv_task_fail(const mjenv_task_api *api, const char *message) {
  return api->fail_with(message);
}

/* ---- Functions for build ----
 * If one of them fails, it returns 0 or "", and mjenv_create fails whatever build returns. */

/* Returns the value of an option of the kind FLAG or INTEGER. */
static inline int64_t mjenv_build_integer(mjenv_builder *builder, const char *option) {
  return builder->api->integer(builder, option);
}

/* Returns the value of an option of the kind REALS that holds one number. */
static inline double mjenv_build_real(mjenv_builder *builder, const char *option) {
  double value = 0;
  builder->api->reals(builder, option, &value, 1);
  return value;
}

/* Writes the numbers of an option of the kind REALS into values[count]. count must be how many numbers it holds. */
static inline void mjenv_build_reals(mjenv_builder *builder, const char *option, double *values, int64_t count) {
  builder->api->reals(builder, option, values, count);
}

/* Returns 1 if the caller set an option of the kind REALS to an integer, else 0. Use it to choose the type of a field
 * that is computed from the option, as Python does: there the product of an integer and a bool is an int, and that of a
 * float and a bool a float. */
static inline int32_t mjenv_build_is_integer(mjenv_builder *builder, const char *option) {
  return builder->api->is_integer(builder, option);
}

/* Returns the value of an option of the kind STRING. It is valid until build returns. */
static inline const char *mjenv_build_text(mjenv_builder *builder, const char *option) {
  return builder->api->text(builder, option);
}

/* Returns the index of a named object of the model. Fails if the model does not have it.
 * type  "body", "joint" and so on, as in mjenv_object_count */
static inline int32_t mjenv_build_index(mjenv_builder *builder, const char *type, const char *name) {
  return builder->api->index(builder, type, name);
}

/* Returns the index of the object that an option of the kind STRING_OR_INT names or numbers. Fails if the model does
 * not have it. */
static inline int32_t mjenv_build_option_index(mjenv_builder *builder, const char *option, const char *type) {
  return builder->api->option_index(builder, option, type);
}

/* Returns 1 if norms must be rounded as by a NumPy that uses fused multiply-add, else 0 (the option "norm").
 * See Norm in mjenv/numpy.hpp. A task that computes norms must call it: images of its rows can then be restored only in
 * environments that round norms alike. */
static inline int32_t mjenv_build_norm_is_fused(mjenv_builder *builder) { return builder->api->norm_is_fused(builder); }

/* Makes the library compute an array that it computes only on demand, so that it is up to date in all callbacks that
 * take a mjenv_sim. Fails for other names.
 * array  "contacts", "cfrc_ext", "geom_xpos" or "geom_xmat", which are members of mjenv_sim; or "cfrc_int", "cacc",
 *        "cam_xpos", "cam_xmat", "light_xpos" or "light_xdir". An array of mjenv_build_array needs no such call */
static inline void mjenv_build_need(mjenv_builder *builder, const char *array) { builder->api->need(builder, array); }

/* Makes an array of mjData or mjModel available in all callbacks that take a mjenv_sim. An array of mjModel is also
 * available in reset. Returns its index in mjenv_sim.arrays. Fails for unknown names and for those that begin with
 * "contact.", whose elements lie apart in MuJoCo's memory: call mjenv_build_need with "contacts" and read
 * mjenv_sim.contacts instead.
 * name   the array's name in MuJoCo, as in mjenv_read
 * field  receives the shape and the type of the elements (double for MJENV_DTYPE_FLOAT64, int32_t for MJENV_DTYPE_INT32
 *        and so on); NULL: not wanted */
static inline int32_t mjenv_build_array(mjenv_builder *builder, const char *name, mjenv_field *field) {
  return builder->api->array(builder, name, field);
}

/* Replaces the field that has the same role and name, or adds the field behind the others of its role. The field is
 * copied. If its doc is NULL or "", the doc of the field that it replaces stays. */
static inline void mjenv_build_field(mjenv_builder *builder, const mjenv_task_field *field) {
  builder->api->field(builder, field);
}

/* Replaces the task's carry_count. */
static inline void mjenv_build_carry(mjenv_builder *builder, int64_t count) { builder->api->carry(builder, count); }

/* Says that count of the numbers that a row carries, from number first on, always lie in [low, high], so that the task
 * can use them as indices or sizes. Without it, mjenv_restore gives a row any numbers that an image has, and an image
 * may come from a stranger. mjenv_restore refuses images with other numbers (MJENV_E_SNAPSHOT), and a callback that
 * writes one fails. The numbers need not be integers, but NaN is refused. [low, high] must contain 0, which a row
 * carries until its first reset. Where several bounds concern a number, all of them hold. */
static inline void mjenv_build_carry_bounds(mjenv_builder *builder, int64_t first, int64_t count, double low,
                                            double high) {
  builder->api->carry_bounds(builder, first, count, low, high);
}

/* Says that count of the numbers that a row carries, from number first on, stay after resets: a terrain's level, for
 * instance. step and reset write them; they are 0 until the row's first reset. */
static inline void mjenv_build_keep(mjenv_builder *builder, int64_t first, int64_t count) {
  builder->api->keep(builder, first, count);
}

/* Returns the index of a live parameter's first number in mjenv_sim.parameters and mjenv_start.parameters. Callbacks see
 * what the caller wrote last. In build, they are the option's values. Fails if the option is not live. */
static inline int64_t mjenv_build_parameter(mjenv_builder *builder, const char *option) {
  return builder->api->parameter(builder, option);
}

/* Calls mjenv_build_field for a vector of np.float64 with this length and no doc. */
static inline void mjenv_build_length(mjenv_builder *builder, mjenv_role role, const char *name, int64_t length) {
  mjenv_task_field field = MJENV_TASK_FIELD_INIT;
  field.role = role;
  field.name = name;
  field.ndim = 1;
  field.shape[0] = length;
  builder->api->field(builder, &field);
}

/* ---- Functions for reset and step: the row's random stream ----
 * Each returns what numpy.random.Generator's method returns and leaves the stream in the same state. Arguments that
 * NumPy refuses make the callback fail. */

/* random(): a number in [0, 1). */
static inline double mjenv_random_real(mjenv_random *random) { return random->api->random(random); }

/* uniform(low, high): a number in [low, high). high - low must be finite and not negative. */
static inline double mjenv_random_uniform(mjenv_random *random, double low, double high) {
  return random->api->uniform(random, low, high);
}

/* standard_normal(). NumPy computes normal(mean, deviation) as mean + deviation * standard_normal(). */
static inline double mjenv_random_normal(mjenv_random *random) { return random->api->normal(random); }

/* integers(low, high): an integer in [low, high). low must be less than high. */
static inline int64_t mjenv_random_integers(mjenv_random *random, int64_t low, int64_t high) {
  return random->api->integers(random, low, high);
}

/* choice(count, p=p): an integer in [0, count). count must be at least 1.
 * p  [count] the probabilities, whose sum is 1; NULL: all numbers are equally likely */
static inline int64_t mjenv_random_choice(mjenv_random *random, int64_t count, const double *p) {
  return random->api->choice(random, count, p);
}

/* choice(count, size, replace=False): writes size different integers of [0, count) into chosen[size]. size must not
 * exceed count. */
static inline void mjenv_random_sample(mjenv_random *random, int64_t count, int64_t size, int64_t *chosen) {
  random->api->sample(random, count, size, chosen);
}

/* permutation(count): writes the integers of [0, count) in random order into order[count]. */
static inline void mjenv_random_permutation(mjenv_random *random, int64_t count, int64_t *order) {
  random->api->permutation(random, count, order);
}

/* ---- The entry of a plug-in ---- */

/* The type of the function "mjenv_tasks", which every plug-in exports. It returns the plug-in's tasks, which the
 * library copies. To fail, it calls mjenv_task_fail and returns NULL. Several threads may call it at the same time. */
typedef const mjenv_plugin *mjenv_tasks_function(const mjenv_task_api *api);

/* Defines the function "mjenv_tasks" of a plug-in in C: MJENV_PLUGIN(&cartpole, &reach) for two structs mjenv_task. In
 * C++, use mjenv/task.hpp, or write this inside extern "C" { }. */
#define MJENV_PLUGIN(...)                                                               \
  MJENV_EXPORT const mjenv_plugin *mjenv_tasks(const mjenv_task_api *api);              \
  const mjenv_plugin *mjenv_tasks(const mjenv_task_api *api) {                          \
    static const mjenv_task *const tasks[] = {__VA_ARGS__};                             \
    static const mjenv_plugin plugin = {sizeof(mjenv_plugin), MJENV_ABI_VERSION, tasks, \
                                        (int64_t)(sizeof tasks / sizeof *tasks)};       \
    (void)api;                                                                          \
    return &plugin;                                                                     \
  }

#ifdef __cplusplus
}
#endif

#endif
