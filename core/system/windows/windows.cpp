// Windows, 64-bit, as mingw-w64's gcc compiles for it.
#define WIN32_LEAN_AND_MEAN
#define NOMINMAX 1  // as the C++ library defines it
#include <windows.h>
// The headers below need windows.h.
#include <bcrypt.h>
#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <psapi.h>
#include <pthread.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <clocale>
#include <limits>
#include <string_view>
#include <utility>

#include "system/condition.hpp"
#include "system/floats.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

Condition::Condition() { pthread_cond_init(&condition_, nullptr); }

// Waits for a duration, because pthread_cond_timedwait would wait until a time of the system clock, which users can
// set.
void Condition::wait(std::unique_lock<std::mutex>& lock, const Deadline& deadline) {
  pthread_mutex_t* mutex = lock.mutex()->native_handle();
  if (!deadline.is_set()) return static_cast<void>(pthread_cond_wait(&condition_, mutex));
  const auto left = std::max(deadline.time() - std::chrono::steady_clock::now(), std::chrono::nanoseconds(0));
  const timespec duration = timespec_of(left);
  pthread_cond_timedwait_relative_np(&condition_, mutex, &duration);
}

namespace platform {
namespace {

// ---- Texts and errors ----

// "" if the text is not UTF-8.
std::wstring wide(const std::string& text) {
  const auto bytes = static_cast<int>(std::min<std::size_t>(text.size(), std::numeric_limits<int>::max()));
  const int count = MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text.data(), bytes, nullptr, 0);
  std::wstring found(static_cast<std::size_t>(std::max(count, 0)), L'\0');
  MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text.data(), bytes, found.data(), count);
  return found;
}

std::string narrow(std::wstring_view text) {
  const auto units = static_cast<int>(text.size());
  const int count = WideCharToMultiByte(CP_UTF8, 0, text.data(), units, nullptr, 0, nullptr, nullptr);
  std::string found(static_cast<std::size_t>(std::max(count, 0)), '\0');
  WideCharToMultiByte(CP_UTF8, 0, text.data(), units, found.data(), count, nullptr, nullptr);
  return found;
}

void set_errno() {
  switch (GetLastError()) {
    case ERROR_ACCESS_DENIED:
    case ERROR_SHARING_VIOLATION: errno = EACCES; break;
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_INVALID_NAME:
    case ERROR_BAD_PATHNAME:
    case ERROR_BAD_NETPATH:
    case ERROR_NOT_READY: errno = ENOENT; break;
    case ERROR_NOT_ENOUGH_MEMORY: errno = ENOMEM; break;
    case ERROR_TOO_MANY_OPEN_FILES: errno = EMFILE; break;
    default: errno = EIO;
  }
}

// Calls write(buffer, size), which returns how many units it has written, or a larger size that it needs, or 0.
template <typename Write>
std::wstring written(const Write& write) {
  std::wstring text(MAX_PATH, L'\0');
  for (;;) {
    const auto count = static_cast<std::size_t>(write(text.data(), static_cast<DWORD>(text.size())));
    const bool fits = count < text.size();
    text.resize(fits ? count : std::max(count, 2 * text.size()));
    if (fits) return text;
  }
}

std::string with_slashes(std::string path) {
  std::replace(path.begin(), path.end(), '\\', '/');
  return path;
}

std::string with_backslashes(std::string path) {
  std::replace(path.begin(), path.end(), '/', '\\');
  return path;
}

}  // namespace

// ---- Processes ----

std::int32_t process_id() { return static_cast<std::int32_t>(GetCurrentProcessId()); }
std::uint32_t thread_id() { return GetCurrentThreadId(); }

// The system's own variables: each C library in the process keeps a copy, which may be older.
std::optional<std::string> environment(const char* name) {
  const std::wstring wanted = wide(name);
  SetLastError(ERROR_SUCCESS);
  const std::wstring value =
      written([&](wchar_t* to, DWORD size) { return GetEnvironmentVariableW(wanted.c_str(), to, size); });
  if (value.empty() && GetLastError() == ERROR_ENVVAR_NOT_FOUND) return std::nullopt;
  return narrow(value);
}

// Windows asks the user before it starts a program with more rights than the user has.
std::optional<std::string> trusted_environment(const char* name) { return environment(name); }

const char path_separator = ';';

// ---- Threads and CPUs ----

const char* const no_threads = "";

// Windows has no signals.
struct BlockedSignals::State {};
BlockedSignals::BlockedSignals() = default;
BlockedSignals::~BlockedSignals() = default;

// The CPUs of this process's processor group, which has up to 64.
std::vector<int> allowed_cpus() {
  std::vector<int> cpus;
  DWORD_PTR own = 0, all = 0;
  if (GetProcessAffinityMask(GetCurrentProcess(), &own, &all))
    for (int cpu = 0; cpu < 64; ++cpu)
      if (own >> cpu & 1) cpus.push_back(cpu);
  return cpus;
}

