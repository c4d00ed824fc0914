/* learn.h - trains policies in mjenv's environments by PPO, and plays them.
 *
 * libmjenv-learn is a library of its own, a client of mjenv.h alone. It is not linked with libmjenv, so that one build
 * serves every version of MuJoCo: the program passes the functions of the libmjenv that it uses (mjenv_learn_calls).
 *
 *     static const mjenv_learn_calls calls = MJENV_LEARN_CALLS_INIT;
 *     mjenv_options *options;
 *     mjenv_env *env;
 *     mjenv_learner *learner;
 *     mjenv_options_create("HalfCheetah-v5", &options);
 *     mjenv_options_set_string(options, "autoreset_mode", "same_step");
 *     mjenv_create(options, 64, &env);
 *     mjenv_learner_create(&calls, env, "HalfCheetah-v5", "gamma=0.97 hidden=128,64", &learner);
 *     mjenv_learner_train(learner, 2000000);
 *     mjenv_learner_save_policy(learner, MJENV_LEARNED_LAST, "policy.txt");
 *     mjenv_learner_destroy(learner);
 *     mjenv_destroy(env);
 *     mjenv_options_destroy(options);
 *
 * Networks are float32. The same settings, seed and environment give the same bits for any number of threads and any
 * instruction set. docs/training.md has the algorithm in detail.
 *
 * Arrays, counts, errors and handles are as in mjenv.h: functions return statuses, and a call that fails changes
 * nothing unless its comment says so. mjenv_learn_last_error has the reason. While one thread trains or changes a
 * learner, all other calls with this learner return BUSY.
 */
#ifndef MJENV_LEARN_H
#define MJENV_LEARN_H

#include "mjenv/mjenv.h"

#if !defined(_WIN32)
#define MJENV_LEARN_API __attribute__((visibility("default")))
#elif defined(MJENV_LEARN_BUILDING)
#define MJENV_LEARN_API __declspec(dllexport)
#else
#define MJENV_LEARN_API __declspec(dllimport)
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* This number changes when compiled clients have to be built again. */
#define MJENV_LEARN_ABI_VERSION 1

/* Handles */
typedef struct mjenv_learner mjenv_learner; /* trains a policy in the rows of an environment */
typedef struct mjenv_policy mjenv_policy;   /* a deterministic policy, which can be saved as text */

/* Pointers to the functions of libmjenv that this library calls. The members have the names of the functions. */
typedef struct mjenv_learn_calls {
  uint32_t struct_size;
  uint32_t reserved; /* 0 */
  const char *(*last_error)(void);
  mjenv_status (*info_of)(mjenv_env *env, mjenv_info *info);
  const mjenv_options *(*options_of)(const mjenv_env *env);
  mjenv_status (*options_get_string)(const mjenv_options *options, const char *name, const char **value);
  mjenv_status (*space_of)(const mjenv_env *env, mjenv_role role, mjenv_space *space);
  mjenv_status (*seed)(mjenv_env *env, const uint8_t *mask, const uint64_t *seeds, int64_t count);
  mjenv_status (*reset)(mjenv_env *env, const uint8_t *mask, const mjenv_batch *out);
  mjenv_status (*step)(mjenv_env *env, const uint8_t *mask, const void *action, int64_t count, mjenv_dtype dtype,
                       const mjenv_batch *out);
  mjenv_status (*snapshot)(mjenv_env *env, int64_t row, void *image, int64_t capacity_bytes, int64_t *size_bytes);
  mjenv_status (*restore)(mjenv_env *env, int64_t row, const void *image, int64_t size_bytes);
  mjenv_status (*field_at)(const mjenv_env *env, mjenv_role role, int64_t index, mjenv_field *field);
} mjenv_learn_calls;

/* clang-format off */
#define MJENV_LEARN_CALLS_INIT \
  {sizeof(mjenv_learn_calls), 0, mjenv_last_error, mjenv_info_of, mjenv_options_of, mjenv_options_get_string, \
   mjenv_space_of, mjenv_seed, mjenv_reset, mjenv_step, mjenv_snapshot, mjenv_restore, mjenv_field_at}
/* clang-format on */

