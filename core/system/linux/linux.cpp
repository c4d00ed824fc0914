// What only Linux has.
#include <dlfcn.h>
#include <elf.h>
#include <link.h>
#include <linux/futex.h>
#include <pthread.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstdlib>
#include <cstring>

#include "system/condition.hpp"
#include "system/linux/cgroups.hpp"
#include "system/platform.hpp"
#include "system/posix/posix.hpp"

namespace mjenv::core {

// Waits are measured by the monotonic clock, which is std::chrono::steady_clock.
Condition::Condition() {
  pthread_condattr_t monotonic;
  pthread_condattr_init(&monotonic);
  pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
  pthread_cond_init(&condition_, &monotonic);
  pthread_condattr_destroy(&monotonic);
}

void Condition::wait(std::unique_lock<std::mutex>& lock, const Deadline& deadline) {
  pthread_mutex_t* mutex = lock.mutex()->native_handle();
  if (!deadline.is_set()) return static_cast<void>(pthread_cond_wait(&condition_, mutex));
  const timespec until = timespec_of(deadline.time().time_since_epoch());
  pthread_cond_timedwait(&condition_, mutex, &until);
}

namespace platform {

std::uint32_t thread_id() { return static_cast<std::uint32_t>(syscall(SYS_gettid)); }

std::optional<std::string> trusted_environment(const char* name) {
  const char* value = secure_getenv(name);
  return value ? std::optional<std::string>(value) : std::nullopt;
}

std::vector<int> allowed_cpus() {
  std::vector<int> cpus;
  cpu_set_t set;
  CPU_ZERO(&set);
  if (sched_getaffinity(0, sizeof set, &set) == 0)
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu)
      if (CPU_ISSET(cpu, &set)) cpus.push_back(cpu);
  return cpus;
}

double cpu_quota(const std::string& root) { return cpu_quota_of_groups(root); }

int scalable_vector_bytes() {
  const int found = prctl(PR_SVE_GET_VL);  // fails on other CPUs
  return found < 0 ? 0 : found & PR_SVE_VL_LEN_MASK;
}

void pin_thread(std::thread& thread, int cpu) {
  cpu_set_t set;
  CPU_ZERO(&set);
  CPU_SET(cpu, &set);
  pthread_setaffinity_np(thread.native_handle(), sizeof set, &set);
}

void name_thread(std::thread& thread, const std::string& name) {
  pthread_setname_np(thread.native_handle(), name.c_str());
}

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

void sleep_while(std::atomic<std::uint32_t>& word, std::uint32_t value) {
  static_assert(sizeof word == sizeof value);
  syscall(SYS_futex, &word, FUTEX_WAIT_PRIVATE, value, nullptr, nullptr, 0);
}

void wake_all(std::atomic<std::uint32_t>& word) {
  syscall(SYS_futex, &word, FUTEX_WAKE_PRIVATE, INT_MAX, nullptr, nullptr, 0);
}

double available_memory(const std::string& root) {
  const double machine = 1024 * counter(root + "/proc/meminfo", "MemAvailable:", kUnlimited);
  const double available = std::min(machine, memory_of_groups(root));
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return available;
  const double used = 1024 * counter(root + "/proc/self/status", "VmSize:", 0);
  return std::min(available, static_cast<double>(limit.rlim_cur) - used);
}

const char* const no_pictures = "";

bool draws_with(std::string_view back_end) { return back_end != "wgl"; }

std::string file_of(const void* address) {
  Dl_info info{};
  link_map* object = nullptr;
  if (dladdr1(address, &info, reinterpret_cast<void**>(&object), RTLD_DL_LINKMAP) == 0) return "";
  // The program itself needs another way, because dladdr returns only the name by which it was started.
  const bool is_program = object && object->l_name && *object->l_name == '\0';
  return is_program ? "/proc/self/exe" : info.dli_fname ? info.dli_fname : "";
}

namespace {

// Reads exactly this number of bytes. Returns false if the file ends before.
bool read_whole(const InputFile& file, void* to, std::size_t bytes) {
  for (auto* at = static_cast<unsigned char*>(to); bytes > 0;) {
    const std::int64_t count = file.read(at, bytes);
    if (count <= 0) return false;
    at += count;
    bytes -= static_cast<std::size_t>(count);
  }
  return true;
}

bool skip(const InputFile& file, std::uint64_t bytes) {
  std::array<unsigned char, 4096> unused{};
  while (bytes > 0) {
    const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(bytes, unused.size()));
    if (!read_whole(file, unused.data(), part)) return false;
    bytes -= part;
  }
  return true;
}

}  // namespace

// Whether the file is shorter than its segments. dlopen maps the segments into memory, and reading a part that the file
// lacks raises SIGBUS. Files that are no ELF files for this machine are left to dlopen, which refuses them before that.
bool is_cut_off(const InputFile& library) {
  constexpr unsigned char kClass = sizeof(void*) == 8 ? ELFCLASS64 : ELFCLASS32;
  const auto size = static_cast<std::uint64_t>(library.status().bytes);
  ElfW(Ehdr) head{};
  if (!read_whole(library, &head, sizeof head)) return false;
  if (std::memcmp(head.e_ident, ELFMAG, SELFMAG) != 0 || head.e_ident[EI_CLASS] != kClass) return false;
  if (head.e_phoff < sizeof head || !skip(library, head.e_phoff - sizeof head)) return true;
  for (int i = 0; i < head.e_phnum; ++i) {
    ElfW(Phdr) segment{};
    if (!read_whole(library, &segment, sizeof segment)) return true;
    const std::uint64_t offset = segment.p_offset, bytes = segment.p_filesz;
    if (bytes > 0 && (offset > size || bytes > size - offset)) return true;
  }
  return false;
}

bool fill_with_entropy(void* to, std::size_t bytes) { return getrandom(to, bytes, 0) == static_cast<ssize_t>(bytes); }

}  // namespace platform
}  // namespace mjenv::core
