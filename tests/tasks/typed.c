// A task whose info has a value and an array of every type, with a model in a file of its own and without a time limit.
#include <mjenv/task.h>

#define VALUE(what, of)                                                                                            \
  {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_INFO, .name = what, .dtype = MJENV_DTYPE_##of}, {   \
    .struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_INFO, .name = what "s", .dtype = MJENV_DTYPE_##of, \
    .ndim = 2, .shape = {                                                                                          \
      1,                                                                                                           \
      2                                                                                                            \
    }                                                                                                              \
  }
static const mjenv_task_field fields[] = {
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_OBSERVATION, .name = "time"},
    VALUE("float64", FLOAT64),
    VALUE("action", ACTION),
    VALUE("native_float", NATIVE_FLOAT),
    VALUE("native_int", NATIVE_INT),
    VALUE("int64", INT64),
    VALUE("float32", FLOAT32),
    VALUE("int32", INT32),
    VALUE("uint8", UINT8),
    {.struct_size = sizeof(mjenv_task_field),
     .role = MJENV_ROLE_REWARD,
     .name = "reward",
     .dtype = MJENV_DTYPE_FLOAT32},
};

static int32_t reset(const void* self, mjenv_start* start) { return (void)self, (void)start, 0; }
static int32_t observe(const void* self, const mjenv_sim* sim, double* to) { return (void)self, to[0] = *sim->time, 0; }
static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self, (void)sim;
  for (int i = 0; i < 24; ++i) outcome->info[i] = i % 3 == 0 ? 200 : i % 3;  // a value 200, an array {{1, 2}}
  outcome->reward = 0.1;
  return 0;
}

static const mjenv_task task = {.struct_size = sizeof task,
                                .id = "Typed-v7",
                                .model = "./typed.xml",
                                .frame_skip = 1,
                                .fields = fields,
                                .field_count = sizeof fields / sizeof *fields,
                                .reset = reset,
                                .observe = observe,
                                .step = step};

MJENV_PLUGIN(&task)
