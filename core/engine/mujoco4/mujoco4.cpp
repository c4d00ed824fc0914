// Opens MuJoCo's library at run time.
#include "engine/mujoco4.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <string>
#include <utility>

#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

#define MJENV_POINTER(name) decltype(&::name) name = nullptr;
MJENV_MUJOCO_FUNCTIONS(MJENV_POINTER)
#undef MJENV_POINTER
const mjfCollision (*mjCOLLISIONFUNC)[mjNGEOMTYPES] = nullptr;

namespace {

std::atomic<bool> is_open = false;

// The environment variable with the path of MuJoCo's library.
constexpr const char* kVariable = "MJENV_MUJOCO";
// These versions have the same layout of mjModel and mjData.
constexpr const char* kNames[] = {"libmujoco.so.4.0.1", "libmujoco.so.4.0.0"};

constexpr const char* kAdvice =
    "install MuJoCo 4.0 (pip install 'mujoco-core>=4.0,<4.1', or an official release), or set MJENV_MUJOCO to the path "
    "of its libmujoco.so.4.0.x";

[[noreturn]] void refuse_engine(const std::string& why) { fail(MJENV_E_FILE, why + "; " + kAdvice); }

void* open_named(const char* path) {
  std::string reason;
  if (void* library = platform::open_library(path, reason)) return library;
  refuse_engine(std::string(kVariable) + ": " + reason);
}

// Prefers a library that the process has already loaded, so that the process and mjenv use the same one.
void* find() {
  const std::string path = platform::environment(kVariable).value_or("");
  if (!path.empty()) return open_named(path.c_str());
  for (const char* name : kNames)
    if (void* library = platform::loaded_library(name)) return library;
  std::string unused;
  for (const char* name : kNames)
    if (void* library = platform::open_library(name, unused)) return library;
  refuse_engine("there is no library of MuJoCo 4.0");
}

template <typename Pointer>
void look_up(void* library, const char* name, Pointer& pointer) {
  void* const found = platform::symbol_of(library, name);
  if (!found) refuse_engine(std::string("MuJoCo's library has no ") + name);
  static_assert(sizeof(Pointer) == sizeof(void*));
  std::memcpy(&pointer, &found, sizeof found);
}

// MuJoCo reads the clock mjcb_time, if there is one, at the beginning and the end of each of its stages, and adds up the
// times in mjData.timer. The Python package mujoco sets a clock. To read it takes an eighth of the mj_step of a small
// robot, and nobody sees mjData.timer of a work space. So mjenv puts its own clock in the place of that one. It reads
// that one, but not while a work space is stepped on the thread.
thread_local bool is_stepping = false;
std::atomic<mjfTime> replaced{nullptr};

mjtNum read_clock() { return is_stepping ? 0 : replaced.load(std::memory_order_relaxed)(); }

// Replaces the first clock, but none that is set later: two copies of mjenv would replace each other's for ever.
void replace_clock() {
  mjfTime found = __atomic_load_n(mjcb_time, __ATOMIC_RELAXED), none = nullptr;
  if (!found || replaced) return;
  platform::keep_loaded(reinterpret_cast<const void*>(&read_clock));
  if (replaced.compare_exchange_strong(none, found))
    __atomic_compare_exchange_n(mjcb_time, &found, &read_clock, false, __ATOMIC_RELEASE, __ATOMIC_RELAXED);
}

class Stepping {
 public:
  Stepping() : before_(std::exchange(is_stepping, true)) {}
  ~Stepping() { is_stepping = before_; }
  Stepping(const Stepping&) = delete;
  Stepping& operator=(const Stepping&) = delete;

 private:
  bool before_;
};

// MuJoCo's functions in place of which work spaces call without_clock.
struct Steps {
  decltype(&::mj_step) step, step1, step2, forward;
} steps{};

template <decltype(&::mj_step) Steps::*function>
void without_clock(const mjModel* m, mjData* d) {
  const Stepping stepping;
  (steps.*function)(m, d);
}

// MuJoCo is never closed, because other code in the process may use it.
void open_library() {
  void* const library = find();
  look_up(library, "mj_version", mj_version);
  look_up(library, "mj_versionString", mj_versionString);
  if (mj_version() / 1000 != mjVERSION_HEADER / 1000)
    refuse_engine(std::string("MuJoCo's library is ") + mj_versionString() + ", and this mjenv is for MuJoCo 4.0");
#define MJENV_LOOK_UP(name) look_up(library, #name, name);
  MJENV_MUJOCO_FUNCTIONS(MJENV_LOOK_UP)
#undef MJENV_LOOK_UP
  look_up(library, "mjCOLLISIONFUNC", mjCOLLISIONFUNC);
  steps = {mj_step, mj_step1, mj_step2, mj_forward};
  mj_step = without_clock<&Steps::step>;
  mj_step1 = without_clock<&Steps::step1>;
  mj_step2 = without_clock<&Steps::step2>;
  mj_forward = without_clock<&Steps::forward>;
  is_open = true;
}

}  // namespace

// std::call_once is not used, because its exceptions pass through a C function, which Julia's unwinder does not
// support.
const char* open_mujoco() {
  static std::mutex opening;
  if (!is_open) {
    const std::lock_guard lock(opening);
    if (!is_open) open_library();
  }
  replace_clock();
  return mj_versionString();
}

bool mujoco_is_open() { return is_open; }

void use_thread_locals() { is_stepping = false; }

namespace {

// Returns a text that differs for different contents, also if a stranger has chosen them: the length and two
// polynomials of the content, at points that are drawn once in each process. Returns "" if the system provides no random
// numbers.
std::string fingerprint(const std::string& content) {
  constexpr std::uint64_t prime = (std::uint64_t{1} << 61) - 1;
  static std::array<std::uint64_t, 2> points{};
  static const bool drawn = platform::fill_with_entropy(points.data(), sizeof points);
  if (!drawn) return "";
  std::string text = std::to_string(content.size());
  for (const std::uint64_t point : points) {
    std::uint64_t sum = 0;
    for (std::size_t at = 0; at < content.size(); at += sizeof(std::uint32_t)) {
      std::uint32_t word = 0;
      std::memcpy(&word, &content[at], std::min(sizeof word, content.size() - at));
      __extension__ using Product = unsigned __int128;
      sum = static_cast<std::uint64_t>((Product{sum} * (point % prime) + word) % prime);
    }
    text += " " + std::to_string(sum);
  }
  return text;
}

}  // namespace

// MuJoCo keeps the meshes and textures of a file, and uses them again if a file with the same path is not modified.
VirtualFiles::VirtualFiles(const Files& files) : providers_(files.size()) {
  mj_defaultVFS(&vfs_);
  auto provider = providers_.begin();
  for (const auto& [path, content] : files) {
    provider->content = content.get();
    if (content) provider->fingerprint = fingerprint(*content);
    provider->mount = [](mjResource*) { return 1; };
    provider->open = [](mjResource* file) {
      file->timestamp[of(*file).fingerprint.copy(file->timestamp, sizeof file->timestamp - 1)] = '\0';
      return static_cast<int>(of(*file).content != nullptr);
    };
    provider->read = [](mjResource* file, const void** bytes) {
      *bytes = of(*file).content->data();
      return static_cast<int>(of(*file).content->size());
    };
    provider->close = [](mjResource*) {};
    provider->modified = [](const mjResource* file, const char* timestamp) {
      return static_cast<int>(file->timestamp[0] == '\0' || std::strcmp(file->timestamp, timestamp) != 0);
    };
    mj_mountVFS(&vfs_, path.c_str(), &*provider++);
  }
}

}  // namespace mjenv::core
