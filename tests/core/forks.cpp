// A child that was forked while another thread held a lock neither waits for that lock nor for that thread.
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csetjmp>
#include <cstdarg>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "held.hpp"
#include "run.hpp"
#include "task/registry.hpp"

// Last: it defines a macro `fail`, and does not say itself that it is C.
extern "C" {
#include <cmocka.h>
}

using namespace mjenv::core;

namespace {

constexpr unsigned kSeconds = 20;

// Forks while another thread is inside body(wait), and returns what in_child returns in the child; -1 if it hangs.
template <typename Body, typename InChild>
int result_of_child(const Body& body, const InChild& in_child) {
  std::atomic<bool> inside{false}, leaves{false};
  std::thread other([&] {
    body([&] {
      inside = true;
      while (!leaves) std::this_thread::yield();
    });
  });
  while (!inside) std::this_thread::yield();
  const pid_t child = fork();
  if (child == 0) {
    alarm(kSeconds);
    _exit(in_child());
  }
  int status = 0;
  assert_int_equal(waitpid(child, &status, 0), child);
  leaves = true;
  other.join();
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// A thread that draws holds the lock of its environment for a moment before and after it is inside the environment.
void test_destroyed_while_drawn(void** state) {
  (void)state;
  auto env = std::make_unique<HeldEnv>(default_options(id_of("Hopper-v5")), 1);
  const std::shared_ptr<Link> link = env->link;
  mjenv_env* handle = handles<mjenv_env>.add(std::move(env));
  const int result = result_of_child(
      [&](const auto& wait) {
        const std::lock_guard lock(link->lock);
        wait();
      },
      [&] {
        handles<mjenv_env>.destroy(handle);
        return handle->object || link->env ? 1 : 0;
      });
  handles<mjenv_env>.destroy(handle);
  assert_int_equal(result, 0);
}

// In one process, threads wait for each other, and what one wrote the next one reads.
void test_excludes(void** state) {
  (void)state;
  constexpr int kThreads = 4, kTimes = 10'000;
  ForkLock lock;
  int count = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i)
    threads.emplace_back([&] {
      for (int time = 0; time < kTimes; ++time) {
        const std::lock_guard hold(lock);
        ++count;
      }
    });
  for (std::thread& thread : threads) thread.join();
  assert_int_equal(count, kThreads * kTimes);
}

// In the child, the lock works as before: one thread at a time.
void test_taken_over(void** state) {
  (void)state;
  ForkLock lock;
  const int result = result_of_child(
      [&](const auto& wait) {
        const std::lock_guard hold(lock);
        wait();
      },
      [&] {
        lock.lock();
        lock.unlock();
        const std::lock_guard hold(lock);
        return 0;
      });
  assert_int_equal(result, 0);
}

}  // namespace

int run_forks() {
  const CMUnitTest tests[] = {cmocka_unit_test(test_destroyed_while_drawn), cmocka_unit_test(test_excludes),
                              cmocka_unit_test(test_taken_over)};
  return cmocka_run_group_tests(tests, nullptr, nullptr);
}
