#pragma once

#include <cstdint>

namespace mjenv::core {

// How many bytes this process can still allocate.
double free_memory();

// Throws if there is not enough memory for `count` objects of `bytes_each` bytes, for which the system would kill the
// process later, because the allocation itself would succeed. what: " rows", for the message.
void check_memory(std::int64_t count, const char* what, std::uint64_t bytes_each);

}  // namespace mjenv::core
