/* task.h - For defining your own robots and tasks, which then work like the built-in ones. docs/tasks/index.md shows how
 * to write them; docs/c.md (Tasks) describes in detail what the library does.
 *
 * Task
 *   A struct mjenv_task: a description and callbacks. mjenv_register_task makes its id known to mjenv.h's functions.
 * Plug-in
 *   A shared object that exports tasks (MJENV_PLUGIN) and is loaded by mjenv_load_tasks. It needs only this header, and
 *   does not link with libmjenv.
 * Threads
 *   build and destroy run on the thread that creates or destroys the environment, the other callbacks on the threads
 *   that step rows. Each call concerns one row, and calls for different rows run at the same time, so a callback
 *   changes only the memory that it is given to write. A row "carries" the numbers that a task needs from step to step
 *   (carry_count).
 * Errors
 *   A callback returns 0, or fails with `return mjenv_task_fail(api, "the reason")`. The function of mjenv.h then
 *   returns MJENV_E_TASK, or what the callback returned if this is MJENV_E_MEMORY or (in build) MJENV_E_MODEL. Wrong
 *   arguments of the functions below make the callback fail; it need not check for errors. In build, mjenv_create then
 *   returns the status that says why, such as MJENV_E_NAME.
 * Forbidden
 *   A callback must not fork, end its thread, or use its own environment. It must return: neither longjmp nor a C++
 *   exception may leave it.
 * Numbers
 *   After a step, a callback sees mjData as mj_step leaves it: qpos, qvel, act and time are new, but everything that
 *   mj_step computes from them (xpos, contacts, ...) belongs to the state one timestep before. If a task calls
 *   mjenv_build_current, its callbacks see what belongs to the new state.
 * Compatibility
 *   docs/abi.md has the rules. In an array of structs, all elements have the struct_size of the first. */
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

/* A constructor option of the task. Its name must differ from those of the options that every task has, which docs/c.md
 * lists. */
typedef struct mjenv_task_option {
  uint32_t struct_size;
  mjenv_kind kind;
  const char *name;     /* without blanks and quotes; unique in the task */
  const char *doc;      /* one line of documentation; NULL: none */
  double value;         /* the default of a FLAG, an INTEGER, REALS with count 0, and STRING_OR_INT with text NULL */
  double low, high;     /* closed bounds of each number; both 0: the kind's own (FLAG: 0 and 1; INTEGER: -(2^53 - 1) and
                           2^53 - 1; STRING_OR_INT: 0 and 2^31 - 1; REALS: infinite) */
  const double *values; /* [count] the defaults of REALS that hold several numbers */
  int64_t count;        /* how many numbers REALS hold; 0: one number, whose default is value */
  const char *text;     /* the default of a STRING (NULL: "") or of a STRING_OR_INT (NULL: value) */
  const char *choices;  /* the valid texts of a STRING, separated by blanks; NULL: any text */
  int32_t live;         /* 1: a live parameter, only for REALS. Each row has numbers of its own, at first the option's.
                           mjenv_write changes them; callbacks read mjenv_sim.parameters (mjenv_build_parameter) */
  int32_t reserved;     /* 0 */
} mjenv_task_option;

/* One named part of the observation, the info or the reset info; a role's parts are stored one after the other. With
 * the role REWARD (at most one field, a scalar), it sets the reward's type and doc. With the role STRUCTURE, it is an
 * entry of Gymnasium's observation_structure: ndim is 1, and shape[0] is the entry's value. */
