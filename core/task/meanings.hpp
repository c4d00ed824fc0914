// The documentation of the terms of observations and the fields of infos that many tasks have.
#pragma once

#include <string>

namespace mjenv::core {

// The documentation of the name, with its unit. "" for an unknown name.
const char* meaning(const std::string& name);

}  // namespace mjenv::core
