// Writes state as bytes and reads it. A class lists its state once, in archive(a), with the range of the numbers: a Writer
// then writes it, a Reader reads it. The bytes may come from a stranger.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>
#include <vector>

#include "error.hpp"

namespace mjenv::learn {

// The least and the greatest value that a number of the state can have. NaN is in no range.
struct Range {
  double low, high;

  bool contains(double value) const { return value >= low && value <= high; }
};

// Larger observations and rewards are refused, so that means, variances and sums of all steps stay finite.
inline constexpr double kLargest = 1e100;
inline constexpr Range kSum{-1e120, 1e120}, kVariance{0, 1e240}, kCount{0, 0x1p53};
inline constexpr Range kFinite{-std::numeric_limits<double>::max(), std::numeric_limits<double>::max()};

// Appends values to bytes.
class Writer {
 public:
  explicit Writer(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(const T& value, Range) {
    append(&value, sizeof value);
  }
  template <typename T>
  void operator()(const std::vector<T>& values) {
    static_assert(std::is_trivially_copyable_v<T>);
    const auto count = static_cast<std::uint64_t>(values.size());
    append(&count, sizeof count);
    append(values.data(), values.size() * sizeof(T));
  }
  template <typename T>
  void operator()(const std::vector<T>& values, Range) {
    (*this)(values);
  }

 private:
  std::vector<std::byte>& bytes_;

  void append(const void* from, std::size_t size) {
    const auto* begin = static_cast<const std::byte*>(from);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }
};

// Reads what a Writer wrote. Allocates nothing, except in resize().
class Reader {
 public:
  explicit Reader(const std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <typename T>
  void operator()(T& value, Range range) {
    take(&value, sizeof value);
    check(value, range);
  }
  // The vector must have as many elements as were written.
  template <typename T>
  void operator()(std::vector<T>& values) {
    std::uint64_t count = 0;
    take(&count, sizeof count);
    if (count != values.size()) fail("its sizes do not fit");
    take(values.data(), values.size() * sizeof(T));
  }
  template <typename T>
  void operator()(std::vector<T>& values, Range range) {
    (*this)(values);
    for (const T value : values) check(value, range);
  }
  // Gives a vector the number of elements that were written, and reads them.
  template <typename T>
  void resize(std::vector<T>& values) {
    std::uint64_t count = 0;
    if (bytes_.size() - at_ >= sizeof count) std::memcpy(&count, bytes_.data() + at_, sizeof count);
    if (count > (bytes_.size() - at_) / sizeof(T)) fail("its sizes do not fit");
    values.resize(static_cast<std::size_t>(count));
    (*this)(values);
  }
  // Throws unless everything was read.
  void end() const {
    if (at_ != bytes_.size()) fail("its sizes do not fit");
  }

  [[noreturn]] static void fail(const char* why) {
    core::fail(MJENV_E_SNAPSHOT, std::string("the checkpoint is damaged: ") + why);
  }

 private:
  const std::vector<std::byte>& bytes_;
  std::size_t at_ = 0;

  template <typename T>
  static void check(T value, Range range) {
    if (!range.contains(static_cast<double>(value))) fail("a number has a value that no learner gives it");
  }
  void take(void* to, std::size_t size) {
    if (size > bytes_.size() - at_) fail("its sizes do not fit");
    if (size > 0) std::memcpy(to, bytes_.data() + at_, size);
    at_ += size;
  }
};

}  // namespace mjenv::learn
