// WebAssembly, as Emscripten compiles for it: one thread, and no files, processes or shared libraries.
#include <unistd.h>

#include <cerrno>
#include <cstdint>

#include "system/condition.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

Condition::Condition() { pthread_cond_init(&condition_, nullptr); }

// Waits would never end: the library only waits for other threads, and there are none.
void Condition::wait(std::unique_lock<std::mutex>&, const Deadline&) {}

namespace platform {

// ---- Processes ----

std::int32_t process_id() { return 1; }
std::uint32_t thread_id() { return 1; }

// A web page must not see the host's environment variables.
std::optional<std::string> environment(const char*) { return std::nullopt; }
std::optional<std::string> trusted_environment(const char*) { return std::nullopt; }

const char path_separator = ':';

// ---- Threads and CPUs ----

const char* const no_threads = "the library has no threads in WebAssembly";

struct BlockedSignals::State {};

BlockedSignals::BlockedSignals() = default;

BlockedSignals::~BlockedSignals() = default;

std::vector<int> allowed_cpus() { return {}; }
double cpu_quota(const std::string&) { return 1; }
int scalable_vector_bytes() { return 0; }
void pin_thread(std::thread&, int) {}
void name_thread(std::thread&, const std::string&) {}

// The lowest address of the stack is 0, see cmake/emscripten.cmake.
std::size_t stack_left() { return reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0)); }
bool run_on_thread(std::size_t, const std::function<void()>&) { return false; }
void sleep_while(std::atomic<std::uint32_t>&, std::uint32_t) {}
void wake_all(std::atomic<std::uint32_t>&) {}

// ---- Memory, entropy, locale ----

// The memory grows up to this address, see cmake/emscripten.cmake.
double available_memory(const std::string&) {
  constexpr double most = 4294967296.0 - 65536;
  return most - static_cast<double>(reinterpret_cast<std::uintptr_t>(sbrk(0)));
}

bool fill_with_entropy(void* to, std::size_t bytes) {
  constexpr std::size_t at_once = 256;
  auto* const first = static_cast<unsigned char*>(to);
  for (std::size_t done = 0; done < bytes; done += at_once)
    if (getentropy(first + done, bytes - done < at_once ? bytes - done : at_once) != 0) return false;
  return true;
}

// There is no other locale.
struct ClassicLocale::State {};

ClassicLocale::ClassicLocale() = default;

ClassicLocale::~ClassicLocale() = default;

// ---- Files ----

FileStatus status_of(const std::string&) { return {}; }
InputFile::InputFile(const std::string&, Links) : handle_(-1) { errno = ENOENT; }

InputFile::~InputFile() = default;

FileStatus InputFile::status() const { return {}; }
std::int64_t InputFile::read(void*, std::size_t) const { return -1; }
bool begins_path(const std::string& text) { return text[0] == '.' || text[0] == '/' || text[0] == '~'; }
bool names_no_file(const std::string&) { return false; }

std::string real_path(const std::string&) {
  errno = ENOENT;
  return "";
}

std::FILE* create_file(std::string&, std::size_t) { return nullptr; }
std::FILE* create_new(const std::string&) { return nullptr; }
bool write_through(std::FILE*) { return false; }
bool rename_over(const std::string&, const std::string&) { return false; }
void remove_file(const std::string&) {}
std::string home_folder() { return "~"; }

// ---- Pictures ----

const char* const no_pictures = "the library draws no pictures in WebAssembly";

bool draws_with(std::string_view) { return false; }

// ---- Shared libraries ----

const char* const plugin_suffix = ".so";

void* open_library(const char* file, std::string& reason) {
  reason = std::string(file) + ": WebAssembly has no shared libraries; compile the tasks in";
  return nullptr;
}

void* loaded_library(const char*) { return nullptr; }
bool show_library(const char*) { return false; }
void close_library(void*) {}
void* symbol_of(void*, const char*) { return nullptr; }
void* visible_symbol(const char*) { return nullptr; }
std::string file_of(const void*) { return ""; }
void keep_loaded(const void*) {}

}  // namespace platform
}  // namespace mjenv::core
