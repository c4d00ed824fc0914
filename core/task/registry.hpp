// The list of ids. Runs the definition of an id to get its options or its task.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "task/options.hpp"
#include "task/own_task.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

// A version of a built-in robot, or a registered task. Lives as long as the process.
struct Id {
  const char *name, *robot;
  int version;
  void (*define)(Robot&);  // null for a registered task
  const OwnTask* own;      // null for a built-in robot
};

// The ids, sorted by name. There are more after tasks were registered.
std::int64_t id_count();
const Id& id_at(std::int64_t index);
const Id& id_of(const std::string& name);

// Adds the ids of the tasks, or throws and adds none. Does nothing if they come from a plug-in that is already
// registered.
void add_tasks(std::vector<std::unique_ptr<OwnTask>> tasks);

Options default_options(const Id& id);
// Declares the options of the environment itself, which every id has.
void declare_env_options(Options& options);
// The task with the default options, without its model.
Task outline(const Id& id);
Task build_task(Options& options);

}  // namespace mjenv::core
