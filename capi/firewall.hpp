// Wraps every function of the C interface: turns exceptions into statuses, and refuses null pointers, destroyed handles
// and calls while another thread is inside the same handle.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <cstdint>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>

#include "engine/model.hpp"
#include "error.hpp"
#include "handles.hpp"
#include "mjenv/mjenv.h"
#include "reasons.hpp"
#include "system/floats.hpp"

namespace mjenv::core::firewall {

// Disables pthread_cancel on this thread while it lives. A cancellation would unwind the stack through the catch of
// guard, which would end the process.
class Uncancelled {
 public:
  Uncancelled() { pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &before_); }
  ~Uncancelled() { pthread_setcancelstate(before_, nullptr); }
  Uncancelled(const Uncancelled&) = delete;
  Uncancelled& operator=(const Uncancelled&) = delete;

 private:
  int before_ = PTHREAD_CANCEL_ENABLE;
};

// Calls use(status, reason) for the exception that is being handled.
template <typename Use>
void explain(const Use& use) noexcept {
  try {
    throw;
  } catch (const Error& error) {
    use(error.status(), error.what());
  } catch (const std::bad_alloc&) {
    use(MJENV_E_MEMORY, "out of memory");
  } catch (const std::length_error&) {
    use(MJENV_E_MEMORY, "out of memory: more than can be addressed");
  } catch (const std::exception& error) {
    use(MJENV_E_INTERNAL, error.what());
  } catch (...) {
    use(MJENV_E_INTERNAL, "unknown exception");
  }
}

// Calls body and turns what it throws into a status and the thread's last reason.
template <typename F>
mjenv_status guard(const F& body) noexcept {
  const Uncancelled uncancelled;
  if (!prepare_thread()) return MJENV_E_MEMORY;
  const DefaultFloats floats;
  const ErrorTrap trap;  // MuJoCo's errors become exceptions
  mjenv_status result = MJENV_OK;
  try {
    body();
  } catch (...) {
    explain([&](mjenv_status status, const char* reason) {
      keep_last_reason(reason);
      result = status;
    });
  }
  return result;
}

// Calls body. If it throws, the handle keeps the reason.
template <typename Handle, typename F>
void with_reason(const Handle* handle, const F& body) {
  try {
    body();
  } catch (...) {
    explain([&](mjenv_status, const char* reason) { handle->reason.keep(reason); });
    throw;
  }
}

// Calls body with the object that a handle holds. body may change the object: no other call that changes it runs
// meanwhile. Calls that only read it may run, unless kReadersSeeChanges.
template <typename Handle, typename F>
mjenv_status change(Handle* handle, const F& body) noexcept {
  return guard([&] {
    const Entered held(handle);
    with_reason(handle, [&] { body(*held); });
  });
}

// Calls body with the object that a handle holds. body may only read the object.
template <typename Handle, typename F>
mjenv_status read(const Handle* handle, const F& body) noexcept {
  return guard([&] {
    const Reading held(handle);
    with_reason(handle, [&] { body(*held); });
  });
}

// Destroys a handle. This never fails, not even if there is no memory.
template <typename Handle>
void destroy(Handle* handle) noexcept {
  const Uncancelled uncancelled;
  std::optional<ErrorTrap> trap;
  if (prepare_thread()) trap.emplace();
  const DefaultFloats floats;  // a task's callback `destroy` may be called
  handles<Handle>.destroy(handle);
}

// For functions that return no status. Returns what body returns, or the fallback if body throws.
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

template <typename T>
T& need(T* pointer, const char* name) {
  if (!pointer) fail(MJENV_E_ARGUMENT, std::string(name) + " is NULL");
  return *pointer;
}

// Checks a count that the caller gave, and returns it. name: what is counted, for the message.
inline std::size_t size_of(std::int64_t count, const char* name) {
  if (count < 0)
    fail(MJENV_E_SIZE, "the count of " + std::string(name) + " is " + std::to_string(count) + ", less than 0");
  return static_cast<std::size_t>(count);
}

template <typename T>
const T* need_array(const T* pointer, std::int64_t count, const char* name) {
  if (size_of(count, name) > 0) need(pointer, name);
  return pointer;
}

inline const void* need_memory(const void* memory, std::int64_t count, const char* name) {
  return need_array(static_cast<const unsigned char*>(memory), count, name);
}

// Writes the elements if the caller gives room for them, and their number to `count`. With too little room, fails and
// writes nothing. With capacity 0, a caller can ask for the number first. name: that of the parameter `target`.
template <typename Write>
void deliver(std::int64_t available, std::int64_t capacity, const void* target, const char* name, std::int64_t* count,
             const Write& write) {
  need(count, "the count");
  need_memory(target, capacity, name);
  if (capacity > 0) {
    if (capacity < available)
      fail(MJENV_E_SIZE,
           "the capacity is " + std::to_string(capacity) + ", but " + std::to_string(available) + " are needed");
    write();
  }
  *count = available;
}

}  // namespace mjenv::core::firewall