typedef struct mjenv_task_field {
  uint32_t struct_size;
  mjenv_role role;   /* OBSERVATION, INFO, RESET_INFO, REWARD or STRUCTURE */
  const char *name;  /* without blanks and quotes; unique in its role */
  const char *doc;   /* one line with the unit; NULL: the library's own text if a built-in robot has a field of this
                        name, else none */
  mjenv_dtype dtype; /* the type in Python; 0: FLOAT64. An observation is always np.float64 */
  int32_t ndim;      /* 0 (a scalar) to 4 dimensions; at most 1 in the observation, where 0 is a vector of length 1 */
  int64_t shape[4];  /* the first ndim are used; -1: build sets the length. A role has at most 16777216 elements */
  const char *group; /* of a term of the observation: the group to which it belongs, such as "policy" or "critic". The
                        terms of a group stand one after the other. NULL: none */
} mjenv_task_field;

/* Gymnasium's default_camera_config. Where a value is NaN or MJENV_BODY_UNSET, MuJoCo's default applies. */
typedef struct mjenv_task_camera {
  uint32_t struct_size;
  int32_t trackbodyid; /* the index of a body, -1 for none, or MJENV_BODY_UNSET */
  double distance;     /* m */
  double lookat[3];    /* m */
  double elevation;    /* degrees */
} mjenv_task_camera;

/* ---- The data that callbacks read and write ---- */

/* A contact between two geoms. This struct never grows. */
typedef struct mjenv_contact {
  int32_t geom1, geom2; /* the indices of the geoms */
  double distance;      /* between the geoms, m; negative if they overlap */
  double position[3];   /* the point midway between the geoms, m */
  double frame[9];      /* the contact frame: one axis per row. The first is the normal, from geom1 to geom2 */
  double force[6];      /* the force (N), then the torque (N m), in the contact frame: mj_contactForce */
} mjenv_contact;

/* One row's simulation, which callbacks only read. The arrays have MuJoCo's names and meanings. The library uses one
 * such struct for many rows, and all values can differ between rows (mjenv_write, mjenv_randomize). So read the members
 * anew in each call. Arrays marked "on demand" may be NULL unless build asked for them with mjenv_build_need. */
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
  const double *action;  /* [action_count] the row's action in before_step, before_substep and step, 0 in build, NaN in
                            the other callbacks */
  const double *carried; /* [carry_count] the numbers that the row carries for the task */

  /* The state. */
  const double *qpos; /* [nq] */
  const double *qvel; /* [nv] */
  const double *act;  /* [na] */
  const double *ctrl; /* [nu] */

  /* Computed from the state. After a step they belong to an older state (see Numbers above). */
  const double *qacc;                                                       /* [nv] */
  const double *xpos;                                                       /* [nbody][3] */
  const double *xquat;                                                      /* [nbody][4] */
  const double *xmat;                                                       /* [nbody][9] */
  const double *xipos;                                                      /* [nbody][3] */
  const double *ximat;                                                      /* [nbody][9] */
  const double *xanchor, *xaxis;                                            /* [njnt][3] */
  const double *geom_xpos;                                                  /* [ngeom][3] on demand */
  const double *geom_xmat;                                                  /* [ngeom][9] on demand */
  const double *site_xpos;                                                  /* [nsite][3] */
  const double *site_xmat;                                                  /* [nsite][9] */
  const double *subtree_com;                                                /* [nbody][3] */
  const double *cinert;                                                     /* [nbody][10] */
  const double *cvel;                                                       /* [nbody][6] */
  const double *cfrc_ext;                                                   /* [nbody][6] on demand */
  const double *sensordata;                                                 /* [nsensordata] */
  const double *actuator_length, *actuator_velocity, *actuator_force;       /* [nu] */
  const double *qfrc_actuator, *qfrc_passive, *qfrc_bias, *qfrc_constraint; /* [nv] */
  const double *ten_length, *ten_velocity;                                  /* [ntendon] */
  const mjenv_contact *contacts;                                            /* [contact_count] on demand */

  /* The model. */
  const double *qpos0;     /* [nq] of the model when the environment was built */
  const double *body_mass; /* [nbody] the row's own, if it was written or drawn */

  const void *const *arrays; /* arrays[i] is the array for which mjenv_build_array returned i */

  const double *parameters; /* the row's live parameters; see mjenv_build_parameter */
  int32_t action_count;     /* how many numbers an action has: nu, or what mjenv_build_action said */
  int32_t reserved2;        /* 0 */
} mjenv_sim;

