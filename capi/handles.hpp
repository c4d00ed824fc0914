// What callers hold: slots in tables that stay readable as long as the library is loaded, so that a destroyed handle
// and a pointer that never was one are refused instead of followed. Free of locks, because a fork may happen at any
// time.
#pragma once

#include <sched.h>
#include <sys/types.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <string>

#include "error.hpp"

namespace mjenv::core {

// On a cache line of its own, as different handles may be used by different threads.
template <typename T>
struct alignas(64) Slot {
  using Object = T;

  std::atomic<T*> object{nullptr};  // null unless the handle is live
  std::atomic<int> readers{0};      // calls that only read; the object outlives them
  std::atomic<bool> taken{false};   // not to be handed out
  std::atomic<bool> busy{false};    // a call that changes the object, one at a time
  pid_t owner = 0;                  // the process that made it
};

template <typename Handle>
class Table {
 public:
  using Object = typename Handle::Object;

  constexpr Table() = default;
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;
  // Handles that were never destroyed may still be used while the process ends.
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
    handle->owner = getpid();
    handle->object = object.release();
    return handle;
  }

  // Refuses further calls and waits for those that are inside. A handle that is not live is left alone.
  void destroy(Handle* handle) noexcept {
    if (!contains(handle)) return;
    Object* object = handle->object.exchange(nullptr);
    if (!object) return;
    // A child waits for no thread that it left behind by a fork, and keeps what such a thread is in.
    const bool here = handle->owner == getpid();
    const auto wait_until = [&](const auto& done) {
      for (;; sched_yield()) {
        if (done()) return true;
        if (!here) return false;
      }
    };
    const bool alone = wait_until([&] { return !handle->busy.exchange(true); });
    const bool unread = wait_until([&] { return handle->readers == 0; });
    if (alone && unread) delete object;
    handle->busy = false;
    handle->taken = false;
    --live_;
  }

 private:
  static constexpr std::size_t kFirst = 128, kChunks = 32;

  std::array<Handle, kFirst> first_;
  std::array<std::atomic<Handle*>, kChunks> more_{};  // each doubles what there is
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

  // At least half of the slots stay free and they are taken in turn, so that a destroyed handle is not soon another's.
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

// A handle's object for a call that changes it.
template <typename Handle>
class Entered {
 public:
  explicit Entered(Handle* handle) : handle_(handle) {
    check_handle(handle);
    const bool busy = handle->busy.exchange(true);
    const bool read = Handle::kReadersSeeChanges && handle->readers > 0;
    object_ = handle->object;
    if (object_ && !busy && !read) return;
    if (!busy) leave();
    if (!object_) refuse_dead<Handle>();
    refuse_busy<Handle>();
  }
  ~Entered() { leave(); }
  Entered(const Entered&) = delete;
  Entered& operator=(const Entered&) = delete;

  typename Handle::Object& operator*() const { return *object_; }

 private:
  Handle* handle_;
  typename Handle::Object* object_;

  void leave() { handle_->busy.store(false, std::memory_order_release); }
};

// A handle's object for a call that only reads.
template <typename Handle>
class Reading {
 public:
  explicit Reading(const Handle* handle) : handle_(const_cast<Handle*>(handle)) {
    check_handle(handle);
    ++handle_->readers;
    const bool changing = Handle::kReadersSeeChanges && handle_->busy;
    object_ = handle_->object;
    if (object_ && !changing) return;
    leave();
    if (!object_) refuse_dead<Handle>();
    refuse_busy<Handle>();
  }
  ~Reading() { leave(); }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  const typename Handle::Object& operator*() const { return *object_; }

 private:
  Handle* handle_;
  const typename Handle::Object* object_;

  void leave() { --handle_->readers; }
};

}  // namespace mjenv::core
