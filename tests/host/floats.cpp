// The host's rounding, traps and treatment of tiny numbers: they change no bit, end no process, and stay as they were.
#include <cfenv>

#include "host.hpp"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace {

constexpr int64_t kRows = 4;

// Set before an environment is created, and after it.
void test_rounding(void**) {
  mjenv_env* env = made({"Hopper-v5", "", 2, kRows});
  const auto expected = played(env, kRows, 0.25);
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    std::fesetround(mode);
    const auto found = played(env, kRows, 0.25);
    mjenv_env* late = made({"Hopper-v5", "", 2, kRows});
    const auto found_late = played(late, kRows, 0.25);
    mjenv_destroy(late);
    const int after = std::fegetround();
    std::fesetround(FE_TONEAREST);
    assert_int_equal(after, mode);
    assert_true(same_bits(found, expected));
    assert_true(same_bits(found_late, expected));
  }
  mjenv_destroy(env);
}

#if defined(__x86_64__)
constexpr const char* kWeightless =
    "<mujoco><option gravity='0 0 0'/><worldbody><body><joint name='x' type='slide' axis='1 0 0'/><joint/>"
    "<geom size='0.1' mass='1'/></body></worldbody>"
    "<actuator><motor joint='x' ctrlrange='-1 1' ctrllimited='true'/></actuator></mujoco>";

// The velocity of a body at rest, pushed by a force that is no normal number.
std::vector<double> pushed(mjenv_env* env) {
  const double zeros[2] = {0, 0}, action = 1e-310;
  assert_ok(mjenv_reset(env, nullptr, nullptr));
  assert_ok(mjenv_set_state(env, 0, zeros, 2, zeros, 2));
  assert_ok(mjenv_step(env, nullptr, &action, 1, MJENV_DTYPE_FLOAT64, nullptr));
  return read(env, 0, "qvel");
}

void test_tiny_numbers(void**) {
  constexpr unsigned flush_and_denormals_are_zero = 0x8040;
  mjenv_env* env = made({"InvertedPendulum-v5", kWeightless});
  const auto expected = pushed(env);
  const unsigned before = _mm_getcsr();
  _mm_setcsr(before | flush_and_denormals_are_zero);
  const auto found = pushed(env);
  const unsigned after = _mm_getcsr();
  _mm_setcsr(before);
  assert_true((after & flush_and_denormals_are_zero) == flush_and_denormals_are_zero);
  assert_true(expected[0] != 0);
  assert_true(same_bits(found, expected));
  mjenv_destroy(env);
}
#endif

#if defined(__GLIBC__)
// Huge but finite actions overflow, which raises no signal.
void test_traps(void**) {
  constexpr int traps = FE_OVERFLOW | FE_DIVBYZERO | FE_INVALID;
  mjenv_env* env = made({"Hopper-v5", "", 2, kRows});
  const auto expected = played(env, kRows, 1e200);
  std::fenv_t before;
  std::fegetenv(&before);
  feenableexcept(traps);
  const auto found = played(env, kRows, 1e200);
  const int left = fegetexcept();
  std::fesetenv(&before);
  assert_int_equal(left, traps);
  assert_true(same_bits(found, expected));
  mjenv_destroy(env);
}
#endif

}  // namespace

int main() {
  const CMUnitTest tests[] = {
    cmocka_unit_test(test_rounding),
#if defined(__x86_64__)
    cmocka_unit_test(test_tiny_numbers),
#endif
#if defined(__GLIBC__)
    cmocka_unit_test(test_traps),
#endif
  };
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