/* The initial state of an episode. In: what the comments say. Out: what reset writes. */
typedef struct mjenv_start {
  uint32_t struct_size;
  int32_t reserved; /* 0 */
  const mjenv_task_api *api;
  mjenv_random *random;      /* the row's random stream */
  const double *qpos0;       /* [nq] the model's initial positions */
  double *qpos;              /* [nq] equal to qpos0 */
  double *qvel;              /* [nv] 0 */
  double *act;               /* [na] 0 */
  double *carried;           /* [carry_count] 0, or what the row has kept (mjenv_build_keep) */
  const void *const *arrays; /* as in mjenv_sim, but only the arrays of mjModel are valid here */
  int32_t nq, nv, na;
  int32_t carry_count;
  const double *parameters; /* the row's live parameters */
  const mjenv_sim *sim; /* NULL unless the task has called mjenv_build_current: the simulation; qpos, qvel and act above
                           are its state. Up to date after mjenv_start_forward and the like, and before reset writes
                           anything */
  double *time;         /* of the simulation, s; NULL where sim is */
  double *const *own; /* own[i] is the row's own array of mjModel for which mjenv_build_own returned i: reset writes it.
                         NULL for qfrc_applied and xfrc_applied, which are 0 after a reset */
} mjenv_start;

/* The result of a step. In: what the comments say. Out: what step writes. */
typedef struct mjenv_outcome {
  uint32_t struct_size;
  int32_t terminated;   /* 0. Any other number terminates the episode */
  double reward;        /* 0 */
  double *info;         /* the INFO fields, one after the other; all NaN */
  double *carried;      /* [carry_count] as before the step; the memory that mjenv_sim.carried points to */
  mjenv_random *random; /* the row's random stream */
  double *const *own;   /* own[i] is the row's own array for which mjenv_build_own returned i. What step writes takes
                           effect in the next step; if the step fails, the row keeps its old values */
  double *qvel; /* [nv] as in mjenv_sim. What step writes, such as a kick, is the row's qvel: carry, observe and the
                   next step see it. What MuJoCo has computed still belongs to the old velocities */
} mjenv_outcome;

/* What drives the simulation in a step. In: what the comments say. Out: what before_step and before_substep write. */
typedef struct mjenv_control {
  uint32_t struct_size;
  int32_t substep; /* which mj_step of the step comes next, from 0 on */
  double *ctrl;    /* [nu] before_step: as the last step has left it, 0 after a reset. before_substep: as before_step or
                            the last call has left it; without before_step, the action */
  double *carried; /* [carry_count] the memory that mjenv_sim.carried points to */
  mjenv_random *random; /* the row's random stream */
  double *const *own; /* own[i] is the row's qfrc_applied or xfrc_applied for which mjenv_build_own returned i; NULL for
                         arrays of mjModel. The forces act until they are written again or the row is reset */
  double *qvel; /* [nv] the velocities with which the step begins, for before_step. NULL for before_substep, and for
                         tasks that called mjenv_build_current */
} mjenv_control;

/* ---- The task ---- */

/* A task. A step calls before_step, before_substep before each mj_step, then step, carry and observe, in this order;
 * a reset calls reset, carry, observe and reset_info. observe and reset_info are not called if nobody wants their
 * output. */
