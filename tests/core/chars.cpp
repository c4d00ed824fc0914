// Numbers as text: what the C library's functions make equals what the C++ library makes, where it has such functions.
#include "chars.hpp"

#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>

#include "run.hpp"

// Last: it defines a macro `fail`, and does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

namespace {

using namespace mjenv::core;

void check(double value) {
  const std::string text = number(value);
  assert_string_equal(by_c_library::number(value).c_str(), text.c_str());
  const auto read = by_c_library::read_double(text);
  assert_true(read.has_value());
  assert_true(std::isnan(value) ? std::isnan(*read) : *read == value);
}

void test_texts(void** state) {
  (void)state;
  const std::pair<double, const char*> known[] = {
      {0, "0"}, {-0.0, "-0"}, {0.1, "0.1"}, {100000, "1e+05"}, {123456, "123456"}, {1e22, "1e+22"}, {5e-324, "5e-324"}};
  for (const auto& [value, text] : known) assert_string_equal(by_c_library::number(value).c_str(), text);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double value : {infinity, -infinity, std::nan(""), std::numeric_limits<double>::max()}) check(value);
}

// Of all sizes, and with few digits.
void test_random_numbers(void** state) {
  (void)state;
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const std::uint64_t word = random();
    double value = 0;
    std::memcpy(&value, &word, sizeof value);
    check(value);
    check(std::ldexp(static_cast<double>(word >> 11), -static_cast<int>(word % 70)));
    check(static_cast<double>(word >> word % 60));
    check(std::round(std::ldexp(static_cast<double>(word >> 12), -40)) * 1e-3);
  }
}

void test_what_is_read(void** state) {
  (void)state;
  for (const char* text : {"1.5abc", ".5", "-.5e3", "1e", "1e+", "0x10", "-0x3", "4.9e-324", "1e-310", "infinity"}) {
    std::size_t our_length = 0, their_length = 0;
    const auto ours = by_c_library::read_double(text, &our_length), theirs = read_double(text, &their_length);
    assert_true(ours && theirs && *ours == *theirs && our_length == their_length);
  }
  for (const char* text : {"", " 1", "\t1", "+1", "e5", "-", "x", "1e999", "1e-999"}) {
    assert_false(by_c_library::read_double(text).has_value());
    assert_false(read_double(text).has_value());
  }
}

}  // namespace

int run_chars() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_texts), cmocka_unit_test(test_random_numbers),
                              cmocka_unit_test(test_what_is_read)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