/* Which policy of a learner is meant. */
typedef int32_t mjenv_learned;
enum mjenv_learned_value {
  MJENV_LEARNED_LAST = 1, /* that of the last update */
  MJENV_LEARNED_BEST = 2  /* that of the rollout at whose end the mean return of the last episodes was greatest */
};

/* The precision in which a policy is evaluated. */
typedef int32_t mjenv_precision;
enum mjenv_precision_value {
  MJENV_PRECISION_FLOAT64 = 1, /* the bits of mjenv.policy in Python and of examples/cpp/deploy.cpp */
  MJENV_PRECISION_FLOAT32 = 2  /* as the learner computes; faster, and equal to float64 but for rounding */
};

/* A point of the learning curve: what one update did, and how the episodes before it went. A mean of no episodes is
 * NaN. */
typedef struct mjenv_learn_report {
  uint32_t struct_size;
  uint32_t reserved;         /* 0 */
  int64_t updates;           /* so far */
  int64_t steps;             /* of all rows together, so far */
  int64_t episodes;          /* that have ended so far */
  double mean_return;        /* of the last `window` episodes of the training, whose actions were drawn */
  double mean_length;        /* of these, in steps */
  double learning_rate;      /* of the update */
  double policy_loss;        /* this, value_loss, approx_kl, clip_fraction, grad_norm: means over the minibatches */
  double value_loss;         /* the mean squared error of the value */
  double entropy;            /* of the policy after the update, in nats */
  double approx_kl;          /* how far the policy has moved: the mean of ratio - 1 - log(ratio) */
  double clip_fraction;      /* the share of steps whose ratio was clipped */
  double grad_norm;          /* before it is clipped */
  double explained_variance; /* 1 - var(returns - values) / var(returns), before the update */
  double std;                /* the mean standard deviation of the actions, after the update */
  int64_t epochs;            /* that were done; fewer than the setting if target_kl ended the update */
} mjenv_learn_report;

/* clang-format off */
#define MJENV_LEARN_REPORT_INIT {sizeof(mjenv_learn_report), 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}
/* clang-format on */

/* What a policy does with an observation: (observation - mean) / scale is clipped to -clip .. clip, goes through the
 * layers, and is clipped to low .. high. The arrays belong to the policy. */
typedef struct mjenv_policy_spec {
  uint32_t struct_size;
  uint32_t reserved; /* 0 */
  int64_t layer_count;
  double clip;
  const double *mean, *scale; /* [observations] */
  const double *low, *high;   /* [actuators] */
  int64_t input_count;        /* how many terms the policy sees; 0 if the text does not name them (version 1) */
  const char *about;          /* what mjenv_learner_describe was given; "" if nothing */
} mjenv_policy_spec;

/* clang-format off */
#define MJENV_POLICY_SPEC_INIT {sizeof(mjenv_policy_spec), 0, 0, 0, NULL, NULL, NULL, NULL, 0, NULL}
/* clang-format on */

/* A term of the observation that a policy sees. Its texts and arrays belong to the policy. */
typedef struct mjenv_policy_input {
  uint32_t struct_size;
  uint32_t reserved;       /* 0 */
  const char *name;        /* as mjenv_field_at with MJENV_ROLE_OBSERVATION lists it */
  int64_t count;           /* how many numbers the term has */
  int64_t seen;            /* how many of them the policy sees */
  const int64_t *elements; /* [seen] which of them, from the least on; NULL: all */
} mjenv_policy_input;

/* clang-format off */
#define MJENV_POLICY_INPUT_INIT {sizeof(mjenv_policy_input), 0, NULL, 0, 0, NULL}
/* clang-format on */

/* A layer of a policy: activation(bias + the sum of weights[input][output] * input). Its arrays belong to the policy. */
typedef struct mjenv_policy_layer {
  uint32_t struct_size;
  uint32_t reserved;      /* 0 */
  const char *activation; /* "tanh", "relu", "elu" or "identity" */
  int64_t inputs, outputs;
  const double *weights; /* [inputs][outputs] */
  const double *bias;    /* [outputs] */
} mjenv_policy_layer;