typedef struct mjenv_task {
  uint32_t struct_size;
  int32_t revision;       /* increase it when the task changes, so that snapshots of the old task are refused */
  const char *id;         /* "Cartpole-v0": letters, digits, "_", "." and "-", then "-v" and a number of at most 9
                             digits. It begins with a letter, a digit or "_" and has at most 100 bytes. A namespace may
                             stand before it: "dm_control/cheetah-run-v0" */
  const char *model;      /* the default of the option xml_file: a built-in model ("hopper.xml"), or a path that begins
                             with "/", "~" or "."; "." is the folder of the shared object that contains step (or
                             build, if step is NULL) */
  const char *model_text; /* the text of an MJCF model, instead of model; give exactly one of the two */
  int32_t frame_skip;     /* how many times a step calls mj_step; at least 1 */
  int32_t has_reward_threshold;    /* 0: the task has no reward_threshold */
  double reward_threshold;         /* the return from which the task counts as solved */
  int64_t time_limit;              /* the number of steps after which an episode is truncated; 0: never */
  int64_t carry_count;             /* how many numbers a row carries for the task. Snapshots contain them, so
                                      indices and sizes need bounds (mjenv_build_carry_bounds) */
  const mjenv_task_camera *camera; /* NULL: MuJoCo's default camera */
  const mjenv_task_option *options;
  int64_t option_count;
  const mjenv_task_field *fields;
  int64_t field_count;
  void *user; /* passed to build; if build is NULL, passed to the other callbacks as self */

  /* Prepares an environment, which mjenv_create creates, and stores in *self what the other callbacks need. If it
   * fails, it must free what it has allocated, because destroy is then not called. NULL: there is nothing to
   * prepare. */
  int32_t (*build)(mjenv_builder *builder, void *user, void **self);

  /* Frees self when the environment is destroyed, or when mjenv_create fails after build. NULL: there is nothing to
   * free. */
  void (*destroy)(void *self);

  /* Draws the initial state of an episode. It fails if the state is not finite, unless the option "strict" is 0. */
  int32_t (*reset)(const void *self, mjenv_start *start);

  /* Writes the RESET_INFO fields into info. NULL: there are none. */
  int32_t (*reset_info)(const void *self, const mjenv_sim *sim, double *info);

  /* Writes what the next step needs to know of the present state into carried[carry_count], to which sim->carried
   * points, too. Also called after functions that change a row's state or own values. NULL: there is nothing to
   * write. */
  int32_t (*carry)(const void *self, const mjenv_sim *sim, double *carried);

  /* Writes the OBSERVATION fields, which depend on sim alone. It fails if one is NaN, unless "strict" is 0. */
  int32_t (*observe)(const void *self, const mjenv_sim *sim, double *observation);

  /* Computes the reward, the info and whether the episode has terminated, once in each step, after frame_skip mj_steps.
   * It fails if the reward is NaN, unless "strict" is 0. */
  int32_t (*step)(const void *self, const mjenv_sim *sim, mjenv_outcome *outcome);

  /* 1: the callbacks run only on the thread that calls the library; num_threads must be 0 or 1 (see mjenv_send). */
  int32_t caller_thread;

  /* 1: the program itself computes observations, rewards and infos (mjenv_begin, mjenv_advance, mjenv_finish). All
   * callbacks except build, destroy and reset must then be NULL. If reset is NULL, too, an episode begins in the model's
   * initial state. mjenv_reset and mjenv_step work, too: their observations and rewards are 0, and infos NaN. 0: reset,
   * observe and step are required. */
  int32_t physics_only;

  int32_t fixed_model;      /* 1: the task has no options xml_file, xml_string and trust_xml */
  int32_t fixed_frame_skip; /* 1: the task has no option frame_skip */

  /* Turns the action into ctrl, once in each step, before its first mj_step. NULL: ctrl is the action. In before_step
   * and before_substep, these members of sim are not valid: those from qacc to contacts, contact_count, and the arrays
   * of mjData in `arrays`. They may belong to other rows or older states. Both callbacks fail if they write a ctrl that
   * is not finite, unless "strict" is 0. If lanes cannot finish the step of a row, the row is stepped again by MuJoCo,
   * and both are called again with the same numbers. */
  int32_t (*before_step)(const void *self, const mjenv_sim *sim, mjenv_control *control);

  /* Changes ctrl or forces before each mj_step. NULL: ctrl and forces stay the same during a step. */
  int32_t (*before_substep)(const void *self, const mjenv_sim *sim, mjenv_control *control);

  /* Computes the reward of one pair of goals, for hindsight experience replay (mjenv_compute_reward). The observation
   * needs the groups or terms achieved_goal and desired_goal. The reward depends on the goals alone. NULL: there is
   * none.
   * achieved, desired  [size] */
  int32_t (*compute_reward)(const void *self, const mjenv_task_api *api, const double *achieved, const double *desired,
                            int64_t size, double *reward);
} mjenv_task;

