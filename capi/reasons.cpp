#include "reasons.hpp"

#include <pthread.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>

#include "engine/thread_locals.hpp"

namespace mjenv::core {
namespace {

constexpr std::size_t kRoom = 8192;  // bytes of a thread's last reason

// The reason that is given if there is no memory for the text.
char no_memory[] = "out of memory";

void discard(void* text) {
  if (text != no_memory) std::free(text);
}

char* copied(const char* reason) noexcept {
  char* text = strdup(reason);
  return text ? text : no_memory;
}

// Stores a reason for each thread. Uses a pthread key and malloc, because a thread-local variable would end the process
// if there is no memory for it.
class ThreadReasons {
 public:
  ThreadReasons() { usable_ = pthread_key_create(&key_, discard) == 0; }
  ~ThreadReasons() {
    if (!usable_) return;
    set(nullptr);
    pthread_key_delete(key_);  // so that no thread calls discard() after the library was unloaded
  }
  ThreadReasons(const ThreadReasons&) = delete;
  ThreadReasons& operator=(const ThreadReasons&) = delete;

  char* get() const { return usable_ ? static_cast<char*>(pthread_getspecific(key_)) : nullptr; }
  void set(char* text) {
    char* before = get();
    if (!usable_ || pthread_setspecific(key_, text) != 0)
      discard(text);
    else
      discard(before);
  }

 private:
  pthread_key_t key_;
  bool usable_;
};

ThreadReasons thread_reasons;

}  // namespace

bool prepare_thread() noexcept {
  const char* text = thread_reasons.get();
  if (text && text != no_memory) return true;
  auto* room = static_cast<char*>(std::malloc(kRoom));
  if (!room || !prepare_thread_locals()) {
    std::free(room);
    thread_reasons.set(no_memory);
    return false;
  }
  room[0] = '\0';
  thread_reasons.set(room);
  return true;
}

const char* last_reason() noexcept {
  const char* text = thread_reasons.get();
  return text ? text : "";
}

void keep_last_reason(const char* reason) noexcept {
  char* text = thread_reasons.get();
  if (!text || text == no_memory) return;
  const std::size_t length = std::min(std::strlen(reason), kRoom - 1);
  std::memcpy(text, reason, length);
  text[length] = '\0';
}

void Reason::replace(char* text) noexcept {
  lock_.lock();
  std::swap(text_, text);
  lock_.unlock();
  discard(text);
}

void Reason::keep(const char* reason) noexcept { replace(copied(reason)); }

void Reason::clear() noexcept {
  if (text_) replace(nullptr);
}

std::size_t Reason::copy(char* to, std::size_t capacity) noexcept {
  const std::lock_guard lock(lock_);
  const char* text = text_ ? text_ : "";
  const std::size_t length = std::strlen(text);
  if (capacity > 0) {
    const std::size_t fits = std::min(length, capacity - 1);
    std::memcpy(to, text, fits);
    to[fits] = '\0';
  }
  return length + 1;
}

}  // namespace mjenv::core
