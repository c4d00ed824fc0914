#include "system/cgroups.hpp"

#include <algorithm>
#include <fstream>

namespace mjenv::core {

double least_of_cgroups(const std::string& root, const std::string& controller,
                        double (*of)(const std::string& folder)) {
  const std::string unified = root + "/sys/fs/cgroup", own = unified + "/" + controller;
  double least = std::min(of(unified), of(own));
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    std::string path = line.substr(line.rfind(':') + 1);
    const std::string& hierarchy = line.rfind("0::", 0) == 0 ? unified : own;
    for (; path.size() > 1 && path[0] == '/'; path.erase(path.rfind('/')))
      least = std::min(least, of(hierarchy + path));
  }
  return least;
}

}  // namespace mjenv::core
