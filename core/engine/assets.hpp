#pragma once

#include <cstddef>

namespace mjenv::core {

// One MJCF file of assets/, compiled into the library.
struct Asset {
  const char* name;
  const char* text;
};

extern const Asset assets[];
extern const std::size_t asset_count;

}  // namespace mjenv::core
