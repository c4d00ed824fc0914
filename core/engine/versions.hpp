#pragma once

#include <string>

namespace mjenv::core {

// Takes MuJoCo's reason for refusing a model. If the reason is an unknown element or attribute, appends the version of
// MuJoCo in use and the first version that knows it.
std::string with_version(std::string reason);

}  // namespace mjenv::core
