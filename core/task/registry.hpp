// The list of ids, and what the definition behind an id gives: its options and its task.
#pragma once

#include <string>
#include <vector>

#include "task/options.hpp"
#include "task/robot.hpp"

namespace mjenv::core {

struct Id {
  std::string name, robot;
  int version;
  void (*define)(Robot&);
};

// Sorted by name.
const std::vector<Id>& ids();
const Id& id_of(const std::string& name);

Options default_options(const Id& id);
// What every environment offers, whatever its robot.
void declare_env_options(Options& options);
// The task without its model, built with the default options.
Task outline(const Id& id);
Task build_task(Options& options);

}  // namespace mjenv::core
