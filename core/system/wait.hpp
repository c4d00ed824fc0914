// Waiting without std::condition_variable::wait, which gcc 12 binds to a symbol that older systems lack.
#pragma once

#include <pthread.h>

#include <condition_variable>
#include <mutex>

namespace mjenv::core {

inline void wait(std::condition_variable& condition, std::unique_lock<std::mutex>& lock) {
  pthread_cond_wait(condition.native_handle(), lock.mutex()->native_handle());
}

template <typename Predicate>
void wait(std::condition_variable& condition, std::unique_lock<std::mutex>& lock, const Predicate& fulfilled) {
  while (!fulfilled()) wait(condition, lock);
}

}  // namespace mjenv::core
