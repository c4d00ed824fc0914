// What is the same on all POSIX systems.
#include <dlfcn.h>
#include <fcntl.h>
#include <locale.h>
#include <pthread.h>
#include <pwd.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <cstdlib>
#include <new>

#include "system/floats.hpp"
#include "system/platform.hpp"
#include "system/posix/posix.hpp"

namespace mjenv::core::platform {

// ---- Processes ----

std::int32_t process_id() { return getpid(); }

std::optional<std::string> environment(const char* name) {
  const char* value = std::getenv(name);
  return value ? std::optional<std::string>(value) : std::nullopt;
}

const char path_separator = ':';

// ---- Threads ----

const char* const no_threads = "";

struct BlockedSignals::State {
  sigset_t before;
};

BlockedSignals::BlockedSignals() : state_(std::make_unique<State>()) {
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &state_->before);
}

BlockedSignals::~BlockedSignals() { pthread_sigmask(SIG_SETMASK, &state_->before, nullptr); }

namespace {

void* run(void* body) {
  (*static_cast<const std::function<void()>*>(body))();
  return nullptr;
}

}  // namespace

bool run_on_thread(std::size_t stack_bytes, const std::function<void()>& body) {
  pthread_t thread;
  {
    const BlockedSignals blocked;
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, stack_bytes + static_cast<std::size_t>(PTHREAD_STACK_MIN));
    const int error = pthread_create(&thread, &attributes, run, const_cast<std::function<void()>*>(&body));
    pthread_attr_destroy(&attributes);
    if (error != 0) return false;
  }
  pthread_join(thread, nullptr);
  return true;
}

// ---- Locale ----

struct ClassicLocale::State {
  locale_t classic, before;
};

ClassicLocale::ClassicLocale() : state_(std::make_unique<State>()) {
  state_->classic = newlocale(LC_ALL_MASK, "C", nullptr);
  if (!state_->classic) throw std::bad_alloc();
  state_->before = uselocale(state_->classic);
}

ClassicLocale::~ClassicLocale() {
  uselocale(state_->before);
  freelocale(state_->classic);
}

// ---- Files ----

namespace {

FileStatus status_from(int error, const struct stat& status) {
  if (error != 0) return {};
  return {true, S_ISREG(status.st_mode), status.st_size};
}

constexpr int kToRead = O_RDONLY | O_CLOEXEC | O_NONBLOCK;
#ifdef O_PATH
constexpr int kToEnter = O_PATH | O_DIRECTORY | O_CLOEXEC;  // needs no right to list the folder
#else
constexpr int kToEnter = O_RDONLY | O_DIRECTORY | O_CLOEXEC;
#endif

int open_without_links(const std::string& real_path) {
  int folder = open("/", kToEnter);
  for (std::size_t at = 1; folder >= 0;) {
    const std::size_t end = real_path.find('/', at);
    const bool is_last = end == std::string::npos;
    const std::string name = real_path.substr(at, end - at);
    const int found = openat(folder, name.c_str(), (is_last ? kToRead : kToEnter) | O_NOFOLLOW);
    close(folder);
    if (is_last) return found;
    folder = found;
    at = end + 1;
  }
  return folder;
}

}  // namespace

FileStatus status_of(const std::string& path) {
  struct stat status {};
  return status_from(lstat(path.c_str(), &status), status);
}

InputFile::InputFile(const std::string& path, Links links)
    : handle_(links == Links::refused ? open_without_links(path) : open(path.c_str(), kToRead)) {}

InputFile::~InputFile() {
  if (is_open()) close(static_cast<int>(handle_));
}

FileStatus InputFile::status() const {
  struct stat status {};
  return status_from(fstat(static_cast<int>(handle_), &status), status);
}

std::int64_t InputFile::read(void* to, std::size_t bytes) const {
  for (;;) {
    const ssize_t count = ::read(static_cast<int>(handle_), to, bytes);
    if (count >= 0 || errno != EINTR) return count;
  }
}

bool begins_path(const std::string& text) { return text[0] == '.' || text[0] == '/' || text[0] == '~'; }
bool names_no_file(const std::string&) { return false; }

std::string real_path(const std::string& path) {
  const std::unique_ptr<char, void (*)(void*)> real(realpath(path.c_str(), nullptr), std::free);
  return real ? real.get() : "";
}

std::FILE* create_file(std::string& path, std::size_t ending) {
  const int descriptor = mkstemps(path.data(), static_cast<int>(ending));
  return descriptor < 0 ? nullptr : fdopen(descriptor, "wb");
}

// O_EXCL follows no link.
std::FILE* create_new(const std::string& path) {
  const int descriptor = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) return nullptr;
  std::FILE* file = fdopen(descriptor, "wb");
  if (file) return file;
  close(descriptor);
  unlink(path.c_str());
  errno = ENOMEM;
  return nullptr;
}

bool write_through(std::FILE* file) { return std::fflush(file) == 0 && fsync(fileno(file)) == 0; }

// The folder is written through, too, if its file system can do that.
bool rename_over(const std::string& from, const std::string& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0) return false;
  const std::size_t end = to.rfind('/');
  const std::string folder = end == std::string::npos ? "." : to.substr(0, end + 1);
  if (const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); descriptor >= 0) {
    fsync(descriptor);
    close(descriptor);
  }
  return true;
}

void remove_file(const std::string& path) { unlink(path.c_str()); }

std::string home_folder() {
  if (const char* home = std::getenv("HOME")) return home;
  const passwd* user = getpwuid(getuid());
  return user ? user->pw_dir : "~";
}

// ---- Shared libraries ----

const char* const plugin_suffix = ".so";

namespace {

// Why dlopen must not open the file; "" if it may. For instance, if the file is a pipe, dlopen would wait for ever for
// somebody to write to it.
std::string refusal_of(const std::string& path) {
  if (path.find('/') == std::string::npos) return "";  // a name without a folder, which dlopen searches
  const InputFile file(path);
  if (!file.is_open()) return "";  // dlopen will give the reason
  if (!file.status().is_regular) return "it is not a regular file";
  return is_cut_off(file) ? "it is damaged: it ends before what its headers describe" : "";
}

}  // namespace

void* open_library(const char* file, std::string& reason) {
  const std::string refusal = refusal_of(file);
  if (!refusal.empty()) {
    reason = std::string(file) + ": " + refusal;
    return nullptr;
  }
  const KeptFloats floats;
  void* library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
  if (library) return library;
  const char* why = dlerror();
  reason = why ? why : file;
  return nullptr;
}

void* loaded_library(const char* file) { return dlopen(file, RTLD_NOW | RTLD_LOCAL | RTLD_NOLOAD); }
bool show_library(const char* file) { return dlopen(file, RTLD_NOW | RTLD_GLOBAL | RTLD_NOLOAD) != nullptr; }

void close_library(void* library) {
  const KeptFloats floats;
  dlclose(library);
}

void* symbol_of(void* library, const char* name) { return dlsym(library, name); }
void* visible_symbol(const char* name) { return dlsym(RTLD_DEFAULT, name); }

void keep_loaded(const void* address) {
  const std::string file = file_of(address);
  if (!file.empty()) static_cast<void>(dlopen(file.c_str(), RTLD_LAZY | RTLD_NOLOAD | RTLD_NODELETE));
}

}  // namespace mjenv::core::platform
