// The stack of the calling thread. Hosts may call the library on threads with small stacks.
#pragma once

#include <cstddef>
#include <functional>

namespace mjenv::core {

// Runs body on this thread if it has that many bytes of stack left. Otherwise runs it on a new thread that has them,
// and waits for it.
void run_with_stack(std::size_t bytes, const std::function<void()>& body);

}  // namespace mjenv::core
