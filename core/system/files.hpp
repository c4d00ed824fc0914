// Reads and writes whole files. Paths are UTF-8.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "mjenv/mjenv.h"
#include "system/platform.hpp"

namespace mjenv::core {

// Reads a file. Fails with `unreadable` if it is no regular file or cannot be opened or read, and with `too_large` if it
// has more than max_bytes. Never waits for a pipe.
std::string read_file(const std::string& path, std::int64_t max_bytes, const char* what = "file ",
                      mjenv_status unreadable = MJENV_E_MODEL, mjenv_status too_large = MJENV_E_MODEL);
// The same for a file that is already open, or could not be opened.
std::string read_file(const platform::InputFile& file, const std::string& path, std::int64_t max_bytes,
                      const char* what = "file ", mjenv_status unreadable = MJENV_E_MODEL,
                      mjenv_status too_large = MJENV_E_MODEL);

// Writes a new file beside `path` and renames it to `path`, so that no reader sees an incomplete file, not even after a
// crash of the system. Fails with MJENV_E_FILE; the old file then stays.
void replace_file(const std::string& path, const void* content, std::size_t size);

}  // namespace mjenv::core