/* clang-format off */
#define MJENV_POLICY_LAYER_INIT {sizeof(mjenv_policy_layer), 0, NULL, 0, 0, NULL, NULL}
/* clang-format on */

/* ---- Library ---- */

/* Returns the MJENV_LEARN_ABI_VERSION of the loaded library. */
MJENV_LEARN_API uint32_t mjenv_learn_abi_version(void);

/* Returns why the last failed call of this library on this thread failed; "" if none has failed. */
MJENV_LEARN_API const char *mjenv_learn_last_error(void);

/* Returns the instruction set that the setting instructions=auto means on this CPU: "sse2", "avx2", "avx512" or
 * "neon". */
MJENV_LEARN_API const char *mjenv_learn_instructions(void);

/* ---- Settings ---- */

/* How a learner learns is said by words NAME=VALUE, separated by white space, such as "gamma=0.98 hidden=64,64
 * normalize_obs=false". Settings that are not named have the defaults of the id: tuned ones for the robots of
 * Gymnasium's v5, else settings that serve most tasks of movement. If a name is given twice, the last value counts.
 * Errors of all functions with settings: NAME (no such setting), TYPE (a text that is no number), VALUE (out of bounds). */

/* Returns the number of settings. */
MJENV_LEARN_API int64_t mjenv_learn_setting_count(void);

/* Describes the setting at 0 <= index < mjenv_learn_setting_count(), as mjenv_options_at describes an option. If its
 * `count` is greater than 1, its value is a list of 0 to `count` numbers with commas between them. Errors: VALUE
 * (index). */
MJENV_LEARN_API mjenv_status mjenv_learn_setting_at(int64_t index, mjenv_option *setting);

/* Writes all settings as such words into text[capacity], with a NUL, in the order of mjenv_learn_setting_at.
 *   id        the id whose defaults are meant
 *   settings  replaces some of them; may be NULL
 *   size      receives how many bytes the whole text needs, also with text NULL and capacity 0
 * Errors: NAME, TYPE, VALUE, SIZE (capacity). */
MJENV_LEARN_API mjenv_status mjenv_learn_settings(const char *id, const char *settings, char *text, int64_t capacity,
                                                  int64_t *size);

/* ---- Training ---- */

/* Creates a learner, and seeds and resets the environment. Until the learner is destroyed, the environment must not be
 * destroyed or used by others. The option "autoreset_mode" must be same_step.
 *   id        of the environment; policies and checkpoints keep it
 *   settings  words; may be NULL. `rows` is that of the environment.
 * Errors: NAME, TYPE, VALUE (a setting, or infinite bounds), SIZE, those of mjenv_reset. */
MJENV_LEARN_API mjenv_status mjenv_learner_create(const mjenv_learn_calls *calls, mjenv_env *env, const char *id,
                                                  const char *settings, mjenv_learner **learner);

/* Creates a learner whose rows the caller steps (mjenv_learner_act), for spaces with these bounds and counts.
 *   obs       [rows][observation->count] the first observations
 * Errors: NAME, TYPE, VALUE, SIZE (obs_count). */
MJENV_LEARN_API mjenv_status mjenv_learner_create_apart(const mjenv_space *observation, const mjenv_space *action,
                                                        const char *id, const char *settings, const double *obs,
                                                        int64_t obs_count, mjenv_learner **learner);

MJENV_LEARN_API void mjenv_learner_destroy(mjenv_learner *learner);

/* Trains until at least `steps` more steps of all rows together are done: whole rollouts, each with its update. If this
 * fails, the rollout under way is undone: the learner and its environment are as after the last update. Errors: VALUE
 * (a reward or observation is no number from -1e100 to 1e100: the row and step are named; an update made weights
 * infinite; or the caller steps the rows), FORKED, those of mjenv_step. */
MJENV_LEARN_API mjenv_status mjenv_learner_train(mjenv_learner *learner, int64_t steps);

/* Draws the next actions of all rows into action[count], for a caller that steps them. count = rows * actuators.
 * Errors: SIZE, VALUE (the library steps the rows, the last actions lack an outcome, or the rollout was given up). */
