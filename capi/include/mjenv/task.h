/* task.h - your own robot and task, under an id of your own, with all that the built-in ones have.
 *
 * Task       A struct of descriptions and callbacks. mjenv_register_task makes its id known to every function that
 *            takes one. A shared object with tasks is a plug-in: mjenv_load_tasks loads it in any language. A plug-in
 *            needs this header alone: it does not link with libmjenv.
 * Rows       A callback sees one row. The library calls it for different rows at once on different threads, so a
 *            callback changes nothing but what it is given to write. State of the task that outlives a callback is
 *            carried: numbers that belong to the row, so that snapshots, copies of rows and any number of threads
 *            keep it.
 * Errors     A callback that returns another number than 0 has failed: return mjenv_task_fail(api, "why"). The row
 *            keeps its state, other rows are stepped, and the call gives MJENV_E_TASK, naming the id and the row.
 *            An unknown name, a wrong kind of option or an impossible range that a callback passes to a function of
 *            this header is such a failure, too, so its callers need not check.
 * Forbidden  A callback must not leave by longjmp or by a C++ exception, end its thread, or fork. The environment that
 *            it runs for is busy: functions that step or change it give MJENV_E_BUSY, and mjenv_destroy of it would
 *            wait for ever. It may take locks of its own, at the cost of the threads that wait.
 * Numbers    What a callback is given to read after a step is as MuJoCo's mj_step leaves it: qpos, qvel, act and time
 *            are new; what MuJoCo computes from them (xpos, contacts, sensordata and so on) belongs to the state
 *            before the last mj_step, a timestep ago. After a reset all belongs together. Gymnasium has the same.
 * ABI        As in mjenv.h. An array of structs is read in steps of its first element's struct_size. */
#ifndef MJENV_TASK_H
#define MJENV_TASK_H

#include <mjenv/mjenv.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mjenv_task_api mjenv_task_api; /* the functions that callbacks may call */
typedef struct mjenv_builder mjenv_builder;   /* what build is given */
typedef struct mjenv_random mjenv_random;     /* a row's random stream: NumPy's default_rng */

/* ---- What a task says about itself ---- */

/* A constructor option of the task. Beside these each task has the options that built-in tasks have: xml_file,
 * xml_string, trust_xml, frame_skip, max_episode_steps and so on. */
typedef struct mjenv_task_option {
  uint32_t struct_size;
  mjenv_kind kind;
  const char *name;
  const char *doc;
  double value;         /* the default of a flag, an integer, one real, and of a STRING_OR_INT without text */
  double low, high;     /* closed bounds of each number; both 0: none */
  const double *values; /* REALS of several numbers: their defaults, count of them */
  int64_t count;        /* 0: one number, value */
  const char *text;     /* the default of a STRING (NULL: "") or a STRING_OR_INT */
  const char *choices;  /* the valid texts separated by blanks; NULL: any text */
} mjenv_task_option;

/* A term of the observation, a value of the info or of the reset info, or the type of the reward. Fields of a role are
 * laid out one after the other in the order in which they are described. */
typedef struct mjenv_task_field {
  uint32_t struct_size;
  mjenv_role role;  /* OBSERVATION, INFO, RESET_INFO, REWARD or STRUCTURE */
  const char *name; /* unique in its role */
  const char *doc;  /* with the unit; NULL: none */
  mjenv_type type;  /* 0: np.float64 */
  int32_t ndim;     /* 0: a scalar; a term of the observation has 1 */
  int64_t shape[4]; /* -1 where build tells the length (mjenv_build_field) */
} mjenv_task_field;

/* Gymnasium's default_camera_config; NaN leaves a value to MuJoCo. */
typedef struct mjenv_task_camera {
  uint32_t struct_size;
  int32_t reserved;   /* 0 */
  double trackbodyid; /* a whole number */
  double distance;    /* m */
  double lookat[3];   /* m */
  double elevation;   /* degrees */
} mjenv_task_camera;

/* ---- What callbacks see ---- */

/* A contact of the row. This struct will not grow. */
typedef struct mjenv_contact {
  int32_t geom1, geom2; /* indices of geoms */
  double distance;      /* between them, m; negative: they overlap */
  double position[3];   /* the middle between them, m */
  double frame[9];      /* its axes as rows; the first, the normal, points from geom1 to geom2 */
  double force[6];      /* force and torque between them in that frame, N, N m */
} mjenv_contact;

/* One row's simulation, to be read. The struct and its arrays belong to the thread that runs the callback, and hold
 * another row in another call. They have MuJoCo's names and meanings, and do not move as long as the environment
 * lives. Arrays marked * cost time in each step: they are NULL unless build asks for them with mjenv_build_need. */
