// Handles are pointers to slots in tables. A pointer that points to no slot is refused without being dereferenced. A
// destroyed handle is recognised by its slot, which stays readable as long as the library is loaded. The tables have no
// locks, because a forked child could find a lock taken for ever.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "error.hpp"
#include "reasons.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

// The base of each kind of handle, which defines
//   kName               the parameter's name, for messages
//   kThing              what the handle is called in messages
//   kReadersSeeChanges  whether calls that only read the object see what other calls change, and so must not run
//                       at the same time
// Each slot has cache lines of its own, because different threads may use different handles at the same time.
template <typename T>
struct alignas(64) Slot {
  using Object = T;
  using Word = std::atomic<std::uint32_t>;
  enum : std::uint32_t { kFree = 0, kInside = 1, kAwaited = 2 };  // states of `busy`
  static constexpr std::uint32_t kReadersAwaited = 0x8000'0000;   // a bit of `readers`

  std::atomic<T*> object{nullptr};  // null unless the handle is live
  Word busy{kFree};                 // whether a call that changes the object is inside; at most one is
  Word readers{0};                  // how many calls that only read the object are inside
  std::atomic<bool> taken{false};   // whether the slot belongs to a handle
  std::int32_t owner = 0;           // the process that made the object
  mutable Reason reason;            // of the last call that failed

  // A call leaves by leave() or leave_reading(). destroy() waits in await_calls() until all calls have left.
  void leave() {
    if (busy.exchange(kFree) == kAwaited) platform::wake_all(busy);
  }
  void leave_reading() {
    if (readers.fetch_sub(1) == kReadersAwaited + 1) platform::wake_all(readers);
  }
  void await_calls() {
    while (busy.exchange(kAwaited) != kFree) platform::sleep_while(busy, kAwaited);
    for (std::uint32_t inside; (inside = readers.fetch_or(kReadersAwaited) & ~kReadersAwaited) != 0;)
      platform::sleep_while(readers, kReadersAwaited | inside);
    readers.fetch_and(~kReadersAwaited);
  }
};

template <typename Handle>
class Table {
 public:
  using Object = typename Handle::Object;

  constexpr Table() = default;
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  // Frees nothing if a handle was never destroyed, because other threads may use it until the process ends.
  ~Table() {
    if (live_ > 0) return;
    for (auto& chunk : more_) delete[] chunk.exchange(nullptr);
  }

  bool contains(const Handle* handle) const {
    if (is_in(first_.data(), kFirst, handle)) return true;
    for (std::size_t i = 0; i < kChunks; ++i) {
      const Handle* chunk = more_[i].load(std::memory_order_acquire);
      if (!chunk) return false;
      if (is_in(chunk, kFirst << i, handle)) return true;
    }
    return false;
  }

  Handle* add(std::unique_ptr<Object> object) {
    Handle* handle = take();
    handle->owner = platform::process_id();
    handle->object = object.release();
    return handle;
  }

  // Refuses further calls, waits for those that are inside, and destroys the object. Does nothing for a handle that is
  // not live.
  void destroy(Handle* handle) noexcept {
    if (!contains(handle)) return;
    Object* object = handle->object.exchange(nullptr);
    if (!object) return;
    if (handle->owner == platform::process_id()) {
      handle->await_calls();
      delete object;
    } else if (handle->busy == Handle::kFree && handle->readers == 0) {
      delete object;
    } else {
      // In a forked child, a thread of the parent may have been inside at the fork. That call never leaves, so the
      // object is leaked.
      handle->readers = 0;
    }
    handle->reason.clear();
    handle->busy = Handle::kFree;
    handle->taken = false;
    --live_;
  }

 private:
  static constexpr std::size_t kFirst = 128, kChunks = 32;

  std::array<Handle, kFirst> first_;
  std::array<std::atomic<Handle*>, kChunks> more_{};  // further slots; each chunk doubles their number
  std::atomic<std::size_t> live_{0}, next_{0};

  static bool is_in(const Handle* chunk, std::size_t count, const Handle* handle) {
    const auto offset = reinterpret_cast<std::uintptr_t>(handle) - reinterpret_cast<std::uintptr_t>(chunk);
    return offset < count * sizeof(Handle) && offset % sizeof(Handle) == 0;
  }

