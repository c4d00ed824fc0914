#pragma once

#include <cstddef>
#include <string_view>

namespace mjenv::core {

// One MJCF file of the folder assets/, whose text is compiled into the library.
struct Asset {
  const char* name;
  const char* text;
};

extern const Asset assets[];
extern const std::size_t asset_count;

// Returns the text of the asset with this name, or null.
inline const char* asset_text(std::string_view name) {
  for (std::size_t i = 0; i < asset_count; ++i)
    if (name == assets[i].name) return assets[i].text;
  return nullptr;
}

}  // namespace mjenv::core
