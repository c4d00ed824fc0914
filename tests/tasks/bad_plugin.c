// Plug-ins that are refused, one for each BAD_*.
#include <mjenv/task.h>

#if defined BAD_no_tasks
#include "floats.h"

__attribute__((constructor)) static void construct(void) { change_floats(); }
#endif

static int32_t reset(const void* self, mjenv_start* start) { return (void)self, (void)start, 0; }
static int32_t observe(const void* self, const mjenv_sim* sim, double* to) { return (void)self, to[0] = *sim->time, 0; }
static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* out) {
  return (void)self, (void)sim, (void)out, 0;
}

static const mjenv_task_field fields[] = {
    {.struct_size = sizeof(mjenv_task_field), .role = MJENV_ROLE_OBSERVATION, .name = "time"}};
static const mjenv_task task = {.struct_size = sizeof(mjenv_task),
                                .id = "Bad-v0",
                                .model = "hopper.xml",
                                .frame_skip = 1,
                                .fields = fields,
                                .field_count = 1,
                                .reset = reset,
                                .observe = observe,
                                .step = step};

#if defined BAD_no_entry
MJENV_EXPORT int32_t not_mjenv_tasks(void);
int32_t not_mjenv_tasks(void) { return task.frame_skip; }
#elif defined BAD_twice
static const mjenv_task good = {.struct_size = sizeof(mjenv_task),
                                .id = "Good-v0",
                                .model = "hopper.xml",
                                .frame_skip = 1,
                                .fields = fields,
                                .field_count = 1,
                                .reset = reset,
                                .observe = observe,
                                .step = step};
MJENV_PLUGIN(&good, &task, &task)
#else
MJENV_EXPORT const mjenv_plugin* mjenv_tasks(const mjenv_task_api* api);
const mjenv_plugin* mjenv_tasks(const mjenv_task_api* api) {
  static const mjenv_task* const tasks[] = {&task};
  static mjenv_plugin plugin = {sizeof(mjenv_plugin), MJENV_ABI_VERSION, tasks, 1};
#if defined BAD_other_abi
  plugin.abi_version = 999;
#elif defined BAD_no_tasks
  plugin.task_count = 0;
#elif defined BAD_refuses
  return mjenv_task_fail(api, "it lacks the licence") ? (const mjenv_plugin*)0 : &plugin;
#else
  return (const mjenv_plugin*)0;
#endif
  (void)api;
  return &plugin;
}
#endif
