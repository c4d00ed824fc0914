// Writes state as bytes and reads it. A class lists its state once, in archive(a): a Writer then writes it, a Reader
// reads it.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <vector>

#include "error.hpp"

namespace mjenv::learn {

// Appends values to bytes.
class Writer {
 public:
  explicit Writer(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    append(&value, sizeof value);
  }
  template <typename T>
  void operator()(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    (*this)(values.size());
    append(values.data(), values.size() * sizeof(T));
  }

 private:
  std::vector<std::byte>& bytes_;

  void append(const void* from, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }
};

// Reads what a Writer wrote. A vector must already have the length that the bytes say, so that reading allocates
// nothing.
class Reader {
 public:
  explicit Reader(const std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    take(&value, sizeof value);
  }
  template <typename T>
  void operator()(std::vector<T>& values) {
    std::size_t count = 0;
    (*this)(count);
    if (count != values.size()) fail();
    take(values.data(), values.size() * sizeof(T));
  }
  // Returns the length of the vector that comes next. Throws if it has more elements than bytes are left.
  std::size_t count_ahead() {
    const std::size_t before = at_;
    std::size_t count = 0;
    (*this)(count);
    at_ = before;
    if (count > bytes_.size() - at_) fail();
    return count;
  }

 private:
  const std::vector<std::byte>& bytes_;
  std::size_t at_ = 0;

  [[noreturn]] static void fail() { core::fail(MJENV_E_SNAPSHOT, "the checkpoint is damaged: its sizes do not fit"); }
  void take(void* to, std::size_t size) {
    if (size > bytes_.size() - at_) fail();
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
};

}  // namespace mjenv::learn