typedef struct mjenv_sim {
  uint32_t struct_size;
  mjenv_dtype action_dtype; /* the type in which the caller passed the action */
  const mjenv_task_api *api;
  int32_t nq, nv, na, nu, nbody, njnt, ngeom, nsite, ntendon, nsensordata;
  int32_t contact_count;
  int32_t reserved;      /* 0 */
  double timestep;       /* of an mj_step, s */
  double dt;             /* of a step, s */
  const double *time;    /* [1] since the reset, s */
  const double *action;  /* [nu] in the callback step; NaN in all others. A float32 is held exactly */
  const double *carried; /* [carry_count] what the task carries */

  /* the state */
  const double *qpos; /* [nq] */
  const double *qvel; /* [nv] */
  const double *act;  /* [na] */
  const double *ctrl; /* [nu] */

  /* computed from it */
  const double *qacc;              /* [nv] */
  const double *xpos;              /* [nbody][3] */
  const double *xquat;             /* [nbody][4] */
  const double *xmat;              /* [nbody][9] */
  const double *xipos;             /* [nbody][3] */
  const double *ximat;             /* [nbody][9] */
  const double *xanchor;           /* [njnt][3] */
  const double *xaxis;             /* [njnt][3] */
  const double *geom_xpos;         /* * [ngeom][3] */
  const double *geom_xmat;         /* * [ngeom][9] */
  const double *site_xpos;         /* [nsite][3] */
  const double *site_xmat;         /* [nsite][9] */
  const double *subtree_com;       /* [nbody][3] */
  const double *cinert;            /* [nbody][10] */
  const double *cvel;              /* [nbody][6] */
  const double *cfrc_ext;          /* * [nbody][6] */
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
  const mjenv_contact *contacts;   /* * [contact_count] */

  /* the model, which never changes */
  const double *qpos0;     /* [nq] */
  const double *body_mass; /* [nbody] */

  const void *const *arrays; /* those that build asked for with mjenv_build_array, by the index that it gave */
} mjenv_sim;

/* The start of an episode, for reset to write. */
typedef struct mjenv_start {
  uint32_t struct_size;
  int32_t reserved; /* 0 */
  const mjenv_task_api *api;
  mjenv_random *random;      /* the row's stream */
  const double *qpos0;       /* [nq] the model's own positions */
  double *qpos;              /* [nq] equal to qpos0 */
  double *qvel;              /* [nv] 0 */
  double *act;               /* [na] 0 */
  double *carried;           /* [carry_count] 0 */
  const void *const *arrays; /* as in mjenv_sim; only those of mjModel mean something now */
  int32_t nq, nv, na;
  int32_t carry_count;
} mjenv_start;

/* What a step comes to, for step to write. */
typedef struct mjenv_outcome {
  uint32_t struct_size;
  int32_t terminated;   /* 0; another number ends the episode */
  double reward;        /* 0 */
  double *info;         /* the INFO fields one after the other; NaN */
  double *carried;      /* [carry_count] as the state before the step left it */
  mjenv_random *random; /* the row's stream */
} mjenv_outcome;

/* ---- A task ---- */

typedef struct mjenv_task {
  uint32_t struct_size;
  int32_t revision;       /* to be raised when the task changes, so that snapshots of before are refused */
  const char *id;         /* "Cartpole-v0": letters, digits, "_", "." and "-", then "-v" and a number */
  const char *model;      /* the default of the option xml_file: a built-in model ("hopper.xml") or a path (./, / or ~
                             first); ./ is the folder of the shared object or program that holds the callback step.
                             NULL: model_text */
  const char *model_text; /* the text of an MJCF model; NULL: model */
  int32_t frame_skip;     /* mj_steps in a step: 1 or more */
  int32_t has_reward_threshold;
  double reward_threshold;         /* of a solved task, if has_reward_threshold is not 0 */
  int64_t time_limit;              /* steps after which an episode is truncated; 0: never */
  int64_t carry_count;             /* numbers that a row carries for the task; build may replace it */
  const mjenv_task_camera *camera; /* NULL: MuJoCo's own */
  const mjenv_task_option *options;
  int64_t option_count;
  const mjenv_task_field *fields;
  int64_t field_count;
  void *user; /* for build; self where there is no build */

  /* Prepares an environment: looks up names in the model and reads options, once, and sets *self, which the other
   * callbacks get. Runs on the caller's thread. NULL: there is nothing to prepare. */
  int32_t (*build)(mjenv_builder *builder, void *user, void **self);

  /* Frees self when the environment goes. Not called when build returned another number than 0. NULL: there is nothing
   * to free. */
  void (*destroy)(void *self);

  /* Draws the start of an episode. */
  int32_t (*reset)(const void *self, mjenv_start *start);

  /* Writes the RESET_INFO fields one after the other. NULL where there are none. */
  int32_t (*reset_info)(const void *self, const mjenv_sim *sim, double *info);

  /* Writes what the next step needs to know of the present state: called at the end of each reset and step, and when
   * the caller sets the state. What it does not write stays. NULL: nothing. */
  int32_t (*carry)(const void *self, const mjenv_sim *sim, double *carried);

  /* Writes the OBSERVATION fields one after the other. It depends on nothing but sim. */
  int32_t (*observe)(const void *self, const mjenv_sim *sim, double *observation);

  /* Judges a step after the simulation has made it. */
  int32_t (*step)(const void *self, const mjenv_sim *sim, mjenv_outcome *outcome);
} mjenv_task;

