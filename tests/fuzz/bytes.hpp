// The fuzzer's bytes, taken as values; zeros when they are used up.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  std::size_t left() const { return left_; }

  template <typename T>
  T take() {
    T value{};
    copy(&value, sizeof value);
    return value;
  }
  bool flag() { return (take<std::uint8_t>() & 1) != 0; }
  // One of 0 .. count - 1.
  std::size_t below(std::size_t count) { return take<std::uint8_t>() % count; }
  template <typename T, std::size_t count>
  T one_of(const T (&values)[count]) {
    return values[below(count)];
  }
  // At most so many bytes, without a NUL.
  std::string text(std::size_t most) {
    std::string value(std::min<std::size_t>(most, left_), '\0');
    copy(value.data(), value.size());
    return value.substr(0, value.find('\0'));
  }
  std::string rest() { return {reinterpret_cast<const char*>(data_), left_}; }
  template <typename T>
  std::vector<T> list(std::size_t count) {
    std::vector<T> values(count);
    copy(values.data(), count * sizeof(T));
    return values;
  }

  // Replaces pieces of some content by the bytes that are left.
  template <typename T>
  void damage(std::vector<T>& content) {
    while (left() > 0 && !content.empty()) {
      const std::size_t at = take<std::uint16_t>() % content.size();
      const auto patch = list<T>(std::min<std::size_t>(below(9), content.size() - at));
      std::copy(patch.begin(), patch.end(), content.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;

  void copy(void* to, std::size_t size) {
    size = std::min(size, left_);
    if (size == 0) return;
    std::memcpy(to, data_, size);
    data_ += size;
    left_ -= size;
  }
};