/* Registers a task until the process ends. Any thread may call this at any time.
 * task  is copied with all that it points to, except the code of the callbacks and what user points to
 * Errors: ARGUMENT (something required is missing, or two members exclude each other), VALUE (an id or name is
 * malformed or known already, a default is not among its choices, or a number is out of its bounds), TYPE (a task
 * cannot have this kind, type or role). */
MJENV_API mjenv_status mjenv_register_task(const mjenv_task *task);

/* ---- Plug-ins ---- */

/* The tasks of a plug-in. */
typedef struct mjenv_plugin {
  uint32_t struct_size;
  uint32_t abi_version; /* MJENV_ABI_VERSION */
  const mjenv_task *const *tasks;
  int64_t task_count; /* at least 1 */
} mjenv_plugin;

/* Initialisers, which set struct_size and valid values: mjenv_task task = MJENV_TASK_INIT; */
/* clang-format off */
#define MJENV_TASK_OPTION_INIT \
  {sizeof(mjenv_task_option), MJENV_KIND_REALS, NULL, NULL, 0, 0, 0, NULL, 0, NULL, NULL, 0, 0}
#define MJENV_TASK_FIELD_INIT \
  {sizeof(mjenv_task_field), MJENV_ROLE_OBSERVATION, NULL, NULL, MJENV_DTYPE_FLOAT64, 0, {0, 0, 0, 0}, NULL}
#define MJENV_TASK_CAMERA_INIT \
  {sizeof(mjenv_task_camera), MJENV_BODY_UNSET, MJENV_NAN, {MJENV_NAN, MJENV_NAN, MJENV_NAN}, MJENV_NAN}
#define MJENV_TASK_INIT \
  {sizeof(mjenv_task), 0, NULL, NULL, NULL, 1, 0, 0, 0, 0, NULL, NULL, 0, NULL, 0, NULL, NULL, NULL, NULL, NULL, \
   NULL, NULL, NULL, 0, 0, 0, 0, NULL, NULL, NULL}
#define MJENV_PLUGIN_INIT {sizeof(mjenv_plugin), MJENV_ABI_VERSION, NULL, 0}
/* clang-format on */

/* Loads a plug-in and registers its tasks: all of them, or none if one is refused. The plug-in is never unloaded;
 * loading it again does nothing. Any thread may call this at any time.
 * path  a shared object that exports "mjenv_tasks" (MJENV_PLUGIN). NULL: the plug-ins that the environment variable
 *       MJENV_TASKS lists, separated by ":" (on Windows by ";"); the first function that looks up an id also loads them
 * Errors: TASK (the file is missing, is not a plug-in, or was built for another ABI version), and those of
 * mjenv_register_task. With NULL, all are TASK. */
MJENV_API mjenv_status mjenv_load_tasks(const char *path);

