#pragma once

#include <cstdint>

namespace mjenv::core {

// How many bytes this process can still allocate.
double free_memory();

// Throws if there is not enough memory for `count` objects of `bytes_each` bytes. The allocation itself might succeed,
// but the system would kill the process later, when it writes to the memory. what: names the objects in the message,
// such as " rows".
void check_memory(std::int64_t count, const char* what, std::uint64_t bytes_each);

}  // namespace mjenv::core
