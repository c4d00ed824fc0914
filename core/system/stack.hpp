// The stack of the calling thread, which may be a small one.
#pragma once

#include <cstddef>
#include <functional>

namespace mjenv::core {

// How many bytes of it are left; 0 where that is unknown, as on the stack of a coroutine.
std::size_t stack_left();

// Runs the body on this thread if so many bytes are left, else on a new thread that has them, and waits for it.
void run_with_stack(std::size_t bytes, const std::function<void()>& body);

}  // namespace mjenv::core