/* ---- Functions for callbacks ----
 * The inline functions below call the library through these pointers, which the library passes to every callback except
 * destroy. */

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
  void (*current)(mjenv_builder *builder);
  int32_t (*own)(mjenv_builder *builder, const char *name);
  void (*random_state)(mjenv_builder *builder);
  int32_t (*forward)(mjenv_start *start);
  int32_t (*advance)(mjenv_start *start, int64_t count);
  int32_t (*restart)(mjenv_start *start);
  int64_t (*contact_count)(mjenv_start *start);
  double (*state_rand)(mjenv_random *random);
  double (*state_uniform)(mjenv_random *random, double low, double high);
  double (*state_randn)(mjenv_random *random);
  int64_t (*state_randint)(mjenv_random *random, int64_t low, int64_t high);
  int64_t (*state_choice)(mjenv_random *random, int64_t count, const double *p);
  int32_t (*state_is_new)(mjenv_random *random);
  void (*action)(mjenv_builder *builder, int64_t count, const double *low, const double *high);
  void (*state_permutation)(mjenv_random *random, int64_t count, int64_t *order);
  int32_t (*control_forward)(mjenv_control *control);
};

/* Returns the library's functions for callbacks, for languages that need them before a callback runs. The struct is
 * static. */
MJENV_API const mjenv_task_api *mjenv_task_functions(void);

struct mjenv_builder {
  uint32_t struct_size;
  int32_t failed; /* 1 after a function for build has failed; all such functions then do nothing */
  const mjenv_task_api *api;
  const mjenv_sim *sim; /* the model's initial state after mj_forward; valid until build returns */
  mjenv_random *random; /* belongs to no row: for trial calls of the task's own functions */
  mjenv_task *task; /* the environment's own copy of the task. build may replace its callbacks, such as before_step, or
                       set them to NULL: a task can have a callback under an option. Changes of other members have no
                       effect */
};

struct mjenv_random {
  uint32_t struct_size;
  int32_t reserved; /* 0 */
  const mjenv_task_api *api;
};

/* Stores the reason of a failure, at most 1023 bytes of it; NULL means "". Returns 1, which the callback can return. */
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

/* Returns 1 if the caller set an option of the kind REALS to an integer, else 0. In Python, the type of a result can
 * depend on this: the product of the option and a bool is an int or a float. */
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

/* Returns the index of the object that an option of the kind STRING_OR_INT gives by its name or index. */
static inline int32_t mjenv_build_option_index(mjenv_builder *builder, const char *option, const char *type) {
  return builder->api->option_index(builder, option, type);
}

/* Returns 1 if norms must be rounded as by a NumPy that uses fused multiply-add (the option "norm"; Norm in
 * mjenv/numpy.hpp), else 0. A task that computes norms must call this, so that the library can refuse images that were
 * made with the other rounding. */
static inline int32_t mjenv_build_norm_is_fused(mjenv_builder *builder) { return builder->api->norm_is_fused(builder); }

/* Makes a member of mjenv_sim that is computed on demand available in all callbacks that take a mjenv_sim.
 * array  "contacts", "cfrc_ext", "geom_xpos" or "geom_xmat"; also accepted are other arrays that are computed on demand
 *        ("cfrc_int", "cacc", "cam_xpos", "cam_xmat", "light_xpos", "light_xdir"), but mjenv_build_array, by which
 *        callbacks read those, makes them available by itself */
static inline void mjenv_build_need(mjenv_builder *builder, const char *array) { builder->api->need(builder, array); }

/* Makes an array of mjData or mjModel available in all callbacks that take a mjenv_sim, one of mjModel also in reset.
 * Returns its index in mjenv_sim.arrays. Fails for unknown names, "warnings" and "contact.*": read mjenv_sim.contacts.
 * name   the array's name in MuJoCo, as in mjenv_read
 * field  receives the shape and the dtype, which tells the C type of the elements (double for MJENV_DTYPE_FLOAT64, and
 *        so on); NULL: not wanted */
static inline int32_t mjenv_build_array(mjenv_builder *builder, const char *name, mjenv_field *field) {
  return builder->api->array(builder, name, field);
}

/* Replaces the field that has the same role and name (its doc and group stay if the new ones are NULL or ""), or adds
 * the field behind the others of its role. The field is copied. */
