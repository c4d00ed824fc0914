#pragma once

#include <string>

namespace mjenv::core {

// Bytes that this process can still have: of the machine, its cgroups and its address space. root: where proc/ and sys/
// are.
double free_memory(const std::string& root = "");

}  // namespace mjenv::core
