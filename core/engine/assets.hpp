#pragma once

#include <cstddef>
#include <string_view>

namespace mjenv::core {

// One MJCF file of assets/, compiled into the library.
struct Asset {
  const char* name;
  const char* text;
};

extern const Asset assets[];
extern const std::size_t asset_count;

// The text of the asset of that name, or null.
inline const char* asset_text(std::string_view name) {
  for (std::size_t i = 0; i < asset_count; ++i)
    if (name == assets[i].name) return assets[i].text;
  return nullptr;
}

}  // namespace mjenv::core
