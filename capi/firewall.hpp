// What stands between C callers and the library: no exception passes, no null pointer, no dead handle, no second
// thread.
#pragma once

#include <pthread.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <stdexcept>
#include <string>

#include "engine/model.hpp"
#include "env/env.hpp"
#include "error.hpp"
#include "handles.hpp"
#include "mjenv/mjenv.h"
#include "system/floats.hpp"
#include "task/options.hpp"

namespace mjenv::core {

struct HeldEnv;

}  // namespace mjenv::core

struct mjenv_options : mjenv::core::Slot<mjenv::core::Options> {
  static constexpr const char* kName = "options";
  static constexpr const char* kThing = "options handle";
  static constexpr bool kReadersSeeChanges = true;

  std::atomic<bool> borrowed{false};  // from an environment, which destroys them; they do not change
};

struct mjenv_env : mjenv::core::Slot<mjenv::core::HeldEnv> {
  static constexpr const char* kName = "env";
  static constexpr const char* kThing = "environment";
  static constexpr bool kReadersSeeChanges = false;
};

namespace mjenv::core {

// What renderers hold of an environment that may be destroyed before them.
struct Link {
  std::mutex mutex;  // one of them at a time reads a row
  mjenv_env* env = nullptr;
};

struct HeldEnv {
  Env env;
  std::shared_ptr<Link> link = std::make_shared<Link>();
  mjenv_options* options;  // as the environment was built with

  HeldEnv(const Options& chosen, std::int64_t rows)
      : env(chosen, rows), options(handles<mjenv_options>.add(std::make_unique<Options>(env.options()))) {
    options->borrowed = true;
  }
  ~HeldEnv() {
    handles<mjenv_options>.destroy(options);
    const std::lock_guard lock(link->mutex);
    link->env = nullptr;
  }
  HeldEnv(const HeldEnv&) = delete;
  HeldEnv& operator=(const HeldEnv&) = delete;
};

}  // namespace mjenv::core

namespace mjenv::core::firewall {

// Plain memory, so that an unloaded library leaves no destructor behind.
inline thread_local std::array<char, 8192> last_error{};

inline mjenv_status report(mjenv_status status, const char* message) {
  const std::size_t length = std::min(std::strlen(message), last_error.size() - 1);
  std::memcpy(last_error.data(), message, length);
  last_error[length] = '\0';
  return status;
}

// A thread is not cancelled inside the library: cancellation unwinds, and would end the process at guard's catch.
class Uncancelled {
 public:
  Uncancelled() { pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &before_); }
  ~Uncancelled() { pthread_setcancelstate(before_, nullptr); }
  Uncancelled(const Uncancelled&) = delete;
  Uncancelled& operator=(const Uncancelled&) = delete;

 private:
  int before_ = PTHREAD_CANCEL_ENABLE;
};

template <typename F>
mjenv_status guard(const F& body) noexcept {  // MuJoCo's errors are trapped, too
  const Uncancelled uncancelled;
  const DefaultFloats floats;
  const ErrorTrap trap;
  try {
    body();
    return MJENV_OK;
  } catch (const Error& error) {
    return report(error.status(), error.what());
  } catch (const std::bad_alloc&) {
    return report(MJENV_E_MEMORY, "out of memory");
  } catch (const std::length_error&) {
    return report(MJENV_E_MEMORY, "out of memory: more than can be addressed");
  } catch (const std::exception& error) {
    return report(MJENV_E_INTERNAL, error.what());
  } catch (...) {
    return report(MJENV_E_INTERNAL, "unknown exception");
  }
}

// Queries that have no status answer with a fallback instead.
template <typename T, typename F>
T answer(T fallback, const F& body) noexcept {
  T result = fallback;
  guard([&] { result = body(); });
  return result;
}

inline mjenv_dtype known_dtype(mjenv_dtype dtype) {
  if (dtype != MJENV_DTYPE_FLOAT64 && dtype != MJENV_DTYPE_FLOAT32)
    fail(MJENV_E_ARGUMENT, "dtype is " + std::to_string(dtype) + ", not MJENV_DTYPE_FLOAT64 or MJENV_DTYPE_FLOAT32");
  return dtype;
}

inline mjenv_role known_role(mjenv_role role) {
  if (role < MJENV_ROLE_OBSERVATION || role > MJENV_ROLE_ARRAYS)
    fail(MJENV_E_ARGUMENT, "no role " + std::to_string(role));
  return role;
}

template <typename T>
T& need(T* pointer, const char* name) {
  if (!pointer) fail(MJENV_E_ARGUMENT, std::string(name) + " is NULL");
  return *pointer;
}

template <typename T>
const T* need_array(const T* pointer, std::size_t count, const char* name) {
  if (count > 0) need(pointer, name);
  return pointer;
}

inline const void* need_memory(const void* memory, std::size_t count, const char* name) {
  return need_array(static_cast<const unsigned char*>(memory), count, name);
}

// Holds an environment for one thread.
template <typename F>
mjenv_status enter(mjenv_env* handle, const F& body) noexcept {
  return guard([&] {
    const Entered entered(handle);
    body((*entered).env);
  });
}

inline std::uint32_t checked_size(std::uint32_t given, std::size_t least, const char* name) {
  if (given < least)
    fail(MJENV_E_ARGUMENT, std::string(name) + "->struct_size is " + std::to_string(given) + ", less than " +
                               std::to_string(least) + "; set it to sizeof");
  return given;
}

// Copies what both sides know of a struct to the caller; least is what its first version had.
template <typename T>
void hand_out(T* to, const char* name, T value, std::size_t least = sizeof(T)) {
  need(to, name);
  value.struct_size = checked_size(to->struct_size, least, name);
  std::memcpy(to, &value, std::min<std::size_t>(value.struct_size, sizeof(T)));
}

// A batch from the caller, who may know less or more of it than this library.
inline mjenv_batch taken(const mjenv_batch* given) {
  if (!given) return {};
  const mjenv_batch& from = *given;
  checked_size(from.struct_size, sizeof(mjenv_batch), "out");
  mjenv_batch batch{};
  // Whole fields: half a pointer points anywhere.
  constexpr std::size_t field = sizeof(void*);
  static_assert(sizeof batch % field == 0);
  std::memcpy(&batch, &from, std::min<std::size_t>(from.struct_size / field * field, sizeof batch));
  return batch;
}

// The same, with the batch that the call writes to: nulls if the caller gave none.
template <typename F>
mjenv_status enter(mjenv_env* handle, const mjenv_batch* out, const F& body) noexcept {
  return enter(handle, [&](Env& env) { body(env, taken(out)); });
}

// The two-call protocol: the size always, the elements when there is room for them.
template <typename Write>
void deliver(std::size_t available, std::size_t capacity, const void* target, std::size_t* count, const Write& write) {
  need(count, "the count");
  if (capacity > 0) {
    need(static_cast<const unsigned char*>(target), "the target");
    if (capacity < available)
      fail(MJENV_E_SIZE,
           "there is room for " + std::to_string(capacity) + ", but " + std::to_string(available) + " are needed");
    write();
  }
  *count = available;
}

}  // namespace mjenv::core::firewall
