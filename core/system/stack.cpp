#include "system/stack.hpp"

#include <exception>

#include "error.hpp"
#include "system/platform.hpp"

namespace mjenv::core {

void run_with_stack(std::size_t bytes, const std::function<void()>& body) {
  if (platform::stack_left() >= bytes) return body();
  std::exception_ptr thrown;
  const bool ran = platform::run_on_thread(bytes, [&] {
    try {
      body();
    } catch (...) {
      thrown = std::current_exception();
    }
  });
  if (!ran)
    fail(MJENV_E_MEMORY, "this thread has less than " + std::to_string(bytes / 1024) +
                             " KB of stack left, and the system does not give this process a thread with more");
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace mjenv::core
