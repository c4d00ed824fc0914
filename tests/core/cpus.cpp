// How many CPUs and how much memory a process may use: its affinity, and the limits of the control groups that it is
// in.
#include <cmath>
#include <csetjmp>
#include <cstdarg>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

// After the headers that it needs; it does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

#include "run.hpp"
#include "system/cpus.hpp"
#include "system/platform.hpp"

namespace {

// A root folder with what a kernel would show; removed at the end.
class Root {
 public:
  Root() {
    std::string name = (std::filesystem::temp_directory_path() / "mjenv-XXXXXX").string();
    if (!mkdtemp(name.data())) std::abort();
    path_ = name;
  }
  ~Root() { std::filesystem::remove_all(path_); }
  Root(const Root&) = delete;
  Root& operator=(const Root&) = delete;

  void write(const std::string& file, const std::string& text) const {
    const auto path = path_ / file;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  double quota() const { return mjenv::core::platform::cpu_quota(path_.string()); }
  double memory() const { return mjenv::core::platform::available_memory(path_.string()); }

 private:
  std::filesystem::path path_;
};

bool quotas_are_found() {
  bool fine = true;
  const auto expect = [&](const Root& root, double wanted) {
    if (root.quota() == wanted) return;
    print_error("a quota of %g, wanted %g\n", root.quota(), wanted);
    fine = false;
  };
  const Root none;
  expect(none, HUGE_VAL);

  const Root unlimited;
  unlimited.write("proc/self/cgroup", "0::/user/job\n");
  unlimited.write("sys/fs/cgroup/user/job/cpu.max", "max 100000\n");
  expect(unlimited, HUGE_VAL);

  const Root own;  // of version 2
  own.write("proc/self/cgroup", "0::/user/job\n");
  own.write("sys/fs/cgroup/user/job/cpu.max", "150000 100000\n");
  expect(own, 1.5);
  own.write("sys/fs/cgroup/user/cpu.max", "50000 100000\n");
  expect(own, 0.5);
  own.write("sys/fs/cgroup/cpu.max", "10000 100000\n");
  expect(own, 0.1);

  const Root inside;  // a container that sees its own group as the root
  inside.write("proc/self/cgroup", "0::/\n");
  inside.write("sys/fs/cgroup/cpu.max", "300000 100000\n");
  expect(inside, 3);

  const Root old;  // of version 1
  old.write("proc/self/cgroup", "5:memory:/elsewhere\n4:cpu,cpuacct:/docker/a\n0::/\n");
  old.write("sys/fs/cgroup/cpu/docker/a/cpu.cfs_period_us", "50000\n");
  old.write("sys/fs/cgroup/cpu/docker/a/cpu.cfs_quota_us", "-1\n");
  expect(old, HUGE_VAL);
  old.write("sys/fs/cgroup/cpu/docker/a/cpu.cfs_quota_us", "100000\n");
  expect(old, 2);

  const Root broken;
  broken.write("proc/self/cgroup", "nonsense\n\n0::\n");
  broken.write("sys/fs/cgroup/cpu.max", "what\n");
  expect(broken, HUGE_VAL);
  broken.write("sys/fs/cgroup/cpu.max", "100000 0\n");
  expect(broken, HUGE_VAL);
  broken.write("sys/fs/cgroup/cpu.max", "-5 100000\n");
  expect(broken, HUGE_VAL);
  return fine;
}

void test_quotas(void**) { assert_true(quotas_are_found()); }

void test_memory(void**) {
  const Root machine;
  assert_true(machine.memory() == HUGE_VAL);
  machine.write("proc/meminfo", "MemTotal: 9000 kB\nMemFree: 1000 kB\nMemAvailable: 4000 kB\n");
  assert_true(machine.memory() == 4000.0 * 1024);

  const Root own;  // of version 2
  own.write("proc/self/cgroup", "0::/user/job\n");
  own.write("sys/fs/cgroup/user/job/memory.max", "max\n");
  own.write("sys/fs/cgroup/user/job/memory.current", "900000\n");
  assert_true(own.memory() == HUGE_VAL);
  own.write("sys/fs/cgroup/user/memory.max", "5000000\n");
  own.write("sys/fs/cgroup/user/memory.current", "1000000\n");
  assert_true(own.memory() == 4000000);
  own.write("sys/fs/cgroup/user/memory.stat", "active_file 7\ninactive_file 500000\n");
  assert_true(own.memory() == 4500000);
  own.write("sys/fs/cgroup/user/job/memory.max", "800000\n");
  assert_true(own.memory() == 0);

  const Root old;  // of version 1
  old.write("proc/self/cgroup", "5:memory:/docker/a\n4:cpu,cpuacct:/docker/b\n");
  old.write("sys/fs/cgroup/memory/docker/a/memory.limit_in_bytes", "3000000\n");
  old.write("sys/fs/cgroup/memory/docker/a/memory.usage_in_bytes", "1000000\n");
  assert_true(old.memory() == 2000000);
}

void test_usable(void**) {
  assert_true(mjenv::core::usable_cpus() >= 1);
  assert_true(mjenv::core::usable_cpus() <= static_cast<int>(mjenv::core::allowed_cpus().size()));
}

}  // namespace

int run_cpus() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_quotas), cmocka_unit_test(test_memory),
                              cmocka_unit_test(test_usable)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
