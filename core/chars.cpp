#include "chars.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace mjenv::core {

#if defined(__cpp_lib_to_chars)

std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::optional<double> read_double(std::string_view text, std::size_t* length) {
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (length) *length = static_cast<std::size_t>(read.ptr - text.data());
  return read.ec == std::errc() ? std::optional<double>(value) : std::nullopt;
}

#else

std::string number(double value) { return by_c_library::number(value); }
std::optional<double> read_double(std::string_view text, std::size_t* length) {
  return by_c_library::read_double(text, length);
}

#endif

namespace by_c_library {
namespace {

std::string printed(const char* format, int precision, double value) {
  std::array<char, 350> text{};
  return {text.data(), static_cast<std::size_t>(std::snprintf(text.data(), text.size(), format, precision, value))};
}

}  // namespace

std::string number(double value) {
  if (std::isnan(value)) return std::signbit(value) ? "-nan" : "nan";
  if (!std::isfinite(value)) return value < 0 ? "-inf" : "inf";
  int places = 0;
  std::string scientific = printed("%.*e", places, value);
  while (std::strtod(scientific.c_str(), nullptr) != value) scientific = printed("%.*e", ++places, value);
  const int exponent = std::atoi(scientific.c_str() + scientific.find('e') + 1);
  const std::string fixed = printed("%.*f", exponent < places ? places - exponent : 0, value);
  return fixed.size() <= scientific.size() ? fixed : scientific;
}

std::optional<double> read_double(std::string_view text, std::size_t* length) {
  // strtod also takes blanks, a plus sign and hexadecimal digits.
  const std::string copy(text.substr(0, text.find_first_of("xX")));
  if (copy.empty() || copy.find_first_of(" \t\n\v\f\r+") == 0) return std::nullopt;
  char* end = nullptr;
  errno = 0;
  const double value = std::strtod(copy.c_str(), &end);
  if (length) *length = static_cast<std::size_t>(end - copy.c_str());
  const bool out_of_range = errno == ERANGE && (value == 0 || std::isinf(value));  // not for subnormal numbers
  return end == copy.c_str() || out_of_range ? std::nullopt : std::optional<double>(value);
}

}  // namespace by_c_library
}  // namespace mjenv::core
