/* Hopper-v5, written outside of the library in C: a plug-in with the id OwnHopper-v5. */
#include <float.h>
#include <math.h>
#include <mjenv/task.h>
#include <stdlib.h>

typedef struct hopper {
  double forward_weight, ctrl_weight, healthy_reward;
  double state_range[2], z_range[2], angle_range[2];
  double noise;
  int64_t terminates;
  int32_t first; /* of the positions that are observed */
} hopper;

static const double state_range[] = {-100, 100}, z_range[] = {0.7, INFINITY}, angle_range[] = {-0.2, 0.2};

#define OPTION(kind_of, called, meaning) \
  .struct_size = sizeof(mjenv_task_option), .kind = (kind_of), .name = (called), .doc = (meaning)
static const mjenv_task_option options[] = {
    {OPTION(MJENV_KIND_REALS, "forward_reward_weight", "weight of the velocity along x"), .value = 1},
    {OPTION(MJENV_KIND_REALS, "ctrl_cost_weight", "weight of the squared action"), .value = 1e-3},
    {OPTION(MJENV_KIND_REALS, "healthy_reward", "reward for each step while healthy"), .value = 1},
    {OPTION(MJENV_KIND_FLAG, "terminate_when_unhealthy", "terminate the episode when unhealthy"), .value = 1},
    {OPTION(MJENV_KIND_REALS, "healthy_state_range", "open bounds of the state except x and z while healthy"),
     .values = state_range, .count = 2},
    {OPTION(MJENV_KIND_REALS, "healthy_z_range", "open bounds of the height while healthy, m"), .values = z_range,
     .count = 2},
    {OPTION(MJENV_KIND_REALS, "healthy_angle_range", "open bounds of the pitch while healthy, rad"),
     .values = angle_range, .count = 2},
    {OPTION(MJENV_KIND_REALS, "reset_noise_scale", "spread of the random initial state"), .value = 5e-3, .low = 0,
     .high = DBL_MAX / 2},
    {OPTION(MJENV_KIND_FLAG, "exclude_current_positions_from_observation", "do not observe x"), .value = 1},
};

#define FIELD(role_of, called) .struct_size = sizeof(mjenv_task_field), .role = (role_of), .name = (called)
static const mjenv_task_field fields[] = {
    {FIELD(MJENV_ROLE_OBSERVATION, "qpos"), .ndim = 1, .shape = {-1}},
    {FIELD(MJENV_ROLE_OBSERVATION, "qvel"), .ndim = 1, .shape = {-1}},
    {FIELD(MJENV_ROLE_RESET_INFO, "x_position")},
    {FIELD(MJENV_ROLE_RESET_INFO, "z_distance_from_origin")},
    {FIELD(MJENV_ROLE_INFO, "x_position")},
    {FIELD(MJENV_ROLE_INFO, "z_distance_from_origin")},
    {FIELD(MJENV_ROLE_INFO, "x_velocity")},
    {FIELD(MJENV_ROLE_INFO, "reward_forward")},
    {FIELD(MJENV_ROLE_INFO, "reward_ctrl"), .dtype = MJENV_DTYPE_ACTION},
    {FIELD(MJENV_ROLE_INFO, "reward_survive"), .dtype = MJENV_DTYPE_NATIVE_FLOAT},
};

static int32_t build(mjenv_builder* builder, void* user, void** self) {
  (void)user;
  if (builder->sim->nq < 3) return mjenv_task_fail(builder->api, "the model has less than 3 positions");
  hopper* h = malloc(sizeof *h);
  if (!h) return mjenv_task_fail(builder->api, "out of memory");
  h->forward_weight = mjenv_build_real(builder, "forward_reward_weight");
  h->ctrl_weight = mjenv_build_real(builder, "ctrl_cost_weight");
  h->healthy_reward = mjenv_build_real(builder, "healthy_reward");
  mjenv_build_reals(builder, "healthy_state_range", h->state_range, 2);
  mjenv_build_reals(builder, "healthy_z_range", h->z_range, 2);
  mjenv_build_reals(builder, "healthy_angle_range", h->angle_range, 2);
  h->noise = mjenv_build_real(builder, "reset_noise_scale");
  h->terminates = mjenv_build_integer(builder, "terminate_when_unhealthy");
  h->first = mjenv_build_integer(builder, "exclude_current_positions_from_observation") ? 1 : 0;
  mjenv_build_length(builder, MJENV_ROLE_OBSERVATION, "qpos", builder->sim->nq - h->first);
  mjenv_build_length(builder, MJENV_ROLE_OBSERVATION, "qvel", builder->sim->nv);
  if (mjenv_build_is_integer(builder, "healthy_reward")) {
    const mjenv_task_field survive = {FIELD(MJENV_ROLE_INFO, "reward_survive"), .dtype = MJENV_DTYPE_NATIVE_INT};
    mjenv_build_field(builder, &survive);
  }
  /* Gymnasium's observation_structure */
  mjenv_task_field counted = {FIELD(MJENV_ROLE_STRUCTURE, "skipped_qpos"), .ndim = 1, .shape = {h->first}};
  mjenv_build_field(builder, &counted);
  counted.name = "qpos", counted.shape[0] = builder->sim->nq - h->first;
  mjenv_build_field(builder, &counted);
  counted.name = "qvel", counted.shape[0] = builder->sim->nv;
  mjenv_build_field(builder, &counted);
  *self = h;
  return 0;
}