/* Makes a task's id known for the rest of the process. Everything is copied but the callbacks and what user points to,
 * which must stay. Errors: ARGUMENT (a null pointer, a field without a name, a callback that is missing or has nothing
 * to do), VALUE (an id that is taken or malformed, a number out of its bounds), TYPE (a kind, type or role that a task
 * cannot have), MEMORY. */
MJENV_API mjenv_status mjenv_register_task(const mjenv_task *task);

/* ---- Plug-ins ---- */

/* What a plug-in holds. */
typedef struct mjenv_plugin {
  uint32_t struct_size;
  uint32_t abi_version; /* MJENV_ABI_VERSION */
  const mjenv_task *const *tasks;
  int64_t task_count;
} mjenv_plugin;

/* Loads a shared object and registers its tasks: all of them, or none when one is refused. The object exports
 * "mjenv_tasks", see MJENV_PLUGIN. It is never unloaded; loading it again does nothing. NULL loads what the environment
 * variable MJENV_TASKS names, paths separated by ":", as the first call that looks for an id does, and reports why that
 * failed. Errors: TASK (not a shared object, not a plug-in, one of another ABI version), those of mjenv_register_task.
 */
MJENV_API mjenv_status mjenv_load_tasks(const char *path);

/* ---- Functions for callbacks ----
 * They are reached through the api that each callback is given; the functions below this struct call them. */

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

  double (*random)(mjenv_random *random);
  double (*uniform)(mjenv_random *random, double low, double high);
  double (*normal)(mjenv_random *random);
  int64_t (*integers)(mjenv_random *random, int64_t low, int64_t high);
  int64_t (*choice)(mjenv_random *random, int64_t count, const double *p);
  void (*sample)(mjenv_random *random, int64_t count, int64_t size, int64_t *chosen);
  void (*permutation)(mjenv_random *random, int64_t count, int64_t *order);
};

/* The library's functions for callbacks, for languages that need their addresses before a callback runs. */
MJENV_API const mjenv_task_api *mjenv_task_functions(void);

struct mjenv_builder {
  uint32_t struct_size;
  int32_t reserved; /* 0 */
  const mjenv_task_api *api;
  const mjenv_sim *sim; /* the model's initial state, evaluated, with an action of zeros; valid until build returns */
  mjenv_random *random; /* a stream for trials, of no consequence */
};

struct mjenv_random {
  uint32_t struct_size;
  int32_t reserved; /* 0 */
  const mjenv_task_api *api;
};

/* Keeps the message for the caller, and returns what a callback returns to fail. */
static inline int32_t mjenv_task_fail(const mjenv_task_api *api, const char *message) {
  return api->fail_with(message);
}

/* ---- In build ----
 * When one of these fails, so does build: whatever it returns, nothing need be checked. They return 0 or "" then. */

/* The value of an option that is a flag or an integer. */
static inline int64_t mjenv_build_integer(mjenv_builder *builder, const char *option) {
  return builder->api->integer(builder, option);
}

/* The value of an option that is one real. */
static inline double mjenv_build_real(mjenv_builder *builder, const char *option) {
  double value = 0;
  builder->api->reals(builder, option, &value, 1);
  return value;
}

/* The values of an option that is count reals. */
static inline void mjenv_build_reals(mjenv_builder *builder, const char *option, double *values, int64_t count) {
  builder->api->reals(builder, option, values, count);
}

/* 1 where the caller gave an integer for an option that is one real: a product with it is an int in Python. */
static inline int32_t mjenv_build_is_integer(mjenv_builder *builder, const char *option) {
  return builder->api->is_integer(builder, option);
}

