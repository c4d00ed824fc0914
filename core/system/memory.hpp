#pragma once

#include <cstdint>

namespace mjenv::core {

// How many bytes this process can still allocate.
double free_memory();

// Throws if there is not enough memory for `count` objects of `bytes_each` bytes, which may be more than can be
// addressed. Without this check the allocation would succeed, and the system would kill the process later.
// what: " rows", for the message.
void check_memory(std::int64_t count, const char* what, std::uint64_t bytes_each);

}  // namespace mjenv::core
