#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mjenv::core {

// How many bytes this process can still allocate, limited by the machine, its control groups and its address space.
// root: the folder that holds proc/ and sys/.
double free_memory(const std::string& root = "");

// Throws when `count` things of that many bytes each do not fit. Without this check the system would kill the process
// later instead of failing the allocation. what: " rows", for the message.
void check_memory(std::int64_t count, const char* what, std::size_t bytes_each);

}  // namespace mjenv::core
