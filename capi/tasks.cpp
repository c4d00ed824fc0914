// Tasks that users register, or that plug-ins contain.
#include "mjenv/task.h"

#include <utility>
#include <vector>

#include "firewall.hpp"
#include "task/api.hpp"
#include "task/plugins.hpp"
#include "task/registry.hpp"

using namespace mjenv::core;
using namespace mjenv::core::firewall;

mjenv_status mjenv_register_task(const mjenv_task* task) {
  return guard([&] {
    std::vector<std::unique_ptr<RegisteredTask>> tasks;
    tasks.push_back(users_task(&need(task, "task"), nullptr));
    add_tasks(std::move(tasks));
  });
}

mjenv_status mjenv_load_tasks(const char* path) {
  return guard([&] {
    if (path) return load_tasks(path);
    load_tasks_of_environment();
    const std::string failure = environment_failure();
    if (!failure.empty()) fail(MJENV_E_TASK, "MJENV_TASKS: " + failure);
  });
}

const mjenv_task_api* mjenv_task_functions() { return &task_api(); }
