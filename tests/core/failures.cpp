// The errors of many rows become one text that names the first rows and counts the others.
#include "env/failures.hpp"

#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <string>

#include "error.hpp"
#include "run.hpp"

// Last: it defines a macro `fail`, and does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

using namespace mjenv::core;

namespace {

constexpr std::size_t kLimit = 8191;  // bytes that mjenv_last_error can return

std::string text_of(Failures& failures, mjenv_status expected) {
  try {
    failures.raise();
  } catch (const Error& error) {
    assert_int_equal(error.status(), expected);
    return error.what();
  }
  fail_msg("nothing was raised");
  return "";
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

// How many rows the text names, which must be the first ones, in their order.
std::int64_t named(const std::string& text) {
  std::int64_t count = 0;
  for (std::size_t at = 0; text.compare(at, 4, "row ") == 0; ++count) {
    assert_true(text.find(in_row(count, ""), at) == at);
    at = text.find("; ", at);
    if (at == std::string::npos) return count + 1;
    at += 2;
  }
  return count;
}

void test_few(void** state) {
  (void)state;
  Failures failures;
  failures.raise();
  failures.add(MJENV_E_TASK, in_row(3, "it fell"));
  failures.add(MJENV_E_PHYSICS, in_row(5, "it broke"));
  assert_true(text_of(failures, MJENV_E_TASK) == "row 3: it fell; row 5: it broke");
  failures.raise();  // forgotten
}

void test_many(void** state) {
  (void)state;
  constexpr std::int64_t kRows = 100'000;
  const std::string what(200, 'x');
  Failures failures;
  for (std::int64_t row = 0; row < kRows; ++row) failures.add(MJENV_E_TASK, in_row(row, what));
  const std::string text = text_of(failures, MJENV_E_TASK);
  assert_true(text.size() < kLimit);
  const std::int64_t count = named(text);
  assert_in_range(count, 10, 100);
  assert_true(ends_with(text, "; and " + std::to_string(kRows - count) + " more"));
}

// Each worker collects its own.
void test_of_several(void** state) {
  (void)state;
  constexpr std::int64_t kWorkers = 8, kEach = 1000;
  Failures all;
  std::int64_t row = 0;
  for (std::int64_t worker = 0; worker < kWorkers; ++worker) {
    Failures failures;
    for (std::int64_t i = 0; i < kEach; ++i) failures.add(MJENV_E_TASK, in_row(row++, "it fell"));
    all.take(failures);
    failures.raise();  // moved away
  }
  const std::string text = text_of(all, MJENV_E_TASK);
  assert_true(text.size() < kLimit);
  assert_true(ends_with(text, "; and " + std::to_string(kWorkers * kEach - named(text)) + " more"));
}

// A status that is not in the text counts, too.
void test_memory(void** state) {
  (void)state;
  Failures failures;
  for (std::int64_t row = 0; row < 10'000; ++row) failures.add(MJENV_E_TASK, in_row(row, "it fell"));
  failures.add(MJENV_E_MEMORY, "");
  text_of(failures, MJENV_E_MEMORY);
}

// The text of one row is never cut.
void test_long(void** state) {
  (void)state;
  const std::string what(100'000, 'x');
  Failures failures;
  failures.add(MJENV_E_TASK, what);
  failures.add(MJENV_E_TASK, what);
  assert_true(text_of(failures, MJENV_E_TASK) == what + "; and 1 more");
}

}  // namespace

int run_failures() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_few), cmocka_unit_test(test_many),
                              cmocka_unit_test(test_of_several), cmocka_unit_test(test_memory),
                              cmocka_unit_test(test_long)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
