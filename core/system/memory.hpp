#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mjenv::core {

// How many bytes this process can still allocate. The machine, control groups and the address space limit them. root:
// the folder that contains proc/ and sys/.
double free_memory(const std::string& root = "");

// Throws if there is not enough memory for `count` objects of `bytes_each` bytes. Without this check the allocation
// would succeed, and the system would kill the process later. what: " rows", for the message.
void check_memory(std::int64_t count, const char* what, std::size_t bytes_each);

}  // namespace mjenv::core