MJENV_LEARN_API mjenv_status mjenv_learner_act(mjenv_learner *learner, float *action, int64_t count);

/* Takes the outcome of the actions of mjenv_learner_act: obs, reward, terminated and truncated of out, and final_obs of
 * rows whose episode ended. After the last step of a rollout, updates the networks. Errors: SIZE, VALUE (no actions were
 * drawn, or a number is not from -1e100 to 1e100). If that is so, or new weights are not finite, the rollout is given up;
 * mjenv_learner_restart begins the next one. */
MJENV_LEARN_API mjenv_status mjenv_learner_feed(mjenv_learner *learner, const mjenv_batch *out);

/* Gives up the rollout under way and continues from the observations obs[obs_count] of new episodes. Errors: SIZE,
 * VALUE (the library steps the rows, or a number is not from -1e100 to 1e100). */
MJENV_LEARN_API mjenv_status mjenv_learner_restart(mjenv_learner *learner, const double *obs, int64_t obs_count);

/* Continues in another environment with the same spaces and number of rows, for instance one with other options. The
 * environment is seeded and reset. Errors: as mjenv_learner_create. */
MJENV_LEARN_API mjenv_status mjenv_learner_set_env(mjenv_learner *learner, mjenv_env *env);

/* Changes the settings that the words name, at once, even in the middle of a rollout whose rows the caller steps. These
 * cannot change: rows, rollout_steps, activation, hidden, actor_obs, critic_obs, normalize_obs, scale_actions, seed,
 * threads, instructions, window. Errors: NAME, TYPE, VALUE. */
MJENV_LEARN_API mjenv_status mjenv_learner_set(mjenv_learner *learner, const char *settings);

/* Describes the learner after its last update; before the first one, all its doubles are NaN. */
MJENV_LEARN_API mjenv_status mjenv_learner_report(const mjenv_learner *learner, mjenv_learn_report *report);

/* Describes the learner after the update 1 <= update <= updates: the learning curve. Errors: VALUE. */
MJENV_LEARN_API mjenv_status mjenv_learner_report_at(const mjenv_learner *learner, int64_t update,
                                                     mjenv_learn_report *report);

/* Saves the state after the last update as a file: networks, optimizer, normalisation, random streams, curve, and the
 * image of all rows (mjenv_snapshot). An older file is replaced once the new one is complete.
 *   note      a text of the caller's own in the file, such as the options of the environment; may be NULL
 * Errors: FILE. */
MJENV_LEARN_API mjenv_status mjenv_learner_save(const mjenv_learner *learner, const char *path, const char *note);

/* Reads the note in a file of mjenv_learner_save into text[capacity], with a NUL. It may come from a stranger.
 *   size      receives how many bytes the whole text needs, also with text NULL and capacity 0
 * Errors: FILE, SNAPSHOT (damaged), SIZE (capacity). */
MJENV_LEARN_API mjenv_status mjenv_checkpoint_note(const char *path, char *text, int64_t capacity, int64_t *size);

/* Continues from a file of mjenv_learner_save, bit for bit. The learner must have the same id, numbers of observations
 * and actions, and settings that cannot change, but for seed, threads and instructions; its other settings stay. The file may come from a stranger. Errors: FILE (also if it is no regular file), SNAPSHOT
 * (damaged, or of another learner). */
MJENV_LEARN_API mjenv_status mjenv_learner_load(mjenv_learner *learner, const char *path);

/* Writes a policy as text (docs/training.md) into text[capacity], with a NUL.
 *   size      receives how many bytes the whole text needs, also with text NULL and capacity 0
 * Errors: SIZE (capacity), VALUE (which). */
MJENV_LEARN_API mjenv_status mjenv_learner_policy(const mjenv_learner *learner, mjenv_learned which, char *text,
                                                  int64_t capacity, int64_t *size);

/* Writes a policy as text to a file. An older file is replaced once the new one is complete. Errors: FILE, VALUE. */
MJENV_LEARN_API mjenv_status mjenv_learner_save_policy(const mjenv_learner *learner, mjenv_learned which,
                                                       const char *path);

