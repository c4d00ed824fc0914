// What only macOS has.
#include <dlfcn.h>
#include <mach/mach.h>
#include <pthread.h>
#include <stdlib.h>
#include <unistd.h>

#include <limits>
#include <numeric>

#include "system/condition.hpp"
#include "system/platform.hpp"
#include "system/posix/posix.hpp"

// What C++'s own atomic waits call on macOS. Apple's headers do not declare them.
extern "C" int __ulock_wait(std::uint32_t operation, void* address, std::uint64_t value, std::uint32_t microseconds);
extern "C" int __ulock_wake(std::uint32_t operation, void* address, std::uint64_t value);

namespace mjenv::core {

Condition::Condition() { pthread_cond_init(&condition_, nullptr); }

// Waits for a duration, because pthread_cond_timedwait would wait until a time of the system clock, which users can
// set.
void Condition::wait(std::unique_lock<std::mutex>& lock, const Deadline& deadline) {
  pthread_mutex_t* mutex = lock.mutex()->native_handle();
  if (!deadline.is_set()) return static_cast<void>(pthread_cond_wait(&condition_, mutex));
  const std::chrono::nanoseconds left = deadline.time() - std::chrono::steady_clock::now();
  if (left.count() <= 0) return;
  const timespec time = timespec_of(left);
  pthread_cond_timedwait_relative_np(&condition_, mutex, &time);
}

namespace platform {

std::uint32_t thread_id() {
  std::uint64_t id = 0;
  pthread_threadid_np(nullptr, &id);
  return static_cast<std::uint32_t>(id);
}

std::optional<std::string> trusted_environment(const char* name) {
  return issetugid() != 0 ? std::nullopt : environment(name);
}

// macOS has no affinity masks.
std::vector<int> allowed_cpus() {
  const long count = sysconf(_SC_NPROCESSORS_ONLN);
  std::vector<int> cpus(count > 0 ? static_cast<std::size_t>(count) : 0);
  std::iota(cpus.begin(), cpus.end(), 0);
  return cpus;
}

double cpu_quota(const std::string&) { return std::numeric_limits<double>::infinity(); }
int scalable_vector_bytes() { return 0; }
void pin_thread(std::thread&, int) {}

// A thread can name only itself.
void name_thread(std::thread&, const std::string&) {}

std::size_t stack_left() {
  const auto top = reinterpret_cast<std::uintptr_t>(pthread_get_stackaddr_np(pthread_self()));
  const std::size_t size = pthread_get_stacksize_np(pthread_self());
  const std::uintptr_t bottom = top - size;
  const auto here = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
  return here > bottom && here - bottom <= size ? here - bottom : 0;
}

namespace {

constexpr std::uint32_t kCompareAndWait = 1, kWakeAll = 0x100;

}  // namespace

void sleep_while(std::atomic<std::uint32_t>& word, std::uint32_t value) {
  static_assert(sizeof word == sizeof value);
  __ulock_wait(kCompareAndWait, &word, value, 0);
}

void wake_all(std::atomic<std::uint32_t>& word) { __ulock_wake(kCompareAndWait | kWakeAll, &word, 0); }

// Free pages, and inactive ones, which the system can use for something else.
double available_memory(const std::string&) {
  vm_statistics64_data_t pages{};
  mach_msg_type_number_t count = HOST_VM_INFO64_COUNT;
  const mach_port_t host = mach_host_self();
  const kern_return_t error = host_statistics64(host, HOST_VM_INFO64, reinterpret_cast<host_info64_t>(&pages), &count);
  mach_port_deallocate(mach_task_self(), host);
  if (error != KERN_SUCCESS) return std::numeric_limits<double>::infinity();
  const double free = static_cast<double>(pages.free_count) + static_cast<double>(pages.inactive_count);
  return free * static_cast<double>(sysconf(_SC_PAGESIZE));
}

bool fill_with_entropy(void* to, std::size_t bytes) {
  arc4random_buf(to, bytes);
  return true;
}

const char* const no_pictures = "the library draws no pictures on macOS";

bool draws_with(std::string_view) { return false; }

// macOS compares the segments with the file's length itself.
bool is_cut_off(const InputFile&) { return false; }

std::string file_of(const void* address) {
  Dl_info info{};
  return dladdr(address, &info) != 0 && info.dli_fname ? info.dli_fname : "";
}

}  // namespace platform
}  // namespace mjenv::core
