#include "system/stack.hpp"

#include <pthread.h>
#include <signal.h>

#include <cstdint>
#include <exception>

#include "error.hpp"

namespace mjenv::core {
namespace {

struct Job {
  const std::function<void()>& body;
  std::exception_ptr thrown;

  static void* run(void* job) {
    auto& self = *static_cast<Job*>(job);
    try {
      self.body();
    } catch (...) {
      self.thrown = std::current_exception();
    }
    return nullptr;
  }
};

}  // namespace

std::size_t stack_left() {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  void* lowest = nullptr;
  std::size_t size = 0;
  pthread_attr_getstack(&attributes, &lowest, &size);
  pthread_attr_destroy(&attributes);
  const auto bottom = reinterpret_cast<std::uintptr_t>(lowest);
  const auto here = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
  return here > bottom && here - bottom <= size ? here - bottom : 0;
}

void run_with_stack(std::size_t bytes, const std::function<void()>& body) {
  if (stack_left() >= bytes) return body();
  Job job{body, nullptr};
  // The new thread blocks all signals, so that the host's signal handlers run on the host's threads.
  sigset_t all, before;
  sigfillset(&all);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, bytes + PTHREAD_STACK_MIN);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  pthread_t thread;
  const int error = pthread_create(&thread, &attributes, Job::run, &job);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  pthread_attr_destroy(&attributes);
  if (error != 0)
    fail(MJENV_E_MEMORY, "this thread has less than " + std::to_string(bytes / 1024) +
                             " KB of stack left, and the system does not give this process a thread with more");
  pthread_join(thread, nullptr);
  if (job.thrown) std::rethrow_exception(job.thrown);
}

}  // namespace mjenv::core
