// The stack of the calling thread. Hosts may call the library on threads with small stacks.
#pragma once

#include <cstddef>
#include <functional>

namespace mjenv::core {

// Runs body on this thread if so many bytes of its stack are left, else on a new thread that has them. Waits for it.
void run_with_stack(std::size_t bytes, const std::function<void()>& body);

}  // namespace mjenv::core