static inline void mjenv_build_field(mjenv_builder *builder, const mjenv_task_field *field) {
  builder->api->field(builder, field);
}

/* Replaces the task's carry_count. */
static inline void mjenv_build_carry(mjenv_builder *builder, int64_t count) { builder->api->carry(builder, count); }

/* Sets bounds of the carried numbers with the indices `first` to `first + count - 1`: mjenv_restore refuses an image in
 * which one of them is NaN or outside of [low, high], and a callback that writes such a number fails. [low, high] must
 * contain 0. If a number has several bounds, all of them apply. */
static inline void mjenv_build_carry_bounds(mjenv_builder *builder, int64_t first, int64_t count, double low,
                                            double high) {
  builder->api->carry_bounds(builder, first, count, low, high);
}

/* Makes the carried numbers with the indices `first` to `first + count - 1` stay after resets: a terrain's level, for
 * instance. step and reset write them; they are 0 until the row's first reset. */
static inline void mjenv_build_keep(mjenv_builder *builder, int64_t first, int64_t count) {
  builder->api->keep(builder, first, count);
}

/* Returns the index of a live parameter's first number in mjenv_sim.parameters and mjenv_start.parameters. Callbacks
 * find there what the caller wrote last; build finds the option's values. Fails if the option is not live. */
static inline int64_t mjenv_build_parameter(mjenv_builder *builder, const char *option) {
  return builder->api->parameter(builder, option);
}

/* Makes callbacks see what belongs to the new state. After the last mj_step of a step, the library computes the stages
 * of mj_step1: positions, velocities, contacts and the sensors that depend on them then belong to the new qpos and
 * qvel; forces, accelerations and their sensors belong to the state before, and mjenv_contact.force is 0. In these
 * stages MuJoCo 2.2.2 normalises the quaternions in qpos, but the next step begins with qpos as it was before that. A
 * reset calls mj_forward with actuation disabled before and after the callback, and the callback can simulate
 * (mjenv_start_forward and the like). */
static inline void mjenv_build_current(mjenv_builder *builder) { builder->api->current(builder); }

/* Sets the action space: an action has count >= 1 numbers, and number i is in [low[i], high[i]]. The task must have the
 * callback before_step, which turns them into ctrl, or be physics_only: the program then passes ctrl to mjenv_advance.
 * low, high  [count], which may be infinite; NULL: -infinity, infinity */
static inline void mjenv_build_action(mjenv_builder *builder, int64_t count, const double *low, const double *high) {
  builder->api->action(builder, count, low, high);
}

/* Gives each row its own copy of an array, which callbacks write as own[i], and returns i. reset (mjenv_start) and step
 * (mjenv_outcome) write arrays of mjModel, and what they write stays, also after resets. before_step, before_substep
 * (mjenv_control) and step write qfrc_applied and xfrc_applied. A callback fails if it writes numbers that mjenv_write
 * refuses, and the row keeps its old values. The elements are doubles; where MuJoCo has float32 (hfield_data,
 * geom_rgba), they are rounded. Fails for all other arrays of mjData, for arrays of mjModel that mjenv_write refuses or
 * that hold integers, for options such as "opt.timestep", and if it was called for this array before. */
static inline int32_t mjenv_build_own(mjenv_builder *builder, const char *name) {
  return builder->api->own(builder, name);
}

/* Gives each row a stream of NumPy's RandomState, of 2.5 kB, besides its default_rng. Only reset draws from it.
 * mjenv_seed seeds both. NumPy refuses seeds above 2^32 - 1; such a seed is passed on as the list of its 32-bit
 * words. */
static inline void mjenv_build_random_state(mjenv_builder *builder) { builder->api->random_state(builder); }

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

/* choice(count, size, replace=False): writes size different integers of [0, count) into chosen[size]; size <= count. */
static inline void mjenv_random_sample(mjenv_random *random, int64_t count, int64_t size, int64_t *chosen) {
  random->api->sample(random, count, size, chosen);
}

