// Converts numbers to text and back, as std::to_chars and std::from_chars do. Some C++ libraries lack these for double.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mjenv::core {

// The shortest text that reads as this number.
std::string number(double value);

// The number at the front of a text; nothing if there is none, or it is too large or too small for a double.
std::optional<double> read_double(std::string_view text);

namespace by_c_library {

// The same, by functions that every C library has.
std::string number(double value);
std::optional<double> read_double(std::string_view text);

}  // namespace by_c_library
}  // namespace mjenv::core
