// A task that writes other infos than it did at first is refused, instead of writing outside of its row.
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "error.hpp"
#include "run.hpp"
#include "task/robot.hpp"

// Last: it defines a macro `fail`, and does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

namespace {

using namespace mjenv::core;

constexpr std::int64_t kRows = 2, kCount = 4;
constexpr double kUntouched = -77;

std::vector<Field> learned() {
  std::vector<Field> fields;
  Info info(fields);
  info("x", 1.0), info("position", Eigen::Vector2d(2, 3)), info("alive", 1.0);
  return fields;
}

// Writes row 1 of two, and checks that it is refused with a text, and that row 0 is untouched.
void assert_refused(const char* text, const std::function<void(Info&)>& write) {
  const std::vector<Field> fields = learned();
  std::vector<double> values(kRows * kCount, kUntouched);
  Info info(fields, values.data(), kRows, 1);
  try {
    write(info);
    info.check_complete();
  } catch (const Error& error) {
    assert_int_equal(error.status(), MJENV_E_INTERNAL);
    if (std::string(error.what()).find(text) == std::string::npos) fail_msg("%s is not in: %s", text, error.what());
    for (const std::size_t i : {0, 2, 3, 6}) assert_true(values[i] == kUntouched);
    return;
  }
  fail_msg("not refused: %s", text);
}

void test_same_fields(void** state) {
  (void)state;
  const std::vector<Field> fields = learned();
  std::vector<double> values(kRows * kCount, kUntouched);
  Info info(fields, values.data(), kRows, 1);
  info("x", 1.0), info("position", Eigen::Vector2d(2, 3)), info("alive", 4.0);
  info.check_complete();
  const std::vector<double> expected{kUntouched, 1, kUntouched, kUntouched, 2, 3, kUntouched, 4};
  assert_true(values == expected);
}

void test_other_fields(void** state) {
  (void)state;
  assert_refused("\"position\"", [](Info& info) { info("position", Eigen::Vector2d(2, 3)); });
  assert_refused("\"y\"", [](Info& info) { info("y", 1.0); });
  assert_refused("3 number(s)", [](Info& info) { info("x", 1.0), info("position", Eigen::Vector3d(1, 2, 3)); });
  assert_refused("\"alive\"", [](Info& info) { info("x", 1.0), info("position", Eigen::Vector2d(2, 3)); });
  assert_refused("\"more\"", [](Info& info) {
    info("x", 1.0), info("position", Eigen::Vector2d(2, 3)), info("alive", 1.0), info("more", 1.0);
  });
  // Also where the caller wants no info.
  const std::vector<Field> fields = learned();
  Info nowhere(fields, nullptr, kRows, 1);
  bool refused = false;
  try {
    nowhere("y", 1.0);
  } catch (const Error&) {
    refused = true;
  }
  assert_true(refused);
}

}  // namespace

int run_info() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_same_fields), cmocka_unit_test(test_other_fields)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
