#pragma once

#include <cstdint>
#include <string>

namespace mjenv::core {

// Writes colours rgb[height][width][3] as a PNG to a new file in the temporary folder, and returns its path.
std::string save_png(const std::uint8_t* rgb, int width, int height);

}  // namespace mjenv::core
