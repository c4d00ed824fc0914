// Registers the tasks that are compiled into the module (dm_control's suite or MJENV_TASK_SOURCES, for instance), as
// mjenv_load_tasks registers those of a plug-in.
#include <mjenv/task.h>

extern "C" {

mjenv_tasks_function mjenv_tasks;  // which the sources of the tasks define (MJENV_PLUGIN)

// Called by bindings/javascript/src/library.js.
mjenv_status mjenv_register_own_tasks() {
  const mjenv_plugin* const plugin = mjenv_tasks(mjenv_task_functions());
  if (!plugin) return MJENV_E_TASK;
  for (int64_t i = 0; i < plugin->task_count; ++i)
    if (const mjenv_status status = mjenv_register_task(plugin->tasks[i])) return status;
  return MJENV_OK;
}
}
