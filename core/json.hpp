// JSON as a tree of values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace mjenv::core {

// Destroying a tree allocates no memory, unlike that of nlohmann's own one, so it may happen when memory has run out.
struct Json {
  enum class Kind { null, flag, integer, real, text, list, object };

  Kind kind = Kind::null;
  bool flag = false;
  std::int64_t integer = 0;
  double real = 0;  // also of an integer
  std::string text;
  std::string name;         // in the object that contains the value
  std::vector<Json> items;  // of a list; of an object, in the order of the text

  bool is_number() const { return kind == Kind::integer || kind == Kind::real; }
  // The member of an object with this name. Null if there is none, or if its value is null.
  const Json* find(const std::string& member) const;
};

// Parses a text. Fails with MJENV_E_VALUE if it is no JSON, with MJENV_E_NAME if an object has a name twice, and with
// MJENV_E_SIZE if the text would take much memory or time. what: of the text, for messages: "the document".
Json parse_json(const std::string& text, const std::string& what);

// Writes a value without spaces, and without the members of objects that are null.
std::string written(const Json& value);

}  // namespace mjenv::core
