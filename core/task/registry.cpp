#include "task/registry.hpp"

#include <algorithm>

#include "error.hpp"

namespace mjenv::core {

#define ROBOT(name, define) void define(Robot&);
#include "robots/all.def"
#undef ROBOT

const std::vector<Id>& ids() {
  static const std::vector<Id> list = [] {
    std::vector<Id> found;
    for (const int version : {4, 5}) {
      const auto suffix = "-v" + std::to_string(version);
#define ROBOT(name, define) found.push_back({name + suffix, name, version, define});
#include "robots/all.def"
#undef ROBOT
    }
    std::sort(found.begin(), found.end(), [](const Id& a, const Id& b) { return a.name < b.name; });
    return found;
  }();
  return list;
}

const Id& id_of(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& id : ids()) {
    if (id.name == name) return id;
    names.push_back(id.name);
  }
  fail(MJENV_E_NAME, "no environment " + quoted(name) + "; there are " + listed(names));
}

Options default_options(const Id& id) {
  Options options(id.name);
  Robot robot(id.version, options, Robot::Build::options);
  id.define(robot);
  robot.declare_common();
  declare_env_options(options);
  return options;
}

Task outline(const Id& id) {
  Options options(id.name);
  Robot robot(id.version, options, Robot::Build::options);
  id.define(robot);
  return robot.take();
}

Task build_task(Options& options) {
  const Id& id = id_of(options.id());
  Robot robot(id.version, options, Robot::Build::task);
  id.define(robot);
  return robot.take();
}

}  // namespace mjenv::core
