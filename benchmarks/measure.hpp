// Functions that several benchmarks in C++ use.
#pragma once

#include <time.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "mjenv/mjenv.h"

namespace measure {

inline void check(mjenv_status status) {
  if (status == MJENV_OK) return;
  std::fprintf(stderr, "%s: %s\n", mjenv_status_name(status), mjenv_last_error());
  std::exit(1);
}

// The CPU time of this thread in seconds, which other programs on the machine disturb least.
inline double cpu_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

inline double seconds(const std::function<void()>& work) {
  const double start = cpu_time();
  work();
  return cpu_time() - start;
}

inline double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

inline std::string cpu() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown CPU";
}

inline std::int64_t sum_of_counts(const mjenv_env* env, mjenv_role role) {
  std::int64_t total = 0;
  for (std::int64_t i = 0; i < mjenv_field_count(env, role); ++i) {
    mjenv_field field = MJENV_FIELD_INIT;
    check(mjenv_field_at(env, role, i, &field));
    total += field.count;
  }
  return total;
}

inline std::vector<double> read(mjenv_env* env, const char* array) {
  std::int64_t count = 0;
  check(mjenv_read(env, 0, array, nullptr, 0, &count));
  std::vector<double> values(count);
  check(mjenv_read(env, 0, array, values.data(), count, &count));
  return values;
}

}  // namespace measure
