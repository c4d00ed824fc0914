#pragma once

namespace mjenv::core {

// glibc allocates a thread's thread-local variables (MuJoCo's and the C++ library's) when the thread first uses them,
// and ends the process when it cannot. This makes the calling thread use them now. False if there is not enough
// memory.
bool prepare_thread_locals() noexcept;

}  // namespace mjenv::core