// The quota of the process's job.
double cpu_quota(const std::string&) {
  JOBOBJECT_CPU_RATE_CONTROL_INFORMATION job{};
  if (!QueryInformationJobObject(nullptr, JobObjectCpuRateControlInformation, &job, sizeof job, nullptr))
    return std::numeric_limits<double>::infinity();
  constexpr DWORD capped = JOB_OBJECT_CPU_RATE_CONTROL_ENABLE | JOB_OBJECT_CPU_RATE_CONTROL_HARD_CAP;
  if ((job.ControlFlags & capped) != capped) return std::numeric_limits<double>::infinity();
  return job.CpuRate / 10000.0 * GetActiveProcessorCount(ALL_PROCESSOR_GROUPS);
}

int scalable_vector_bytes() { return 0; }

void pin_thread(std::thread& thread, int cpu) {
  SetThreadAffinityMask(pthread_gethandle(thread.native_handle()), DWORD_PTR{1} << cpu);
}

// Windows has the function since version 10.
void name_thread(std::thread& thread, const std::string& name) {
  using Describe = HRESULT(WINAPI*)(HANDLE, PCWSTR);
  const auto describe = reinterpret_cast<Describe>(
      reinterpret_cast<void*>(GetProcAddress(GetModuleHandleW(L"kernel32.dll"), "SetThreadDescription")));
  if (describe) describe(pthread_gethandle(thread.native_handle()), wide(name).c_str());
}

std::size_t stack_left() {
  ULONG_PTR lowest = 0, highest = 0;
  GetCurrentThreadStackLimits(&lowest, &highest);
  const auto here = reinterpret_cast<ULONG_PTR>(__builtin_frame_address(0));
  return here > lowest && here <= highest ? here - lowest : 0;
}

namespace {

unsigned __stdcall run(void* body) {
  (*static_cast<const std::function<void()>*>(body))();
  return 0;
}

}  // namespace

bool run_on_thread(std::size_t stack_bytes, const std::function<void()>& body) {
  constexpr std::size_t kReserve = 64 << 10;  // what the system itself uses of a stack
  const std::uintptr_t thread =
      _beginthreadex(nullptr, static_cast<unsigned>(stack_bytes + kReserve), run,
                     const_cast<std::function<void()>*>(&body), STACK_SIZE_PARAM_IS_A_RESERVATION, nullptr);
  if (thread == 0) return false;
  auto* const handle = reinterpret_cast<HANDLE>(thread);
  WaitForSingleObject(handle, INFINITE);
  CloseHandle(handle);
  return true;
}

void sleep_while(std::atomic<std::uint32_t>& word, std::uint32_t value) {
  static_assert(sizeof word == sizeof value);
  WaitOnAddress(&word, &value, sizeof value, INFINITE);
}

void wake_all(std::atomic<std::uint32_t>& word) { WakeByAddressAll(&word); }

// ---- Memory, entropy, locale ----

// The least of what the machine has free, what the process can address, and what its job allows it.
double available_memory(const std::string&) {
  MEMORYSTATUSEX machine{};
  machine.dwLength = sizeof machine;
  double available = std::numeric_limits<double>::infinity();
  if (GlobalMemoryStatusEx(&machine))
    available =
        static_cast<double>(std::min({machine.ullAvailPhys, machine.ullAvailPageFile, machine.ullAvailVirtual}));
  JOBOBJECT_EXTENDED_LIMIT_INFORMATION job{};
  PROCESS_MEMORY_COUNTERS used{};
  if (!QueryInformationJobObject(nullptr, JobObjectExtendedLimitInformation, &job, sizeof job, nullptr) ||
      !GetProcessMemoryInfo(GetCurrentProcess(), &used, sizeof used))
    return available;
  const auto limit = [&](DWORD flag, SIZE_T bytes) {
    if (job.BasicLimitInformation.LimitFlags & flag)
      available = std::min(available, static_cast<double>(bytes) - static_cast<double>(used.PagefileUsage));
  };
  limit(JOB_OBJECT_LIMIT_PROCESS_MEMORY, job.ProcessMemoryLimit);
  limit(JOB_OBJECT_LIMIT_JOB_MEMORY, job.JobMemoryLimit);
  return available;
}

bool fill_with_entropy(void* to, std::size_t bytes) {
  return BCryptGenRandom(nullptr, static_cast<UCHAR*>(to), static_cast<ULONG>(bytes),
                         BCRYPT_USE_SYSTEM_PREFERRED_RNG) == 0;
}

struct ClassicLocale::State {
  int kind = -1;  // -1 where the C library has no locales of threads
  std::string before;
};

