#include "system/cgroups.hpp"

#include <algorithm>
#include <fstream>

namespace mjenv::core {

double counter(const std::string& file, const std::string& word, double fallback) {
  std::ifstream from(file);
  double value = 0;
  for (std::string key; from >> key;)
    if (key == word && from >> value) return value;
  return fallback;
}

double smallest_limit(const std::string& root, const std::string& controller,
                      double (*limit_of)(const std::string& folder)) {
  const std::string unified = root + "/sys/fs/cgroup", own = unified + "/" + controller;
  double smallest = std::min(limit_of(unified), limit_of(own));
  std::ifstream groups(root + "/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    std::string path = line.substr(line.rfind(':') + 1);
    const std::string& hierarchy = line.rfind("0::", 0) == 0 ? unified : own;
    for (; path.size() > 1 && path[0] == '/'; path.erase(path.rfind('/')))
      smallest = std::min(smallest, limit_of(hierarchy + path));
  }
  return smallest;
}

}  // namespace mjenv::core
