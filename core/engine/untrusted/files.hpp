// Reads and validates the files that a model refers to: meshes, skins, images and height fields.
#pragma once

#include <cstdint>
#include <string>

#include "engine/untrusted/limits.hpp"
#include "error.hpp"
#include "mjenv/mjenv.h"
#include "system/files.hpp"

namespace mjenv::core {

// Refuses a model or one of its files.
[[noreturn]] inline void refuse(const std::string& why) { fail(MJENV_E_MODEL, why); }

// These fail with MJENV_E_MODEL if MuJoCo would crash, hang or print when it reads the content. Their messages do not
// name the file.

struct MeshSize {
  std::int64_t vertices, triangles;
};
MeshSize check_mesh(const std::string& path, const std::string& content, const Limits& limits);
void check_skin(const std::string& content, const Limits& limits);
// Returns the number of pixels.
std::int64_t check_image(const std::string& path, const std::string& content, const Limits& limits);
// Checks a height field and returns its number of heights.
std::int64_t check_heights(const std::string& path, const std::string& content, const Limits& limits);

}  // namespace mjenv::core
