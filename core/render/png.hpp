#pragma once

#include <cstdint>
#include <string>

namespace mjenv::core {

// Writes the picture rgb[height][width][3] to a new PNG file in the temporary folder, and returns the file's path.
std::string save_png(const std::uint8_t* rgb, int width, int height);

}  // namespace mjenv::core
