#pragma once

namespace mjenv::core {

// Makes sure that the calling thread's thread-local variables (MuJoCo's and the C++ library's) are allocated. glibc
// would allocate them at the first use, and end the process if there is no memory. Returns false if there is not enough
// memory.
bool prepare_thread_locals() noexcept;

}  // namespace mjenv::core
