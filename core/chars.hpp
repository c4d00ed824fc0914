// Converts numbers to text and back, as std::to_chars and std::from_chars do. Some C++ libraries lack these for double.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace mjenv::core {

// Returns the shortest text that read_double turns back into this number.
std::string number(double value);

// Parses the number at the front of a text. Returns nothing if there is no number, or if it overflows or underflows a
// double. length: receives how long the number is.
std::optional<double> read_double(std::string_view text, std::size_t* length = nullptr);

namespace by_c_library {

// The same two functions, written with strtod and snprintf, which every C library has.
std::string number(double value);
std::optional<double> read_double(std::string_view text, std::size_t* length = nullptr);

}  // namespace by_c_library
}  // namespace mjenv::core
