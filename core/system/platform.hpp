// The functions of the operating system that the library uses. posix.cpp implements those that are the same on all
// POSIX systems, linux.cpp the others; windows.cpp and emscripten.cpp (WebAssembly) implement all. Only core/system, core/engine/lanes, extras/learn/kernels, cmake/math and the export macros of mjenv.h
// and learn.h test for the system or the CPU. Texts are UTF-8 on every system.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace mjenv::core::platform {

// ---- Processes ----

std::int32_t process_id();
// The id of the calling thread, which is unique among the threads of the process.
std::uint32_t thread_id();
// The value of an environment variable, if it is set.
std::optional<std::string> environment(const char* name);
// The value of an environment variable; nothing if it is not set or if the program runs with more rights than its user.
std::optional<std::string> trusted_environment(const char* name);
// The separator in an environment variable that lists paths.
extern const char path_separator;

// ---- Threads and CPUs ----

// Why the library starts no threads on this system; "" if it starts them.
extern const char* const no_threads;

// Blocks all signals on this thread while the object lives. Threads that are started meanwhile block them for ever.
class BlockedSignals {
 public:
  BlockedSignals();
  ~BlockedSignals();
  BlockedSignals(const BlockedSignals&) = delete;
  BlockedSignals& operator=(const BlockedSignals&) = delete;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The CPUs in this process's affinity mask; empty if they are unknown.
std::vector<int> allowed_cpus();
// The quota of CPUs that the system sets for this process in addition to the affinity mask; infinite if there is none.
// root: the folder that contains proc/ and sys/ on Linux.
double cpu_quota(const std::string& root);
// How many bytes a scalable vector (SVE) of the CPU has; 0 if the CPU has no SVE.
int scalable_vector_bytes();
void pin_thread(std::thread& thread, int cpu);
// Sets the name that debuggers and top show for the thread. Linux keeps 15 characters of it.
void name_thread(std::thread& thread, const std::string& name);

// How many bytes are left of the calling thread's stack; 0 if that is unknown, for example on the stack of a coroutine.
std::size_t stack_left();
// Runs body, which must not throw, on a new thread that has a stack of this size and blocks all signals. Returns false
// if the thread could not be started; body has then not run.
bool run_on_thread(std::size_t stack_bytes, const std::function<void()>& body);

// These let a thread sleep until another thread of this process changes a word. Unlike a condition variable, a word
// needs no initialization, and a forked child can use it even if threads of its parent were sleeping on it.

// Sleeps while the word has this value. May also return spuriously.
void sleep_while(std::atomic<std::uint32_t>& word, std::uint32_t value);
// Wakes all threads that sleep on the word.
void wake_all(std::atomic<std::uint32_t>& word);

// ---- Memory, entropy, locale ----

// How many bytes this process can still allocate: the smallest of what the machine has free, what the limits of the
// process allow, and what those of its control groups allow. root: the folder that contains proc/ and sys/ on Linux.
double available_memory(const std::string& root);

// Fills the memory with random bytes. False if the system provides none.
bool fill_with_entropy(void* to, std::size_t bytes);

// While the object lives, this thread has the locale "C", so that the C library reads numbers and compares text as
// MuJoCo expects. The host's locales have no effect on this thread, even if other threads change them meanwhile.
class ClassicLocale {
 public:
  ClassicLocale();
  ~ClassicLocale();
  ClassicLocale(const ClassicLocale&) = delete;
  ClassicLocale& operator=(const ClassicLocale&) = delete;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// ---- Files ----

struct FileStatus {
  bool exists = false, is_regular = false;
  std::int64_t bytes = 0;
};

// The status of the file or folder at this path. Follows links in the path's folders, but not a link at its end.
FileStatus status_of(const std::string& path);

// A file that is open for reading. Opening never waits, not even for a pipe.
class InputFile {
 public:
  // refused: the path is a real_path(), and opening fails if one of its parts has become a link since.
  enum class Links { followed, refused };
  explicit InputFile(const std::string& path, Links links = Links::followed);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  // If it is not open, errno says why.
  bool is_open() const { return handle_ != -1; }
  FileStatus status() const;
  // Returns how many bytes it has read, 0 at the end. Returns -1 if it fails; errno then says why.
  std::int64_t read(void* to, std::size_t bytes) const;

 private:
  std::intptr_t handle_;  // -1 if it is not open
};

// Whether a text begins like a path: with ".", "/", "~", or on Windows in other ways.
bool begins_path(const std::string& text);
// Whether a path in an untrusted model must not even be opened, because it may lead to something other than a file, or
// cannot be compared with the real path of a folder. Does not resolve links.
bool names_no_file(const std::string& path);

// The absolute path without links, with "/" between names; "" if there is no such file or folder (errno says why).
std::string real_path(const std::string& path);

// Creates and opens a new file, with a unique name in place of the "XXXXXX" before the last `ending` characters of the
// path. Returns null if that fails.
std::FILE* create_file(std::string& path, std::size_t ending);

// Creates and opens a new file. Null if that fails, also if there is something at this path, such as a link; errno says
// why.
std::FILE* create_new(const std::string& path);
// Writes what is buffered through to the disk. False if that fails; errno says why.
bool write_through(std::FILE* file);
// Renames a file, which replaces one that has the new name. False if that fails; errno says why.
bool rename_over(const std::string& from, const std::string& to);
void remove_file(const std::string& path);

// The user's home folder, or "~" if it is unknown.
std::string home_folder();

// ---- Pictures ----

// Why the library draws no pictures on this system; "" if it draws them.
extern const char* const no_pictures;
// Whether the system draws with this back end of core/render: "egl", "glfw", "osmesa" or "wgl".
bool draws_with(std::string_view back_end);

// ---- Shared libraries ----

// How the file names of plug-ins end: ".so" or ".dll".
extern const char* const plugin_suffix;
// Opens a library by its path, or by a file name that the system looks up. If that fails, returns null and sets
// `reason`. Refuses a truncated file, because some systems would end the process.
void* open_library(const char* file, std::string& reason);
// Returns a library if the process has loaded it already, otherwise null.
void* loaded_library(const char* file);
// Makes a loaded library's symbols visible to the process, as if linked to it. False if the library is not loaded.
bool show_library(const char* file);
void close_library(void* library);
// Null if the library has no such symbol.
void* symbol_of(void* library, const char* name);
// Looks the symbol up among all symbols that are visible to the whole process.
void* visible_symbol(const char* name);
// The path of the library or program that contains this address, or "" if it is unknown.
std::string file_of(const void* address);
// Keeps the library with this address loaded until the process ends.
void keep_loaded(const void* address);

}  // namespace mjenv::core::platform