ClassicLocale::ClassicLocale() : state_(std::make_unique<State>()) {
  state_->kind = _configthreadlocale(_ENABLE_PER_THREAD_LOCALE);
  if (state_->kind == -1) return;
  state_->before = std::setlocale(LC_ALL, nullptr);
  std::setlocale(LC_ALL, "C");
}

ClassicLocale::~ClassicLocale() {
  if (state_->kind == -1) return;
  std::setlocale(LC_ALL, state_->before.c_str());
  _configthreadlocale(state_->kind);
}

// ---- Files ----

namespace {

constexpr DWORD kShareAll = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

class File {
 public:
  File(const std::string& path, DWORD access, DWORD flags = 0)
      : handle_(CreateFileW(wide(path.c_str()).c_str(), access, kShareAll, nullptr, OPEN_EXISTING,
                            FILE_FLAG_BACKUP_SEMANTICS | flags, nullptr)) {
    if (!is_open()) set_errno();
  }
  ~File() {
    if (is_open()) CloseHandle(handle_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  bool is_open() const { return handle_ != INVALID_HANDLE_VALUE; }
  HANDLE get() const { return handle_; }
  HANDLE release() { return std::exchange(handle_, INVALID_HANDLE_VALUE); }

 private:
  HANDLE handle_;
};

FileStatus status_from(HANDLE file) {
  BY_HANDLE_FILE_INFORMATION status{};
  if (GetFileType(file) != FILE_TYPE_DISK || !GetFileInformationByHandle(file, &status)) return {true, false, 0};
  const bool other = (status.dwFileAttributes & (FILE_ATTRIBUTE_DIRECTORY | FILE_ATTRIBUTE_REPARSE_POINT)) != 0;
  return {true, !other, static_cast<std::int64_t>(status.nFileSizeHigh) << 32 | status.nFileSizeLow};
}

HANDLE handle_of(std::intptr_t number) { return reinterpret_cast<HANDLE>(number); }

// The real path of an open file or folder.
std::string final_path(HANDLE file) {
  const std::wstring found =
      written([&](wchar_t* to, DWORD size) { return GetFinalPathNameByHandleW(file, to, size, FILE_NAME_NORMALIZED); });
  if (found.empty()) set_errno();
  std::string real = with_slashes(narrow(found));
  const std::string local = "//?/", remote = "//?/UNC/";
  if (real.rfind(remote, 0) == 0) return "//" + real.substr(remote.size());
  return real.rfind(local, 0) == 0 ? real.substr(local.size()) : real;
}

}  // namespace

FileStatus status_of(const std::string& path) {
  const File file(path, FILE_READ_ATTRIBUTES, FILE_FLAG_OPEN_REPARSE_POINT);
  return file.is_open() ? status_from(file.get()) : FileStatus{};
}

InputFile::InputFile(const std::string& path, Links links) : handle_(-1) {
  File file(path, GENERIC_READ);
  if (links == Links::refused && file.is_open() && final_path(file.get()) != path)
    errno = ELOOP;
  else
    handle_ = reinterpret_cast<std::intptr_t>(file.release());
}

InputFile::~InputFile() {
  if (is_open()) CloseHandle(handle_of(handle_));
}

FileStatus InputFile::status() const { return status_from(handle_of(handle_)); }

std::int64_t InputFile::read(void* to, std::size_t bytes) const {
  constexpr std::size_t kMost = 1 << 30;
  DWORD count = 0;
  if (ReadFile(handle_of(handle_), to, static_cast<DWORD>(std::min(bytes, kMost)), &count, nullptr)) return count;
  set_errno();
  return -1;
}

bool begins_path(const std::string& text) {
  const auto separates = [](char c) { return c == '/' || c == '\\'; };
  if (text[0] == '.' || text[0] == '~' || separates(text[0])) return true;
  return text.size() > 2 && text[1] == ':' && separates(text[2]);
}

namespace {

bool names_device(std::string_view name) {
  std::string base(name.substr(0, name.find('.')));
  base.erase(base.find_last_not_of(' ') + 1);
  for (char& letter : base)
    if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
  for (const char* device : {"CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$", "CLOCK$"})
    if (base == device) return true;
  const std::string kind = base.substr(0, 3), number = base.substr(std::min<std::size_t>(base.size(), 3));
  if (kind != "COM" && kind != "LPT") return false;
  return (number.size() == 1 && number[0] >= '0' && number[0] <= '9') || number == "\u00b9" || number == "\u00b2" ||
         number == "\u00b3";
}

}  // namespace

// ":" stands after a drive and before a stream. One separator at the beginning leads to the root of the current drive,
// two lead to another machine or a device. Windows drops dots and blanks at the end of a name, which is then another
// one.
bool names_no_file(const std::string& path) {
  constexpr std::string_view separators = "/\\";
  if (path.empty() || separators.find(path[0]) != std::string_view::npos) return true;
  if (path.find_first_of(":*?\"<>|") != std::string::npos) return true;
  for (std::size_t at = 0; at <= path.size();) {
    const std::size_t end = std::min(path.find_first_of(separators, at), path.size());
    const std::string_view name = std::string_view(path).substr(at, end - at);
    const bool goes_up = name == "." || name == "..";
    if (names_device(name) || (!goes_up && !name.empty() && (name.back() == '.' || name.back() == ' '))) return true;
    at = end + 1;
  }
  return false;
}

std::string real_path(const std::string& path) {
  const File file(path, 0);
  return file.is_open() ? final_path(file.get()) : "";
}

std::FILE* create_new(const std::string& path) {
  const int descriptor =
      _wopen(wide(path).c_str(), _O_CREAT | _O_EXCL | _O_BINARY | _O_WRONLY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
  return descriptor < 0 ? nullptr : _fdopen(descriptor, "wb");
}

bool write_through(std::FILE* file) { return std::fflush(file) == 0 && _commit(_fileno(file)) == 0; }

bool rename_over(const std::string& from, const std::string& to) {
  if (MoveFileExW(wide(from).c_str(), wide(to).c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0)
    return true;
  set_errno();
  return false;
}

void remove_file(const std::string& path) { _wremove(wide(path).c_str()); }

std::FILE* create_file(std::string& path, std::size_t ending) {
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyz0123456789";
  constexpr std::size_t kLength = 6;
  constexpr int kTries = 1000;
  char* const name = &path[path.size() - ending - kLength];
  for (int i = 0; i < kTries; ++i) {
    std::array<unsigned char, kLength> numbers{};
    if (!fill_with_entropy(numbers.data(), numbers.size())) return nullptr;
    for (std::size_t k = 0; k < kLength; ++k) name[k] = letters[numbers[k] % letters.size()];
    std::FILE* file = create_new(path);
    if (file || errno != EEXIST) return file;
  }
  return nullptr;
}

std::string home_folder() { return environment("USERPROFILE").value_or("~"); }

// ---- Pictures ----

const char* const no_pictures = "";

bool draws_with(std::string_view back_end) { return back_end == "wgl"; }

// ---- Shared libraries ----

const char* const plugin_suffix = ".dll";

namespace {

HMODULE module_of(void* library) { return static_cast<HMODULE>(library); }

// The module with this address, which is then never unloaded if the flags say so.
HMODULE module_at(const void* address, DWORD flags) {
  HMODULE module = nullptr;
  GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | flags, static_cast<const wchar_t*>(address), &module);
  return module;
}

std::string error_text(DWORD error) {
  std::array<wchar_t, 512> text{};
  DWORD length = FormatMessageW(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS, nullptr, error, 0,
                                text.data(), static_cast<DWORD>(text.size()), nullptr);
  while (length > 0 && (text[length - 1] <= L' ' || text[length - 1] == L'.')) --length;
  return length > 0 ? narrow({text.data(), length}) : "error " + std::to_string(error);
}

}  // namespace

// Windows does not search the current folder. If `file` is a path, Windows also searches the folder of that file, for
// the libraries that the file imports.
void* open_library(const char* file, std::string& reason) {
  const KeptFloats floats;
  const bool absolute = std::string_view(file).find_first_of("/\\") != std::string_view::npos;
  const DWORD from = LOAD_LIBRARY_SEARCH_DEFAULT_DIRS | (absolute ? LOAD_LIBRARY_SEARCH_DLL_LOAD_DIR : 0);
  HMODULE library = LoadLibraryExW(wide(with_backslashes(file)).c_str(), nullptr, from);
  if (!library) reason = std::string(file) + ": " + error_text(GetLastError());
  return library;
}

void* loaded_library(const char* file) {
  HMODULE library = nullptr;
  GetModuleHandleExW(0, wide(with_backslashes(file)).c_str(), &library);
  return library;
}

// On Windows a library names the library of each symbol that it imports, so none can be made visible to all.
bool show_library(const char*) { return false; }

void close_library(void* library) {
  const KeptFloats floats;
  FreeLibrary(module_of(library));
}

void* symbol_of(void* library, const char* name) {
  return reinterpret_cast<void*>(GetProcAddress(module_of(library), name));
}

void* visible_symbol(const char*) { return nullptr; }

std::string file_of(const void* address) {
  HMODULE module = module_at(address, GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT);
  if (!module) return "";
  return narrow(written([&](wchar_t* to, DWORD size) { return GetModuleFileNameW(module, to, size); }));
}

void keep_loaded(const void* address) { module_at(address, GET_MODULE_HANDLE_EX_FLAG_PIN); }

}  // namespace platform
}  // namespace mjenv::core
