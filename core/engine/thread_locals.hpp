#pragma once

namespace mjenv::core {

// Makes the calling thread use its thread-local variables (MuJoCo's and the C++ library's). glibc allocates them at the
// first use, and ends the process if it cannot. False if there is not enough memory.
bool prepare_thread_locals() noexcept;

}  // namespace mjenv::core
