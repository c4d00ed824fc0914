// Loads plug-ins: shared objects that contain tasks (mjenv/task.h).
#pragma once

#include <string>

namespace mjenv::core {

// Loads a plug-in and registers its tasks; it then stays loaded. If a task is refused, unloads the plug-in and throws.
void load_tasks(const std::string& path);

// Loads the plug-ins that the environment variable MJENV_TASKS lists. Later calls do nothing, unless memory ran out
// before.
void load_tasks_of_environment();
// Why some plug-ins of MJENV_TASKS could not be loaded; "" if all were loaded.
std::string environment_failure();

}  // namespace mjenv::core
