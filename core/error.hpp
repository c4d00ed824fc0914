#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "chars.hpp"
#include "mjenv/mjenv.h"

namespace mjenv::core {

// A status and a message for the caller. capi/firewall.hpp turns it into the result of a C function.
class Error : public std::exception {
 public:
  Error(mjenv_status status, std::string message) : status_(status), message_(std::move(message)) {}
  mjenv_status status() const { return status_; }
  const char* what() const noexcept override { return message_.c_str(); }

 private:
  mjenv_status status_;
  std::string message_;
};

[[noreturn]] inline void fail(mjenv_status status, std::string message) { throw Error(status, std::move(message)); }

inline std::string quoted(const std::string& text) { return '"' + text + '"'; }

// Joins names as "a, b, c", for messages that list the valid choices.
std::string listed(const std::vector<std::string>& names);

// Ends a message about a name that does not exist: "; there are a, b, c" if there are few, otherwise the nearest, and
// which function lists all.
std::string choices(const std::string& given, const std::vector<std::string>& names, const std::string& lister);

// The up to three names that the caller probably meant, the likeliest first: names that end with the given word, such as
// "opt.gravity" for "gravity", names that contain it, and names that differ by a few letters.
std::vector<std::string> nearest(const std::string& given, const std::vector<std::string>& names);

inline std::string in_row(std::int64_t row, const std::string& what) {
  return "row " + std::to_string(row) + ": " + what;
}

// Returns the beginning of a message about one element of an array, such as "qpos[2] is nan".
inline std::string element_is(const std::string& array, std::size_t index, double value) {
  return array + "[" + std::to_string(index) + "] is " + number(value);
}

inline void check_count(const char* what, std::int64_t given, std::int64_t needed) {
  if (given != needed)
    fail(MJENV_E_SIZE, std::string(what) + " is " + std::to_string(given) + ", not " + std::to_string(needed));
}

inline void check_range(const char* what, std::int64_t given, std::int64_t low, std::int64_t high,
                        mjenv_status status = MJENV_E_VALUE) {
  if (given < low || given > high)
    fail(status, std::string(what) + " is " + std::to_string(given) + ", not " + std::to_string(low) + " to " +
                     std::to_string(high));
}

inline void check_index(const char* what, std::int64_t index, std::size_t count) {
  const auto end = static_cast<std::int64_t>(count);
  if (end == 0) fail(MJENV_E_VALUE, std::string(what) + " " + std::to_string(index) + ": there are none");
  if (index < 0 || index >= end)
    fail(MJENV_E_VALUE, std::string(what) + " " + std::to_string(index) + " is outside 0.." + std::to_string(end - 1));
}

}  // namespace mjenv::core
