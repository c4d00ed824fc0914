// A task that writes other infos than it did at first is refused, instead of writing outside of its row.
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <functional>
#include <mjenv/task.hpp>
#include <string>
#include <vector>

#include "run.hpp"

// Last: it defines a macro `fail`, and does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

namespace {

using mjenv::Info;

constexpr double kUntouched = -77;

// The fields of a trial call.
const std::vector<Info::Entry> learned{{"x", "x", 1}, {"position", "position", 2}, {"alive", "alive", 1}};

// Checks that the call is refused with a text, and writes nothing behind the info.
void assert_refused(const char* text, const std::function<void(Info&)>& write) {
  std::vector<double> values(5, kUntouched);
  Info info(learned, values.data());
  try {
    write(info);
    info.check_complete();
  } catch (const std::logic_error& error) {
    if (std::string(error.what()).find(text) == std::string::npos) fail_msg("%s is not in: %s", text, error.what());
    assert_true(values[4] == kUntouched);
    return;
  }
  fail_msg("not refused: %s", text);
}

void test_same_fields(void** state) {
  (void)state;
  std::vector<double> values(5, kUntouched);
  Info info(learned, values.data());
  info("x", 1.0), info("position", Eigen::Vector2d(2, 3)), info("alive", 4.0);
  info.check_complete();
  const std::vector<double> expected{1, 2, 3, 4, kUntouched};
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
}

}  // namespace

int run_info() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_same_fields), cmocka_unit_test(test_other_fields)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
