#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace mjenv::learn {

// Writes a temporary file beside `path` (UTF-8) and renames it to `path`, so that no reader sees an incomplete file.
void replace_file(const std::string& path, const void* content, std::size_t size);

std::vector<std::byte> read_file(const std::string& path);

}  // namespace mjenv::learn
