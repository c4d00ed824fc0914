#pragma once

#include <cstddef>
#include <cstdint>

namespace mjenv::core {

inline constexpr std::uint64_t kHashStart = 0xcbf29ce484222325;

// 64-bit FNV-1a, by Fowler, Noll and Vo. It detects damage, but does not protect against forgery.
inline std::uint64_t hash(const void* bytes, std::size_t count, std::uint64_t start = kHashStart) {
  const auto* data = static_cast<const unsigned char*>(bytes);
  std::uint64_t value = start;
  for (std::size_t i = 0; i < count; ++i) value = (value ^ data[i]) * 0x100000001b3;
  return value;
}

}  // namespace mjenv::core