/* permutation(count): writes the integers of [0, count) in random order into order[count]. */
static inline void mjenv_random_permutation(mjenv_random *random, int64_t count, int64_t *order) {
  random->api->permutation(random, count, order);
}

/* ---- Functions for reset: RandomState ----
 * What the methods of numpy.random.RandomState return, for tasks that called mjenv_build_random_state. Arguments that
 * NumPy refuses make the callback fail. */

static inline double mjenv_random_state_rand(mjenv_random *random) { return random->api->state_rand(random); }
static inline double mjenv_random_state_uniform(mjenv_random *random, double low, double high) {
  return random->api->state_uniform(random, low, high);
}
static inline double mjenv_random_state_randn(mjenv_random *random) { return random->api->state_randn(random); }
/* randint(low, high), where high - low is 1 to 2^32 */
static inline int64_t mjenv_random_state_randint(mjenv_random *random, int64_t low, int64_t high) {
  return random->api->state_randint(random, low, high);
}
/* As mjenv_random_choice, where count is 1 to 2^32. */
static inline int64_t mjenv_random_state_choice(mjenv_random *random, int64_t count, const double *p) {
  return random->api->state_choice(random, count, p);
}
/* As mjenv_random_permutation, where count is at most 2^32. shuffle(x), which draws the same numbers, moves x[order[i]]
 * to x[i]. */
static inline void mjenv_random_state_permutation(mjenv_random *random, int64_t count, int64_t *order) {
  random->api->state_permutation(random, count, order);
}
/* Returns 1 if no number was drawn since the stream was seeded, else 0. */
static inline int32_t mjenv_random_state_is_new(mjenv_random *random) { return random->api->state_is_new(random); }

/* ---- Functions for reset: the simulation ----
 * For tasks that called mjenv_build_current. All but the last return 0, or another number if MuJoCo fails; the callback
 * then fails whatever it returns. */

/* Calls mj_forward with actuation disabled, for the qpos, qvel, act and own arrays that reset has written. */
static inline int32_t mjenv_start_forward(mjenv_start *start) { return start->api->forward(start); }
/* Simulates count >= 1 timesteps, then computes the stages of mj_step1. Except with RK4, the first timestep continues
 * from what was computed last (mj_step2), even if qpos was written since. */
static inline int32_t mjenv_start_advance(mjenv_start *start, int64_t count) {
  return start->api->advance(start, count);
}
/* Begins again: calls mj_resetData, which does not change the row's own arrays, then mjenv_start_forward. */
static inline int32_t mjenv_start_restart(mjenv_start *start) { return start->api->restart(start); }
/* Returns how many contacts the last of these calls has found. */
static inline int64_t mjenv_start_contact_count(mjenv_start *start) { return start->api->contact_count(start); }

/* ---- A function for before_step ---- */

/* Calls mj_forward for the velocities and ctrl as they are, as programs do that call Gymnasium's set_state before each
 * step: MuJoCo 2.2.2 then solves the constraints of the step from this result, so the bits differ. Not for tasks that
 * called mjenv_build_current. Returns 0, or another number if MuJoCo fails; the callback then fails whatever it returns. */
static inline int32_t mjenv_control_forward(mjenv_control *control) {
  return control->random->api->control_forward(control);
}

/* ---- The entry of a plug-in ---- */

/* The function "mjenv_tasks" that a plug-in exports. It returns the tasks, which the library copies; or it calls
 * mjenv_task_fail and returns NULL. Several threads may call it at the same time. */
typedef const mjenv_plugin *mjenv_tasks_function(const mjenv_task_api *api);

/* Defines "mjenv_tasks" in C: MJENV_PLUGIN(&cartpole, &reach) for two structs mjenv_task. In C++, write it inside of
 * extern "C" { }, or use mjenv/task.hpp. */
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
