// What the tests of the host's settings share: an environment, and what an episode of it computes.
#pragma once

#include <csetjmp>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

// After the headers that it needs.
extern "C" {
#include <cmocka.h>
}

#include "mjenv/mjenv.h"

// The call succeeds; else the test fails with the library's message.
#define assert_ok(call)                                                                               \
  do {                                                                                                \
    if ((call) != MJENV_OK) fail_msg("%s:%d: %s: %s", __FILE__, __LINE__, #call, mjenv_last_error()); \
  } while (0)

struct Setting {
  const char* id = "Hopper-v5";
  std::string xml = {};
  int threads = 1;
  int64_t rows = 1;
};

inline mjenv_status create(const Setting& setting, mjenv_env** env) {
  mjenv_options* options = nullptr;
  assert_ok(mjenv_options_create(setting.id, &options));
  assert_ok(mjenv_options_set_integer(options, "num_threads", setting.threads));
  assert_ok(mjenv_options_set_integer(options, "strict", 0));
  if (!setting.xml.empty()) assert_ok(mjenv_options_set_string(options, "xml_string", setting.xml.c_str()));
  const mjenv_status status = mjenv_create(options, setting.rows, env);
  mjenv_options_destroy(options);
  return status;
}

inline mjenv_env* made(const Setting& setting) {
  mjenv_env* env = nullptr;
  assert_ok(create(setting, &env));
  return env;
}

inline std::vector<double> read(mjenv_env* env, int64_t row, const char* array) {
  int64_t count = 0;
  assert_ok(mjenv_read(env, row, array, nullptr, 0, &count));
  std::vector<double> values(count);
  if (count > 0) assert_ok(mjenv_read(env, row, array, values.data(), count, &count));
  return values;
}

// The positions and velocities of all rows after some steps under one action.
inline std::vector<double> played(mjenv_env* env, int64_t rows, double action, int steps = 20) {
  std::vector<uint64_t> seeds;
  for (int64_t row = 0; row < rows; ++row) seeds.push_back(static_cast<uint64_t>(row) + 1);
  assert_ok(mjenv_seed(env, nullptr, seeds.data(), rows));
  assert_ok(mjenv_reset(env, nullptr, nullptr));
  const size_t count = read(env, 0, "ctrl").size() * static_cast<size_t>(rows);
  const std::vector<double> actions(count, action);
  for (int step = 0; step < steps; ++step)
    assert_ok(mjenv_step(env, nullptr, actions.data(), count, MJENV_DTYPE_FLOAT64, nullptr));
  std::vector<double> state;
  for (int64_t row = 0; row < rows; ++row)
    for (const char* array : {"qpos", "qvel", "cfrc_ext"})
      for (const double value : read(env, row, array)) state.push_back(value);
  return state;
}

inline bool same_bits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}