/* The value of an option that is a text; borrowed until build returns. */
static inline const char *mjenv_build_text(mjenv_builder *builder, const char *option) {
  return builder->api->text(builder, option);
}

/* The index of a named object of the model: type as in mjenv_object_index. A model without it is refused. */
static inline int32_t mjenv_build_index(mjenv_builder *builder, const char *type, const char *name) {
  return builder->api->index(builder, type, name);
}

/* The index of the object that an option of the kind STRING_OR_INT names. */
static inline int32_t mjenv_build_option_index(mjenv_builder *builder, const char *option, const char *type) {
  return builder->api->option_index(builder, option, type);
}

/* 1 where the option "norm" has numpy.linalg.norm fuse the multiplication with the addition. */
static inline int32_t mjenv_build_norm_is_fused(mjenv_builder *builder) { return builder->api->norm_is_fused(builder); }

/* Asks for what costs time in each step, so that it is there, and up to date, in all callbacks: "contacts" or an array
 * of mjData that is computed on demand: "cfrc_ext", "geom_xpos" and so on. */
static inline void mjenv_build_need(mjenv_builder *builder, const char *array) { builder->api->need(builder, array); }

/* Asks for any array of mjData or mjModel by its MuJoCo name, as in mjenv_read. Returns its index in sim->arrays;
 * field, if not NULL, receives its shape and type: double for MJENV_TYPE_FLOAT64, int32_t for MJENV_TYPE_INT32 and so
 * on. */
static inline int32_t mjenv_build_array(mjenv_builder *builder, const char *name, mjenv_field *field) {
  return builder->api->array(builder, name, field);
}

/* Describes a field: replaces the one of that role and name, or adds one at the end. */
static inline void mjenv_build_field(mjenv_builder *builder, const mjenv_task_field *field) {
  builder->api->field(builder, field);
}

/* Replaces the task's carry_count. */
static inline void mjenv_build_carry(mjenv_builder *builder, int64_t count) { builder->api->carry(builder, count); }

/* Tells the length of a vector that the task describes with shape[0] = -1. */
static inline void mjenv_build_length(mjenv_builder *builder, mjenv_role role, const char *name, int64_t length) {
  /* NOLINTNEXTLINE(modernize-use-nullptr): this is C, too */
  mjenv_task_field field = {sizeof(mjenv_task_field), 0, 0, 0, 0, 1, {0, 0, 0, 0}};
  field.role = role;
  field.name = name;
  field.shape[0] = length;
  builder->api->field(builder, &field);
}

/* ---- In reset and step: the row's random stream ----
 * Each draws what the method of numpy.random.Generator draws, and takes as much from the stream. */

/* random(): in [0, 1). */
static inline double mjenv_random_real(mjenv_random *random) { return random->api->random(random); }

/* uniform(low, high) */
static inline double mjenv_random_uniform(mjenv_random *random, double low, double high) {
  return random->api->uniform(random, low, high);
}

/* standard_normal(). normal(mean, deviation) is mean + deviation * standard_normal(). */
static inline double mjenv_random_normal(mjenv_random *random) { return random->api->normal(random); }

/* integers(low, high): low <= number < high. */
static inline int64_t mjenv_random_integers(mjenv_random *random, int64_t low, int64_t high) {
  return random->api->integers(random, low, high);
}

/* choice(count, p=p): 0 <= number < count. p[count] are probabilities of the sum 1; NULL: all alike. */
static inline int64_t mjenv_random_choice(mjenv_random *random, int64_t count, const double *p) {
  return random->api->choice(random, count, p);
}

/* choice(count, size, replace=False): size different numbers below count, into chosen[size]. */
static inline void mjenv_random_sample(mjenv_random *random, int64_t count, int64_t size, int64_t *chosen) {
  random->api->sample(random, count, size, chosen);
}

/* permutation(count): the numbers 0 to count - 1 in random order, into order[count]. */
static inline void mjenv_random_permutation(mjenv_random *random, int64_t count, int64_t *order) {
  random->api->permutation(random, count, order);
}

/* ---- The entry of a plug-in ---- */

/* The name of the function by which a plug-in hands over its tasks. api may be used to fail: then it returns NULL. */
typedef const mjenv_plugin *mjenv_tasks_function(const mjenv_task_api *api);

/* Makes a shared object a plug-in of tasks: MJENV_PLUGIN(&cartpole, &reach) */
#define MJENV_PLUGIN(...)                                                               \
  MJENV_API const mjenv_plugin *mjenv_tasks(const mjenv_task_api *api);                 \
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
