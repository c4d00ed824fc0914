// The stack of the calling thread. Hosts may call the library on threads with small stacks.
#pragma once

#include <cstddef>
#include <functional>

namespace mjenv::core {

// How many bytes are left on it; 0 if that is unknown, for example on the stack of a coroutine.
std::size_t stack_left();

// Runs body on this thread if that many bytes are left. Otherwise runs it on a new thread that has them, and waits for
// it.
void run_with_stack(std::size_t bytes, const std::function<void()>& body);

}  // namespace mjenv::core
