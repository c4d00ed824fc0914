// Shared objects with tasks.
#pragma once

#include <string>

namespace mjenv::core {

// Loads a plug-in for good and registers its tasks, all or none.
void load_tasks(const std::string& path);

// Loads the plug-ins that the environment variable MJENV_TASKS names, once in a process.
void load_tasks_of_environment();
// Why some of them could not be loaded; "" if all were.
std::string environment_failure();

}  // namespace mjenv::core
