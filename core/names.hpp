// Searches in lists of names.
#pragma once

#include <algorithm>
#include <string>

namespace mjenv::core {

template <typename Names>
bool is_in(const Names& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Whether `name` begins with one of these prefixes.
template <typename Names>
bool begins_with(const Names& beginnings, const std::string& name) {
  return std::any_of(beginnings.begin(), beginnings.end(), [&](const char* b) { return name.rfind(b, 0) == 0; });
}

}  // namespace mjenv::core
