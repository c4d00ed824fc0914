// The files that a model is made of: read with care, and asked what MuJoCo's loaders fail to ask.
#pragma once

#include <cstdint>
#include <string>

namespace mjenv::core {

// What a stranger's file may hold; a trusted one is only kept from crashing MuJoCo.
struct FileLimits {
  std::int64_t bytes, pixels, vertices, faces;
};
FileLimits file_limits(bool trusted);

// The whole of a regular file. Fails where it cannot be read, is no regular file or has more bytes than allowed.
std::string read_file(const std::string& path, std::int64_t most_bytes, const char* what = "file ");

// Each fails with MJENV_E_MODEL, without naming the file, when MuJoCo would crash, hang or print on the content.
void check_mesh(const std::string& path, const std::string& content, const FileLimits& limits);
void check_skin(const std::string& content, const FileLimits& limits);
// The result is how many pixels, or heights, it has.
std::int64_t check_image(const std::string& path, const std::string& content, const FileLimits& limits, bool heights);

}  // namespace mjenv::core
