#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace mjenv::learn {

// Writes a file beside `path` and then gives it that name, so that no reader sees half of it. path: UTF-8.
void replace_file(const std::string& path, const void* content, std::size_t size);

std::vector<std::byte> read_file(const std::string& path);

}  // namespace mjenv::learn