static int32_t reset(const void* self, mjenv_start* start) {
  const hopper* h = self;
  for (int i = 0; i < start->nq; ++i) start->qpos[i] += mjenv_random_uniform(start->random, -h->noise, h->noise);
  for (int i = 0; i < start->nv; ++i) start->qvel[i] += mjenv_random_uniform(start->random, -h->noise, h->noise);
  return 0;
}

static int32_t reset_info(const void* self, const mjenv_sim* sim, double* info) {
  (void)self;
  info[0] = sim->qpos[0];
  info[1] = sim->qpos[1] - sim->qpos0[1];
  return 0;
}

static int32_t carry(const void* self, const mjenv_sim* sim, double* carried) {
  (void)self;
  carried[0] = sim->qpos[0];
  return 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* observation) {
  const hopper* h = self;
  for (int i = h->first; i < sim->nq; ++i) *observation++ = sim->qpos[i];
  for (int i = 0; i < sim->nv; ++i) {
    const double v = sim->qvel[i];
    *observation++ = v < -10 ? -10 : v > 10 ? 10 : v;
  }
  return 0;
}

static int within(double x, const double* range) { return range[0] < x && x < range[1]; }

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  const hopper* h = self;
  const double x = sim->qpos[0], z = sim->qpos[1], angle = sim->qpos[2];
  const double velocity = (x - sim->carried[0]) / sim->dt;
  int healthy = within(z, h->z_range) && within(angle, h->angle_range);
  for (int i = 2; i < sim->nq; ++i) healthy = healthy && within(sim->qpos[i], h->state_range);
  for (int i = 0; i < sim->nv; ++i) healthy = healthy && within(sim->qvel[i], h->state_range);

  const double forward = h->forward_weight * velocity, survive = healthy * h->healthy_reward;
  double ctrl;
  if (sim->action_dtype == MJENV_DTYPE_FLOAT32) { /* NumPy computes in the action's type */
    float sum = 0;
    for (int i = 0; i < sim->nu; ++i) sum += (float)sim->action[i] * (float)sim->action[i];
    ctrl = (float)h->ctrl_weight * sum;
  } else {
    double sum = 0;
    for (int i = 0; i < sim->nu; ++i) sum += sim->action[i] * sim->action[i];
    ctrl = h->ctrl_weight * sum;
  }
  double* info = outcome->info;
  info[0] = x;
  info[1] = z - sim->qpos0[1];
  info[2] = velocity;
  info[3] = forward;
  info[4] = -ctrl;
  info[5] = survive;
  outcome->reward = (forward + survive) - ctrl;
  outcome->terminated = h->terminates && !healthy;
  return 0;
}

static const mjenv_task_camera camera = {
    .struct_size = sizeof camera, .trackbodyid = 2, .distance = 3, .lookat = {0, 0, 1.15}, .elevation = -20};

static const mjenv_task task = {
    .struct_size = sizeof task,
    .id = "OwnHopper-v5",
    .model = "hopper.xml",
    .frame_skip = 4,
    .has_reward_threshold = 1,
    .reward_threshold = 3800,
    .time_limit = 1000,
    .carry_count = 1,
    .camera = &camera,
    .options = options,
    .option_count = sizeof options / sizeof *options,
    .fields = fields,
    .field_count = sizeof fields / sizeof *fields,
    .build = build,
    .destroy = free,
    .reset = reset,
    .reset_info = reset_info,
    .carry = carry,
    .observe = observe,
    .step = step,
};

MJENV_PLUGIN(&task)
