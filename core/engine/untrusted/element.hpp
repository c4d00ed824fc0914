// An element of a model's XML, and its attributes as MuJoCo reads them.
#pragma once

#include <strings.h>
#include <tinyxml2.h>

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace mjenv::core {

// Parses values of type T from the front of a text, up to the first word that is no such value.
template <typename T>
std::vector<T> values_of(const std::string& text) {
  std::istringstream from(text);
  from.imbue(std::locale::classic());
  std::vector<T> values;
  for (T value; from >> value;) values.push_back(value);
  return values;
}

struct Element {
  const tinyxml2::XMLElement& xml;
  std::string name, parent;  // an included element has the parent of <include>

  // Returns "" if the attribute is missing.
  std::string text(const char* attribute) const {
    const char* text = xml.Attribute(attribute);
    return text ? text : "";
  }
  // Parses the number at the front of the text. Returns 0 if there is none.
  std::int64_t integer(const char* attribute) const {
    const char* text = xml.Attribute(attribute);
    return text ? std::strtoll(text, nullptr, 10) : 0;
  }
  // Parses the first word as MuJoCo does; 1e-400 underflows to 0. Returns no value if the word is no number.
  std::optional<double> real(const char* attribute) const {
    const auto words = values_of<std::string>(text(attribute));
    if (words.empty()) return std::nullopt;
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (strcasecmp(words[0].c_str(), "inf") == 0) return infinity;
    if (strcasecmp(words[0].c_str(), "-inf") == 0) return -infinity;
    std::istringstream from(words[0]);
    from.imbue(std::locale::classic());
    double value = 0;
    if (!(from >> value) || !from.eof()) return std::nullopt;
    return value;
  }
};

}  // namespace mjenv::core
