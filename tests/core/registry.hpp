// Tests that register themselves, so that no list has to name them.
#pragma once

#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <vector>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

// Defines a test.
#define TEST(name)                                                       \
  void name(void** state);                                               \
  [[maybe_unused]] const bool name##_is_listed = list_test(#name, name); \
  void name(void** /*state*/)

inline std::vector<CMUnitTest>& listed_tests() {
  static std::vector<CMUnitTest> all;
  return all;
}

inline bool list_test(const char* name, CMUnitTestFunction test) {
  listed_tests().push_back({name, test, nullptr, nullptr, nullptr});
  return true;
}

inline int run_listed(const char* group) {
  return _cmocka_run_group_tests(group, listed_tests().data(), listed_tests().size(), nullptr, nullptr);
}
