// The list of ids, and the task of each.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mjenv/task.hpp"
#include "task/options.hpp"
#include "task/registered_task.hpp"

namespace mjenv::core {

// One id: a version of a built-in robot, or a task that a user registered. It lives as long as the process.
struct Id {
  const char *name, *robot;
  int version;
  Definition built_in;               // of a built-in robot
  const RegisteredTask* registered;  // null for a built-in robot
};

// The ids are sorted by name. Registering a task adds its id.
std::int64_t id_count();
const Id& id_at(std::int64_t index);
const Id& id_of(const std::string& name);

// Adds the ids of the tasks, or throws and adds none. Does nothing for a plug-in that is already registered.
void add_tasks(std::vector<std::unique_ptr<RegisteredTask>> tasks);

// The task of an id. Each call makes a new one for a built-in robot.
std::shared_ptr<const RegisteredTask> task_of(const Id& id);

Options default_options(const Id& id);
// Declares the options of the environment itself, which every id has.
void declare_env_options(Options& options);

}  // namespace mjenv::core
