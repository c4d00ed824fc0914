#include "engine/thread_locals.hpp"

#include <cstdlib>
#include <exception>

#include "engine/mujoco.hpp"

namespace mjenv::core {

bool prepare_thread_locals() noexcept {
  // More than enough: MuJoCo's variables take 1.2 KB, and glibc's table of all libraries' variables takes 1 KB or more.
  constexpr std::size_t kEnough = 16384;
  void* const volatile room = std::malloc(kEnough);  // volatile: otherwise the compiler drops the allocation
  const bool enough = room != nullptr;
  std::free(room);
  if (!enough) return false;
  use_thread_locals();
  const ErrorTrap trap;                           // the first use of MuJoCo's variables
  static_cast<void>(std::uncaught_exceptions());  // the first use of the C++ library's
  return true;
}

}  // namespace mjenv::core
