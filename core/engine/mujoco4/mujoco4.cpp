// Opens MuJoCo's library at run time.
#include "engine/mujoco4.hpp"

#include <atomic>
#include <cstring>
#include <mutex>
#include <string>

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
  return mj_versionString();
}

bool mujoco_is_open() { return is_open; }

}  // namespace mjenv::core
