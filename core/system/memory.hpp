#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mjenv::core {

// Bytes that this process can still have: of the machine, its cgroups and its address space. root: where proc/ and sys/
// are.
double free_memory(const std::string& root = "");

// Throws when `count` things of that many bytes each do not fit. Without this check the system would kill the process
// later instead of failing the allocation. what: " rows", for the message.
void check_memory(std::int64_t count, const char* what, std::size_t bytes_each);

}  // namespace mjenv::core
