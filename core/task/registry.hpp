// The list of ids, and what the definition behind an id gives: its options and its task.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "task/options.hpp"
#include "task/own_task.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

// A built-in robot's version, or a registered task. It lives as long as the process.
struct Id {
  const char *name, *robot;
  int version;
  void (*define)(Robot&);  // null for a registered task
  const OwnTask* own;      // null for a built-in robot
};

// Sorted by name. They grow when tasks are registered.
std::int64_t id_count();
const Id& id_at(std::int64_t index);
const Id& id_of(const std::string& name);

// Makes the tasks' ids known, or none of them: those of a plug-in that is registered already are left alone.
void add_tasks(std::vector<std::unique_ptr<OwnTask>> tasks);

Options default_options(const Id& id);
// What every environment offers, whatever its robot.
void declare_env_options(Options& options);
// The task without its model, built with the default options.
Task outline(const Id& id);
Task build_task(Options& options);

}  // namespace mjenv::core
