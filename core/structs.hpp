// Reads and writes callers' structs. A caller may have been compiled with an older header, whose structs are shorter,
// or with a newer one, whose structs are longer. The field struct_size says how long the caller's struct is.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "error.hpp"
#include "mjenv/mjenv.h"
#include "mjenv/task.h"

namespace mjenv::core {

// A struct has one size with 64-bit pointers and another with 32-bit pointers. Returns the one for this machine.
constexpr std::size_t by_pointers(std::size_t with_64, std::size_t with_32) {
  return sizeof(void*) == 8 ? with_64 : with_32;
}

// The size that a struct had in the first release. Every caller's struct is at least that long, so these numbers never
// change.
constexpr std::size_t oldest_size(const mjenv_option*) { return by_pointers(56, 48); }
constexpr std::size_t oldest_size(const mjenv_field*) { return by_pointers(80, 72); }
constexpr std::size_t oldest_size(const mjenv_space*) { return by_pointers(32, 24); }
constexpr std::size_t oldest_size(const mjenv_spec*) { return by_pointers(96, 88); }
constexpr std::size_t oldest_size(const mjenv_info*) { return by_pointers(40, 40); }
constexpr std::size_t oldest_size(const mjenv_batch*) { return by_pointers(136, 96); }
constexpr std::size_t oldest_size(const mjenv_render_settings*) { return 128; }
constexpr std::size_t oldest_size(const mjenv_task_option*) { return by_pointers(80, 64); }
constexpr std::size_t oldest_size(const mjenv_task_field*) { return by_pointers(64, 56); }
constexpr std::size_t oldest_size(const mjenv_task_camera*) { return 48; }
constexpr std::size_t oldest_size(const mjenv_task*) { return by_pointers(168, 120); }
constexpr std::size_t oldest_size(const mjenv_plugin*) { return 24; }

// Returns the caller's struct_size. `theirs` may be misaligned, so its members are copied before they are read.
template <typename T>
std::uint32_t struct_size(const T* theirs, const char* name) {
  static_assert(offsetof(T, struct_size) == 0);
  if (!theirs) fail(MJENV_E_ARGUMENT, std::string(name) + " is NULL");
  std::uint32_t size = 0;
  std::memcpy(&size, theirs, sizeof size);
  return size;
}

// How many bytes of a struct both the caller and the library know.
template <typename T>
std::size_t shared_size(const T* theirs, const char* name) {
  constexpr std::size_t kWord = sizeof(void*);  // whole words only: half of a pointer is not a valid pointer
  constexpr std::size_t kOldest = oldest_size(static_cast<const T*>(nullptr));
  static_assert(kOldest % kWord == 0 && sizeof(T) % kWord == 0);
  const std::uint32_t size = struct_size(theirs, name);
  if (size < kOldest)
    fail(MJENV_E_ARGUMENT, std::string(name) + "->struct_size is " + std::to_string(size) + ", less than " +
                               std::to_string(kOldest) + "; set it to sizeof");
  return std::min<std::size_t>(size / kWord * kWord, sizeof(T));
}

// Copies the fields that both sides know to the caller's struct, which keeps its struct_size.
template <typename T>
void write_struct(T* theirs, const char* name, T ours) {
  const std::size_t size = shared_size(theirs, name);
  ours.struct_size = struct_size(theirs, name);
  std::memcpy(theirs, &ours, size);
}

// Returns the caller's struct. Fields that the caller does not know have their defaults.
template <typename T>
T read_struct(const T* theirs, const char* name, T defaults = {}) {
  std::memcpy(&defaults, theirs, shared_size(theirs, name));
  return defaults;
}

// Calls visit(element) for each struct of a caller's array. Refuses more than `most`. count_name, name: for messages.
template <typename T, typename Visit>
void for_each_struct(const T* array, std::int64_t count, std::int64_t most, const char* count_name,
                     const std::string& name, const Visit& visit) {
  check_range(count_name, count, 0, most, MJENV_E_SIZE);
  if (count == 0) return;
  const std::uint32_t step = struct_size(array, name.c_str());  // from one element to the next
  // A greater struct_size would make us read beyond the element.
  const auto check_size = [&](const std::string& element, std::uint32_t size) {
    if (size != step)
      fail(MJENV_E_ARGUMENT, element + ".struct_size is " + std::to_string(size) + ", but " + name +
                                 "[0].struct_size is " + std::to_string(step) + "; set each to sizeof");
  };
  const auto* at = reinterpret_cast<const unsigned char*>(array);
  for (std::int64_t i = 0; i < count; ++i, at += step) {
    const auto* element = reinterpret_cast<const T*>(at);
    const std::string element_name = name + "[" + std::to_string(i) + "]";
    check_size(element_name, struct_size(element, element_name.c_str()));
    visit(read_struct(element, element_name.c_str()));
  }
}

}  // namespace mjenv::core