  std::size_t chunks() const {
    std::size_t count = 0;
    while (count < kChunks && more_[count].load(std::memory_order_acquire)) ++count;
    return count;
  }

  Handle& at(std::size_t index) {
    if (index < kFirst) return first_[index];
    std::size_t chunk = 0, start = kFirst;
    for (; index >= 2 * start; start *= 2) ++chunk;
    return more_[chunk].load(std::memory_order_acquire)[index - start];
  }

  // Takes a free slot. The slots are taken in turn, and at least half of them stay free, so that it takes long until
  // the address of a destroyed handle is used again.
  Handle* take() {
    const std::size_t live = ++live_;
    try {
      for (std::size_t count = chunks(); 2 * live > kFirst << count; count = chunks()) {
        auto chunk = std::make_unique<Handle[]>(kFirst << count);
        Handle* none = nullptr;
        if (count < kChunks && more_[count].compare_exchange_strong(none, chunk.get())) chunk.release();
      }
    } catch (...) {
      --live_;
      throw;
    }
    for (;;) {
      Handle& handle = at(next_++ % (kFirst << chunks()));
      if (!handle.taken.exchange(true)) return &handle;
    }
  }
};

// One table for each kind of handle.
template <typename Handle>
inline Table<Handle> handles;

template <typename Handle>
[[noreturn]] void refuse_dead() {
  fail(MJENV_E_ARGUMENT, std::string(Handle::kName) + " is no live handle: it was destroyed, or never created");
}

template <typename Handle>
void check_handle(const Handle* handle) {
  if (!handle) fail(MJENV_E_ARGUMENT, std::string(Handle::kName) + " is NULL");
  if (!handles<Handle>.contains(handle)) refuse_dead<Handle>();
}

template <typename Handle>
[[noreturn]] void refuse_busy() {
  fail(MJENV_E_BUSY, std::string("another thread is inside this ") + Handle::kThing);
}

// The object of a handle, for a call that may change it. Enters the handle in the constructor and leaves it in the
// destructor.
template <typename Handle>
class Entered {
 public:
  explicit Entered(Handle* handle) : handle_(handle) {
    check_handle(handle);
    std::uint32_t expected = Handle::kFree;
    const bool entered = handle->busy.compare_exchange_strong(expected, Handle::kInside);
    const bool read = Handle::kReadersSeeChanges && handle->readers > 0;
    object_ = handle->object;
    if (object_ && entered && !read) return;
    if (entered) handle->leave();
    if (!object_) refuse_dead<Handle>();
    refuse_busy<Handle>();
  }
  ~Entered() { handle_->leave(); }
  Entered(const Entered&) = delete;
  Entered& operator=(const Entered&) = delete;

  typename Handle::Object& operator*() const { return *object_; }

 private:
  Handle* handle_;
  typename Handle::Object* object_;
};

// The object of a handle, for a call that only reads it.
template <typename Handle>
class Reading {
 public:
  explicit Reading(const Handle* handle) : handle_(const_cast<Handle*>(handle)) {
    check_handle(handle);
    ++handle_->readers;
    const bool changing = Handle::kReadersSeeChanges && handle_->busy != Handle::kFree;
    object_ = handle_->object;
    if (object_ && !changing) return;
    handle_->leave_reading();
    if (!object_) refuse_dead<Handle>();
    refuse_busy<Handle>();
  }
  ~Reading() { handle_->leave_reading(); }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  const typename Handle::Object& operator*() const { return *object_; }

 private:
  Handle* handle_;
  const typename Handle::Object* object_;
};

// Copies the reason of the last failing call with a handle. False if the pointer is no live handle of this kind.
template <typename Handle>
bool copy_reason(const void* pointer, char* text, std::int64_t capacity, std::int64_t* size) {
  auto* handle = static_cast<Handle*>(const_cast<void*>(pointer));
  if (!handles<Handle>.contains(handle)) return false;
  ++handle->readers;  // so that destroy waits
  const bool live = handle->object != nullptr;
  if (live) *size = static_cast<std::int64_t>(handle->reason.copy(text, static_cast<std::size_t>(capacity)));
  handle->leave_reading();
  return live;
}

}  // namespace mjenv::core