/* Says what the policies of a learner tell of their environment, beside its id. Errors: VALUE (about), NAME, SIZE.
 *   about   one line of printable ASCII, which mjenv_policy_spec.about returns; may be NULL. That of `mjenv train` is
 *           JSON: the engine, the options and the revision of the task (docs/training.md)
 *   names   [term_count] the terms of the observation, one after the other, and in counts how many numbers each has. 0
 *           terms: they stay; at first they are those of the learner's environment */
MJENV_LEARN_API mjenv_status mjenv_learner_describe(mjenv_learner *learner, const char *about, const char *const *names,
                                                    const int64_t *counts, int64_t term_count);

/* ---- Policies ---- */

/* Reads a policy from text[size]. Errors: VALUE (the line is named). */
MJENV_LEARN_API mjenv_status mjenv_policy_parse(const char *text, int64_t size, mjenv_policy **policy);

/* Reads a policy from a file. Errors: FILE (also if it is no regular file), VALUE. */
MJENV_LEARN_API mjenv_status mjenv_policy_load(const char *path, mjenv_policy **policy);

MJENV_LEARN_API void mjenv_policy_destroy(mjenv_policy *policy);

/* Returns the id that a policy was trained for; NULL if it fails. */
MJENV_LEARN_API const char *mjenv_policy_id(const mjenv_policy *policy);

/* Reads how many numbers the policy sees of an observation, and how many an action has. */
MJENV_LEARN_API mjenv_status mjenv_policy_sizes(const mjenv_policy *policy, int64_t *observations, int64_t *actuators);

/* Reads the numbers of a policy, and those of its layer 0 <= index < layer_count. Errors: VALUE (index). */
MJENV_LEARN_API mjenv_status mjenv_policy_spec_of(const mjenv_policy *policy, mjenv_policy_spec *spec);
MJENV_LEARN_API mjenv_status mjenv_policy_layer_at(const mjenv_policy *policy, int64_t index,
                                                   mjenv_policy_layer *layer);

/* Reads a term that a policy sees, 0 <= index < input_count. Errors: VALUE (index). */
MJENV_LEARN_API mjenv_status mjenv_policy_input_at(const mjenv_policy *policy, int64_t index,
                                                   mjenv_policy_input *input);

/* Finds in an observation what a policy sees of it. Before each mjenv_policy_act, copy: seen[i] = obs[places[i]].
 *   names   [term_count] the terms of the observation, one after the other, and in counts how many numbers each has
 *   places  [place_count] receives the index of each number that the policy sees; place_count as mjenv_policy_sizes
 * Errors, which name the term: NAME (the observation lacks it), SIZE (it has another count; place_count). */
MJENV_LEARN_API mjenv_status mjenv_policy_find(const mjenv_policy *policy, const char *const *names,
                                               const int64_t *counts, int64_t term_count, int64_t *places,
                                               int64_t place_count);

/* Computes the actions of rows.
 *   obs       [rows][obs_count / rows]; action [rows][action_count / rows]
 * Errors: SIZE (the policy is of another size), VALUE (precision). */
MJENV_LEARN_API mjenv_status mjenv_policy_act(const mjenv_policy *policy, mjenv_precision precision, int64_t rows,
                                              const double *obs, int64_t obs_count, float *action,
                                              int64_t action_count);

/* Plays whole episodes in all rows of an environment whose option "autoreset_mode" is disabled, and whose observation has
 * the terms that the policy sees. Before each episode, its
 * row is restored to what it was when this function was called; then episode k begins with a reset by seed + k. So the
 * result does not depend on the number of rows and threads, if the rows were equal, as those of a new environment are.
 *   returns   [episodes] the sum of each episode's rewards; may be NULL
 *   lengths   [episodes] its steps; may be NULL
 * Errors: NAME, SIZE, VALUE (episodes < 1, autoreset_mode, an episode without end), those of mjenv_step. */
MJENV_LEARN_API mjenv_status mjenv_evaluate(const mjenv_learn_calls *calls, mjenv_env *env, const mjenv_policy *policy,
                                            mjenv_precision precision, uint64_t seed, int64_t episodes, double *returns,
                                            int64_t *lengths);

#ifdef __cplusplus
}
#endif

#endif
