#include "engine/thread_locals.hpp"

#include <cstdlib>
#include <exception>

#include "engine/model.hpp"

namespace mjenv::core {

bool prepare_thread_locals() noexcept {
  // MuJoCo's variables take 1.2 KB; glibc's table of all libraries' variables takes 1 KB or more.
  constexpr std::size_t kEnough = 16384;
  void* room = std::malloc(kEnough);
  __asm__ volatile("" : "+r"(room));  // else the compiler drops the allocation
  std::free(room);
  if (!room) return false;
  const ErrorTrap of_mujoco;
  static_cast<void>(std::uncaught_exceptions());
  return true;
}

}  // namespace mjenv::core
