#pragma once

#include <string>

namespace mjenv::core {

// MuJoCo's reason for refusing a model; where it does not know an element or attribute, with its version and the first
// version that does.
std::string with_version(std::string reason);

}  // namespace mjenv::core
