// A program with a task of its own, whose model lies in the program's folder. The test starts it from another folder
// and by its name alone, which the shell looks up in PATH, so that argv[0] does not tell the folder.
#include <stdio.h>
#include <stdlib.h>

#include "mjenv/task.h"

static int32_t reset(const void* self, mjenv_start* start) {
  (void)self;
  (void)start;
  return 0;
}

static int32_t observe(const void* self, const mjenv_sim* sim, double* observation) {
  (void)self;
  observation[0] = sim->qpos[0];
  return 0;
}

static int32_t step(const void* self, const mjenv_sim* sim, mjenv_outcome* outcome) {
  (void)self;
  (void)sim;
  (void)outcome;
  return 0;
}

static void check(mjenv_status status) {
  if (status == MJENV_OK) return;
  fprintf(stderr, "%s\n", mjenv_last_error());
  exit(1);
}

int main(void) {
  const mjenv_task_field field = {.struct_size = sizeof field, .role = MJENV_ROLE_OBSERVATION, .name = "angle"};
  const mjenv_task task = {.struct_size = sizeof task,
                           .id = "Program-v0",
                           .model = "./typed.xml",
                           .frame_skip = 1,
                           .fields = &field,
                           .field_count = 1,
                           .reset = reset,
                           .observe = observe,
                           .step = step};
  mjenv_options* options = NULL;
  mjenv_env* env = NULL;
  check(mjenv_register_task(&task));
  check(mjenv_options_create("Program-v0", &options));
  check(mjenv_create(options, 1, &env));
  mjenv_destroy(env);
  mjenv_options_destroy(options);
  return 0;
}
