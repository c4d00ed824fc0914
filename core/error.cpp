#include "error.hpp"

#include "chars.hpp"

namespace mjenv::core {

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

std::string number(double value) { return shortest_text(value); }

}  // namespace mjenv::core
